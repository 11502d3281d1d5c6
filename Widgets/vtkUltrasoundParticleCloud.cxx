// SPDX-License-Identifier: BSD-3-Clause
#include "vtkUltrasoundParticleCloud.h"

#include "Core/Base/Angles.h"
#include "Core/Base/Parallel.h"
#include "vtkActor.h"
#include "vtkCamera.h"
#include "vtkCellArray.h"
#include "vtkFloatArray.h"
#include "vtkIdTypeArray.h"
#include "vtkMath.h"
#include "vtkObjectFactory.h"
#include "vtkOpenGLPolyDataMapper.h"
#include "vtkOpenGLRenderWindow.h"
#include "vtkOpenGLState.h"
#include "vtkPointData.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"
#include "vtkProperty.h"
#include "vtkRenderer.h"
#include "vtkShaderProperty.h"
#include "vtkUniforms.h"
#include "vtkUnsignedCharArray.h"

#include <algorithm>
#include <cmath>

namespace echorama {

namespace {
/** Points whose size in pixels the vertex shader decides, and that hide nothing. */
class ParticleMapper : public vtkOpenGLPolyDataMapper {
public:
  static ParticleMapper* New();
  vtkTypeMacro(ParticleMapper, vtkOpenGLPolyDataMapper);

  void ComputeBounds() override // of all points, whether they are sorted already or not
  {
    vtkPoints* points = this->GetInput() ? this->GetInput()->GetPoints() : nullptr;
    if (points && points->GetNumberOfPoints() > 0) {
      points->GetBounds(this->Bounds);
    } else {
      vtkMath::UninitializeBounds(this->Bounds);
    }
  }

  void RenderPieceDraw(vtkRenderer* renderer, vtkActor* actor) override
  {
    constexpr unsigned int ProgramPointSize = 0x8642; // GL_PROGRAM_POINT_SIZE
    vtkOpenGLState* state = static_cast<vtkOpenGLRenderWindow*>(renderer->GetRenderWindow())->GetState();
    state->vtkglEnable(ProgramPointSize);
    state->vtkglDepthMask(0);
    this->Superclass::RenderPieceDraw(renderer, actor);
    state->vtkglDepthMask(1);
    state->vtkglDisable(ProgramPointSize);
  }
};
vtkStandardNewMacro(ParticleMapper);
} // namespace

ParticleCloud::ParticleCloud()
{
  vtkNew<ParticleMapper> mapper;
  mapper->SetInputData(this->Cloud);
  mapper->MapDataArrayToVertexAttribute("particleSize", "Size", vtkDataObject::FIELD_ASSOCIATION_POINTS);
  this->Actor->SetMapper(mapper);
  this->Actor->ForceOpaqueOn();
  this->Actor->PickableOff();
  this->Actor->VisibilityOff();
  this->Actor->GetProperty()->LightingOff();
  vtkShaderProperty* shader = this->Actor->GetShaderProperty();
  shader->AddVertexShaderReplacement("//VTK::PositionVC::Dec", true, "//VTK::PositionVC::Dec\nin float particleSize;\n", false);
  shader->AddVertexShaderReplacement(
      "//VTK::PositionVC::Impl", true,
      "//VTK::PositionVC::Impl\n  gl_PointSize = max(1.0, particleSize * particlePixels / gl_Position.w);\n", false);
  shader->GetVertexCustomUniforms()->SetUniformf("particlePixels", 1.0f);
}

ParticleCloud::~ParticleCloud() = default;

int ParticleCloud::Count() const
{
  return this->Actor->GetVisibility() ? static_cast<int>(this->Cloud->GetNumberOfPoints()) : 0;
}

void ParticleCloud::Fill(std::vector<Part> parts, double sides)
{
  this->Filled = std::move(parts);
  vtkIdType count = 0;
  for (const Part& part : this->Filled) {
    count += static_cast<vtkIdType>(part.particles->Count());
  }
  vtkNew<vtkUnsignedCharArray> colours;
  colours->SetName("Colour");
  colours->SetNumberOfComponents(4);
  colours->SetNumberOfTuples(count);
  vtkNew<vtkFloatArray> sizes;
  sizes->SetName("Size");
  sizes->SetNumberOfTuples(count);
  unsigned char* rgba = colours->GetPointer(0);
  float* size = sizes->GetPointer(0);
  for (const Part& part : this->Filled) {
    unsigned char tints[3][256];
    for (int value = 0; value < 256; ++value) {
      for (std::size_t c = 0; c < 3; ++c) {
        tints[c][value] = static_cast<unsigned char>(std::lround(part.colour[c] * value));
      }
    }
    for (std::size_t p = 0; p < part.particles->Count(); ++p) {
      for (std::size_t c = 0; c < 3; ++c) {
        *rgba++ = tints[c][part.particles->values[p]];
      }
      *rgba++ = static_cast<unsigned char>(std::lround(part.opacity * part.particles->alphas[p]));
    }
    size = std::fill_n(size, part.particles->Count(), static_cast<float>(sides * part.particles->sizeMm));
  }
  vtkNew<vtkPoints> points;
  points->SetDataTypeToFloat();
  points->SetNumberOfPoints(count);
  this->Cloud->SetPoints(points);
  this->Cloud->GetPointData()->SetScalars(colours);
  this->Cloud->GetPointData()->AddArray(sizes);
}

void ParticleCloud::Move()
{
  vtkPoints* points = this->Cloud->GetPoints();
  float* out = points->GetNumberOfPoints() > 0 ? static_cast<float*>(points->GetVoidPointer(0)) : nullptr;
  for (const Part& part : this->Filled) {
    const std::vector<float>& positions = part.particles->positions;
    const Eigen::Matrix3f R = part.volumeToWorld.linear().cast<float>();
    const Eigen::Vector3f t = part.volumeToWorld.translation().cast<float>();
    ParallelRanges(static_cast<std::ptrdiff_t>(positions.size() / 3), 1 << 15, Progress(),
                   [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
                     for (std::ptrdiff_t p = 3 * begin; p < 3 * end; p += 3) {
                       Eigen::Map<Eigen::Vector3f>{out + p} = R * Eigen::Map<const Eigen::Vector3f>(positions.data() + p) + t;
                     }
                   });
    out += positions.size();
  }
  points->Modified();
  this->Cloud->Modified();
  this->SortedAlong.setZero();
}

void ParticleCloud::Face(vtkRenderer* renderer)
{
  if (!this->Actor->GetVisibility()) {
    return;
  }
  vtkCamera* camera = renderer->GetActiveCamera();
  Eigen::Vector3d towards;
  camera->GetViewPlaneNormal(towards.data());
  if (towards != this->SortedAlong) {
    this->Sort(towards);
  }
  const double height = renderer->GetSize()[1];
  const double pixels = camera->GetParallelProjection()
                            ? height / (2.0 * camera->GetParallelScale())
                            : height / (2.0 * std::tan(RadiansPerDegree * camera->GetViewAngle() / 2.0));
  this->Actor->GetShaderProperty()->GetVertexCustomUniforms()->SetUniformf("particlePixels", static_cast<float>(pixels));
}

// From back to front.
void ParticleCloud::Sort(const Eigen::Vector3d& towards)
{
  this->SortedAlong = towards;
  std::vector<ParticleDepths> sets;
  for (const Part& part : this->Filled) {
    sets.push_back({&part.particles->positions, part.volumeToWorld.linear().transpose() * towards,
                    towards.dot(part.volumeToWorld.translation())});
  }
  const std::vector<std::uint32_t> order = BackToFront(sets);
  vtkNew<vtkIdTypeArray> connectivity, offsets;
  connectivity->SetNumberOfValues(static_cast<vtkIdType>(order.size()));
  std::copy(order.begin(), order.end(), connectivity->GetPointer(0));
  offsets->InsertNextValue(0);
  if (!order.empty()) {
    offsets->InsertNextValue(static_cast<vtkIdType>(order.size()));
  }
  vtkNew<vtkCellArray> cells; // one cell with all points
  cells->SetData(offsets, connectivity);
  this->Cloud->SetVerts(cells);
  this->Cloud->Modified();
}

} // namespace echorama
