// SPDX-License-Identifier: BSD-3-Clause
#include "Readers/CoarseVolume.h"
#include "Core/Base/NumberText.h"
#include "Core/Geometry/CoarseGrid.h"
#include <cstring>
#include <utility>
#include <vector>

namespace echorama {
namespace {

class Coarse : public VolumeSource {
public:
  Coarse(std::unique_ptr<VolumeSource> whole, int stride)
    : VolumeSource(whole->Content().path, whole->Content().format), whole_(std::move(whole)), stride_(stride)
  {
    content_ = whole_->Content();
    content_.geometry = CoarseGrid(content_.geometry, stride);
    Note("one of " + NumberText(stride) + " voxels along each axis was read");
  }

  void Read(std::size_t index, void* voxels, unsigned char*, const Progress& progress) override
  {
    ReadSlices(index, 0, content_.geometry.dimensions[2], voxels, progress);
  }

  bool ReadsSlices() const override { return true; }

  void ReadSlices(std::size_t index, int first, int count, void* voxels, const Progress& progress) override
  {
    const auto &n = content_.geometry.dimensions, &all = whole_->Content().geometry.dimensions;
    const std::size_t size = SizeOf(content_.type), stride = static_cast<std::size_t>(stride_),
                      row = static_cast<std::size_t>(all[0]) * size,
                      bytes = static_cast<std::size_t>(n[0]) * static_cast<std::size_t>(n[1]) * size;
    std::vector<unsigned char> slice(row * static_cast<std::size_t>(all[1]));
    for (int done = 0; done < count; ++done) {
      progress(static_cast<double>(done) / count);
      const int k = content_.lastSliceFirst ? count - 1 - done : done; // forwards through the file
      whole_->ReadSlices(index, (first + k) * stride_, 1, slice.data());
      auto* to = static_cast<unsigned char*>(voxels) + static_cast<std::size_t>(k) * bytes;
      for (std::size_t j = 0; j < static_cast<std::size_t>(n[1]); ++j)
        for (std::size_t i = 0; i < static_cast<std::size_t>(n[0]); ++i, to += size)
          std::memcpy(to, &slice[(j * row + i * size) * stride], size);
    }
  }

private:
  const std::unique_ptr<VolumeSource> whole_;
  const int stride_;
};

} // namespace

std::unique_ptr<VolumeSource> CoarseVolume(std::unique_ptr<VolumeSource> whole, int stride)
{
  if (stride == 0)
    for (stride = 1; whole->ReadsSlices() && CoarseGrid(whole->Content().geometry, stride).VoxelCount() > 128'000'000;)
      ++stride;
  if (stride == 1)
    return whole;
  if (!whole->ReadsSlices())
    throw Error(Error::Kind::NotPossible,
                whole->Content().path +
                    ": Stride must be 1, for this file cannot be read slice by slice (MetaImage, NRRD and NIfTI can)");
  return std::make_unique<Coarse>(std::move(whole), stride);
}

} // namespace echorama
