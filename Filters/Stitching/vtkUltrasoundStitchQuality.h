// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class vtkUltrasoundStitchQuality
 * @brief tells how visible the seams of a stitched volume are, and how much texture it kept
 *
 * Input 0: the stitched volume. Input 1 (repeatable): the volumes that it was stitched from, vtkImageData or the image
 * leaves of vtkDataObjectTree, with their poses. Input 2 (optional): a reference to compare with, such as the full
 * reconstruction. Voxel types may differ. A volume with the point array `Reliability` counts by it where textures are compared.
 *
 * Output: the stitched volume as it came. The numbers are asked for after the update; those that could not be measured, because
 * there is no border or no overlap as wide as a window of five voxels, are NaN.
 *
 * echorama::MeasureStitch says how they are defined. The same numbers compare any two ways to stitch, of other programs too.
 * Under MPI every rank measures the whole.
 *
 * @sa vtkUltrasoundStitcher
 */
#ifndef vtkUltrasoundStitchQuality_h
#define vtkUltrasoundStitchQuality_h

#include "EchoramaFiltersStitchingModule.h"
#include "vtkUltrasoundImageAlgorithm.h"
#include "vtkUltrasoundParameters.h"

#include <string> // GetReport is wrapped

#ifndef __VTK_WRAP__
#include "Filters/Stitching/StitchQuality.h"
#endif

class ECHORAMAFILTERSSTITCHING_EXPORT vtkUltrasoundStitchQuality : public vtkUltrasoundImageAlgorithm {
public:
  static vtkUltrasoundStitchQuality* New();
  vtkTypeMacro(vtkUltrasoundStitchQuality, vtkUltrasoundImageAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  // BEGIN parameters
  /** One of Stride^3 windows and one of Stride^2 faces is measured. In [1, 1000]; default 3. */
  vtkUltrasoundIntegerMacro(Stride);

  /**
   * Any parameter by its name: as a number (of a switch 0 or 1, of a choice its place from 0), as text ("1.5", "on", the name of
   * a choice, "1 0 0"), integers and vectors without a loss. Setting returns false, after an error event, when there is no such
   * parameter or value. GetParameterDescriptions tells what parameters there are, as JSON: an array of objects with name, type,
   * value, unit, low, high, choices, help ...
   */
  vtkUltrasoundAnyParameterMacro();
  // END parameters

  ///@{
  /** The volumes that were stitched go to input 1. */
  void AddSourceConnection(vtkAlgorithmOutput* output) { this->AddInputConnection(1, output); }
  void AddSourceData(vtkDataObject* data) { this->AddInputDataObject(1, data); }
  void RemoveAllSources() { this->SetInputConnection(1, nullptr); }
  ///@}

  ///@{
  /** What it should look like goes to input 2; nullptr: nothing is known. */
  void SetReferenceConnection(vtkAlgorithmOutput* output) { this->SetInputConnection(2, output); }
  void SetReferenceData(vtkDataObject* data) { this->SetInputDataObject(2, data); }
  ///@}

  ///@{
  /** Jump of local means, and of gradient energy, across seams over the same in the volumes: 1 is no seam. */
  double GetSeamMean() const;
  double GetSeamGradient() const;
  ///@}

  /** Local standard deviation inside overlaps over that of the volumes: 1 is all of their texture. */
  double GetTextureKept() const;

  ///@{
  /** Speckle SNR (mean over standard deviation) inside overlaps, of the result and of the volumes. */
  double GetSpeckleSnr() const;
  double GetSourceSpeckleSnr() const;
  ///@}

  ///@{
  /** Mean absolute difference to the reference, grey levels, inside and outside overlaps. */
  double GetErrorOverlap() const;
  double GetErrorOutside() const;
  ///@}

  /**
   * All numbers of the last update, as JSON: {"seam_mean", "seam_gradient", "borders": {"mean", "gradient", "faces"}, "cuts":
   * {the same}, "texture_kept", "snr", "snr_sources", "overlap_windows", "overlap_voxels", "error_overlap", "error_outside"}.
   * What could not be measured is null. Empty when it failed.
   */
  std::string GetReport() const { return this->Report; }

#ifndef __VTK_WRAP__
  echorama::ParameterList Parameters();                  ///< for C++: they point into this object
  const echorama::StitchQualityReport& Measured() const; ///< GetReport() for C++
#endif

protected:
  vtkUltrasoundStitchQuality();
  ~vtkUltrasoundStitchQuality() override = default;

  int FillInputPortInformation(int port, vtkInformation* information) override;
#ifndef __VTK_WRAP__
  void Execute(vtkInformationVector** inputs, vtkImageData* output, const echorama::Progress& progress) override;
#endif

private:
  vtkUltrasoundStitchQuality(const vtkUltrasoundStitchQuality&) = delete;
  void operator=(const vtkUltrasoundStitchQuality&) = delete;

#ifndef __VTK_WRAP__
  echorama::StitchQualityParameters Values;
  echorama::StitchQualityReport Quality;
  std::string Report;
#endif
};

#endif
