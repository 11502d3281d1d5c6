// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class vtkUltrasoundDistanceMap
 * @brief how far every voxel is from the valid region, or how deep inside it
 *
 * Input: one volume. Output: the same volume (pose, arrays and field data kept) with one more point array `Distance` (float,
 * mm, between voxel centres), exact to rounding, whatever the spacing.
 *
 * The region is `ValidRegion`, less the voxels whose intensity is not finite; without `ValidRegion` it is every voxel that
 * is finite. Another array may be chosen with SetInputArrayToProcess(0, 0, 0, 0, NAME): the region is then where it is
 * finite and not 0.
 *
 * The distance to an empty region is +infinity everywhere. Fails when the input has no intensities, or the chosen array is not
 * there. Source: the distance maps of dissertation 5.2.
 *
 * @sa echorama::SquaredDistanceMap, echorama::SquaredDepthMap
 */
#ifndef vtkUltrasoundDistanceMap_h
#define vtkUltrasoundDistanceMap_h

#include "EchoramaCoreModule.h"
#include "vtkUltrasoundImageAlgorithm.h"
#include "vtkUltrasoundParameters.h"

class ECHORAMACORE_EXPORT vtkUltrasoundDistanceMap : public vtkUltrasoundImageAlgorithm {
public:
  static vtkUltrasoundDistanceMap* New();
  vtkTypeMacro(vtkUltrasoundDistanceMap, vtkUltrasoundImageAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  // BEGIN parameters
  enum Measures { OUTSIDE = 0, INSIDE = 1, SIGNED = 2 };

  ///@{
  /**
   * Outside: the distance to the nearest voxel of the region, 0 inside it. Inside: the distance to the nearest voxel outside the
   * region or beyond the grid, 0 outside it. Signed: the first less the second. Default outside. There are OUTSIDE, INSIDE,
   * SIGNED.
   */
  vtkUltrasoundChoiceMacro(Measure);
  void SetMeasureToOutside() { this->SetMeasure(OUTSIDE); }
  void SetMeasureToInside() { this->SetMeasure(INSIDE); }
  void SetMeasureToSigned() { this->SetMeasure(SIGNED); }
  ///@}

  /** Whether distances are put out squared (mm^2), with their sign. Default off. */
  vtkUltrasoundSwitchMacro(Squared);

  /**
   * Any parameter by its name: as a number (of a switch 0 or 1, of a choice its place from 0), as text ("1.5", "on", the name of
   * a choice, "1 0 0"), integers and vectors without a loss. Setting returns false, after an error event, when there is no such
   * parameter or value. GetParameterDescriptions tells what parameters there are, as JSON: an array of objects with name, type,
   * value, unit, low, high, choices, help ...
   */
  vtkUltrasoundAnyParameterMacro();
  // END parameters

  /** Name of the array that is added. */
  static const char* DistanceName() { return "Distance"; }

#ifndef __VTK_WRAP__
  echorama::ParameterList Parameters(); ///< for C++: they point into this object
#endif

protected:
  vtkUltrasoundDistanceMap() = default;
  ~vtkUltrasoundDistanceMap() override = default;

#ifndef __VTK_WRAP__
  void Execute(vtkInformationVector** inputs, vtkImageData* output, const echorama::Progress& progress) override;
#endif

private:
  vtkUltrasoundDistanceMap(const vtkUltrasoundDistanceMap&) = delete;
  void operator=(const vtkUltrasoundDistanceMap&) = delete;

  int Measured = 0; // of Measures
  bool Squares = false;
};

#endif
