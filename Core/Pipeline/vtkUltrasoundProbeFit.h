// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class vtkUltrasoundProbeFit
 * @brief finds the probe of a volume that came without: its geometry and its pose, from the shape of the valid region
 *
 * Input: one volume, or a 2D image (one slice), which is fitted by a single plane. Output: the same volume, all arrays shared,
 * with the field data `ProbeGeometry` and `ProbeToWorld` (see vtkUltrasoundAcquisition). Those it had are replaced, and the notes
 * say so.
 *
 * The region is `ValidRegion`, less the voxels whose intensity is not finite; without `ValidRegion` it is every voxel that is
 * finite, mostly a box. What a region cannot tell is told by GetNotes(): depth 0 is always the near edge of the region.
 *
 * Fails when nothing is valid and when no fan explains the region well enough. With EncloseRegion the fan instead is one that
 * holds the whole region, whatever its shape: that of a machine which would have seen all of it.
 *
 * @sa echorama::FitProbe, echorama::EncloseRegion, vtkUltrasoundScanConverter
 */
#ifndef vtkUltrasoundProbeFit_h
#define vtkUltrasoundProbeFit_h

#include "EchoramaCoreModule.h"
#include "vtkUltrasoundImageAlgorithm.h"
#include "vtkUltrasoundParameters.h"

#ifndef __VTK_WRAP__
#include "Core/Geometry/EnclosingFan.h"
#include "Core/Geometry/ProbeFit.h"
#endif

#include <string>

class ECHORAMACORE_EXPORT vtkUltrasoundProbeFit : public vtkUltrasoundImageAlgorithm {
public:
  static vtkUltrasoundProbeFit* New();
  vtkTypeMacro(vtkUltrasoundProbeFit, vtkUltrasoundImageAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  // BEGIN parameters
  /**
   * Fits are refused when intersection over union of region and fan is less. Used when EncloseRegion is off. In [0, 1]; default
   * 0.75.
   */
  vtkUltrasoundNumberMacro(MinimumOverlap);

  /**
   * Fits are refused when the outline of the region lies further from the fan's surface in the mean: a part of the region's size,
   * which is the cube root of its volume (of an image the square root of its area). Used when EncloseRegion is off. Above 0;
   * default 0.026.
   */
  vtkUltrasoundNumberMacro(MaximumDistance);

  /** How many points of the outline take part in the last fit. Used when EncloseRegion is off. At least 100; default 4000. */
  vtkUltrasoundIntegerMacro(OutlinePoints);

  /**
   * Whether the fan must hold every real voxel: the least that does, found from the region or enlarged from the probe that the
   * volume has, for regions of any shape such as stitched volumes. Default off.
   */
  vtkUltrasoundSwitchMacro(EncloseRegion);

  /**
   * How far the fan reaches beyond the centres of the voxels at least, in depth and to all sides. Below 0: by a fortieth of the
   * longest side of the data, at most 5 mm. Used when EncloseRegion is on. At least -1 mm; default 0.
   */
  vtkUltrasoundNumberMacro(MarginMm);

  enum Outlines { AUTOMATIC = 0, LINEAR = 1, PHASED = 2, CURVED = 3 };

  ///@{
  /**
   * The kind of probe whose beams give the outline, where no fan is given: linear makes a box, phased a fan from a single point,
   * curved one that bends as it must. Automatic: the simplest that is at most 5% larger than the smallest, phased only where the
   * data begin at a point. Used when EncloseRegion is on. Default automatic. There are AUTOMATIC, LINEAR, PHASED, CURVED.
   */
  vtkUltrasoundChoiceMacro(Outline);
  void SetOutlineToAutomatic() { this->SetOutline(AUTOMATIC); }
  void SetOutlineToLinear() { this->SetOutline(LINEAR); }
  void SetOutlineToPhased() { this->SetOutline(PHASED); }
  void SetOutlineToCurved() { this->SetOutline(CURVED); }
  ///@}

  /**
   * Any parameter by its name: as a number (of a switch 0 or 1, of a choice its place from 0), as text ("1.5", "on", the name of
   * a choice, "1 0 0"), integers and vectors without a loss. Setting returns false, after an error event, when there is no such
   * parameter or value. GetParameterDescriptions tells what parameters there are, as JSON: an array of objects with name, type,
   * value, unit, low, high, choices, help ...
   */
  vtkUltrasoundAnyParameterMacro();
  // END parameters

  ///@{
  /**
   * How good the last fit was; 0 when there was none. Residual: root mean square distance (mm) of the outline from the fan's
   * surface. Mean distance: the mean, as a part of the region's size. Overlap: intersection over union. With EncloseRegion the
   * first two are 0.
   */
  double GetResidualMm() const { return this->ResidualMm; }
  double GetMeanDistance() const { return this->MeanDistance; }
  double GetOverlap() const { return this->Overlap; }
  ///@}

  /** What the region left open in the last fit: sentences, one per line. */
  std::string GetNotes() const { return this->Notes; }

#ifndef __VTK_WRAP__
  echorama::ParameterList Parameters(); ///< for C++: they point into this object

  /**
   * The probe of a volume: the recorded one (`ProbeGeometry` and `ProbeToWorld` both), else one that is fitted to where the
   * volume is real; \a notes then tells so and what the region leaves open, one per line. Throws echorama::Error that names the
   * volume when none fits, and Error(Cancelled).
   */
  static echorama::PlacedProbe ProbeOf(const vtkUltrasoundVolume::Input& input, std::string* notes = nullptr,
                                       const echorama::Progress& progress = {});
#endif

protected:
  vtkUltrasoundProbeFit() = default;
  ~vtkUltrasoundProbeFit() override = default;

#ifndef __VTK_WRAP__
  void Execute(vtkInformationVector** inputs, vtkImageData* output, const echorama::Progress& progress) override;
#endif

private:
  vtkUltrasoundProbeFit(const vtkUltrasoundProbeFit&) = delete;
  void operator=(const vtkUltrasoundProbeFit&) = delete;

#ifndef __VTK_WRAP__
  void Remember(const echorama::ProbeFit& fit);
  echorama::ProbeFit Enclose(vtkImageData* image, const echorama::Volume<unsigned char>& region,
                             const echorama::Progress& progress) const;

  echorama::ProbeFitParameters Fitting;
  echorama::EnclosingFanParameters Enclosing;
#endif

  bool Encloses = false;
  double ResidualMm = 0.0;
  double MeanDistance = 0.0;
  double Overlap = 0.0;
  std::string Notes;
};

#endif
