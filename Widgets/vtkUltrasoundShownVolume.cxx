// SPDX-License-Identifier: BSD-3-Clause
#include "vtkUltrasoundShownVolume.h"

#include "Core/Geometry/MatrixRows.h"
#include "vtkColorTransferFunction.h"
#include "vtkCubeSource.h"
#include "vtkFixedPointVolumeRayCastMapper.h"
#include "vtkGPUVolumeRayCastMapper.h"
#include "vtkImageData.h"
#include "vtkMatrix4x4.h"
#include "vtkPiecewiseFunction.h"
#include "vtkUltrasoundViewProps.h"
#include "vtkUltrasoundVolume.h"
#include "vtkVolumeProperty.h"
#include "Widgets/Pictures/DetailLevel.h"

#include <algorithm>
#include <cmath>
#include <tuple>

namespace echorama {

namespace {
// Of volume rendering, by level: voxels along a block's side, pixels from ray to ray.
constexpr int Blocks[DetailLevel::Coarsest + 1] = {1, 1, 2, 3, 4, 5};
constexpr float Rays[DetailLevel::Coarsest + 1] = {1.0f, 1.7f, 2.0f, 3.0f, 4.0f, 6.0f};

auto All(const ParticleParameters& p)
{
  return std::tie(p.downsampling, p.opacity, p.valueOpacity, p.minimum, p.maximum, p.black, p.white, p.budget);
}

// Calls functor(PosedVolume) with the voxels of a volume in the space of its file.
template <class Functor>
void WithVoxels(const SessionVolume& volume, vtkImageData* image, const Functor& functor)
{
  const vtkUltrasoundVolume::Input input = vtkUltrasoundVolume::CheckInput(nullptr, image, volume.name);
  vtkUltrasoundVolume::Dispatch(input.Intensity, [&](auto type) {
    auto posed = vtkUltrasoundVolume::PosedVolumeOf<decltype(type)>(input);
    posed.geometry = volume.geometry;
    functor(posed);
  });
}
} // namespace

ShownVolume::ShownVolume()
{
  vtkNew<vtkPolyDataMapper> box;
  box->SetInputConnection(this->Cube->GetOutputPort());
  this->Box->SetMapper(box);
  this->Box->GetProperty()->SetRepresentationToWireframe();
  SetUpLine(this->Box);
  this->Volume->SetMapper(this->RayCaster);
  this->Volume->PickableOff();
  this->RayCaster->AutoAdjustSampleDistancesOff();
  this->RayCaster->LockSampleDistanceToInputSpacingOff();
}

ShownVolume::~ShownVolume() = default;

bool ShownVolume::SetLook(const ParticleParameters& look)
{
  const bool isOther = All(look) != All(this->Parameters);
  if (isOther) {
    this->Parameters = look;
    this->Clouds.clear();
    this->Bytes.clear();
  }
  return isOther;
}

void ShownVolume::TakeVoxels(const SessionVolume& volume, vtkImageData* image)
{
  Eigen::AlignedBox3i real;
  WithVoxels(volume, image, [&](const auto& posed) { real = RealBox(posed); });
  if (real.isEmpty()) {
    real.extend(Eigen::Vector3i::Zero());
  }
  const Eigen::Vector3d spacing = volume.geometry.spacing;
  const Eigen::Vector3d sides = (real.sizes() + Eigen::Vector3i::Ones()).cast<double>(), size = sides.cwiseProduct(spacing);
  const Eigen::Vector3d middle = 0.5 * (real.min() + real.max()).cast<double>().cwiseProduct(spacing);
  this->Cube->SetXLength(size.x());
  this->Cube->SetYLength(size.y());
  this->Cube->SetZLength(size.z());
  this->Cube->SetCenter(middle.x(), middle.y(), middle.z());
  this->InBox = sides.prod();
  this->Clouds.clear();
  this->Bytes.clear();
  this->VoxelsDirty = false;
}

const Particles& ShownVolume::ParticlesAt(int level, const SessionVolume& volume, vtkImageData* image)
{
  // The number of particles falls to about a third with each level. The budget makes the full picture's blocks larger; it need
  // not be there to know by how much, about.
  const int asked = this->Parameters.downsampling;
  int block = asked;
  if (level > 0) {
    const auto made = this->Clouds.find(asked);
    const double over = this->InBox / std::pow(asked, 3) / this->Parameters.budget;
    const int full = made != this->Clouds.end() ? made->second.block : static_cast<int>(asked * std::cbrt(std::max(1.0, over)));
    block = std::max(full + level, static_cast<int>(std::lround(full * std::pow(DetailLevel::Step, level / 3.0))));
  }
  const auto [found, isNew] = this->Clouds.try_emplace(block);
  if (isNew) {
    ParticleParameters parameters = this->Parameters;
    parameters.block = block;
    WithVoxels(volume, image,
               [&, &particles = found->second](const auto& posed) { particles = MakeParticles(posed, parameters); });
  }
  return found->second;
}

vtkImageData* ShownVolume::BytesAt(int level, const SessionVolume& volume, vtkImageData* image)
{
  const int block = Blocks[level];
  vtkSmartPointer<vtkImageData>& bytes = this->Bytes[block];
  if (bytes) {
    return bytes;
  }
  ParticleParameters parameters = this->Parameters;
  parameters.downsampling = 1;
  parameters.block = block;
  bytes = vtkSmartPointer<vtkImageData>::New();
  WithVoxels(volume, image, [&](const auto& posed) {
    const DisplayVolume display = MakeDisplayVolume(posed, parameters);
    const auto values = display.values.View();
    const Eigen::Vector3d spacing = block * volume.geometry.spacing, origin = display.first.cwiseProduct(volume.geometry.spacing);
    bytes->SetDimensions(values.Dimensions().data());
    bytes->SetOrigin(origin.data());
    bytes->SetSpacing(spacing.data());
    bytes->AllocateScalars(VTK_UNSIGNED_CHAR, 1);
    std::copy(values.begin(), values.end(), static_cast<unsigned char*>(bytes->GetScalarPointer()));
  });
  return bytes;
}

void ShownVolume::CastRays(int level, const SessionVolume& volume, vtkImageData* image, bool onProcessor)
{
  vtkImageData* bytes = this->BytesAt(level, volume, image);
  const auto distance = static_cast<float>(Blocks[level] * volume.geometry.spacing.minCoeff());
  if (onProcessor) {
    this->RayCaster->SetSampleDistance(distance);
    this->RayCaster->SetInteractiveSampleDistance(distance);
    this->RayCaster->SetImageSampleDistance(Rays[level]);
    this->Volume->SetMapper(this->RayCaster);
  } else {
    if (!this->Graphics) {
      this->Graphics = vtkSmartPointer<vtkGPUVolumeRayCastMapper>::New();
      this->Graphics->AutoAdjustSampleDistancesOff();
      this->Graphics->LockSampleDistanceToInputSpacingOff();
    }
    this->Graphics->SetSampleDistance(distance);
    this->Graphics->SetImageSampleDistance(Rays[level]);
    this->Volume->SetMapper(this->Graphics);
  }
  if (this->Volume->GetMapper()->GetDataSetInput() != bytes) {
    vtkVolumeMapper::SafeDownCast(this->Volume->GetMapper())->SetInputData(bytes);
  }

  vtkVolumeProperty* property = this->Volume->GetProperty();
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

void ShownVolume::Place(const SessionVolume& volume)
{
  Pose grid = Pose::Identity(); // from the grid along its own axes to the file's space
  grid.linear() = volume.geometry.direction;
  grid.translation() = volume.geometry.origin;
  vtkNew<vtkMatrix4x4> matrix;
  Eigen::Map<MatrixRows>(matrix->GetData()) = (volume.volumeToWorld * grid).matrix();
  this->Volume->SetUserMatrix(matrix);
  this->Box->SetUserMatrix(matrix);
}

} // namespace echorama
