// SPDX-License-Identifier: BSD-3-Clause
#include "vtkUltrasoundGel.h"

#include "Core/Base/NumberText.h"
#include "Filters/Physics/GelMotion.h"
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

#include <algorithm>
#include <limits>
#include <sstream>
#include <utility>
#include <vector>

using echorama::GelBeam;
using echorama::GelCoat;
using echorama::GelMotion;
using echorama::Material;
using echorama::TissueSurface;

vtkStandardNewMacro(vtkUltrasoundGel);

vtkUltrasoundParametersMacro(vtkUltrasoundGel);

// What a probe does next, and the tissue that it presses then.
struct GelStep {
  echorama::PlacedProbe probe;
  double seconds = 0.0; // 0: by its speed
  vtkPolyData* pressed = nullptr;
  vtkMTimeType pressedTime = 0;

  bool operator==(const GelStep& other) const
  {
    return probe.geometry == other.probe.geometry && probe.probeToWorld.matrix() == other.probe.probeToWorld.matrix() &&
           seconds == other.seconds && pressed == other.pressed && pressedTime == other.pressedTime;
  }
};

struct vtkUltrasoundGel::Kept {
  GelMotion Motion;
  vtkPolyData* Tissue;
  vtkMTimeType TissueTime;
  std::string Parameters;
  std::vector<GelStep> Steps;
};

namespace {

std::vector<GelStep> StepsOf(vtkInformationVector* probes, vtkInformationVector* pressed)
{
  using echorama::Error;
  using echorama::NumberText;
  std::vector<GelStep> steps;
  std::optional<double> before;
  for (const echorama::PlacedProbe& probe : vtkUltrasoundAcquisition::ProbesOf(probes)) {
    GelStep step{probe};
    const std::size_t number = steps.size() + 1;
    if (!(probe.geometry == (steps.empty() ? probe : steps.front().probe).geometry)) {
      throw Error(Error::Kind::BadInput, "probe " + NumberText(number) + " is another one than probe 1: gel goes with one face");
    }
    const std::optional<double> now =
        vtkUltrasoundAcquisition::TimeStampOf(vtkDataObject::GetData(probes, static_cast<int>(number) - 1));
    if (before && now) {
      step.seconds = *now - *before;
      if (!(step.seconds > 0.0)) {
        throw Error(Error::Kind::BadInput, "the time stamp of probe " + NumberText(number) + " (" + NumberText(*now) +
                                               " s) does not come after that of probe " + NumberText(number - 1) + " (" +
                                               NumberText(*before) + " s)");
      }
    }
    before = now;
    steps.push_back(step);
  }
  if (steps.empty()) {
    throw Error(Error::Kind::BadInput, "there is no probe that gel could be put on");
  }
  const auto count = static_cast<std::size_t>(pressed->GetNumberOfInformationObjects());
  if (count > 1 && count != steps.size()) {
    throw Error(Error::Kind::BadInput, "there are " + NumberText(steps.size()) + " probes, but " + NumberText(count) +
                                           " states of the tissue that they press; give one for each, or one for the last");
  }
  for (std::size_t n = 0; n < count; ++n) {
    GelStep& step = steps[steps.size() - count + n];
    step.pressed = vtkPolyData::GetData(pressed, static_cast<int>(n));
    step.pressedTime = step.pressed ? step.pressed->GetMTime() : 0;
  }
  return steps;
}

// The tissue's own material of a name, or the standard one.
const Material& MaterialIn(const TissueSurface& tissue, const std::string& name)
{
  const auto own = std::find_if(tissue.materials.begin(), tissue.materials.end(),
                                [&name](const Material& material) { return material.name == name; });
  return own == tissue.materials.end() ? echorama::StandardMaterial(name) : *own;
}

} // namespace

//----------------------------------------------------------------------------
TissueSurface vtkUltrasoundGel::SurfaceOf(const GelCoat& coat, const echorama::Material& gel, const echorama::Material& air)
{
  // Contours are made along the axes of the grid; the world comes after.
  vtkNew<vtkImageData> image;
  image->SetDimensions(coat.grid.dimensions.data());
  vtkNew<vtkFloatArray> level;
  level->SetArray(const_cast<float*>(coat.level.data()), static_cast<vtkIdType>(coat.level.size()), 1); // which only reads
  image->GetPointData()->SetScalars(level);
  vtkNew<vtkFlyingEdges3D> contour;
  contour->SetInputData(image);
  contour->SetValue(0, 0.0);
  contour->ComputeNormalsOff();
  contour->ComputeScalarsOff();
  contour->Update();
  vtkPolyData* made = contour->GetOutput();

  TissueSurface surface;
  surface.materials = {air, gel};
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

//----------------------------------------------------------------------------
void vtkUltrasoundGel::SetFace(const GelCoat& coat, vtkPolyData* face)
{
  // A rectangle of the beams' starts.
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
  vtkUltrasoundVolume::AddField(face, vtkUltrasoundGel::GelGoneName(), &coat.goneMm3, 1);
  vtkUltrasoundVolume::AddField(face, vtkUltrasoundGel::SecondsName(), &coat.seconds, 1);
}

//----------------------------------------------------------------------------
vtkUltrasoundGel::vtkUltrasoundGel()
{
  this->SetNumberOfInputPorts(3);
  this->SetNumberOfOutputPorts(2);
}

//----------------------------------------------------------------------------
vtkUltrasoundGel::~vtkUltrasoundGel() = default;

//----------------------------------------------------------------------------
echorama::ParameterList vtkUltrasoundGel::Parameters()
{
  return echorama::Join({Describe(this->Coat), Describe(this->Material), Describe(this->Head)});
}

//----------------------------------------------------------------------------
int vtkUltrasoundGel::FillInputPortInformation(int port, vtkInformation* info)
{
  info->Set(vtkAlgorithm::INPUT_REQUIRED_DATA_TYPE(), port == 1 ? "vtkDataObject" : "vtkPolyData");
  if (port > 0) {
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
    // 1. what came in, and how much of it is done already
    echorama::CheckRanges(this->Parameters());
    vtkPolyData* body = vtkPolyData::GetData(inputs[0]);
    const vtkMTimeType time = body ? body->GetMTime() : 0;
    std::vector<GelStep> steps = StepsOf(inputs[1], inputs[2]);
    std::ostringstream parameters;
    vtkUltrasoundParameters::Print(parameters, vtkIndent(), this->Parameters());
    std::unique_ptr<Kept> kept = std::move(this->Last); // gone when anything fails
    if (kept && !(kept->Tissue == body && kept->TissueTime == time && kept->Parameters == parameters.str() &&
                  kept->Steps.size() <= steps.size() && std::equal(kept->Steps.begin(), kept->Steps.end(), steps.begin()))) {
      kept = nullptr;
    }

    // 2. the kernel
    if (!kept) {
      const TissueSurface tissue = vtkUltrasoundTissue::Of(body);
      kept.reset(new Kept{
          GelMotion(tissue, steps.front().probe, this->Head, this->Material, this->Coat), body, time, parameters.str(), {}});
    }
    const std::size_t known = kept->Steps.size();
    const double more = static_cast<double>(steps.size() - known);
    for (std::size_t n = known; n < steps.size(); ++n) {
      TissueSurface pressed;
      if (steps[n].pressed) {
        pressed = vtkUltrasoundTissue::Of(steps[n].pressed);
      }
      const auto part = [&](std::size_t at) { return 0.8 * static_cast<double>(at - known) / more; };
      kept->Motion.Move(steps[n].probe.probeToWorld, steps[n].seconds, steps[n].pressed ? &pressed : nullptr,
                        progress.Part(part(n), part(n + 1)));
    }
    GelMotion settled = kept->Motion; // the motion itself goes on without a stop
    GelCoat coat = settled.Look(true, progress.Part(0.8, 1.0));

    // 3. what goes out
    const TissueSurface& now = settled.Tissue();
    TissueSurface all = SurfaceOf(coat, MaterialIn(now, "gel"), MaterialIn(now, "air"));
    all.Append(now);
    vtkUltrasoundTissue::Set(vtkPolyData::GetData(outputs, 0), all);
    SetFace(coat, vtkPolyData::GetData(outputs, 1));
    this->PosesComputed = static_cast<int>(steps.size() - known);
    kept->Steps = std::move(steps);
    this->Last = std::move(kept);
  });
}

//----------------------------------------------------------------------------
void vtkUltrasoundGel::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  vtkUltrasoundParameters::Print(os, indent, this->Parameters());
}
