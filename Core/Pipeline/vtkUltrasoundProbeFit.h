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

#ifndef __VTK_WRAP__
#include "Core/Geometry/ProbeFit.h"
#endif

#include <string>

class ECHORAMACORE_EXPORT vtkUltrasoundProbeFit : public vtkUltrasoundImageAlgorithm {
public:
  static vtkUltrasoundProbeFit* New();
  vtkTypeMacro(vtkUltrasoundProbeFit, vtkUltrasoundImageAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  ///@{
  /** Fits are refused when intersection over union of region and fan is less, in [0, 1]. Default 0.75. */
  vtkSetClampMacro(MinimumOverlap, double, 0.0, 1.0);
  vtkGetMacro(MinimumOverlap, double);
  ///@}

  ///@{
  /**
   * Fits are refused when the outline of the region lies further from the fan's surface, in the mean: a part of the region's
   * size (cube root of its volume, square root of the area of an image), in [0.0001, 10]. Default 0.026.
   */
  vtkSetClampMacro(MaximumDistance, double, 1e-4, 10.0);
  vtkGetMacro(MaximumDistance, double);
  ///@}

  ///@{
  /** How many points of the outline take part in the last fit, in [100, 1000000]. Default 4000. */
  vtkSetClampMacro(OutlinePoints, int, 100, 1000000);
  vtkGetMacro(OutlinePoints, int);
  ///@}

  ///@{
  /**
   * Whether the fan must hold every real voxel: the least that does, found from the region or, where the volume has probe
   * geometry and pose, enlarged from these (they stay when they hold all). Such a region need not be a fan, so
   * MinimumOverlap, MaximumDistance and OutlinePoints are not used. Default off.
   */
  vtkSetMacro(EncloseRegion, bool);
  vtkGetMacro(EncloseRegion, bool);
  vtkBooleanMacro(EncloseRegion, bool);
  ///@}

  ///@{
  /** With EncloseRegion: how far the fan reaches beyond the voxels at least, mm, in [0, 1000]. Default 0. */
  vtkSetClampMacro(MarginMm, double, 0.0, 1000.0);
  vtkGetMacro(MarginMm, double);
  ///@}

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
  /**
   * The probe of a volume: the recorded one (`ProbeGeometry` and `ProbeToWorld` both), else one that is fitted to where the
   * volume is real; \a notes then tells so and what the region leaves open, one per line. Throws echorama::Error that names the
   * volume when none fits, and Error(Cancelled).
   */
  static echorama::PlacedProbe ProbeOf(const vtkUltrasoundVolume::Input& input, std::string* notes = nullptr,
                                       const echorama::Progress& progress = {});
#endif

protected:
  vtkUltrasoundProbeFit();
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
#endif

  double MinimumOverlap;
  double MaximumDistance;
  int OutlinePoints;
  bool EncloseRegion = false;
  double MarginMm;
  double ResidualMm = 0.0;
  double MeanDistance = 0.0;
  double Overlap = 0.0;
  std::string Notes;
};

#endif
