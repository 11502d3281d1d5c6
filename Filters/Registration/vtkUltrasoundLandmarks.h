// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class vtkUltrasoundLandmarks
 * @brief marks places in a volume by hand, as a step of the pipeline that stays editable
 *
 * Input: one volume. Output: the same volume (voxels shared) with two more fields: `Landmarks` (3 doubles each, mm, in the world)
 * and `LandmarkLabels` (a string each). They go where the volume goes. vtkUltrasoundAligner takes those of one label in two
 * volumes to be one place, and vtkUltrasoundLandmarkError tells how far they lie apart; so mark each volume before the aligner.
 *
 * The points are in the world, where the input lies. The first label is that of the first point; points beyond the labels are
 * called by their number, from 1. Landmarks that the input has already stay, except those of a label that is given here anew.
 *
 * Fails with a message for more labels than points, a label that is empty or there twice, and a point that is not finite. Of a
 * composite data set each volume gets all of them.
 *
 * @sa vtkUltrasoundAligner, vtkUltrasoundLandmarkError
 */
#ifndef vtkUltrasoundLandmarks_h
#define vtkUltrasoundLandmarks_h

#include "EchoramaFiltersRegistrationModule.h"
#include "vtkUltrasoundImageAlgorithm.h"

#ifndef __VTK_WRAP__
#include "Core/Geometry/Landmark.h"
#include <string>
#include <vector>
#endif

class ECHORAMAFILTERSREGISTRATION_EXPORT vtkUltrasoundLandmarks : public vtkUltrasoundImageAlgorithm {
public:
  static vtkUltrasoundLandmarks* New();
  vtkTypeMacro(vtkUltrasoundLandmarks, vtkUltrasoundImageAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  ///@{
  /** The places, mm, in the world. */
  void AddPoint(double x, double y, double z);
  void ClearPoints();
  int GetNumberOfPoints() const { return static_cast<int>(this->Points.size()); }
  ///@}

  ///@{
  /** What they are called, in their order. */
  void AddLabel(const char* label);
  void ClearLabels();
  int GetNumberOfLabels() const { return static_cast<int>(this->Labels.size()); }
  ///@}

protected:
  vtkUltrasoundLandmarks();
  ~vtkUltrasoundLandmarks() override;

#ifndef __VTK_WRAP__
  void Execute(vtkInformationVector** inputs, vtkImageData* output, const echorama::Progress& progress) override;
#endif

private:
  vtkUltrasoundLandmarks(const vtkUltrasoundLandmarks&) = delete;
  void operator=(const vtkUltrasoundLandmarks&) = delete;

#ifndef __VTK_WRAP__
  std::vector<echorama::Landmark> Landmarks() const;

  std::vector<Eigen::Vector3d> Points;
  std::vector<std::string> Labels;
#endif
};

#endif
