// SPDX-License-Identifier: BSD-3-Clause
// The types of volumes end here: what stitches sees numbers and masks.
#include "StitchSampler.h"
#include "Core/Base/Error.h"
#include <algorithm>

namespace echorama {

const ImageGeometry& GeometryOf(const StitchInput& input)
{
  return std::visit([](const auto& volume) -> const ImageGeometry& { return volume.geometry; }, input.volume);
}

ImageGeometry Cropped(const ImageGeometry& grid, const GridBox& box)
{
  ImageGeometry cropped = grid;
  cropped.origin = grid.IndexToWorld() * Eigen::Vector3d(box.first[0], box.first[1], box.first[2]);
  cropped.dimensions = box.size;
  return cropped;
}

ImageGeometry Coarsened(const ImageGeometry& grid, int factor)
{
  ImageGeometry coarse = grid;
  Eigen::Vector3d first;
  for (int axis = 0; axis < 3; ++axis) {
    const int count = grid.dimensions[axis], start = CoarseStart(count, factor);
    first[axis] = start;
    coarse.dimensions[axis] = (count - start + factor - 1) / factor;
    if (count > 1)
      coarse.spacing[axis] *= factor;
  }
  coarse.origin = grid.IndexToWorld() * first;
  return coarse;
}

CoarseSampler::CoarseSampler(const Boxed<float>& values, const Boxed<unsigned char>& known, const ImageGeometry& coarse,
                             const ImageGeometry& grid)
  : sampler_(PosedVolume<float>{values.values.View(), known.values.View(), Cropped(coarse, values.box)}, grid)
{
}

template <class A>
void CoarseSampler::Row(int j, int k, int first, int end, const unsigned char* wanted, float fallback, A* values) const
{
  std::fill(values, values + (end - first), static_cast<A>(fallback));
  const GridBox& box = sampler_.Box();
  const int from = std::max(first, box.first[0]), to = std::min(end, box.first[0] + box.size[0]);
  if (!box.HasRow(j, k) || from >= to)
    return;
  // Only what is wanted and known is read.
  thread_local std::vector<unsigned char> inside;
  thread_local std::vector<A> row;
  inside.resize(static_cast<std::size_t>(box.size[0]));
  row.resize(static_cast<std::size_t>(box.size[0]));
  sampler_.Inside(j, k, inside.data());
  std::fill(inside.begin(), inside.begin() + (from - box.first[0]), static_cast<unsigned char>(0));
  std::fill(inside.begin() + (to - box.first[0]), inside.end(), static_cast<unsigned char>(0));
  for (int i = from; i < to; ++i)
    inside[static_cast<std::size_t>(i - box.first[0])] &= wanted[i - first];
  sampler_.Values(j, k, inside.data(), row.data());
  for (int i = from; i < to; ++i)
    if (inside[static_cast<std::size_t>(i - box.first[0])] & 1)
      values[i - first] = row[static_cast<std::size_t>(i - box.first[0])];
}

template void CoarseSampler::Row<float>(int, int, int, int, const unsigned char*, float, float*) const;
template void CoarseSampler::Row<double>(int, int, int, int, const unsigned char*, float, double*) const;

StitchSampler::StitchSampler(const StitchInput& input, const ImageGeometry& grid, double reliabilityFloor)
  : sampler_(std::visit(
        [&](const auto& volume) -> AnySampler {
          if (volume.intensity.Dimensions() != volume.geometry.dimensions ||
              (!volume.valid.Empty() && volume.valid.Dimensions() != volume.geometry.dimensions))
            throw Error(Error::Kind::BadInput, input.name + ": its voxels are not of the size that its geometry says");
          return RowSampler(volume, grid, input.displacement);
        },
        input.volume)),
    box_(std::visit([](const auto& sampler) { return sampler.Box(); }, sampler_)), floor_(static_cast<float>(reliabilityFloor))
{
  if (input.reliability.Empty())
    return;
  std::visit(
      [&](const auto& volume) {
        if (input.reliability.Dimensions() != volume.geometry.dimensions)
          throw Error(Error::Kind::BadInput, input.name + ": its reliability is not of the size that its geometry says");
        trust_ = std::make_shared<const RowSampler<float>>(PosedVolume<float>{input.reliability, volume.valid, volume.geometry},
                                                           grid, input.displacement);
      },
      input.volume);
}

void StitchSampler::Inside(int j, int k, unsigned char* inside) const
{
  std::visit([&](const auto& sampler) { sampler.Inside(j, k, inside); }, sampler_);
}

template <class A>
void StitchSampler::Values(int j, int k, const unsigned char* inside, A* values) const
{
  std::visit([&](const auto& sampler) { sampler.Values(j, k, inside, values); }, sampler_);
}

template void StitchSampler::Values<float>(int, int, const unsigned char*, float*) const;
template void StitchSampler::Values<double>(int, int, const unsigned char*, double*) const;

template <class A>
void StitchSampler::Read(int j, int k, unsigned char* inside, A* values) const
{
  std::visit([&](const auto& sampler) { sampler.Read(j, k, inside, values); }, sampler_);
}

template void StitchSampler::Read<float>(int, int, unsigned char*, float*) const;
template void StitchSampler::Read<double>(int, int, unsigned char*, double*) const;

void StitchSampler::Trust(int j, int k, const unsigned char* inside, float* trust) const
{
  trust_->Values(j, k, inside, trust);
  // What is not a number is not trusted.
  for (int i = 0; i < box_.size[0]; ++i)
    trust[i] = trust[i] > floor_ ? std::min(trust[i], 1.0f) : floor_;
}

std::vector<Boxed<unsigned char>> MasksOf(const std::vector<StitchSampler>& samplers, const Progress& progress)
{
  std::vector<Boxed<unsigned char>> masks(samplers.size());
  const double n = static_cast<double>(samplers.size());
  for (std::size_t v = 0; v < samplers.size(); ++v) {
    masks[v].box = samplers[v].Box();
    if (masks[v].box.Empty())
      continue;
    masks[v].values = Volume<unsigned char>(masks[v].box.size);
    ForRows(masks[v].box, progress.Part(static_cast<double>(v) / n, static_cast<double>(v + 1) / n),
            [&](int j, int k) { samplers[v].Inside(j, k, masks[v].Row(j, k)); });
  }
  return masks;
}

Presence PresenceOf(const std::vector<StitchSampler>& samplers, std::size_t volume)
{
  Presence found;
  const GridBox& own = samplers[volume].Box();
  std::vector<unsigned char> inside(static_cast<std::size_t>(own.size[0])), other;
  for (int k = own.first[2]; k < own.first[2] + own.size[2] && !found.isShared; ++k)
    for (int j = own.first[1]; j < own.first[1] + own.size[1] && !found.isShared; ++j) {
      samplers[volume].Inside(j, k, inside.data());
      found.isInside = found.isInside || std::any_of(inside.begin(), inside.end(), [](unsigned char mask) { return mask & 1; });
      for (std::size_t u = 0; u < samplers.size() && !found.isShared; ++u) {
        const GridBox& box = samplers[u].Box();
        if (u == volume || !box.HasRow(j, k))
          continue;
        other.resize(static_cast<std::size_t>(box.size[0]));
        samplers[u].Inside(j, k, other.data());
        const int first = std::max(own.first[0], box.first[0]);
        const int end = std::min(own.first[0] + own.size[0], box.first[0] + box.size[0]);
        for (int i = first; i < end && !found.isShared; ++i)
          found.isShared =
              (inside[static_cast<std::size_t>(i - own.first[0])] & other[static_cast<std::size_t>(i - box.first[0])] & 1) != 0;
      }
    }
  return found;
}

} // namespace echorama
