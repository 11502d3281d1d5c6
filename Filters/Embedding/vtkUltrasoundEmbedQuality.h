// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class vtkUltrasoundEmbedQuality
 * @brief tells how visible the border of an embedded volume is, and whether its data are untouched
 *
 * Input 0: the embedded volume, with the point array `Embedding` (0 nothing, 1 data, 2 blend, 3 invented). Its probe geometry, as
 * field data, is the fan that the crop is measured in. Input 1 (optional): the volume that was embedded, on voxels of the same
 * lattice and of the same type.
 *
 * Output: the embedded volume as it came. The numbers are asked for after the update; those that could not be measured, because
 * there is no border, no fan or no original, are NaN (voxel counts: -1). Fails when there is no array `Embedding`, and when
 * the original does not lie on the voxels of the embedded volume or has another type.
 *
 * echorama::MeasureEmbedding says how the numbers are defined. Under MPI every rank measures the whole.
 *
 * @sa vtkUltrasoundEmbedder, vtkUltrasoundFeather
 */
#ifndef vtkUltrasoundEmbedQuality_h
#define vtkUltrasoundEmbedQuality_h

#include "EchoramaFiltersEmbeddingModule.h"
#include "vtkUltrasoundImageAlgorithm.h"
#include "vtkUltrasoundParameters.h"

#include <string> // GetReport is wrapped

#ifndef __VTK_WRAP__
#include "Filters/Embedding/EmbedQuality.h"
#endif

class ECHORAMAFILTERSEMBEDDING_EXPORT vtkUltrasoundEmbedQuality : public vtkUltrasoundImageAlgorithm {
public:
  static vtkUltrasoundEmbedQuality* New();
  vtkTypeMacro(vtkUltrasoundEmbedQuality, vtkUltrasoundImageAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  // BEGIN parameters
  /** How thick the shells on either side of the border are, and how wide its patches. Above 0 mm; default 5. */
  vtkUltrasoundNumberMacro(ShellMm);

  /** The embedder's feather: data deeper than this must be shown as they are. At least 0 mm; default 3. */
  vtkUltrasoundNumberMacro(FeatherMm);

  /** With how many random surfaces inside the data the border is compared. In [0, 1000]; default 24. */
  vtkUltrasoundIntegerMacro(RandomSurfaces);

  /** The same seed makes the same random surfaces. At least 0; default 1. */
  vtkUltrasoundInteger64Macro(Seed);

  /**
   * Any parameter by its name: as a number (of a switch 0 or 1, of a choice its place from 0), as text ("1.5", "on", the name of
   * a choice, "1 0 0"), integers and vectors without a loss. Setting returns false, after an error event, when there is no such
   * parameter or value. GetParameterDescriptions tells what parameters there are, as JSON: an array of objects with name, type,
   * value, unit, low, high, choices, help ...
   */
  vtkUltrasoundAnyParameterMacro();
  // END parameters

  ///@{
  /** The volume that was embedded goes to input 1; nullptr: not known. */
  void SetOriginalConnection(vtkAlgorithmOutput* output) { this->SetInputConnection(1, output); }
  void SetOriginalData(vtkDataObject* data) { this->SetInputDataObject(1, data); }
  ///@}

  ///@{
  /**
   * Of 95 % of the border the local mean jumps no more than this, grey levels; the same at surfaces inside the data; and what the
   * border is allowed: the larger of that and 2 grey levels.
   */
  double GetSeamJump() const;
  double GetReferenceJump() const;
  double GetJumpLimit() const;
  ///@}

  /** Local standard deviation outside the border over that inside: 1 is alike. */
  double GetDeviationRatio() const;

  /** Whether the jump is at most its limit and the ratio of deviations is within 15 % of 1. */
  bool GetSeamPasses() const;

  ///@{
  /** Voxels labelled as data, blend and invented. */
  vtkIdType GetDataVoxels() const;
  vtkIdType GetBlendVoxels() const;
  vtkIdType GetInventedVoxels() const;
  ///@}

  ///@{
  /**
   * Against the original, voxels: labelled as data but with another value; labelled as data or blend where there was nothing;
   * deeper than FeatherMm but not shown as they are. All 0 in a true embedding; -1 without an original.
   */
  vtkIdType GetAlteredVoxels() const;
  vtkIdType GetPretendedVoxels() const;
  vtkIdType GetLostVoxels() const;
  ///@}

  /** How much of the data the largest crop of the fan would have kept, [0, 1]. */
  double GetCropShare() const;

  /**
   * All numbers of the last update, as JSON: {"border": {"patches", "mean", "median", "percentile95", "bias", "deviation_ratio",
   * "deviation_ratio_5", "deviation_ratio_95"}, "reference": {the same}, "border_measured", "jump_limit", "jump_passes",
   * "deviation_passes", "voxels": {"data", "blend", "invented", "altered", "pretended", "lost"}, "crop": {"share", "depth_mm",
   * "fan", "sweep"}}. What could not be measured is null. Empty when it failed.
   */
  std::string GetReport() const { return this->Report; }

#ifndef __VTK_WRAP__
  echorama::ParameterList Parameters(); ///< for C++: they point into this object
#endif

protected:
  vtkUltrasoundEmbedQuality();
  ~vtkUltrasoundEmbedQuality() override = default;

  int FillInputPortInformation(int port, vtkInformation* information) override;
#ifndef __VTK_WRAP__
  void Execute(vtkInformationVector** inputs, vtkImageData* output, const echorama::Progress& progress) override;
#endif

private:
  vtkUltrasoundEmbedQuality(const vtkUltrasoundEmbedQuality&) = delete;
  void operator=(const vtkUltrasoundEmbedQuality&) = delete;

#ifndef __VTK_WRAP__
  echorama::EmbedQualityParameters Values;
  echorama::EmbedQualityReport Quality;
  std::string Report;
#endif
};

#endif
