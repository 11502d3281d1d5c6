// SPDX-License-Identifier: BSD-3-Clause
// Particles of all visible volumes are the points of one vtkPolyData in world coordinates, and one cell names them from back to
// front. A pose that changes moves points, a camera that turns sorts them; both are linear in their number. Points are drawn in
// the opaque pass without writing depths: there VTK blends in the order of drawing, while its translucent pass would mix without
// any order. So what is opaque must be drawn first: the actor of the particles is the last.
//
// Volume rendering takes bytes (0: nothing) on a grid along its own axes, which the volume's pose then places in the world: the
// ray caster on the CPU does not know oblique directions.
#include "vtkUltrasoundVolumeView.h"

#include "Core/Base/Parallel.h"
#include "vtkActor.h"
#include "vtkActor2D.h"
#include "vtkArrowSource.h"
#include "vtkAutoInit.h"
#include "vtkBoundingBox.h"
#include "vtkCamera.h"
#include "vtkCellArray.h"
#include "vtkCellData.h"
#include "vtkColorTransferFunction.h"
#include "vtkCubeSource.h"
#include "vtkFixedPointVolumeRayCastMapper.h"
#include "vtkFloatArray.h"
#include "vtkGlyph3D.h"
#include "vtkIdTypeArray.h"
#include "vtkImageData.h"
#include "vtkLookupTable.h"
#include "vtkMath.h"
#include "vtkMatrix4x4.h"
#include "vtkNew.h"
#include "vtkObjectFactory.h"
#include "vtkOpenGLPolyDataMapper.h"
#include "vtkOpenGLRenderWindow.h"
#include "vtkOpenGLState.h"
#include "vtkPiecewiseFunction.h"
#include "vtkPointData.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"
#include "vtkPolyDataMapper.h"
#include "vtkPolyDataMapper2D.h"
#include "vtkProperty.h"
#include "vtkProperty2D.h"
#include "vtkRenderer.h"
#include "vtkRenderWindow.h"
#include "vtkScalarBarActor.h"
#include "vtkShaderProperty.h"
#include "vtkSmartPointer.h"
#include "vtkTextActor.h"
#include "vtkTextProperty.h"
#include "vtkTexture.h"
#include "vtkUltrasoundAlignmentSession.h"
#include "vtkUltrasoundVolume.h"
#include "vtkUniforms.h"
#include "vtkUnsignedCharArray.h"
#include "vtkVolume.h"
#include "vtkVolumeProperty.h"
#include "Widgets/Particles/DetailLevel.h"
#include "Widgets/Particles/Particles.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <map>
#include <vector>

// The view makes text and ray casters at once: whoever uses it need not know what draws them.
VTK_MODULE_INIT(vtkRenderingFreeType);
VTK_MODULE_INIT(vtkRenderingOpenGL2);
VTK_MODULE_INIT(vtkRenderingVolumeOpenGL2);

using echorama::DetailLevel;
using echorama::ParticleParameters;
using echorama::Pose;
using echorama::SessionVolume;

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

/** What decides how a volume's voxels look; when it is the same, so are the particles. */
struct Look {
  ParticleParameters Parameters;
  bool operator==(const Look& other) const
  {
    const ParticleParameters &a = this->Parameters, &b = other.Parameters;
    return a.downsampling == b.downsampling && a.opacity == b.opacity && a.valueOpacity == b.valueOpacity &&
           a.minimum == b.minimum && a.maximum == b.maximum && a.black == b.black && a.white == b.white && a.budget == b.budget;
  }
};

/** A volume as this view keeps it. */
struct Shown {
  Look Of;
  bool VoxelsDirty = false;
  std::map<int, echorama::Particles> Particles;       ///< by the block that was asked for
  std::map<int, vtkSmartPointer<vtkImageData>> Bytes; ///< of volume rendering, by block
  vtkNew<vtkVolume> Volume;
  vtkNew<vtkFixedPointVolumeRayCastMapper> RayCaster;
  vtkNew<vtkActor> Box;
  vtkNew<vtkCubeSource> Cube; ///< around its real voxels
  double RealVoxels = 0.0;    ///< in that box
};

/** The plane of a slice view. */
struct Plane {
  vtkNew<vtkPolyData> Quad, Frame;
  vtkNew<vtkTexture> Texture;
  vtkNew<vtkActor> Picture, Outline;
};

void CopyPose(const Pose& pose, vtkMatrix4x4* matrix)
{
  const Eigen::Matrix<double, 4, 4, Eigen::RowMajor> rows = pose.matrix();
  if (!std::equal(rows.data(), rows.data() + 16, matrix->GetData())) {
    matrix->DeepCopy(rows.data());
  }
}

void MakeLine(vtkActor* actor)
{
  actor->GetProperty()->LightingOff();
  actor->GetProperty()->SetLineWidth(1.5f);
  actor->PickableOff();
}

// Voxels along a block's side in volume rendering, by level.
constexpr int Blocks[DetailLevel::Coarsest + 1] = {1, 1, 2, 3, 4, 5};

// The least of 1, 2, 5, 10, ... that is not below x: a scale that does not change with every millimetre.
double RoundUp(double x)
{
  if (!(x > 0.0)) {
    return 1.0;
  }
  const double ten = std::pow(10.0, std::floor(std::log10(x)));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (x <= factor * ten) {
      return factor * ten;
    }
  }
  return 10.0 * ten;
}
} // namespace

//----------------------------------------------------------------------------
struct vtkUltrasoundVolumeView::Internals {
  vtkSmartPointer<vtkUltrasoundAlignmentSession> Session;
  std::vector<unsigned long> SessionObservers;
  vtkNew<vtkRenderer> Renderer;

  std::string Style = "points";
  ParticleParameters Parameters;
  double ParticleSize = 1.25;
  bool ShowPlanes = true, ShowErrors = false, ShowMarker = true;

  bool Interactive = false, EverFitted = false, Updating = false;
  DetailLevel Detail;
  int Refined = -1;                          ///< the level of Refine; -1: that of the drag
  bool Deferred = false;                     ///< voxels or grey window changed and are not shown yet
  double RestSeconds = 1.0;                  ///< what a frame of Refine may take
  double Coarser = 0.0;                      ///< what the frame of the level before took to draw; 0: not known
  std::map<std::string, double> FullSeconds; ///< of the last full picture, by style
  std::vector<int> VisibleIds;               ///< of the last frame
  std::chrono::steady_clock::time_point Begin, DrawBegin;
  double LastSeconds = 0.0, DrawSeconds = 0.0;

  bool VolumesDirty = true, PosesDirty = true;
  bool Remade = false; ///< this frame began with new particles: its time says nothing about the next
  std::map<int, Shown> Volumes;
  std::map<int, Plane> Planes;

  // Particles: those of the visible volumes in turn.
  vtkNew<vtkPolyData> Cloud;
  vtkNew<vtkActor> CloudActor;
  vtkSmartPointer<ParticleMapper> CloudMapper = vtkSmartPointer<ParticleMapper>::New();
  std::vector<int> CloudIds; ///< the volumes of the sets
  std::vector<int> CloudBlocks;
  std::array<double, 3> SortedAlong{0.0, 0.0, 0.0}; ///< the direction of view; zero: not sorted

  // Error vectors.
  vtkNew<vtkPolyData> Errors;
  vtkNew<vtkGlyph3D> Arrows;
  vtkNew<vtkActor> ArrowActor;
  vtkNew<vtkScalarBarActor> Scale;
  vtkNew<vtkLookupTable> ErrorColours;

  // Orientation marker.
  vtkNew<vtkPolyData> MarkerLines;
  vtkNew<vtkActor2D> Marker;
  std::array<vtkSmartPointer<vtkTextActor>, 3> Letters;

  Internals()
  {
    this->Renderer->SetBackground(0.0, 0.0, 0.0);
    this->SetUpErrors();
    this->SetUpMarker();
    this->SetUpCloud();
  }

  void SetUpCloud()
  {
    this->CloudMapper->SetInputData(this->Cloud);
    this->CloudMapper->MapDataArrayToVertexAttribute("particleSize", "Size", vtkDataObject::FIELD_ASSOCIATION_POINTS);
    this->CloudActor->SetMapper(this->CloudMapper);
    this->CloudActor->ForceOpaqueOn();
    this->CloudActor->PickableOff();
    this->CloudActor->VisibilityOff();
    this->CloudActor->GetProperty()->LightingOff();
    vtkShaderProperty* shader = this->CloudActor->GetShaderProperty();
    shader->AddVertexShaderReplacement("//VTK::PositionVC::Dec", true, "//VTK::PositionVC::Dec\nin float particleSize;\n", false);
    shader->AddVertexShaderReplacement(
        "//VTK::PositionVC::Impl", true,
        "//VTK::PositionVC::Impl\n  gl_PointSize = max(1.0, particleSize * particlePixels / gl_Position.w);\n", false);
    shader->GetVertexCustomUniforms()->SetUniformf("particlePixels", 1.0f);
    this->Renderer->AddActor(this->CloudActor);
  }

  void SetUpErrors()
  {
    vtkNew<vtkColorTransferFunction> ramp; // from dark blue over green to yellow: brightness follows the length
    ramp->SetColorSpaceToLab();
    ramp->AddRGBPoint(0.0, 0.27, 0.30, 0.75);
    ramp->AddRGBPoint(0.5, 0.13, 0.68, 0.55);
    ramp->AddRGBPoint(1.0, 0.99, 0.90, 0.15);
    this->ErrorColours->SetNumberOfTableValues(256);
    for (int i = 0; i < 256; ++i) {
      double rgb[3];
      ramp->GetColor(i / 255.0, rgb);
      this->ErrorColours->SetTableValue(i, rgb[0], rgb[1], rgb[2], 1.0);
    }
    vtkNew<vtkArrowSource> arrow;
    arrow->SetTipResolution(8);
    arrow->SetShaftResolution(6);
    arrow->SetTipRadius(0.12);
    arrow->SetShaftRadius(0.04);
    this->Arrows->SetInputData(this->Errors);
    this->Arrows->SetSourceConnection(arrow->GetOutputPort());
    this->Arrows->SetVectorModeToUseVector();
    this->Arrows->SetScaleModeToScaleByVector();
    this->Arrows->SetColorModeToColorByScalar();
    this->Arrows->SetInputArrayToProcess(0, 0, 0, vtkDataObject::FIELD_ASSOCIATION_POINTS, "Length");
    this->Arrows->SetInputArrayToProcess(1, 0, 0, vtkDataObject::FIELD_ASSOCIATION_POINTS, "Way");
    this->Arrows->SetInputArrayToProcess(3, 0, 0, vtkDataObject::FIELD_ASSOCIATION_POINTS, "Length");
    vtkNew<vtkPolyDataMapper> mapper;
    mapper->SetInputConnection(this->Arrows->GetOutputPort());
    mapper->SetLookupTable(this->ErrorColours);
    mapper->UseLookupTableScalarRangeOn();
    this->ArrowActor->SetMapper(mapper);
    this->ArrowActor->PickableOff();
    this->ArrowActor->VisibilityOff();
    this->Scale->SetLookupTable(this->ErrorColours);
    this->Scale->SetTitle("error, mm");
    this->Scale->SetNumberOfLabels(3);
    this->Scale->SetLabelFormat("%-#.3g");
    this->Scale->SetUnconstrainedFontSize(true);
    this->Scale->GetTitleTextProperty()->SetFontSize(14);
    this->Scale->GetLabelTextProperty()->SetFontSize(13);
    for (vtkTextProperty* text : {this->Scale->GetTitleTextProperty(), this->Scale->GetLabelTextProperty()}) {
      text->SetFontFamilyToArial();
      text->ItalicOff();
      text->ShadowOff();
      text->BoldOff();
    }
    this->Scale->SetPosition(0.88, 0.08);
    this->Scale->SetWidth(0.1);
    this->Scale->SetHeight(0.4);
    this->Scale->VisibilityOff();
    this->Renderer->AddActor(this->ArrowActor);
    this->Renderer->AddActor2D(this->Scale);
  }

  void SetUpMarker()
  {
    static const unsigned char colours[3][3] = {{235, 80, 80}, {90, 210, 90}, {100, 140, 255}};
    vtkNew<vtkUnsignedCharArray> rgb;
    rgb->SetNumberOfComponents(3);
    vtkNew<vtkPoints> points;
    vtkNew<vtkCellArray> lines;
    points->InsertNextPoint(0.0, 0.0, 0.0);
    for (int axis = 0; axis < 3; ++axis) {
      const vtkIdType ends[2] = {0, points->InsertNextPoint(0.0, 0.0, 0.0)};
      lines->InsertNextCell(2, ends);
      rgb->InsertNextTypedTuple(colours[axis]);
      auto& letter = this->Letters[static_cast<std::size_t>(axis)];
      letter = vtkSmartPointer<vtkTextActor>::New();
      letter->SetInput(axis == 0 ? "L" : axis == 1 ? "P" : "S");
      letter->GetTextProperty()->SetFontSize(15);
      letter->GetTextProperty()->SetJustificationToCentered();
      letter->GetTextProperty()->SetVerticalJustificationToCentered();
      letter->GetTextProperty()->SetColor(colours[axis][0] / 255.0, colours[axis][1] / 255.0, colours[axis][2] / 255.0);
      letter->PickableOff();
      this->Renderer->AddActor2D(letter);
    }
    this->MarkerLines->SetPoints(points);
    this->MarkerLines->SetLines(lines);
    this->MarkerLines->GetCellData()->SetScalars(rgb);
    vtkNew<vtkPolyDataMapper2D> mapper;
    mapper->SetInputData(this->MarkerLines);
    this->Marker->SetMapper(mapper);
    this->Marker->GetProperty()->SetLineWidth(2.0f);
    this->Marker->PickableOff();
    this->Renderer->AddActor2D(this->Marker);
  }

  const std::vector<SessionVolume>& State() const { return this->Session->GetKernel().State().volumes; }
  const SessionVolume* Find(int id) const { return this->Session->GetKernel().State().Find(id); }

  int VisibleCount() const
  {
    return static_cast<int>(
        std::count_if(this->State().begin(), this->State().end(), [](const SessionVolume& volume) { return volume.visible; }));
  }

  int Level() const { return !this->Interactive ? 0 : this->Refined >= 0 ? this->Refined : this->Detail.Level(); }

  // What the full picture takes, s. Before one was drawn: what it takes where there is no graphics card.
  double ExpectedSeconds() const
  {
    const auto known = this->FullSeconds.find(this->Style);
    if (known != this->FullSeconds.end()) {
      return known->second;
    }
    if (this->Style == "outline") {
      return 0.0;
    }
    constexpr double PerParticle = 2e-6, PerVoxel = 2e-7;
    double blocks = 0.0, voxels = 0.0;
    for (const int id : this->VisibleIds) {
      const double count = this->Volumes.at(id).RealVoxels;
      voxels += count;
      blocks += count / std::pow(this->Parameters.downsampling, 3);
    }
    return this->Style == "points" ? PerParticle * std::min<double>(blocks, this->Parameters.budget) : PerVoxel * voxels;
  }

  void BeginDetail()
  {
    this->Refined = -1;
    this->Coarser = 0.0;
    this->Detail.Begin(this->ExpectedSeconds());
  }

  // Calls functor(PosedVolume) with the voxels of a volume in the space of its file.
  template <class Functor>
  void WithVoxels(const SessionVolume& volume, const Functor& functor)
  {
    const vtkUltrasoundVolume::Input input =
        vtkUltrasoundVolume::CheckInput(nullptr, this->Session->GetImage(volume.id), volume.name);
    vtkUltrasoundVolume::Dispatch(input.Intensity, [&](auto type) {
      auto posed = vtkUltrasoundVolume::PosedVolumeOf<decltype(type)>(input);
      posed.geometry = volume.geometry;
      functor(posed);
    });
  }

  const echorama::Particles& ParticlesOf(const SessionVolume& volume, Shown& shown, int block)
  {
    const auto found = shown.Particles.find(block);
    if (found != shown.Particles.end()) {
      return found->second;
    }
    ParticleParameters parameters = shown.Of.Parameters;
    parameters.block = block;
    echorama::Particles& particles = shown.Particles[block];
    this->WithVoxels(volume, [&](const auto& posed) { particles = echorama::MakeParticles(posed, parameters); });
    return particles;
  }

  // The block to ask for at a level: the number of particles falls to about a third with each.
  int ParticleBlock(const Shown& shown, int level)
  {
    const int asked = this->Parameters.downsampling;
    if (level == 0) {
      return asked;
    }
    // The budget makes the full picture's blocks larger; it need not be there to know by how much, about.
    const auto made = shown.Particles.find(asked);
    const double over = shown.RealVoxels / std::pow(asked, 3) / shown.Of.Parameters.budget;
    const int full =
        made != shown.Particles.end() ? made->second.block : static_cast<int>(asked * std::cbrt(std::max(1.0, over)));
    return std::max(full + level, static_cast<int>(std::lround(full * std::pow(DetailLevel::Step, level / 3.0))));
  }

  vtkImageData* BytesOf(const SessionVolume& volume, Shown& shown, int block)
  {
    vtkSmartPointer<vtkImageData>& image = shown.Bytes[block];
    if (image) {
      return image;
    }
    ParticleParameters parameters = shown.Of.Parameters;
    parameters.downsampling = 1;
    parameters.block = block;
    image = vtkSmartPointer<vtkImageData>::New();
    this->WithVoxels(volume, [&](const auto& posed) {
      const echorama::DisplayVolume display = echorama::MakeDisplayVolume(posed, parameters);
      const auto values = display.values.View();
      image->SetDimensions(values.Dimensions().data());
      const Eigen::Vector3d spacing = block * volume.geometry.spacing,
                            origin = display.first.cwiseProduct(volume.geometry.spacing);
      image->SetOrigin(origin.data());
      image->SetSpacing(spacing.data());
      image->AllocateScalars(VTK_UNSIGNED_CHAR, 1);
      std::copy(values.begin(), values.end(), static_cast<unsigned char*>(image->GetScalarPointer()));
    });
    return image;
  }

  // What a drag will begin with, while nobody waits for it.
  void Prepare()
  {
    const int level = this->Detail.LevelFor(this->ExpectedSeconds());
    for (auto& [id, shown] : this->Volumes) {
      const SessionVolume* volume = this->Session ? this->Find(id) : nullptr;
      if (volume && volume->visible && this->Style == "points") {
        this->ParticlesOf(*volume, shown, this->ParticleBlock(shown, level));
      } else if (volume && volume->visible && this->Style == "volume") {
        this->BytesOf(*volume, shown, Blocks[level]);
      }
    }
  }

  void UpdateVolumes();
  void UpdatePlaces();
  void FillCloud();
  void MoveCloud();
  void SortCloud();
  void UpdateRayCaster(const SessionVolume& volume, Shown& shown);
  void UpdateErrors();
  void UpdateMarker();
  void FitCamera();
};

//----------------------------------------------------------------------------
// Which volumes there are and how they look.
void vtkUltrasoundVolumeView::Internals::UpdateVolumes()
{
  for (auto each = this->Volumes.begin(); each != this->Volumes.end();) {
    if (this->Session && this->Find(each->first)) {
      ++each;
      continue;
    }
    this->Renderer->RemoveViewProp(each->second.Volume);
    this->Renderer->RemoveViewProp(each->second.Box);
    each = this->Volumes.erase(each);
  }
  if (!this->Session) {
    this->VisibleIds.clear();
    this->CloudActor->VisibilityOff();
    return;
  }
  // A stroke and a drag of the grey window change all particles at each step: those of a volume that is shown already wait for
  // the end of the gesture.
  const bool waits = this->Interactive && this->Refined < 0;
  this->Deferred = false;
  std::vector<int> visible;
  ParticleParameters parameters = this->Parameters;
  double window[2];
  this->Session->GetGreyWindow(window);
  parameters.black = window[0];
  parameters.white = window[1];
  parameters.budget = std::max(1, this->Parameters.budget / std::max(1, this->VisibleCount()));
  for (const SessionVolume& volume : this->State()) {
    const bool isNew = this->Volumes.count(volume.id) == 0;
    Shown& shown = this->Volumes[volume.id];
    if (isNew) {
      vtkNew<vtkPolyDataMapper> box;
      box->SetInputConnection(shown.Cube->GetOutputPort());
      shown.Box->SetMapper(box);
      shown.Box->GetProperty()->SetRepresentationToWireframe();
      MakeLine(shown.Box);
      shown.Volume->SetMapper(shown.RayCaster);
      shown.Volume->PickableOff();
      shown.RayCaster->AutoAdjustSampleDistancesOff();
      shown.RayCaster->LockSampleDistanceToInputSpacingOff();
      // Before the particles, which are to be drawn last.
      this->Renderer->RemoveViewProp(this->CloudActor);
      this->Renderer->AddViewProp(shown.Box);
      this->Renderer->AddViewProp(shown.Volume);
      this->Renderer->AddViewProp(this->CloudActor);
    }
    const bool takes = isNew || (shown.VoxelsDirty && !waits);
    if (takes) {
      Eigen::AlignedBox3i real;
      this->WithVoxels(volume, [&](const auto& posed) { real = echorama::RealBox(posed); });
      if (real.isEmpty()) {
        real.extend(Eigen::Vector3i::Zero());
      }
      const Eigen::Vector3d spacing = volume.geometry.spacing;
      const Eigen::Vector3d sides = (real.sizes() + Eigen::Vector3i::Ones()).cast<double>(), size = sides.cwiseProduct(spacing);
      const Eigen::Vector3d middle = 0.5 * (real.min() + real.max()).cast<double>().cwiseProduct(spacing);
      shown.Cube->SetXLength(size.x());
      shown.Cube->SetYLength(size.y());
      shown.Cube->SetZLength(size.z());
      shown.Cube->SetCenter(middle.x(), middle.y(), middle.z());
      shown.RealVoxels = sides.prod();
    }
    Look wanted{parameters};
    if (waits && !isNew) {
      wanted.Parameters.black = shown.Of.Parameters.black;
      wanted.Parameters.white = shown.Of.Parameters.white;
      this->Deferred = this->Deferred || shown.VoxelsDirty || !(wanted == Look{parameters});
    }
    const bool looksOther = !(shown.Of == wanted);
    if (takes || looksOther) {
      shown.Of = wanted;
      shown.Particles.clear();
      shown.Bytes.clear();
    }
    if (takes) {
      shown.VoxelsDirty = false;
    } else if (looksOther) {
      this->FullSeconds.clear();
    }
    if (volume.visible) {
      visible.push_back(volume.id);
    }
    shown.Box->SetVisibility(volume.visible && (this->Style == "outline" || this->Session->IsSelected(volume.id)));
    shown.Box->GetProperty()->SetColor(volume.colour[0], volume.colour[1], volume.colour[2]);
    shown.Volume->SetVisibility(volume.visible && this->Style == "volume");
  }
  if (visible != this->VisibleIds) {
    this->VisibleIds = visible;
    this->FullSeconds.clear();
    if (this->Interactive) {
      this->BeginDetail();
    }
  }
  if (this->Style == "volume") {
    for (const int id : visible) {
      this->UpdateRayCaster(*this->Find(id), this->Volumes.at(id));
    }
  }
  this->CloudActor->SetVisibility(this->Style == "points");
  if (this->CloudActor->GetVisibility()) {
    this->FillCloud();
  }
}

//----------------------------------------------------------------------------
void vtkUltrasoundVolumeView::Internals::UpdateRayCaster(const SessionVolume& volume, Shown& shown)
{
  static const float rays[DetailLevel::Coarsest + 1] = {1.0f, 1.7f, 2.0f, 3.0f, 4.0f, 6.0f};
  const int level = this->Level(), block = Blocks[level];
  vtkImageData* bytes = this->BytesOf(volume, shown, block);
  if (shown.RayCaster->GetInput() != bytes) {
    shown.RayCaster->SetInputData(bytes);
  }
  const double voxel = volume.geometry.spacing.minCoeff();
  shown.RayCaster->SetSampleDistance(static_cast<float>(block * voxel));
  shown.RayCaster->SetInteractiveSampleDistance(static_cast<float>(block * voxel));
  shown.RayCaster->SetImageSampleDistance(rays[level]);

  vtkVolumeProperty* property = shown.Volume->GetProperty();
  property->SetInterpolationTypeToLinear();
  property->ShadeOff();
  property->SetScalarOpacityUnitDistance(this->Parameters.downsampling * std::cbrt(volume.geometry.spacing.prod()));
  vtkNew<vtkPiecewiseFunction> opacity;
  const double full = this->Parameters.opacity * volume.opacity;
  opacity->AddPoint(0.0, 0.0);
  opacity->AddPoint(1.0, this->Parameters.valueOpacity ? full / 255.0 : full);
  opacity->AddPoint(255.0, full);
  property->SetScalarOpacity(opacity);
  vtkNew<vtkColorTransferFunction> colour;
  colour->AddRGBPoint(0.0, 0.0, 0.0, 0.0);
  colour->AddRGBPoint(255.0, volume.colour[0], volume.colour[1], volume.colour[2]);
  property->SetColor(colour);
}

//----------------------------------------------------------------------------
// The particles of all visible volumes, without their places.
void vtkUltrasoundVolumeView::Internals::FillCloud()
{
  this->CloudIds.clear();
  this->CloudBlocks.clear();
  vtkIdType count = 0;
  for (const SessionVolume& volume : this->State()) {
    if (volume.visible) {
      Shown& shown = this->Volumes.at(volume.id);
      const int block = this->ParticleBlock(shown, this->Level());
      count += static_cast<vtkIdType>(this->ParticlesOf(volume, shown, block).Count());
      this->CloudIds.push_back(volume.id);
      this->CloudBlocks.push_back(block);
    }
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
  for (std::size_t s = 0; s < this->CloudIds.size(); ++s) {
    const SessionVolume& volume = *this->Find(this->CloudIds[s]);
    const echorama::Particles& particles = this->ParticlesOf(volume, this->Volumes.at(volume.id), this->CloudBlocks[s]);
    unsigned char tints[3][256];
    for (int value = 0; value < 256; ++value) {
      for (std::size_t c = 0; c < 3; ++c) {
        tints[c][value] = static_cast<unsigned char>(std::lround(volume.colour[c] * value));
      }
    }
    for (std::size_t p = 0; p < particles.Count(); ++p) {
      for (std::size_t c = 0; c < 3; ++c) {
        *rgba++ = tints[c][particles.values[p]];
      }
      *rgba++ = static_cast<unsigned char>(std::lround(volume.opacity * particles.alphas[p]));
    }
    size = std::fill_n(size, particles.Count(), static_cast<float>(this->ParticleSize * particles.sizeMm));
  }
  vtkNew<vtkPoints> points;
  points->SetDataTypeToFloat();
  points->SetNumberOfPoints(count);
  this->Cloud->SetPoints(points);
  this->Cloud->GetPointData()->SetScalars(colours);
  this->Cloud->GetPointData()->AddArray(sizes);
  this->PosesDirty = true;
}

//----------------------------------------------------------------------------
// To where the volumes are.
void vtkUltrasoundVolumeView::Internals::MoveCloud()
{
  vtkPoints* points = this->Cloud->GetPoints();
  float* out = points->GetNumberOfPoints() > 0 ? static_cast<float*>(points->GetVoidPointer(0)) : nullptr;
  for (std::size_t s = 0; s < this->CloudIds.size(); ++s) {
    const SessionVolume& volume = *this->Find(this->CloudIds[s]);
    const std::vector<float>& positions = this->ParticlesOf(volume, this->Volumes.at(volume.id), this->CloudBlocks[s]).positions;
    const Eigen::Matrix3f R = volume.volumeToWorld.linear().cast<float>();
    const Eigen::Vector3f t = volume.volumeToWorld.translation().cast<float>();
    echorama::ParallelRanges(static_cast<std::ptrdiff_t>(positions.size() / 3), 1 << 15, echorama::Progress(),
                             [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
                               for (std::ptrdiff_t p = 3 * begin; p < 3 * end; p += 3) {
                                 Eigen::Map<Eigen::Vector3f>{out + p} =
                                     R * Eigen::Map<const Eigen::Vector3f>(positions.data() + p) + t;
                               }
                             });
    out += positions.size();
  }
  points->Modified();
  this->Cloud->Modified();
  this->SortedAlong = {0.0, 0.0, 0.0};
}

//----------------------------------------------------------------------------
// Seen from the camera, from back to front.
void vtkUltrasoundVolumeView::Internals::SortCloud()
{
  std::array<double, 3> normal;
  this->Renderer->GetActiveCamera()->GetViewPlaneNormal(normal.data());
  if (normal == this->SortedAlong) {
    return;
  }
  this->SortedAlong = normal;
  const Eigen::Vector3d towards(normal[0], normal[1], normal[2]);
  std::vector<echorama::ParticleDepths> sets;
  for (std::size_t s = 0; s < this->CloudIds.size(); ++s) {
    const SessionVolume& volume = *this->Find(this->CloudIds[s]);
    const echorama::Particles& particles = this->ParticlesOf(volume, this->Volumes.at(volume.id), this->CloudBlocks[s]);
    sets.push_back({&particles.positions, volume.volumeToWorld.linear().transpose() * towards,
                    towards.dot(volume.volumeToWorld.translation())});
  }
  const std::vector<std::uint32_t> order = echorama::BackToFront(sets);
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

//----------------------------------------------------------------------------
void vtkUltrasoundVolumeView::Internals::UpdatePlaces()
{
  for (auto& [id, shown] : this->Volumes) {
    const SessionVolume& volume = *this->Find(id);
    Pose grid = Pose::Identity(); // from the grid along its own axes to the file's space
    grid.linear() = volume.geometry.direction;
    grid.translation() = volume.geometry.origin;
    vtkNew<vtkMatrix4x4> matrix;
    CopyPose(volume.volumeToWorld * grid, matrix);
    shown.Volume->SetUserMatrix(matrix);
    shown.Box->SetUserMatrix(matrix);
  }
  if (this->CloudActor->GetVisibility()) {
    this->MoveCloud();
  }
  this->UpdateErrors();
}

//----------------------------------------------------------------------------
void vtkUltrasoundVolumeView::Internals::UpdateErrors()
{
  vtkNew<vtkPoints> points;
  vtkNew<vtkFloatArray> ways, lengths;
  ways->SetName("Way");
  ways->SetNumberOfComponents(3);
  lengths->SetName("Length");
  double longest = 0.0;
  if (this->ShowErrors && this->Session && this->Session->HasTruth()) {
    vtkNew<vtkPolyData> vectors;
    this->Session->GetErrorVectors(vectors);
    vtkDataArray* errors = vectors->GetPointData()->GetArray("Error");
    vtkDataArray* ids = vectors->GetPointData()->GetArray("Volume");
    for (vtkIdType p = 0; p < vectors->GetNumberOfPoints(); ++p) {
      const SessionVolume* volume = this->Find(static_cast<int>(ids->GetComponent(p, 0)));
      if (volume && volume->visible) {
        double error[3];
        errors->GetTuple(p, error);
        const double length = vtkMath::Norm(error);
        points->InsertNextPoint(vectors->GetPoint(p));
        ways->InsertNextTuple3(-error[0], -error[1], -error[2]);
        lengths->InsertNextValue(static_cast<float>(length));
        longest = std::max(longest, length);
      }
    }
  }
  this->Errors->Initialize();
  this->Errors->SetPoints(points);
  this->Errors->GetPointData()->AddArray(ways);
  this->Errors->GetPointData()->AddArray(lengths);
  this->ErrorColours->SetTableRange(0.0, RoundUp(longest));
  this->ArrowActor->SetVisibility(points->GetNumberOfPoints() > 0);
  this->Scale->SetVisibility(points->GetNumberOfPoints() > 0);
}

//----------------------------------------------------------------------------
void vtkUltrasoundVolumeView::Internals::UpdateMarker()
{
  constexpr double Middle = 48.0, Length = 30.0; // pixels
  vtkMatrix4x4* view = this->Renderer->GetActiveCamera()->GetViewTransformMatrix();
  vtkPoints* points = this->MarkerLines->GetPoints();
  points->SetPoint(0, Middle, Middle, 0.0);
  for (int axis = 0; axis < 3; ++axis) {
    const double x = view->GetElement(0, axis), y = view->GetElement(1, axis);
    points->SetPoint(axis + 1, Middle + Length * x, Middle + Length * y, 0.0);
    this->Letters[static_cast<std::size_t>(axis)]->SetPosition(Middle + 1.35 * Length * x, Middle + 1.35 * Length * y);
    // An axis along the view has no letter: it would lie on the others.
    this->Letters[static_cast<std::size_t>(axis)]->SetVisibility(this->ShowMarker && std::hypot(x, y) > 0.25);
  }
  points->Modified();
  this->MarkerLines->Modified();
  this->Marker->SetVisibility(this->ShowMarker);
}

//----------------------------------------------------------------------------
void vtkUltrasoundVolumeView::Internals::FitCamera()
{
  vtkBoundingBox box;
  for (const SessionVolume& volume : this->State()) {
    if (volume.visible) {
      double bounds[6];
      this->Volumes.at(volume.id).Box->GetBounds(bounds);
      box.AddBounds(bounds);
    }
  }
  if (!box.IsValid()) {
    return;
  }
  if (!this->EverFitted) {
    // Towards posterior, a little from the left and above.
    vtkCamera* camera = this->Renderer->GetActiveCamera();
    camera->SetFocalPoint(0.0, 0.0, 0.0);
    camera->SetPosition(0.6, -1.0, 0.45);
    camera->SetViewUp(0.0, 0.0, 1.0);
    this->EverFitted = true;
  }
  double bounds[6];
  box.GetBounds(bounds);
  this->Renderer->ResetCamera(bounds);
}

vtkStandardNewMacro(vtkUltrasoundVolumeView);

//----------------------------------------------------------------------------
vtkUltrasoundVolumeView::vtkUltrasoundVolumeView() : Parts(std::make_unique<Internals>())
{
  this->Parts->Renderer->AddObserver(vtkCommand::StartEvent, this, &vtkUltrasoundVolumeView::OnStart);
  this->Parts->Renderer->AddObserver(vtkCommand::EndEvent, this, &vtkUltrasoundVolumeView::OnEnd);
}

//----------------------------------------------------------------------------
vtkUltrasoundVolumeView::~vtkUltrasoundVolumeView()
{
  this->SetSession(nullptr);
}

//----------------------------------------------------------------------------
void vtkUltrasoundVolumeView::SetSession(vtkUltrasoundAlignmentSession* session)
{
  Internals& parts = *this->Parts;
  if (parts.Session == session) {
    return;
  }
  for (const unsigned long observer : parts.SessionObservers) {
    parts.Session->RemoveObserver(observer);
  }
  parts.SessionObservers.clear();
  parts.Session = nullptr;
  parts.UpdateVolumes(); // what was shown goes
  parts.Session = session;
  if (session) {
    for (const auto event :
         {vtkUltrasoundAlignmentSession::VolumesChangedEvent, vtkUltrasoundAlignmentSession::PosesChangedEvent,
          vtkUltrasoundAlignmentSession::SelectionChangedEvent, vtkUltrasoundAlignmentSession::VoxelsChangedEvent}) {
      parts.SessionObservers.push_back(session->AddObserver(event, this, &vtkUltrasoundVolumeView::OnSession));
    }
  }
  parts.VolumesDirty = parts.PosesDirty = true;
  this->Modified();
}

//----------------------------------------------------------------------------
vtkUltrasoundAlignmentSession* vtkUltrasoundVolumeView::GetSession() const
{
  return this->Parts->Session;
}

//----------------------------------------------------------------------------
vtkRenderer* vtkUltrasoundVolumeView::GetRenderer() const
{
  return this->Parts->Renderer;
}

//----------------------------------------------------------------------------
void vtkUltrasoundVolumeView::OnSession(vtkObject*, unsigned long event, void* data)
{
  Internals& parts = *this->Parts;
  if (event == vtkUltrasoundAlignmentSession::PosesChangedEvent) {
    parts.PosesDirty = true;
  } else {
    parts.VolumesDirty = true;
  }
  if (event == vtkUltrasoundAlignmentSession::VoxelsChangedEvent) {
    for (auto& [id, shown] : parts.Volumes) {
      if (!data || *static_cast<int*>(data) == id) {
        shown.VoxelsDirty = true;
      }
    }
  }
  this->Modified();
}

//----------------------------------------------------------------------------
void vtkUltrasoundVolumeView::Update()
{
  Internals& parts = *this->Parts;
  if (parts.Updating) {
    return;
  }
  parts.Updating = true;
  try {
    if (parts.VolumesDirty) {
      parts.UpdateVolumes();
      parts.VolumesDirty = false;
      parts.Remade = true;
      parts.PosesDirty = true;
    }
    if (parts.PosesDirty && parts.Session) {
      parts.UpdatePlaces();
    } else if (parts.PosesDirty) {
      parts.UpdateErrors();
    }
    parts.PosesDirty = false;
    if (!parts.EverFitted && parts.Session && parts.VisibleCount() > 0) {
      parts.FitCamera();
    }
  } catch (const std::exception& error) {
    parts.VolumesDirty = parts.PosesDirty = false; // said once
    parts.CloudActor->VisibilityOff();
    vtkErrorMacro(<< error.what());
  }
  parts.Updating = false;
}

//----------------------------------------------------------------------------
void vtkUltrasoundVolumeView::OnStart()
{
  Internals& parts = *this->Parts;
  parts.Begin = std::chrono::steady_clock::now();
  this->Update();
  parts.Renderer->ResetCameraClippingRange(); // planes and arrows come and go
  vtkCamera* camera = parts.Renderer->GetActiveCamera();
  if (parts.CloudActor->GetVisibility()) {
    parts.SortCloud();
    const double height = parts.Renderer->GetSize()[1];
    const double pixels = camera->GetParallelProjection()
                              ? height / (2.0 * camera->GetParallelScale())
                              : height / (2.0 * std::tan(vtkMath::RadiansFromDegrees(camera->GetViewAngle()) / 2.0));
    parts.CloudActor->GetShaderProperty()->GetVertexCustomUniforms()->SetUniformf("particlePixels", static_cast<float>(pixels));
  }
  parts.UpdateMarker();
  parts.DrawBegin = std::chrono::steady_clock::now();
}

//----------------------------------------------------------------------------
void vtkUltrasoundVolumeView::OnEnd()
{
  Internals& parts = *this->Parts;
  parts.Renderer->GetRenderWindow()->WaitForCompletion();
  const auto now = std::chrono::steady_clock::now();
  parts.LastSeconds = std::chrono::duration<double>(now - parts.Begin).count();
  parts.DrawSeconds = std::chrono::duration<double>(now - parts.DrawBegin).count();
  const bool representative = !parts.Remade;
  parts.Remade = false;
  if (parts.Interactive && parts.Refined != 0) {
    if (parts.Refined < 0 && representative && parts.Detail.Measure(parts.LastSeconds)) {
      parts.VolumesDirty = true;
    }
    return;
  }
  if (representative || parts.FullSeconds.count(parts.Style) == 0) {
    parts.FullSeconds[parts.Style] = parts.LastSeconds;
  }
  if (parts.Interactive) {
    return; // coarser levels are there already
  }
  try {
    parts.Prepare();
  } catch (const std::exception& error) {
    vtkErrorMacro(<< error.what());
  }
}

//----------------------------------------------------------------------------
void vtkUltrasoundVolumeView::SetInteractive(bool on)
{
  Internals& parts = *this->Parts;
  if (parts.Interactive == on && parts.Refined < 0) {
    return;
  }
  const int before = parts.Level();
  parts.Interactive = on;
  parts.Refined = -1;
  if (on) {
    parts.BeginDetail();
  }
  if (parts.Level() != before || (!on && parts.Deferred)) {
    parts.VolumesDirty = true;
  }
  this->Modified();
}

//----------------------------------------------------------------------------
bool vtkUltrasoundVolumeView::Refine()
{
  Internals& parts = *this->Parts;
  if (!parts.Interactive) {
    return false;
  }
  this->Update();
  const int level = parts.Level();
  if (parts.Deferred) {
    parts.Refined = level;
  } else if (level == 0) {
    this->SetInteractive(false); // the same picture
    return false;
  } else {
    // As much more as the last step took; of the first step what is known of levels.
    const double known = level == 1 && parts.FullSeconds.count(parts.Style) > 0 ? parts.FullSeconds[parts.Style] : 0.0;
    const double growth =
        parts.Coarser > 0.0 ? std::clamp(parts.DrawSeconds / parts.Coarser, 1.2, DetailLevel::Step) : DetailLevel::Step;
    if ((known > 0.0 ? known : growth * parts.DrawSeconds) > parts.RestSeconds) {
      return false;
    }
    parts.Coarser = parts.DrawSeconds;
    parts.Refined = level - 1;
  }
  parts.VolumesDirty = true;
  this->Modified();
  return true;
}

//----------------------------------------------------------------------------
void vtkUltrasoundVolumeView::SetRestBudget(double milliseconds)
{
  if (milliseconds >= 5.0 && milliseconds <= 1e6) {
    this->Parts->RestSeconds = milliseconds / 1000.0;
    this->Modified();
  } else {
    vtkErrorMacro("the time of a frame at rest must be in [5, 1000000] ms; it is " << milliseconds);
  }
}

//----------------------------------------------------------------------------
double vtkUltrasoundVolumeView::GetRestBudget() const
{
  return this->Parts->RestSeconds * 1000.0;
}

//----------------------------------------------------------------------------
bool vtkUltrasoundVolumeView::GetInteractive() const
{
  return this->Parts->Interactive;
}

//----------------------------------------------------------------------------
void vtkUltrasoundVolumeView::SetFrameBudget(double milliseconds)
{
  if (milliseconds >= 5.0 && milliseconds <= 10000.0) {
    this->Parts->Detail = DetailLevel(milliseconds / 1000.0);
    this->Modified();
  } else {
    vtkErrorMacro("the time of a frame must be in [5, 10000] ms; it is " << milliseconds);
  }
}

//----------------------------------------------------------------------------
double vtkUltrasoundVolumeView::GetFrameBudget() const
{
  return this->Parts->Detail.Budget() * 1000.0;
}

//----------------------------------------------------------------------------
double vtkUltrasoundVolumeView::GetLastFrameSeconds() const
{
  return this->Parts->LastSeconds;
}

//----------------------------------------------------------------------------
int vtkUltrasoundVolumeView::GetDetailLevel() const
{
  return this->Parts->Level();
}

//----------------------------------------------------------------------------
int vtkUltrasoundVolumeView::GetNumberOfParticles() const
{
  return this->Parts->CloudActor->GetVisibility() ? static_cast<int>(this->Parts->Cloud->GetNumberOfPoints()) : 0;
}

//----------------------------------------------------------------------------
void vtkUltrasoundVolumeView::Fit()
{
  this->Update();
  if (this->Parts->Session) {
    this->Parts->FitCamera();
  }
  this->Modified();
}

//----------------------------------------------------------------------------
bool vtkUltrasoundVolumeView::SetStyle(const char* style)
{
  const std::string name = style ? style : "";
  if (name != "points" && name != "volume" && name != "outline") {
    vtkErrorMacro("the style is \"" << name << "\"; it must be \"points\", \"volume\" or \"outline\"");
    return false;
  }
  if (name != this->Parts->Style) {
    this->Parts->Style = name;
    if (this->Parts->Interactive) {
      this->Parts->BeginDetail();
    }
    this->Parts->VolumesDirty = true;
    this->Modified();
  }
  return true;
}

//----------------------------------------------------------------------------
std::string vtkUltrasoundVolumeView::GetStyle() const
{
  return this->Parts->Style;
}

// Parameters are clamped to their ranges; what is not a number is left out.
#define EchoramaParameter(Name, Type, Member, Lowest, Highest)                                                                   \
  void vtkUltrasoundVolumeView::Set##Name(Type value)                                                                            \
  {                                                                                                                              \
    if (std::isnan(static_cast<double>(value))) {                                                                                \
      vtkErrorMacro(#Name " must be a number");                                                                                  \
      return;                                                                                                                    \
    }                                                                                                                            \
    const Type clamped = std::clamp<Type>(value, Lowest, Highest);                                                               \
    if (this->Parts->Member != clamped) {                                                                                        \
      this->Parts->Member = clamped;                                                                                             \
      this->Parts->VolumesDirty = true;                                                                                          \
      this->Modified();                                                                                                          \
    }                                                                                                                            \
  }                                                                                                                              \
  Type vtkUltrasoundVolumeView::Get##Name() const                                                                                \
  {                                                                                                                              \
    return this->Parts->Member;                                                                                                  \
  }
EchoramaParameter(Downsampling, int, Parameters.downsampling, 1, 64);
EchoramaParameter(Budget, int, Parameters.budget, 1000, 1000000000);
EchoramaParameter(ParticleSize, double, ParticleSize, 0.1, 10.0);
EchoramaParameter(Opacity, double, Parameters.opacity, 0.0, 1.0);
EchoramaParameter(ValueOpacity, bool, Parameters.valueOpacity, false, true);
EchoramaParameter(Minimum, double, Parameters.minimum, -1e300, 1e300);
EchoramaParameter(Maximum, double, Parameters.maximum, -1e300, 1e300);
EchoramaParameter(ErrorVectors, bool, ShowErrors, false, true);
EchoramaParameter(OrientationMarker, bool, ShowMarker, false, true);
#undef EchoramaParameter

//----------------------------------------------------------------------------
bool vtkUltrasoundVolumeView::SetPlane(int plane, const double corners[12], vtkImageData* picture)
{
  Internals& parts = *this->Parts;
  if (!std::all_of(corners, corners + 12, [](double x) { return std::isfinite(x); })) {
    vtkErrorMacro("the corners of plane " << plane << " are not finite");
    return false;
  }
  if (picture && picture->GetNumberOfPoints() > 0 &&
      (!picture->GetPointData()->GetScalars() || picture->GetScalarType() != VTK_UNSIGNED_CHAR ||
       picture->GetNumberOfScalarComponents() < 3)) {
    vtkErrorMacro("the picture of plane " << plane << " must be of RGB or RGBA bytes");
    return false;
  }
  const bool isNew = parts.Planes.count(plane) == 0;
  Plane& shown = parts.Planes[plane];
  if (isNew) {
    vtkNew<vtkFloatArray> places;
    places->SetName("Place");
    places->SetNumberOfComponents(2);
    for (const auto& [u, v] : {std::pair{0.0, 0.0}, {1.0, 0.0}, {1.0, 1.0}, {0.0, 1.0}}) {
      places->InsertNextTuple2(u, v);
    }
    vtkNew<vtkCellArray> quad, frame;
    const vtkIdType ids[5] = {0, 1, 2, 3, 0};
    quad->InsertNextCell(4, ids);
    frame->InsertNextCell(5, ids);
    shown.Quad->SetPolys(quad);
    shown.Quad->GetPointData()->SetTCoords(places);
    shown.Frame->SetLines(frame);
    vtkNew<vtkPolyDataMapper> quads, frames;
    quads->SetInputData(shown.Quad);
    frames->SetInputData(shown.Frame);
    shown.Texture->InterpolateOn();
    shown.Texture->EdgeClampOn();
    shown.Texture->SetColorModeToDirectScalars();
    shown.Picture->SetMapper(quads);
    shown.Picture->SetTexture(shown.Texture);
    shown.Picture->ForceOpaqueOn();
    shown.Picture->PickableOff();
    shown.Picture->GetProperty()->LightingOff();
    // Where the picture shows nothing it hides nothing.
    shown.Picture->GetShaderProperty()->AddFragmentShaderReplacement(
        "//VTK::Picking::Impl", true, "//VTK::Picking::Impl\n  if (gl_FragData[0].a < 0.5) discard;\n", false);
    shown.Outline->SetMapper(frames);
    MakeLine(shown.Outline);
    shown.Outline->GetProperty()->SetColor(0.9, 0.8, 0.3);
    parts.Renderer->RemoveViewProp(parts.CloudActor);
    parts.Renderer->AddViewProp(shown.Picture);
    parts.Renderer->AddViewProp(shown.Outline);
    parts.Renderer->AddViewProp(parts.CloudActor);
  }
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  for (int corner = 0; corner < 4; ++corner) {
    points->InsertNextPoint(corners + 3 * corner);
  }
  shown.Quad->SetPoints(points);
  shown.Frame->SetPoints(points);
  const bool pictured = picture && picture->GetNumberOfPoints() > 0;
  if (pictured) {
    shown.Texture->SetInputData(picture);
  }
  shown.Picture->SetVisibility(pictured && parts.ShowPlanes);
  shown.Outline->SetVisibility(parts.ShowPlanes);
  this->Modified();
  return true;
}

//----------------------------------------------------------------------------
void vtkUltrasoundVolumeView::SetPlaneColour(int plane, double r, double g, double b)
{
  const auto found = this->Parts->Planes.find(plane);
  if (found == this->Parts->Planes.end()) {
    vtkErrorMacro("there is no plane " << plane);
    return;
  }
  found->second.Outline->GetProperty()->SetColor(r, g, b);
  this->Modified();
}

//----------------------------------------------------------------------------
void vtkUltrasoundVolumeView::RemovePlane(int plane)
{
  const auto found = this->Parts->Planes.find(plane);
  if (found != this->Parts->Planes.end()) {
    this->Parts->Renderer->RemoveViewProp(found->second.Picture);
    this->Parts->Renderer->RemoveViewProp(found->second.Outline);
    this->Parts->Planes.erase(found);
    this->Modified();
  }
}

//----------------------------------------------------------------------------
int vtkUltrasoundVolumeView::GetNumberOfPlanes() const
{
  return static_cast<int>(this->Parts->Planes.size());
}

//----------------------------------------------------------------------------
void vtkUltrasoundVolumeView::SetShowPlanes(bool on)
{
  this->Parts->ShowPlanes = on;
  for (auto& [number, plane] : this->Parts->Planes) {
    plane.Picture->SetVisibility(on && plane.Texture->GetInput() != nullptr);
    plane.Outline->SetVisibility(on);
  }
  this->Modified();
}

//----------------------------------------------------------------------------
bool vtkUltrasoundVolumeView::GetShowPlanes() const
{
  return this->Parts->ShowPlanes;
}

//----------------------------------------------------------------------------
void vtkUltrasoundVolumeView::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  const Internals& parts = *this->Parts;
  os << indent << "Session: " << parts.Session.Get() << "\n";
  os << indent << "Style: " << parts.Style << "\n";
  os << indent << "Downsampling: " << parts.Parameters.downsampling << "\n";
  os << indent << "Budget: " << parts.Parameters.budget << "\n";
  os << indent << "ParticleSize: " << parts.ParticleSize << "\n";
  os << indent << "Opacity: " << parts.Parameters.opacity << "\n";
  os << indent << "ValueOpacity: " << parts.Parameters.valueOpacity << "\n";
  os << indent << "Minimum: " << parts.Parameters.minimum << "\n";
  os << indent << "Maximum: " << parts.Parameters.maximum << "\n";
  os << indent << "Interactive: " << parts.Interactive << "\n";
  os << indent << "FrameBudget: " << this->GetFrameBudget() << "\n";
  os << indent << "RestBudget: " << this->GetRestBudget() << "\n";
  os << indent << "DetailLevel: " << parts.Level() << "\n";
  os << indent << "Planes: " << parts.Planes.size() << "\n";
}
