// SPDX-License-Identifier: BSD-3-Clause
#ifndef vtkUltrasoundTriangles_h
#define vtkUltrasoundTriangles_h

#include "Filters/Tissue/SurfaceCheck.h"
#include "vtkCellArray.h"
#include "vtkNew.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"
#include "vtkTriangleFilter.h"

#include <Eigen/Geometry>

namespace echorama {

/// Adds the points of \a data, each moved by \a map, and its triangles. Polygons and strips are cut into such; lines and vertices
/// are left out.
inline void AddTriangles(TriangleSurface& surface, vtkPolyData* data, const Eigen::Affine3d& map = Eigen::Affine3d::Identity())
{
  vtkNew<vtkTriangleFilter> cut;
  cut->SetInputData(data);
  cut->PassVertsOff();
  cut->PassLinesOff();
  cut->Update();
  vtkPolyData* mesh = cut->GetOutput();
  const auto first = static_cast<std::uint32_t>(surface.points.size());
  for (vtkIdType i = 0; i < mesh->GetNumberOfPoints(); ++i) {
    surface.points.push_back((map * Eigen::Vector3d(mesh->GetPoint(i))).cast<float>());
  }
  vtkIdType count;
  const vtkIdType* ids;
  for (vtkIdType i = 0; i < mesh->GetNumberOfPolys(); ++i) {
    mesh->GetPolys()->GetCellAtId(i, count, ids);
    surface.triangles.push_back({first + static_cast<std::uint32_t>(ids[0]), first + static_cast<std::uint32_t>(ids[1]),
                                 first + static_cast<std::uint32_t>(ids[2])});
  }
}

/// Fills points and polygons of \a data.
inline void SetTriangles(vtkPolyData* data, const TriangleSurface& surface)
{
  vtkNew<vtkPoints> points;
  points->SetNumberOfPoints(static_cast<vtkIdType>(surface.points.size()));
  for (std::size_t i = 0; i < surface.points.size(); ++i) {
    const Eigen::Vector3d point = surface.points[i].cast<double>();
    points->SetPoint(static_cast<vtkIdType>(i), point.data());
  }
  vtkNew<vtkCellArray> triangles;
  for (const auto& [a, b, c] : surface.triangles) {
    triangles->InsertNextCell({static_cast<vtkIdType>(a), static_cast<vtkIdType>(b), static_cast<vtkIdType>(c)});
  }
  data->SetPoints(points);
  data->SetPolys(triangles);
}

} // namespace echorama

#endif
