// SPDX-License-Identifier: BSD-3-Clause
// The normals of a surface of VTK, for a fused tracker.
#ifndef vtkUltrasoundSkinNormals_h
#define vtkUltrasoundSkinNormals_h

#include "Tracking/Devices/FusedTracker.h"

#include "vtkCell.h"
#include "vtkDataArray.h"
#include "vtkGenericCell.h"
#include "vtkNew.h"
#include "vtkPointData.h"
#include "vtkPolyData.h"
#include "vtkPolygon.h"
#include "vtkSmartPointer.h"
#include "vtkStaticCellLocator.h"

#include <cmath>
#include <vector>

namespace echorama {

/// At the nearest place of the surface as it is now: the normals of its points, interpolated, or of its triangle.
inline FusedTracker::NormalOf NormalsOf(vtkPolyData* surface)
{
  // Copies: the device's thread may ask while the surface changes.
  auto copy = vtkSmartPointer<vtkPolyData>::New();
  copy->DeepCopy(surface);
  auto locator = vtkSmartPointer<vtkStaticCellLocator>::New();
  locator->SetDataSet(copy);
  locator->BuildLocator();
  return [copy, locator,
          cell = vtkSmartPointer<vtkGenericCell>::New()](const Eigen::Vector3d& place) -> std::optional<Eigen::Vector3d> {
    double at[3], distance2 = 0.0;
    vtkIdType id = -1;
    int part = 0;
    locator->FindClosestPoint(place.data(), at, cell, id, part, distance2);
    if (id < 0 || cell->GetNumberOfPoints() < 3) {
      return std::nullopt;
    }
    Eigen::Vector3d normal = Eigen::Vector3d::Zero();
    if (vtkDataArray* normals = copy->GetPointData()->GetNormals()) {
      double nearest[3], parametric[3];
      std::vector<double> weights(static_cast<std::size_t>(cell->GetNumberOfPoints()));
      cell->EvaluatePosition(at, nearest, part, parametric, distance2, weights.data());
      for (vtkIdType i = 0; i < cell->GetNumberOfPoints(); ++i) {
        double one[3];
        normals->GetTuple(cell->GetPointId(static_cast<int>(i)), one);
        normal += weights[static_cast<std::size_t>(i)] * Eigen::Vector3d(one[0], one[1], one[2]);
      }
    } else {
      vtkPolygon::ComputeNormal(cell->GetPoints(), normal.data());
    }
    return normal.allFinite() && normal.norm() > 1e-9 ? std::optional<Eigen::Vector3d>(normal) : std::nullopt;
  };
}

} // namespace echorama

#endif
