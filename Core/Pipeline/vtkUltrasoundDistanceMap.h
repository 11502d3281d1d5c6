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

class ECHORAMACORE_EXPORT vtkUltrasoundDistanceMap : public vtkUltrasoundImageAlgorithm {
public:
  static vtkUltrasoundDistanceMap* New();
  vtkTypeMacro(vtkUltrasoundDistanceMap, vtkUltrasoundImageAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  enum MeasureType {
    OUTSIDE = 0, ///< distance to the nearest voxel of the region; 0 inside
    INSIDE = 1,  ///< distance to the nearest voxel outside the region, or beyond the grid; 0 outside
    SIGNED = 2   ///< OUTSIDE less INSIDE: negative inside the region
  };

  ///@{
  /** What is measured. Default OUTSIDE. */
  vtkSetClampMacro(Measure, int, OUTSIDE, SIGNED);
  vtkGetMacro(Measure, int);
  void SetMeasureToOutside() { this->SetMeasure(OUTSIDE); }
  void SetMeasureToInside() { this->SetMeasure(INSIDE); }
  void SetMeasureToSigned() { this->SetMeasure(SIGNED); }
  ///@}

  ///@{
  /** Put out squared distances (mm^2; with their sign for SIGNED). Default off. */
  vtkSetMacro(Squared, bool);
  vtkGetMacro(Squared, bool);
  vtkBooleanMacro(Squared, bool);
  ///@}

  /** Name of the array that is added. */
  static const char* DistanceName() { return "Distance"; }

protected:
  vtkUltrasoundDistanceMap() = default;
  ~vtkUltrasoundDistanceMap() override = default;

#ifndef __VTK_WRAP__
  void Execute(vtkInformationVector** inputs, vtkImageData* output, const echorama::Progress& progress) override;
#endif

private:
  vtkUltrasoundDistanceMap(const vtkUltrasoundDistanceMap&) = delete;
  void operator=(const vtkUltrasoundDistanceMap&) = delete;

  int Measure = OUTSIDE;
  bool Squared = false;
};

#endif
