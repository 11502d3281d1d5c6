// SPDX-License-Identifier: BSD-3-Clause
// Cells of the outline become a small image around which a line of empty cells is laid, so that the surface is closed where the
// region ends with its grid. Its surface at one half is then brought from cells to the world. Smoothing comes before that: cells
// are of one size, whatever the voxels are. Time: one pass over the voxels, and what the cells cost, which are bounded.
#include "vtkUltrasoundSkin.h"

#include "Core/Imaging/RegionOutline.h"
#include "vtkUltrasoundTissue.h"
#include "vtkUltrasoundVolume.h"

#include "vtkCallbackCommand.h"
#include "vtkCleanPolyData.h"
#include "vtkCommand.h"
#include "vtkDataArray.h"
#include "vtkFlyingEdges3D.h"
#include "vtkImageData.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkNew.h"
#include "vtkObjectFactory.h"
#include "vtkPointData.h"
#include "vtkPolyData.h"
#include "vtkPolyDataConnectivityFilter.h"
#include "vtkPolyDataNormals.h"
#include "vtkSmartPointer.h"
#include "vtkTriangleFilter.h"
#include "vtkWindowedSincPolyDataFilter.h"

#include <algorithm>
#include <cmath>
#include <vector>

using echorama::Error;

vtkStandardNewMacro(vtkUltrasoundSkin);

vtkUltrasoundParametersMacro(vtkUltrasoundSkin);

namespace {

// Runs a filter of VTK as a step of ours, which may be stopped.
void UpdateStep(vtkAlgorithm* step, const echorama::Progress& progress)
{
  struct Watch {
    vtkAlgorithm* Step;
    const echorama::Progress* Told;
    bool Stopped = false;
  } watch{step, &progress};
  vtkNew<vtkCallbackCommand> command;
  command->SetClientData(&watch);
  command->SetCallback([](vtkObject*, unsigned long, void* data, void*) {
    auto* told = static_cast<Watch*>(data);
    try {
      (*told->Told)(told->Step->GetProgress());
    } catch (const Error&) { // must not fly through VTK
      told->Stopped = true;
      told->Step->SetAbortExecute(1);
    }
  });
  const unsigned long tag = step->AddObserver(vtkCommand::ProgressEvent, command);
  step->Update();
  step->RemoveObserver(tag);
  if (watch.Stopped) {
    throw Error(Error::Kind::Cancelled, "stopped on request");
  }
  progress(1.0);
}

// From a place among the padded cells to an index of the voxels.
double IndexOf(double cell, const std::vector<double>& centres)
{
  const double at = cell - 1.0; // the padding
  const auto last = static_cast<int>(centres.size()) - 1;
  if (last == 0) {
    return centres[0] + at * 2.0 * (centres[0] + 0.5);
  }
  const int low = std::clamp(static_cast<int>(std::floor(at)), 0, last - 1);
  const auto i = static_cast<std::size_t>(low);
  return centres[i] + (at - low) * (centres[i + 1] - centres[i]);
}

// The body that holds the others.
vtkSmartPointer<vtkPolyData> BodyAlone(const echorama::TissueSurface& tissue)
{
  const int outermost = echorama::OutermostBody(tissue);
  if (outermost < 0) {
    throw Error(Error::Kind::BadInput, "the tissue has no body whose surface the skin could be");
  }
  auto body = vtkSmartPointer<vtkPolyData>::New();
  vtkUltrasoundTissue::Set(body, tissue.Only(outermost));
  return body;
}

vtkSmartPointer<vtkPolyData> TrianglesOf(vtkPolyData* mesh, const echorama::Progress& progress)
{
  const vtkNew<vtkPolyData> bare; // only its shape counts
  bare->SetPoints(mesh->GetPoints());
  bare->SetPolys(mesh->GetPolys());
  bare->SetStrips(mesh->GetStrips());
  const vtkNew<vtkTriangleFilter> triangles;
  triangles->PassVertsOff();
  triangles->PassLinesOff();
  triangles->SetInputData(bare);
  UpdateStep(triangles, progress);
  if (triangles->GetOutput()->GetNumberOfPolys() == 0) {
    throw Error(Error::Kind::BadInput, "the surface has no triangle");
  }
  return triangles->GetOutput();
}

} // namespace

//----------------------------------------------------------------------------
echorama::ParameterList vtkUltrasoundSkin::Parameters()
{
  return Describe(this->Values);
}

//----------------------------------------------------------------------------
void vtkUltrasoundSkin::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  vtkUltrasoundParameters::Print(os, indent, this->Parameters());
}

//----------------------------------------------------------------------------
int vtkUltrasoundSkin::FillInputPortInformation(int, vtkInformation* information)
{
  information->Set(vtkAlgorithm::INPUT_REQUIRED_DATA_TYPE(), "vtkImageData");
  information->Append(vtkAlgorithm::INPUT_REQUIRED_DATA_TYPE(), "vtkPolyData");
  return 1;
}

//----------------------------------------------------------------------------
int vtkUltrasoundSkin::RequestUpdateExtent(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector*)
{
  vtkUltrasoundVolume::RequestWhole(inputs[0]);
  return 1;
}

//----------------------------------------------------------------------------
int vtkUltrasoundSkin::RequestData(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  return vtkUltrasoundVolume::Run(this, outputs, [&](const echorama::Progress& progress) {
    echorama::CheckRanges(this->Values);
    vtkImageData* volume = vtkImageData::GetData(inputs[0]);
    vtkPolyData* mesh = vtkPolyData::GetData(inputs[0]);
    if (!volume && !mesh) {
      throw Error(Error::Kind::BadInput, "there is no volume, tissue or surface to take the skin of");
    }
    vtkSmartPointer<vtkPolyData> surface = mesh;
    if (volume) {
      surface = this->OutlineOf(volume, progress.Part(0.0, 0.8));
    } else {
      if (vtkUltrasoundTissue::IsTissue(mesh)) {
        surface = BodyAlone(vtkUltrasoundTissue::Of(mesh));
      }
      surface = TrianglesOf(surface, progress.Part(0.0, 0.8)); // without materials: skin is no tissue
    }
    progress(0.8);
    const vtkNew<vtkPolyDataNormals> normals;
    normals->SetInputData(surface);
    normals->SplittingOff();
    normals->ConsistencyOn();
    normals->AutoOrientNormalsOn();
    UpdateStep(normals, progress.Part(0.8, 1.0));
    vtkPolyData* output = vtkPolyData::GetData(outputs);
    output->ShallowCopy(normals->GetOutput());
  });
}

//----------------------------------------------------------------------------
vtkSmartPointer<vtkPolyData> vtkUltrasoundSkin::OutlineOf(vtkImageData* volume, const echorama::Progress& progress) const
{
  const echorama::ImageGeometry geometry = vtkUltrasoundVolume::GeometryOf(volume);
  vtkDataArray* valid = vtkUltrasoundVolume::CheckValidRegion(volume, "the volume");
  std::vector<unsigned char> whole;
  if (!valid) {
    whole.assign(geometry.VoxelCount(), 1);
  }
  const auto region = valid ? vtkUltrasoundVolume::ViewOf<const unsigned char>(valid, volume)
                            : echorama::VolumeView<const unsigned char>(whole.data(), geometry.dimensions);
  const echorama::RegionOutline outline =
      echorama::OutlineRegion(region, geometry, this->Values.mostCells, progress.Part(0.0, 0.4));

  int size[3];
  for (int a = 0; a < 3; ++a) {
    size[a] = static_cast<int>(outline.centres[a].size());
  }
  const vtkNew<vtkImageData> cells;
  cells->SetDimensions(size[0] + 2, size[1] + 2, size[2] + 2);
  cells->AllocateScalars(VTK_FLOAT, 1);
  std::fill_n(static_cast<float*>(cells->GetScalarPointer()), cells->GetNumberOfPoints(), 0.0f);
  for (int k = 0; k < size[2]; ++k) {
    for (int j = 0; j < size[1]; ++j) {
      for (int i = 0; i < size[0]; ++i) {
        *static_cast<float*>(cells->GetScalarPointer(i + 1, j + 1, k + 1)) = outline.filled.View()(i, j, k);
      }
    }
  }
  const vtkNew<vtkFlyingEdges3D> surface;
  surface->SetInputData(cells);
  surface->SetValue(0, 0.5);
  surface->ComputeNormalsOff();
  surface->ComputeScalarsOff();
  UpdateStep(surface, progress.Part(0.4, 0.5));
  const vtkNew<vtkPolyDataConnectivityFilter> largest;
  largest->SetInputConnection(surface->GetOutputPort());
  largest->SetExtractionModeToLargestRegion();
  const vtkNew<vtkCleanPolyData> alone; // it leaves the points of the other pieces
  alone->SetInputConnection(largest->GetOutputPort());
  alone->PointMergingOff();
  UpdateStep(alone, progress.Part(0.5, 0.7));
  const vtkNew<vtkPolyData> skin;
  if (this->Values.smoothingSteps > 0) {
    const vtkNew<vtkWindowedSincPolyDataFilter> smooth; // off the steps of the cells
    smooth->SetInputConnection(alone->GetOutputPort());
    smooth->SetNumberOfIterations(this->Values.smoothingSteps);
    smooth->SetPassBand(this->Values.passBand);
    smooth->NormalizeCoordinatesOn();
    UpdateStep(smooth, progress.Part(0.7, 1.0));
    skin->DeepCopy(smooth->GetOutput());
  } else {
    skin->DeepCopy(alone->GetOutput());
  }
  const Eigen::Affine3d toWorld = geometry.IndexToWorld();
  for (vtkIdType i = 0; i < skin->GetNumberOfPoints(); ++i) {
    double cell[3];
    skin->GetPoint(i, cell);
    Eigen::Vector3d index;
    for (int a = 0; a < 3; ++a) {
      index[a] = IndexOf(cell[a], outline.centres[a]);
    }
    const Eigen::Vector3d world = toWorld * index;
    skin->GetPoints()->SetPoint(i, world.data());
  }
  return skin.Get();
}
