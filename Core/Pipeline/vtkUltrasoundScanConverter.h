// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class vtkUltrasoundScanConverter
 * @brief from samples along beams to a Cartesian volume
 *
 * Input 0: a beam volume, a vtkImageData whose x axis counts the samples along a beam, y the beams across the fan and z the
 * steps of the sweep, with `Intensity` (or the array that SetInputArrayToProcess names), optionally `ValidRegion`, the
 * field data `ProbeGeometry`, and optionally `ProbeToWorld` (identity when missing). Its own origin, spacing and direction
 * say nothing and are not used. A geometry without a sweep and a single step make a 2D image.
 *
 * Output: `Intensity` (of the input's type and array name; trilinear, integers rounded) and `ValidRegion` (1 inside the
 * fan) on the tightest grid of cubic voxels around the fan, aligned with the probe's axes and posed by ProbeToWorld. Where
 * ValidRegion is 0 so is the intensity. A voxel next to a sample that is not real (ValidRegion 0, or not finite) is not
 * real. Field data is kept, with ProbeToWorld always there.
 *
 * Fails when there is no probe geometry, it is not one (echorama::ProbeGeometry::Check), it does not go with the size of
 * the beam volume, or the output would have more than MaximumVoxels voxels.
 *
 * The grid depends on the field data of the input, so the input is brought up to date when information is asked for.
 * Source: dissertation 3.4.5 (image formation), with the exact inverse of the probe geometry.
 */
#ifndef vtkUltrasoundScanConverter_h
#define vtkUltrasoundScanConverter_h

#include "EchoramaCoreModule.h"
#include "vtkUltrasoundImageAlgorithm.h"

class ECHORAMACORE_EXPORT vtkUltrasoundScanConverter : public vtkUltrasoundImageAlgorithm {
public:
  static vtkUltrasoundScanConverter* New();
  vtkTypeMacro(vtkUltrasoundScanConverter, vtkUltrasoundImageAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  ///@{
  /**
   * Edge of a voxel in mm, in [0, 1000]. 0, the default, takes the geometric mean of the distances between samples, beams and
   * steps halfway down the middle beam: about as many voxels inside the fan as there are samples.
   */
  vtkSetClampMacro(SpacingMm, double, 0.0, 1000.0);
  vtkGetMacro(SpacingMm, double);
  ///@}

  ///@{
  /**
   * The output is refused when it would have more voxels, >= 1. Default 2^30. A voxel takes the bytes of its type and one
   * for its ValidRegion, so a volume of unsigned char at the default limit takes 2 GB.
   */
  vtkSetClampMacro(MaximumVoxels, vtkIdType, 1, VTK_ID_MAX);
  vtkGetMacro(MaximumVoxels, vtkIdType);
  ///@}

protected:
  vtkUltrasoundScanConverter() = default;
  ~vtkUltrasoundScanConverter() override = default;

  int RequestInformation(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs) override;
#ifndef __VTK_WRAP__
  void Execute(vtkInformationVector** inputs, vtkImageData* output, const echorama::Progress& progress) override;
#endif

private:
#ifndef __VTK_WRAP__
  struct Job;
  Job Prepare(vtkInformationVector** inputs);
#endif
  vtkUltrasoundScanConverter(const vtkUltrasoundScanConverter&) = delete;
  void operator=(const vtkUltrasoundScanConverter&) = delete;

  double SpacingMm = 0.0;
  vtkIdType MaximumVoxels = vtkIdType(1) << 30;
};

#endif
