// SPDX-License-Identifier: BSD-3-Clause
// Cells of the outline become a small image around which a line of empty cells is laid, so that the surface is closed where the
// region ends with its grid. Its surface at one half is then brought from cells to the world.
#include "SkinSurface.h"
#include "AlgorithmRun.h"
#include "Core/Imaging/RegionOutline.h"
#include <algorithm>
#include <cmath>
#include <vtkDataArray.h>
#include <vtkFloatArray.h>
#include <vtkFlyingEdges3D.h>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkPolyDataConnectivityFilter.h>
#include <vtkPolyDataNormals.h>
#include <vtkUltrasoundVolume.h>
#include <vtkWindowedSincPolyDataFilter.h>

namespace echorama {

namespace {

constexpr int MostCells = 300000; ///< a finer skin would follow the voxels' steps

// From a place among the padded cells to an index of the voxels.
double IndexOf(double cell, const std::vector<double>& centres)
{
  const double at = cell - 1.0; // the padding
  const auto last = static_cast<int>(centres.size()) - 1;
  if (last == 0)
    return centres[0] + at * 2.0 * (centres[0] + 0.5);
  const int low = std::clamp(static_cast<int>(std::floor(at)), 0, last - 1);
  const auto i = static_cast<std::size_t>(low);
  return centres[i] + (at - low) * (centres[i + 1] - centres[i]);
}

} // namespace

vtkSmartPointer<vtkPolyData> SkinOfVolume(vtkImageData* volume)
{
  const ImageGeometry geometry = vtkUltrasoundVolume::GeometryOf(volume);
  vtkDataArray* valid = vtkUltrasoundVolume::GetValidRegion(volume);
  std::vector<unsigned char> whole;
  if (!valid)
    whole.assign(geometry.VoxelCount(), 1);
  const VolumeView<const unsigned char> region = valid ? vtkUltrasoundVolume::ViewOf<const unsigned char>(valid, volume)
                                                       : VolumeView<const unsigned char>(whole.data(), geometry.dimensions);
  const RegionOutline outline = OutlineRegion(region, geometry, MostCells);

  int size[3];
  for (int a = 0; a < 3; a++)
    size[a] = static_cast<int>(outline.centres[a].size());
  vtkNew<vtkImageData> cells;
  cells->SetDimensions(size[0] + 2, size[1] + 2, size[2] + 2);
  cells->AllocateScalars(VTK_FLOAT, 1);
  auto* values = static_cast<float*>(cells->GetScalarPointer());
  std::fill_n(values, cells->GetNumberOfPoints(), 0.0f);
  for (int k = 0; k < size[2]; k++)
    for (int j = 0; j < size[1]; j++)
      for (int i = 0; i < size[0]; i++)
        *static_cast<float*>(cells->GetScalarPointer(i + 1, j + 1, k + 1)) = outline.filled.View()(i, j, k);

  vtkNew<vtkFlyingEdges3D> surface;
  surface->SetInputData(cells);
  surface->SetValue(0, 0.5);
  surface->ComputeNormalsOff();
  surface->ComputeScalarsOff();
  vtkNew<vtkPolyDataConnectivityFilter> largest;
  largest->SetInputConnection(surface->GetOutputPort());
  largest->SetExtractionModeToLargestRegion();
  vtkNew<vtkWindowedSincPolyDataFilter> smooth; // off the steps of the cells
  smooth->SetInputConnection(largest->GetOutputPort());
  smooth->SetNumberOfIterations(15);
  smooth->SetPassBand(0.1);
  smooth->NormalizeCoordinatesOn();
  Update(smooth, {});

  vtkNew<vtkPolyData> skin;
  skin->DeepCopy(smooth->GetOutput());
  const Eigen::Affine3d toWorld = geometry.IndexToWorld();
  for (vtkIdType i = 0; i < skin->GetNumberOfPoints(); i++) {
    double cell[3];
    skin->GetPoint(i, cell);
    Eigen::Vector3d index;
    for (int a = 0; a < 3; a++)
      index[a] = IndexOf(cell[a], outline.centres[a]);
    const Eigen::Vector3d world = toWorld * index;
    skin->GetPoints()->SetPoint(i, world.data());
  }
  return WithNormals(skin);
}

vtkSmartPointer<vtkPolyData> WithNormals(vtkPolyData* surface)
{
  vtkNew<vtkPolyDataNormals> normals;
  normals->SetInputData(surface);
  normals->SplittingOff();
  normals->ConsistencyOn();
  normals->AutoOrientNormalsOn();
  Update(normals, {});
  return normals->GetOutput();
}

} // namespace echorama
