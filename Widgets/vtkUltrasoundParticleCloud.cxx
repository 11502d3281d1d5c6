// SPDX-License-Identifier: BSD-3-Clause
#include "vtkUltrasoundParticleCloud.h"

#include "Core/Base/Angles.h"
#include "Core/Base/Parallel.h"
#include "vtkActor.h"
#include "vtkBoundingBox.h"
#include "vtkCamera.h"
#include "vtkCellArray.h"
#include "vtkFloatArray.h"
#include "vtkIdTypeArray.h"
#include "vtkMath.h"
#include "vtkMatrix4x4.h"
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
#include "vtkTextureObject.h"
#include "vtkUniforms.h"
#include "vtkUnsignedCharArray.h"

#include <algorithm>
#include <cmath>
#include <string>

namespace echorama {

namespace {
constexpr unsigned int Scissors = 0x0C11, Depths = 0x0B71, Blends = 0x0BE2; // GL_SCISSOR_TEST, GL_DEPTH_TEST, GL_BLEND
constexpr unsigned int One = 1, OneMinusAlpha = 0x0303;                     // GL_ONE, GL_ONE_MINUS_SRC_ALPHA

double PixelsPerMm(vtkRenderer* renderer) // where the clip coordinate w is 1
{
  const double height = renderer->GetSize()[1];
  vtkCamera* camera = renderer->GetActiveCamera();
  return camera->GetParallelProjection() ? height / (2.0 * camera->GetParallelScale())
                                         : height / (2.0 * std::tan(RadiansPerDegree * camera->GetViewAngle() / 2.0));
}
} // namespace

/** Points whose size in pixels the vertex shader decides, and that hide nothing; or a picture of them. */
class ParticleCloud::Mapper : public vtkOpenGLPolyDataMapper {
public:
  static Mapper* New();
  vtkTypeMacro(Mapper, vtkOpenGLPolyDataMapper);

  const ParticleCloud* Drawn = nullptr;

  void ComputeBounds() override // of all particles, whether there are points of them or not
  {
    vtkBoundingBox box;
    for (const Part& part : this->Drawn->Filled) {
      for (int corner = 0; !part.box.isEmpty() && corner < 8; ++corner) {
        const Eigen::Vector3f at = part.box.corner(static_cast<Eigen::AlignedBox3f::CornerType>(corner));
        box.AddPoint(Eigen::Vector3d(part.volumeToWorld * at.cast<double>()).data());
      }
    }
    if (box.IsValid()) {
      box.GetBounds(this->Bounds);
    } else {
      vtkMath::UninitializeBounds(this->Bounds);
    }
  }

  void RenderPiece(vtkRenderer* renderer, vtkActor* actor) override
  {
    if (this->Drawn->IsOnProcessor) {
      this->Drawn->DrawOnProcessor(renderer);
    } else {
      this->Superclass::RenderPiece(renderer, actor);
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
vtkStandardNewMacro(ParticleCloud::Mapper);

bool DrawsInSoftware(vtkRenderWindow* window)
{
  const char* const told = window->ReportCapabilities();
  const std::string capabilities = told ? told : "";
  const auto names = {"llvmpipe", "softpipe", "swrast", "SWR", "Software Rasterizer", "GDI Generic"};
  return std::any_of(names.begin(), names.end(), [&](const char* name) { return capabilities.find(name) != std::string::npos; });
}

ParticleCloud::ParticleCloud()
{
  vtkNew<Mapper> mapper;
  mapper->Drawn = this;
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

ParticleCloud::~ParticleCloud()
{
  this->Filled.clear(); // the mapper may live on in a renderer
}

int ParticleCloud::Count() const
{
  std::size_t count = 0;
  for (const Part& part : this->Filled) {
    count += part.particles->Count();
  }
  return this->Actor->GetVisibility() ? static_cast<int>(count) : 0;
}

void ParticleCloud::Fill(std::vector<Part> parts, double sides)
{
  this->Filled = std::move(parts);
  this->Sides = sides;
  for (Part& part : this->Filled) {
    const auto count = static_cast<Eigen::Index>(part.particles->Count());
    const Eigen::Map<const Eigen::Matrix3Xf> positions(part.particles->positions.data(), 3, count);
    part.box =
        count > 0 ? Eigen::AlignedBox3f(positions.rowwise().minCoeff(), positions.rowwise().maxCoeff()) : Eigen::AlignedBox3f();
  }
  this->PointsDirty = true;
}

void ParticleCloud::FillPoints()
{
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
    const SplatTints tints(part);
    for (std::size_t p = 0; p < part.particles->Count(); ++p) {
      const auto colour = tints.Of(part.particles->values[p], part.particles->alphas[p]);
      rgba = std::copy(colour.begin(), colour.end(), rgba);
    }
    size = std::fill_n(size, part.particles->Count(), static_cast<float>(this->Sides * part.particles->sizeMm));
  }
  vtkNew<vtkPoints> points;
  points->SetDataTypeToFloat();
  points->SetNumberOfPoints(count);
  this->Cloud->SetPoints(points);
  this->Cloud->GetPointData()->SetScalars(colours);
  this->Cloud->GetPointData()->AddArray(sizes);
  this->PointsDirty = false;
  this->PlacesDirty = true;
}

void ParticleCloud::Move()
{
  this->PlacesDirty = true;
  this->Actor->GetMapper()->Modified();
}

void ParticleCloud::MovePoints()
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
  this->PlacesDirty = false;
  this->SortedAlong.setZero();
}

void ParticleCloud::Face(vtkRenderer* renderer, bool onProcessor)
{
  this->IsOnProcessor = onProcessor;
  if (!this->Actor->GetVisibility() || onProcessor) {
    return;
  }
  if (this->PointsDirty) {
    this->FillPoints();
  }
  if (this->PlacesDirty) {
    this->MovePoints();
  }
  Eigen::Vector3d towards;
  renderer->GetActiveCamera()->GetViewPlaneNormal(towards.data());
  if (towards != this->SortedAlong) {
    this->Sort(towards);
  }
  this->Actor->GetShaderProperty()->GetVertexCustomUniforms()->SetUniformf("particlePixels",
                                                                           static_cast<float>(PixelsPerMm(renderer)));
}

// Over what was drawn before, and behind what of it is nearer.
void ParticleCloud::DrawOnProcessor(vtkRenderer* renderer) const
{
  int width, height, left, bottom;
  renderer->GetTiledSizeAndOrigin(&width, &height, &left, &bottom);
  if (width <= 0 || height <= 0) {
    return;
  }
  auto* window = static_cast<vtkOpenGLRenderWindow*>(renderer->GetRenderWindow());
  vtkOpenGLState* state = window->GetState();
  SplatView view;
  view.width = width;
  view.height = height;
  view.pixels = PixelsPerMm(renderer);
  view.sides = this->Sides;
  const double* toClip =
      renderer->GetActiveCamera()->GetCompositeProjectionTransformMatrix(renderer->GetTiledAspectRatio(), -1, 1)->GetData();
  view.worldToClip = Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(toClip);
  std::vector<float> depth(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  const vtkOpenGLState::ScopedglEnableDisable scissors(state, Scissors), depths(state, Depths), blends(state, Blends);
  const vtkOpenGLState::ScopedglBlendFuncSeparate blend(state);
  window->GetZbufferData(left, bottom, left + width - 1, bottom + height - 1, depth.data());
  std::vector<std::uint8_t> rgba = DrawParticles({this->Filled.begin(), this->Filled.end()}, view, depth.data());
  vtkNew<vtkTextureObject> texture;
  texture->SetContext(window);
  texture->Create2DFromRaw(static_cast<unsigned int>(width), static_cast<unsigned int>(height), 4, VTK_UNSIGNED_CHAR,
                           rgba.data());
  state->vtkglDisable(Depths);
  state->vtkglEnable(Blends);
  state->vtkglBlendFuncSeparate(One, OneMinusAlpha, One, OneMinusAlpha);
  const vtkOpenGLState::ScopedglViewport viewport(state);
  texture->CopyToFrameBuffer(0, 0, width - 1, height - 1, left, bottom, left + width, bottom + height, nullptr, nullptr);
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
