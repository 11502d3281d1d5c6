// SPDX-License-Identifier: BSD-3-Clause
// VTK's own slice mappers either ignore the direction of a volume or cut along its index axes alone, and none knows a valid
// region. So pictures of planes are made here, by reading every volume through its pose and mask at each pixel. A picture
// of 700 x 700 pixels costs half a million trilinear look-ups per volume, some 20 ms.
#include "ShownVolumes.h"

#include "Core/Base/Parallel.h"
#include "Core/Imaging/Sampling.h"
#include <algorithm>
#include <vtkPointData.h>
#include <vtkUltrasoundVolume.h>

namespace echorama {
namespace {

template <class T>
Sampler<T> SamplerOf(vtkDataArray* intensity, vtkDataArray* valid, vtkImageData* image)
{
  return {vtkUltrasoundVolume::ViewOf<const T>(intensity, image), vtkUltrasoundVolume::ViewOf<const unsigned char>(valid, image)};
}

// Fully bright colours whose hues are evenly spread: their mean is grey.
std::array<double, 3> TintOf(std::size_t i, std::size_t count)
{
  if (count == 1)
    return {1.0, 1.0, 1.0};
  const double hue = 6.0 * (static_cast<double>(i) / static_cast<double>(count) + 30.0 / 360.0);
  std::array<double, 3> tint;
  for (int c = 0; c < 3; ++c) {
    const double distance = std::fabs(std::remainder(hue - 2.0 * c, 6.0));
    tint[c] = 0.25 + 0.75 * std::clamp(2.0 - distance, 0.0, 1.0);
  }
  return tint;
}

// What each voxel of an embedded volume is; nullptr of any other.
vtkDataArray* LabelsOf(vtkImageData* image)
{
  vtkDataArray* labels = image->GetPointData()->GetArray(vtkUltrasoundVolume::EmbeddingName());
  return labels && labels->GetDataType() == VTK_UNSIGNED_CHAR && labels->GetNumberOfComponents() == 1 ? labels : nullptr;
}

// The colours of EmbeddedVoxel.
constexpr std::array<std::array<double, 3>, 4> labelTints{
    {{1.0, 1.0, 1.0}, {1.0, 1.0, 1.0}, {1.0, 0.85, 0.4}, {0.45, 0.65, 1.0}}};

} // namespace

ShownVolumes::ShownVolumes(const std::vector<LoadedVolume>& volumes)
{
  const Eigen::Matrix3d toFrame = vtkUltrasoundVolume::GeometryOf(volumes.front().image).direction.transpose();
  for (const LoadedVolume& volume : volumes) {
    Shown shown;
    shown.image = volume.image;
    shown.intensity = vtkUltrasoundVolume::GetIntensity(volume.image);
    shown.labels = LabelsOf(volume.image);
    shown.valid = shown.labels ? shown.labels : vtkUltrasoundVolume::GetValidRegion(volume.image);
    shown.geometry = vtkUltrasoundVolume::GeometryOf(volume.image);
    shown.tint = TintOf(volumes_.size(), volumes.size());
    // Some hundred thousand voxels per volume tell the percentiles, the box and the middle.
    vtkUltrasoundVolume::Dispatch(shown.intensity, [&](auto type) {
      using T = decltype(type);
      const auto view = vtkUltrasoundVolume::ViewOf<const T>(shown.intensity, shown.image);
      const auto sampler = SamplerOf<T>(shown.intensity, shown.valid, shown.image);
      const Eigen::Affine3d map = toFrame * shown.geometry.IndexToWorld();
      const std::ptrdiff_t step = std::max<std::ptrdiff_t>(1, view.Size() / 300000) | 1;
      for (std::ptrdiff_t v = 0; v < view.Size(); v += step) {
        if (!sampler.IsReal(v))
          continue;
        sorted_.push_back(static_cast<float>(view[v]));
        const Eigen::Vector3d index(static_cast<double>(v % view.RowStride()),
                                    static_cast<double>(v % view.SliceStride() / view.RowStride()),
                                    static_cast<double>(v / view.SliceStride()));
        box_.extend(map * index);
        middle_ += map * index;
      }
    });
    volumes_.push_back(shown);
  }
  if (sorted_.empty())
    throw Error(Error::Kind::BadInput, volumes.front().file + ": nothing to show: no voxel is valid");
  std::sort(sorted_.begin(), sorted_.end());
  middle_ /= static_cast<double>(sorted_.size());
  // The voxels between those that were looked at, and half of the outermost.
  const Eigen::Vector3d margin = 0.01 * box_.sizes() + Eigen::Vector3d::Constant(SmallestSpacing());
  box_.extend(box_.min() - margin);
  box_.extend(box_.max() + margin);
}

double ShownVolumes::Percentile(double share) const
{
  return sorted_[static_cast<std::size_t>(share * static_cast<double>(sorted_.size() - 1))];
}

GreyWindow ShownVolumes::Window() const
{
  const GreyWindow window{Percentile(0.001), Percentile(0.999)};
  return window.white > window.black ? window : GreyWindow{window.black - 1.0, window.black + 1.0};
}

double ShownVolumes::SmallestSpacing() const
{
  double smallest = volumes_.front().geometry.spacing.minCoeff();
  for (const Shown& volume : volumes_)
    smallest = std::min(smallest, volume.geometry.spacing.minCoeff());
  return smallest;
}

vtkSmartPointer<vtkImageData> ShownVolumes::Picture(const ImageGeometry& plane, const GreyWindow& window,
                                                    const std::vector<bool>& shown, bool labels) const
{
  auto picture = vtkSmartPointer<vtkImageData>::New();
  vtkUltrasoundVolume::SetGeometry(picture, plane);
  picture->AllocateScalars(VTK_UNSIGNED_CHAR, 4);
  auto* pixels = static_cast<unsigned char*>(picture->GetScalarPointer());
  const int width = plane.dimensions[0], height = plane.dimensions[1];
  std::vector<std::array<float, 4>> sums(static_cast<std::size_t>(width) * height, {0.f, 0.f, 0.f, 0.f});
  for (std::size_t i = 0; i < volumes_.size(); ++i) {
    if (!shown[i])
      continue;
    const Shown& volume = volumes_[i];
    const Eigen::Affine3d toIndex = volume.geometry.WorldToIndex() * plane.IndexToWorld();
    vtkUltrasoundVolume::Dispatch(volume.intensity, [&](auto type) {
      const auto sampler = SamplerOf<decltype(type)>(volume.intensity, volume.valid, volume.image);
      ParallelFor(height, [&](std::ptrdiff_t row) {
        for (int column = 0; column < width; ++column) {
          const Eigen::Vector3d at = toIndex * Eigen::Vector3d(column, static_cast<double>(row), 0.0);
          double value = 0.0;
          if (!sampler.Linear(at[0], at[1], at[2], value))
            continue;
          auto& sum = sums[static_cast<std::size_t>(row) * width + column];
          const double grey = window(value);
          std::array<double, 3> tint = volume.tint;
          if (labels && volume.labels) {
            const auto* label = static_cast<const unsigned char*>(volume.labels->GetVoidPointer(0));
            const std::size_t kind = label[sampler.NearestIndex(at[0], at[1], at[2])];
            for (std::size_t c = 0; c < 3; ++c)
              tint[c] *= labelTints[std::min(kind, labelTints.size() - 1)][c];
          }
          for (int c = 0; c < 3; ++c)
            sum[c] += static_cast<float>(grey * tint[c]);
          sum[3] += 1.f;
        }
      });
    });
  }
  for (std::size_t p = 0; p < sums.size(); ++p) {
    const float scale = sums[p][3] > 0.f ? 255.f / sums[p][3] : 0.f;
    for (int c = 0; c < 3; ++c)
      pixels[4 * p + c] = static_cast<unsigned char>(sums[p][c] * scale + 0.5f);
    pixels[4 * p + 3] = sums[p][3] > 0.f ? 255 : 0;
  }
  return picture;
}

vtkSmartPointer<vtkImageData> ShownVolumes::Bytes(std::size_t i, const GreyWindow& window, int maxSide) const
{
  const Shown& volume = volumes_[i];
  const auto& n = volume.geometry.dimensions;
  std::array<int, 3> block{};
  ImageGeometry reduced = volume.geometry;
  for (int axis = 0; axis < 3; ++axis) {
    block[axis] = (n[axis] + maxSide - 1) / maxSide;
    reduced.dimensions[axis] = (n[axis] + block[axis] - 1) / block[axis];
    reduced.spacing[axis] *= block[axis];
  }
  reduced.origin =
      volume.geometry.IndexToWorld() * Eigen::Vector3d(0.5 * (block[0] - 1), 0.5 * (block[1] - 1), 0.5 * (block[2] - 1));
  auto bytes = vtkSmartPointer<vtkImageData>::New();
  vtkUltrasoundVolume::SetGeometry(bytes, reduced);
  bytes->AllocateScalars(VTK_UNSIGNED_CHAR, 1);
  const VolumeView<unsigned char> out(static_cast<unsigned char*>(bytes->GetScalarPointer()), reduced.dimensions);
  vtkUltrasoundVolume::Dispatch(volume.intensity, [&](auto type) {
    using T = decltype(type);
    const auto in = vtkUltrasoundVolume::ViewOf<const T>(volume.intensity, volume.image);
    const auto sampler = SamplerOf<T>(volume.intensity, volume.valid, volume.image);
    ParallelFor(out.Slices(), [&](std::ptrdiff_t slice) {
      const int k = static_cast<int>(slice);
      for (int j = 0; j < reduced.dimensions[1]; ++j)
        for (int x = 0; x < reduced.dimensions[0]; ++x) {
          double sum = 0.0;
          int real = 0, all = 0;
          for (int c = k * block[2]; c < std::min(n[2], (k + 1) * block[2]); ++c)
            for (int b = j * block[1]; b < std::min(n[1], (j + 1) * block[1]); ++b)
              for (int a = x * block[0]; a < std::min(n[0], (x + 1) * block[0]); ++a, ++all) {
                const std::ptrdiff_t index = c * in.SliceStride() + b * in.RowStride() + a;
                if (sampler.IsReal(index)) {
                  sum += static_cast<double>(in[index]);
                  ++real;
                }
              }
          out(x, j, k) = 2 * real >= all && real > 0 ? static_cast<unsigned char>(1.5 + 254.0 * window(sum / real)) : 0;
        }
    });
  });
  return bytes;
}

} // namespace echorama
