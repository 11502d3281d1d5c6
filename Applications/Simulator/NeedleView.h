// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <Eigen/Core>
#include <vtkNew.h>

class vtkActor;
class vtkLineSource;
class vtkRenderer;
class vtkSphereSource;

namespace echorama {

class NeedleTool;

/// A needle in the view of the body: its shaft and its hub. Of one whose tip may not be told the skin hides what is within.
class NeedleView {
public:
  explicit NeedleView(vtkRenderer* renderer);
  ~NeedleView();

  void Show(const NeedleTool& needle, double lengthMm);
  /// The end that a hand holds, as it is shown.
  const Eigen::Vector3d& Hub() const { return hub_; }

private:
  vtkNew<vtkLineSource> line_;
  vtkNew<vtkSphereSource> ball_;
  vtkNew<vtkActor> shaft_, end_;
  Eigen::Vector3d hub_ = Eigen::Vector3d::Zero();
};

} // namespace echorama
