// SPDX-License-Identifier: BSD-3-Clause
#include "vtkUltrasoundGel.h"

#include "Filters/Tissue/TissueSurface.h"
#include "vtkCellArray.h"
#include "vtkDoubleArray.h"
#include "vtkFloatArray.h"
#include "vtkFlyingEdges3D.h"
#include "vtkIdList.h"
#include "vtkImageData.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkNew.h"
#include "vtkObjectFactory.h"
#include "vtkPointData.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"
#include "vtkUltrasoundAcquisition.h"
#include "vtkUltrasoundTissue.h"
#include "vtkUltrasoundVolume.h"
#include "vtkUnsignedCharArray.h"

#include <optional>

using echorama::GelBeam;
using echorama::GelCoat;
using echorama::TissueSurface;

vtkStandardNewMacro(vtkUltrasoundGel);

vtkUltrasoundParametersMacro(vtkUltrasoundGel);

namespace {

// Where the level is 0, as a body of gel in air; no body where there is no gel.
TissueSurface SurfaceOf(GelCoat& coat)
{
  // Contours are made along the axes of the grid; the world comes after.
  vtkNew<vtkImageData> image;
  image->SetDimensions(coat.grid.dimensions.data());
  vtkNew<vtkFloatArray> level;
  level->SetArray(coat.level.data(), static_cast<vtkIdType>(coat.level.size()), 1);
  image->GetPointData()->SetScalars(level);
  vtkNew<vtkFlyingEdges3D> contour;
  contour->SetInputData(image);
  contour->SetValue(0, 0.0);
  contour->ComputeNormalsOff();
  contour->ComputeScalarsOff();
  contour->Update();
  vtkPolyData* made = contour->GetOutput();

  TissueSurface surface;
  surface.materials = {echorama::StandardMaterial("air"), echorama::StandardMaterial("gel")};
  if (made->GetNumberOfPolys() == 0) {
    return surface;
  }
  const Eigen::Affine3d toWorld = coat.grid.IndexToWorld();
  for (vtkIdType n = 0; n < made->GetNumberOfPoints(); ++n) {
    surface.points.push_back((toWorld * Eigen::Vector3d(made->GetPoint(n))).cast<float>());
  }
  double volume = 0.0; // six times, by which triangles say what is outside
  vtkNew<vtkIdList> corners;
  for (vtkIdType n = 0; n < made->GetNumberOfPolys(); ++n) {
    made->GetPolys()->GetCellAtId(n, corners);
    const auto corner = [&corners](vtkIdType at) { return static_cast<std::uint32_t>(corners->GetId(at)); };
    surface.triangles.push_back({corner(0), corner(1), corner(2)});
    const auto point = [&surface, &corner](vtkIdType at) { return surface.points[corner(at)].cast<double>().eval(); };
    volume += (point(0) - coat.grid.origin).dot((point(1) - coat.grid.origin).cross(point(2) - coat.grid.origin));
  }
  if (volume < 0.0) {
    for (auto& triangle : surface.triangles) {
      std::swap(triangle[1], triangle[2]);
    }
  }
  surface.bodyOfTriangle.assign(surface.triangles.size(), 0);
  surface.bodies = {{"gel", 1}};
  return surface;
}

// The face as a rectangle of the beams' starts.
void SetFace(vtkPolyData* face, const GelCoat& coat)
{
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  vtkNew<vtkDoubleArray> gel, air;
  gel->SetName(vtkUltrasoundGel::GelName());
  air->SetName(vtkUltrasoundGel::AirName());
  vtkNew<vtkUnsignedCharArray> couples;
  couples->SetName(vtkUltrasoundGel::CouplesName());
  for (const GelBeam& beam : coat.face) {
    points->InsertNextPoint(beam.start.data());
    gel->InsertNextValue(beam.gelMm);
    air->InsertNextValue(beam.airMm);
    couples->InsertNextValue(beam.couples ? 1 : 0);
  }
  face->SetPoints(points);
  vtkNew<vtkCellArray> cells;
  if (coat.planes == 1) {
    cells->InsertNextCell(coat.beams);
    for (int n = 0; n < coat.beams; ++n) {
      cells->InsertCellPoint(n);
    }
    face->SetLines(cells);
  } else {
    for (int plane = 0; plane + 1 < coat.planes; ++plane) {
      for (int n = 0; n + 1 < coat.beams; ++n) {
        const vtkIdType first = plane * coat.beams + n;
        cells->InsertNextCell({first, first + 1, first + coat.beams + 1, first + coat.beams});
      }
    }
    face->SetPolys(cells);
  }
  face->GetPointData()->AddArray(gel);
  face->GetPointData()->AddArray(air);
  face->GetPointData()->AddArray(couples);
  vtkUltrasoundVolume::AddField(face, vtkUltrasoundGel::CoupledName(), &coat.coupled, 1);
  vtkUltrasoundVolume::AddField(face, vtkUltrasoundGel::GelVolumeName(), &coat.volumeMm3, 1);
}

} // namespace

//----------------------------------------------------------------------------
vtkUltrasoundGel::vtkUltrasoundGel()
{
  this->SetNumberOfInputPorts(3);
  this->SetNumberOfOutputPorts(2);
}

//----------------------------------------------------------------------------
echorama::ParameterList vtkUltrasoundGel::Parameters()
{
  return echorama::Join({Describe(this->Coat), Describe(this->Material), Describe(this->Head)});
}

//----------------------------------------------------------------------------
int vtkUltrasoundGel::FillInputPortInformation(int port, vtkInformation* info)
{
  info->Set(vtkAlgorithm::INPUT_REQUIRED_DATA_TYPE(), port == 1 ? "vtkDataObject" : "vtkPolyData");
  if (port == 1) {
    info->Set(vtkAlgorithm::INPUT_IS_REPEATABLE(), 1);
  }
  if (port == 2) {
    info->Set(vtkAlgorithm::INPUT_IS_OPTIONAL(), 1);
  }
  return 1;
}

//----------------------------------------------------------------------------
int vtkUltrasoundGel::RequestData(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  return vtkUltrasoundVolume::Run(this, outputs, [this, inputs, outputs](const echorama::Progress& progress) {
    // 1. what came in
    echorama::CheckRanges(this->Parameters());
    const std::vector<echorama::PlacedProbe> probes = vtkUltrasoundAcquisition::ProbesOf(inputs[1]);
    const TissueSurface rest = vtkUltrasoundTissue::Of(vtkPolyData::GetData(inputs[0]));
    vtkPolyData* under = vtkPolyData::GetData(inputs[2]);
    std::optional<TissueSurface> pressed;
    if (under) {
      pressed = vtkUltrasoundTissue::Of(under);
    }

    // 2. the kernel
    GelCoat coat =
        echorama::SpreadGel(rest, pressed ? &*pressed : nullptr, probes, this->Head, this->Material, this->Coat, progress);

    // 3. what goes out
    TissueSurface all = SurfaceOf(coat);
    all.Append(pressed ? *pressed : rest);
    vtkUltrasoundTissue::Set(vtkPolyData::GetData(outputs, 0), all);
    SetFace(vtkPolyData::GetData(outputs, 1), coat);
  });
}

//----------------------------------------------------------------------------
void vtkUltrasoundGel::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  vtkUltrasoundParameters::Print(os, indent, this->Parameters());
}
