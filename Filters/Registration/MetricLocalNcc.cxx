// SPDX-License-Identifier: BSD-3-Clause
// Local normalised cross-correlation as a difference of images: each voxel less the mean around it, over the deviation around
// it. For two images so normalised the mean of (a - b)^2 / 2 is 1 - NCC, averaged over windows: what costs a sum over a window
// per point and pose elsewhere is done once per volume here, and the rest is a least squares problem. Gain, offset and
// what attenuation leaves of them along the depth fall out.
//
// Means and deviations are Gaussian and count real voxels alone, by how far they can be trusted. A floor under the deviation
// keeps fluid and saturated tissue from being amplified to noise; there the weight is low as well.
//
// Windows are wide, so they are worked out at half the resolution, an eighth of the voxels, and read between these; what is
// compared is smoothed by less than a voxel, at full resolution, slice by slice. Beside the result nothing is ever held that has
// as many voxels as the volume.
#include "Core/Base/Parallel.h"
#include "Metric.h"
#include <algorithm>
#include <cmath>

namespace echorama {
namespace {

constexpr double WindowVoxels = 2.0; // standard deviation of the window, in voxels of the octave
constexpr double SmoothVoxels = 0.6; // of what is compared
// What the border leaves of a window says less of the tissue around a voxel, and where its middle has been taken back to the
// voxel (see Centre) not quite the same. Voxels count by how much of their window is real, from nothing to all between these two.
constexpr float CutWindow = 0.6f, WholeWindow = 0.95f;
constexpr float LeastCentred = 0.2f, AllButWhole = 0.999f; // windows that are worth it, and need it
constexpr float FlatterBeside = 0.5f;                      // see Centre
constexpr double FloorShare = 0.6;                         // of the level's own standard deviation: the floor under the local one
constexpr float LeastTrust = 0.01f;

// The sums over the windows, at half the resolution along each axis whose windows are wide enough, with a rim of one cell around.
class Windows {
public:
  Windows(const MetricSource& source, float globalMean, const Eigen::Vector3d& sigmaVoxels)
  {
    const auto& n = source.intensity.Dimensions();
    std::array<int, 3> cells{};
    Eigen::Vector3d sigma = sigmaVoxels;
    for (int axis = 0; axis < 3; ++axis) {
      // Cells and reading between them blur by one voxel: the mean over two, and a triangle over four.
      step_[axis] = sigmaVoxels[axis] >= 1.4 && n[axis] > 1 ? 2 : 1;
      if (step_[axis] == 2)
        sigma[axis] = 0.5 * std::sqrt(sigmaVoxels[axis] * sigmaVoxels[axis] - 1.0);
      cells[axis] = (n[axis] + step_[axis] - 1) / step_[axis] + 2;
    }
    for (Volume<float>& sums : sums_)
      sums = Volume<float>(cells);
    Gather(source, globalMean);
    for (Volume<float>& sums : sums_)
      GaussianSum(sums.View(), sigma);
    if (source.isFinest)
      Centre(sigmaVoxels);
  }

  /// Part of a row of voxels: the weight around each, the mean value times the weight and the mean square times the weight.
  void Row(int j, int k, const RowSpan& span, const std::array<float*, 3>& out, std::vector<float>& work) const
  {
    const Between y(j, step_[1]), z(k, step_[2]);
    const int first = span.first / step_[0], end = (span.end - 1) / step_[0] + 1; // cells, but for the rim
    work.resize(static_cast<std::size_t>(sums_[0].Dimensions()[0]));
    for (std::size_t n = 0; n < 3; ++n) {
      const VolumeView<const float> view = sums_[n].View();
      const float *a = view.Row(y.first, z.first), *b = view.Row(y.second, z.first), *c = view.Row(y.first, z.second),
                  *d = view.Row(y.second, z.second);
      const float ya = 1.0f - y.part, za = 1.0f - z.part;
      for (int i = first; i < end + 2; ++i)
        work[static_cast<std::size_t>(i)] = za * (ya * a[i] + y.part * b[i]) + z.part * (ya * c[i] + y.part * d[i]);
      Along(work.data(), first, end, out[n]);
    }
  }

private:
  // Between which cells a voxel lies, and how far beyond the first.
  struct Between {
    Between(int voxel, int step) : first(voxel / step + 1), second(first)
    {
      if (step == 2) {
        second = voxel % 2 == 0 ? first - 1 : first + 1;
        part = 0.25f;
      }
    }
    int first, second;
    float part = 0.0f;
  };

  void Along(const float* cells, int first, int end, float* out) const
  {
    if (step_[0] == 1) {
      std::copy(cells + first + 1, cells + end + 1, out + first);
      return;
    }
    for (int c = first; c < end; ++c) {
      out[2 * c] = 0.25f * cells[c] + 0.75f * cells[c + 1];
      out[2 * c + 1] = 0.75f * cells[c + 1] + 0.25f * cells[c + 2];
    }
  }

  // The mean weight, value and square of each cell.
  void Gather(const MetricSource& source, float globalMean)
  {
    const auto& n = source.intensity.Dimensions();
    const VolumeView<float> w = sums_[0].View(), m = sums_[1].View(), s = sums_[2].View();
    const float share = 1.0f / static_cast<float>(step_[0] * step_[1] * step_[2]);
    ParallelFor(m.Dimensions()[2] - 2, [&](std::ptrdiff_t slice) {
      const int c = static_cast<int>(slice);
      for (int k = c * step_[2]; k < std::min(n[2], (c + 1) * step_[2]); ++k)
        for (int j = 0; j < n[1]; ++j) {
          const std::ptrdiff_t row = k * source.intensity.SliceStride() + j * source.intensity.RowStride();
          const int b = j / step_[1] + 1;
          float *toMean = m.Row(b, c + 1), *toSquare = s.Row(b, c + 1), *toWeight = w.Row(b, c + 1);
          const RowSpan span = source.spans.At(j, k);
          for (int i = span.first; i < span.end; ++i) {
            const float v = source.intensity[row + i];
            if (!(v == v))
              continue;
            const float trust = share * std::fmax(LeastTrust, static_cast<float>(source.Trust(row + i))), d = v - globalMean;
            const int a = i / step_[0] + 1;
            toWeight[a] += trust;
            toMean[a] += trust * d;
            toSquare[a] += trust * d * d;
          }
        }
    });
  }

  // A window that the border cuts has its middle beside its voxel, on the inner side. Its mean is that of there: a pattern that
  // moves with the volume, with which each of two volumes pulls the other onto itself. So the mean is followed back along its
  // slope. Where the middle is the weights tell: that of a Gaussian times w lies beside its own by its variance times the slope
  // of log w, w being what the Gaussian leaves of the weights. The less is left, the flatter is the slope beside the tissue's:
  // by 1 + b^2 / 2, b being how many standard deviations the middle lies beside (measured: with 1 + b^2 fine grain is pushed
  // apart, with 1 smooth tissue pulled together). At the finest level only, where the answer is made: borders are wide at coarse
  // ones, and what is guessed there costs starts that are far off.
  void Centre(const Eigen::Vector3d& sigmaVoxels)
  {
    const VolumeView<float> weight = sums_[0].View(), value = sums_[1].View(), square = sums_[2].View();
    const auto& n = weight.Dimensions();
    const std::ptrdiff_t strides[3] = {1, weight.RowStride(), weight.SliceStride()};
    float variances[3]; // in cells; a quarter of them, as slopes are over two cells
    for (std::size_t axis = 0; axis < 3; ++axis)
      variances[axis] = static_cast<float>(0.25 * std::pow(sigmaVoxels[static_cast<Eigen::Index>(axis)] / step_[axis], 2));
    Volume<float> centred(n);
    const VolumeView<float> out = centred.View();
    ParallelFor(n[2], [&](std::ptrdiff_t k) {
      for (int j = 0; j < n[1]; ++j) {
        const std::ptrdiff_t row = k * strides[2] + j * strides[1];
        std::copy_n(&value[row], n[0], &out[row]);
        if (k == 0 || k + 1 == n[2] || j == 0 || j + 1 == n[1])
          continue;
        for (std::ptrdiff_t i = row + 1; i < row + n[0] - 1; ++i) {
          const float w = weight[i];
          if (w < LeastCentred || w > AllButWhole)
            continue;
          const float mean = value[i] / w;
          float back = 0.0f, beside2 = 0.0f;
          for (std::size_t axis = 0; axis < 3; ++axis) {
            const std::ptrdiff_t before = i - strides[axis], after = i + strides[axis];
            if (!(weight[before] > 0.0f && weight[after] > 0.0f))
              continue;
            const float beside = variances[axis] * (weight[after] - weight[before]) / w;
            back += beside * (value[after] / weight[after] - value[before] / weight[before]);
            beside2 += beside * beside / variances[axis];
          }
          back *= 1.0f + FlatterBeside * beside2;
          out[i] = w * (mean - back);
          square[i] += w * back * (back - 2.0f * mean); // so that the deviation stays
        }
      }
    });
    sums_[1] = std::move(centred);
  }

  std::array<int, 3> step_{1, 1, 1};  // voxels of a cell along each axis
  std::array<Volume<float>, 3> sums_; // of weights, values and squares
};

// A row, from the sums over what is smoothed and over the windows.
struct RowSums {
  const float *smoothWeight, *smoothValue, *weight, *value, *square;
};

void SeeRow(const float* intensity, const RowSums& sums, const float* trust, float floor, int count, SeenVoxel* out)
{
  for (int i = 0; i < count; ++i) {
    const bool real = intensity[i] == intensity[i];
    const float one = 1.0f / sums.weight[i], mean = sums.value[i] * one, spread = sums.square[i] * one - mean * mean;
    const float variance = spread > 0.0f ? spread : 0.0f, scale = 1.0f / (variance + floor);
    const float whole = (sums.weight[i] - CutWindow) * (1.0f / (WholeWindow - CutWindow));
    const float full = whole > 0.0f ? (whole < 1.0f ? whole : 1.0f) : 0.0f, weight = variance * scale * full * full;
    const float value = (sums.smoothValue[i] / sums.smoothWeight[i] - mean) * std::sqrt(scale);
    out[i] = {real ? value : 0.0f, real ? trust[i] * (weight > 1e-3f ? weight : 1e-3f) : 0.0f};
  }
}

void SeeLocalNcc(const MetricSource& source, MetricLevel& level)
{
  const auto& n = level.geometry.dimensions;
  const double octaveMm = std::exp2(level.octave);
  const Eigen::Vector3d window = (WindowVoxels * octaveMm / level.geometry.spacing.array()).matrix();
  const Eigen::Vector3d smooth = (SmoothVoxels * octaveMm / level.geometry.spacing.array()).matrix();
  const MeanAndDeviation global = MeanAndDeviationOf(source);
  const float mean = static_cast<float>(global.mean);
  const float floor = static_cast<float>(FloorShare * FloorShare * global.deviation * global.deviation) + 1e-30f;
  const Windows windows(source, mean, window);
  level.seen.resize(static_cast<std::size_t>(source.intensity.Size()));
  const std::ptrdiff_t slice = source.intensity.SliceStride();
  SmoothSlices(
      n, 2, smooth, source.spans,
      [&](int k, VolumeView<float> out) {
        for (int j = 0; j < n[1]; ++j) {
          const RowSpan span = source.spans.At(j, k);
          const std::ptrdiff_t row = k * slice + j * source.intensity.RowStride();
          float *weights = out.Row(j, 0), *values = out.Row(j, 1);
          for (int i = span.first; i < span.end; ++i) {
            const float v = source.intensity[row + i];
            const bool real = v == v;
            weights[i] = real ? std::fmax(LeastTrust, static_cast<float>(source.Trust(row + i))) : 0.0f;
            values[i] = real ? weights[i] * (v - mean) : 0.0f;
          }
        }
      },
      [&](int k, VolumeView<const float> smoothed) {
        const std::size_t width = static_cast<std::size_t>(n[0]) + 1; // windows come in pairs of voxels
        std::vector<float> weight(width), value(width), square(width), trust(width, 1.0f), work;
        for (int j = 0; j < n[1]; ++j) {
          const RowSpan span = source.spans.At(j, k);
          if (span.Empty())
            continue;
          windows.Row(j, k, span, {weight.data(), value.data(), square.data()}, work);
          const int first = span.first;
          const std::ptrdiff_t start = k * slice + j * source.intensity.RowStride() + first;
          if (!source.reliability.Empty())
            for (int i = 0; i < span.Size(); ++i)
              trust[static_cast<std::size_t>(i)] = static_cast<float>(source.Trust(start + i));
          SeeRow(source.intensity.Data() + start,
                 {smoothed.Row(j, 0) + first, smoothed.Row(j, 1) + first, weight.data() + first, value.data() + first,
                  square.data() + first},
                 trust.data(), floor, span.Size(), level.seen.data() + start);
        }
      });
}

} // namespace

const Metric LocalNccMetric{"local-ncc", 0.25, false, NoLimit, SeeLocalNcc};

} // namespace echorama
