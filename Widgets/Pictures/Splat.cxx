// SPDX-License-Identifier: BSD-3-Clause
// The picture is cut into tiles that stay in a core's cache. Particles are brought to pixels once, in chunks; each chunk then
// names them in the lists of the tiles that they touch, so that these keep the order of the sets. A tile sorts its list by
// depth and draws from the front, where it can end as soon as nothing more would be seen.
#include "Splat.h"
#include "Core/Base/Parallel.h"
#include <algorithm>
#include <cmath>
#include <numeric>

namespace echorama {
namespace {

constexpr int TileSide = 32;
constexpr std::ptrdiff_t ChunkSize = 1 << 15;

struct Splat {
  float x, y, half;                   ///< pixels
  float depth;                        ///< as OpenGL keeps it, [0, 1]
  std::array<std::uint8_t, 4> colour; ///< not multiplied by alpha
};

// Pixels whose middles lie in [middle - half, middle + half).
struct Span {
  int first, last; // both included
  Span(float middle, float half, int limit)
    : first(std::max(0, static_cast<int>(std::ceil(middle - half - 0.5f)))),
      last(std::min(limit - 1, static_cast<int>(std::ceil(middle + half - 0.5f)) - 1))
  {
  }
};

struct Chunk {
  std::size_t set;
  std::ptrdiff_t begin, end; ///< particles of the set
  std::vector<Splat> splats;
  std::vector<std::uint32_t> places; ///< how many in each tile; then where they begin in its list
  float nearest = 1.0f, farthest = 0.0f;
};

class Picture {
public:
  Picture(const std::vector<SplatSet>& sets, const SplatView& view, const float* depth)
    : sets_(sets), view_(view), depth_(depth), columns_((view.width + TileSide - 1) / TileSide),
      rows_((view.height + TileSide - 1) / TileSide),
      rgba_(4 * static_cast<std::size_t>(view.width) * static_cast<std::size_t>(view.height))
  {
  }

  std::vector<std::uint8_t> Draw()
  {
    for (std::size_t s = 0; s < sets_.size(); ++s) {
      const auto count = static_cast<std::ptrdiff_t>(sets_[s].particles->Count());
      for (std::ptrdiff_t begin = 0; begin < count; begin += ChunkSize)
        chunks_.push_back({s, begin, std::min(begin + ChunkSize, count), {}, {}});
    }
    ParallelFor(static_cast<std::ptrdiff_t>(chunks_.size()),
                [this](std::ptrdiff_t c) { Project(chunks_[static_cast<std::size_t>(c)]); });
    List();
    ParallelFor(static_cast<std::ptrdiff_t>(Tiles()), [this](std::ptrdiff_t tile) { DrawTile(static_cast<int>(tile)); });
    return std::move(rgba_);
  }

private:
  std::size_t Tiles() const { return static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_); }

  template <class Sink>
  void VisitTiles(const Splat& splat, const Sink& sink) const
  {
    const Span x(splat.x, splat.half, view_.width), y(splat.y, splat.half, view_.height);
    if (x.first > x.last || y.first > y.last)
      return;
    for (int row = y.first / TileSide; row <= y.last / TileSide; ++row)
      for (int column = x.first / TileSide; column <= x.last / TileSide; ++column)
        sink(static_cast<std::size_t>(row * columns_ + column));
  }

  void Project(Chunk& chunk) const
  {
    const SplatSet& set = sets_[chunk.set];
    const Particles& particles = *set.particles;
    const Eigen::Matrix4f toClip = (view_.worldToClip * set.volumeToWorld.matrix()).cast<float>();
    const auto size = static_cast<float>(view_.sides * particles.sizeMm * view_.pixels);
    const auto width = static_cast<float>(view_.width), height = static_cast<float>(view_.height);
    const SplatTints tints(set);
    chunk.splats.reserve(static_cast<std::size_t>(chunk.end - chunk.begin));
    chunk.places.assign(Tiles(), 0);
    for (std::ptrdiff_t p = chunk.begin; p < chunk.end; ++p) {
      const float* position = particles.positions.data() + 3 * p;
      const Eigen::Vector4f clip =
          toClip.col(0) * position[0] + toClip.col(1) * position[1] + toClip.col(2) * position[2] + toClip.col(3);
      const float w = clip[3];
      if (!(w > 0.0f && std::fabs(clip[0]) <= w && std::fabs(clip[1]) <= w && std::fabs(clip[2]) <= w))
        continue;
      const auto at = static_cast<std::size_t>(p);
      Splat splat{0.5f * width * (clip[0] / w + 1.0f), 0.5f * height * (clip[1] / w + 1.0f), 0.5f * std::max(1.0f, size / w),
                  0.5f * (clip[2] / w + 1.0f), tints.Of(particles.values[at], particles.alphas[at])};
      chunk.nearest = std::min(chunk.nearest, splat.depth);
      chunk.farthest = std::max(chunk.farthest, splat.depth);
      VisitTiles(splat, [&chunk](std::size_t tile) { ++chunk.places[tile]; });
      chunk.splats.push_back(splat);
    }
  }

  // The lists of all tiles, one after the other; in each the chunks in their order.
  void List()
  {
    ends_.assign(Tiles(), 0);
    std::uint32_t place = 0;
    for (std::size_t tile = 0; tile < Tiles(); ++tile) {
      for (Chunk& chunk : chunks_)
        place += std::exchange(chunk.places[tile], place);
      ends_[tile] = place;
    }
    listed_.resize(place);
    ParallelFor(static_cast<std::ptrdiff_t>(chunks_.size()), [this](std::ptrdiff_t c) {
      Chunk& chunk = chunks_[static_cast<std::size_t>(c)];
      for (const Splat& splat : chunk.splats)
        VisitTiles(splat, [&](std::size_t tile) { listed_[chunk.places[tile]++] = &splat; });
    });
    for (const Chunk& chunk : chunks_) {
      nearest_ = std::min(nearest_, chunk.nearest);
      farthest_ = std::max(farthest_, chunk.farthest);
    }
  }

  // From front to back; of one step of depth in the reverse order of the sets, for the last lies over the others.
  std::vector<const Splat*> Sorted(std::size_t tile) const
  {
    const auto begin = listed_.begin() + (tile == 0 ? 0 : ends_[tile - 1]), end = listed_.begin() + ends_[tile];
    std::vector<const Splat*> splats(std::make_reverse_iterator(end), std::make_reverse_iterator(begin)), other(splats.size());
    const float range = farthest_ - nearest_, scale = range > 0.0f ? 65535.0f / range : 0.0f;
    for (const int shift : {0, 8}) {
      const auto digit = [&](const Splat* splat) {
        return (static_cast<std::uint32_t>((splat->depth - nearest_) * scale) >> shift) & 255u;
      };
      std::array<std::uint32_t, 257> places{};
      for (const Splat* splat : splats)
        ++places[digit(splat) + 1];
      std::partial_sum(places.begin(), places.end(), places.begin());
      for (const Splat* splat : splats)
        other[places[digit(splat)]++] = splat;
      splats.swap(other);
    }
    return splats;
  }

  void DrawTile(int tile)
  {
    constexpr float Opaque = 254.5f;      // what is behind changes no byte
    constexpr std::size_t Patience = 512; // splats between two looks whether there is something left to be seen
    const int left = tile % columns_ * TileSide, bottom = tile / columns_ * TileSide;
    const int width = std::min(TileSide, view_.width - left), height = std::min(TileSide, view_.height - bottom);
    std::array<Eigen::Array4f, TileSide * TileSide> pixels;
    pixels.fill(Eigen::Array4f::Constant(255.0f)); // beyond the picture there is nothing to be seen
    for (int j = 0; j < height; ++j)
      std::fill_n(pixels.begin() + j * TileSide, width, Eigen::Array4f::Zero());
    std::array<float, TileSide * TileSide> limits; // of depth
    bool isCovered = false;
    for (int j = 0; depth_ && j < height; ++j)
      for (int i = 0; i < width; ++i) {
        const float limit = depth_[static_cast<std::ptrdiff_t>(bottom + j) * view_.width + left + i];
        limits[static_cast<std::size_t>(j * TileSide + i)] = limit;
        isCovered = isCovered || limit < 1.0f;
      }
    std::size_t count = 0;
    for (const Splat* splat : Sorted(static_cast<std::size_t>(tile))) {
      const float alpha = splat->colour[3];
      const Eigen::Array4f colour =
          Eigen::Array4f(splat->colour[0], splat->colour[1], splat->colour[2], 255.0f) * (alpha / 255.0f);
      const Span x(splat->x - static_cast<float>(left), splat->half, width),
          y(splat->y - static_cast<float>(bottom), splat->half, height);
      for (int j = y.first; j <= y.last; ++j)
        for (int i = x.first; i <= x.last; ++i) {
          const auto at = static_cast<std::size_t>(j * TileSide + i);
          if (!isCovered || splat->depth < limits[at])
            pixels[at] += (1.0f - pixels[at][3] / 255.0f) * colour;
        }
      if (++count % Patience == 0 &&
          std::all_of(pixels.begin(), pixels.end(), [](const Eigen::Array4f& p) { return p[3] >= Opaque; }))
        break;
    }
    for (int j = 0; j < height; ++j) {
      std::uint8_t* out = rgba_.data() + 4 * (static_cast<std::ptrdiff_t>(bottom + j) * view_.width + left);
      for (int i = 0; i < width; ++i, out += 4)
        Eigen::Map<Eigen::Array<std::uint8_t, 4, 1>>{out} =
            (pixels[static_cast<std::size_t>(j * TileSide + i)] + 0.5f).min(255.0f).cast<std::uint8_t>();
    }
  }

  const std::vector<SplatSet>& sets_;
  const SplatView& view_;
  const float* depth_;
  int columns_, rows_;
  std::vector<Chunk> chunks_;
  std::vector<std::uint32_t> ends_;
  std::vector<const Splat*> listed_;
  float nearest_ = 1.0f, farthest_ = 0.0f;
  std::vector<std::uint8_t> rgba_;
};

} // namespace

SplatTints::SplatTints(const SplatSet& set)
{
  for (std::size_t value = 0; value < 256; ++value) {
    for (std::size_t c = 0; c < 3; ++c)
      tints_[c][value] = static_cast<std::uint8_t>(std::lround(set.colour[c] * static_cast<double>(value)));
    tints_[3][value] = static_cast<std::uint8_t>(std::lround(set.opacity * static_cast<double>(value)));
  }
}

std::vector<std::uint8_t> DrawParticles(const std::vector<SplatSet>& sets, const SplatView& view, const float* depth)
{
  return Picture(sets, view, depth).Draw();
}

} // namespace echorama
