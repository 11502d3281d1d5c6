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
#include "vtkUltrasoundParameters.h"

#include <cstdint> // for counts

class ECHORAMACORE_EXPORT vtkUltrasoundScanConverter : public vtkUltrasoundImageAlgorithm {
public:
  static vtkUltrasoundScanConverter* New();
  vtkTypeMacro(vtkUltrasoundScanConverter, vtkUltrasoundImageAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  // BEGIN parameters
  /**
   * Edge of a voxel. 0: the geometric mean of the distances between samples, beams and steps halfway down the middle beam, so
   * that about as many voxels lie inside the fan as there are samples. In [0, 1000] mm; default 0.
   */
  vtkUltrasoundNumberMacro(SpacingMm);

  /**
   * The output is refused when it would have more voxels. A voxel takes the bytes of its type and one for its valid region. At
   * least 1; default 1073741824.
   */
  vtkUltrasoundInteger64Macro(MaximumVoxels);

  /**
   * Any parameter by its name: as a number (of a switch 0 or 1, of a choice its place from 0), as text ("1.5", "on", the name of
   * a choice, "1 0 0"), integers and vectors without a loss. Setting returns false, after an error event, when there is no such
   * parameter or value. GetParameterDescriptions tells what parameters there are, as JSON: an array of objects with name, type,
   * value, unit, low, high, choices, help ...
   */
  vtkUltrasoundAnyParameterMacro();
  // END parameters
#ifndef __VTK_WRAP__
  echorama::ParameterList Parameters(); ///< for C++: they point into this object
#endif

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

  double Spacing = 0.0;
  std::int64_t MostVoxels = std::int64_t(1) << 30;
};

#endif
