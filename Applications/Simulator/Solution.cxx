// SPDX-License-Identifier: BSD-3-Clause
#include "Solution.h"
#include "Scan.h"
#include <cmath>
#include <vtkCellArray.h>
#include <vtkNew.h>
#include <vtkPoints.h>

namespace echorama {

namespace {

// Lines through points, each closed if asked for.
vtkSmartPointer<vtkPolyData> LinesThrough(const std::vector<std::vector<Eigen::Vector3d>>& lines, bool closed)
{
  vtkNew<vtkPoints> points;
  vtkNew<vtkCellArray> cells;
  for (const auto& line : lines) {
    const vtkIdType first = points->GetNumberOfPoints();
    cells->InsertNextCell(static_cast<int>(line.size()) + (closed ? 1 : 0));
    for (const Eigen::Vector3d& at : line)
      cells->InsertCellPoint(points->InsertNextPoint(at.data()));
    if (closed)
      cells->InsertCellPoint(first);
  }
  auto surface = vtkSmartPointer<vtkPolyData>::New();
  surface->SetPoints(points);
  surface->SetLines(cells);
  return surface;
}

} // namespace

ShownSolution SolutionOf(const ScanTask& task, Scan& scan)
{
  ShownSolution shown;
  if (const auto* plane = std::get_if<FindPlane>(&task.goal)) {
    shown.picture = scan.PictureFrom(plane->probeToWorld);
    std::vector<Eigen::Vector3d> fan;
    for (const QPointF& mm : shown.picture.fan)
      fan.push_back(plane->probeToWorld * Eigen::Vector3d(mm.x(), 0.0, mm.y()));
    shown.marks = LinesThrough({fan}, true);
    shown.text = QObject::tr("The plane that was asked for is beside yours, and marked on the body");
  } else if (const auto* length = std::get_if<MeasureLength>(&task.goal)) {
    shown.text = QObject::tr("It measures %1 mm").arg(length->lengthMm, 0, 'f', 1);
    if (length->from != length->to) {
      shown.marks = LinesThrough({{length->from, length->to}}, false);
      shown.text += QObject::tr(", where it is marked on the body");
    }
  } else {
    const auto& target = std::get<ReachTarget>(task.goal);
    std::vector<std::vector<Eigen::Vector3d>> cross;
    for (int axis = 0; axis < 3; axis++)
      cross.push_back({target.target - target.radiusMm * Eigen::Vector3d::Unit(axis),
                       target.target + target.radiusMm * Eigen::Vector3d::Unit(axis)});
    shown.marks = LinesThrough(cross, false);
    shown.text = QObject::tr("The target is marked on the body");
  }
  return shown;
}

vtkSmartPointer<vtkPolyData> RingAt(const Pose& pose, double radiusMm)
{
  constexpr int corners = 48;
  std::vector<Eigen::Vector3d> ring;
  for (int i = 0; i < corners; i++) {
    const double angle = 2.0 * M_PI * i / corners;
    ring.push_back(pose * Eigen::Vector3d(radiusMm * std::cos(angle), radiusMm * std::sin(angle), 0.0));
  }
  return LinesThrough({ring}, true);
}

} // namespace echorama
