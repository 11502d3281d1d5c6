// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/ZeroedMemory.h"
#include "LocalAlign.h"
#include <array>
#include <cstdint>
#include <functional>

namespace echorama {

/// A voxel as a metric that compares values sees it, in four bytes: points are read all over a volume, and what is read is what
/// they cost. The steps are far below speckle.
struct SeenVoxel {
  static constexpr float ValueUnit = 1.0f / 1024.0f, WeightUnit = 1.0f / 32767.0f; ///< what one step of each is
  static constexpr float LargestValue = 32767.0f * ValueUnit;                      ///< values beyond are as large

  std::int16_t value = 0, weight = 0; ///< weight is 0 where the voxel is not real, and nowhere else

  SeenVoxel() = default;
  SeenVoxel(float v, float w)
    : value(static_cast<std::int16_t>(Nearest(Between(v, -LargestValue, LargestValue) / ValueUnit))),
      weight(static_cast<std::int16_t>(w > 0.0f ? Nearest(Between(w / WeightUnit, 1.0f, 32767.0f)) : 0))
  {
  }
  float Value() const { return ValueUnit * static_cast<float>(value); }
  float Weight() const { return WeightUnit * static_cast<float>(weight); }
  bool IsReal() const { return weight > 0; }

private:
  static float Between(float v, float low, float high) { return v > low ? (v < high ? v : high) : low; } // NaN: low
  static int Nearest(float v) { return static_cast<int>(v + (v < 0.0f ? -0.5f : 0.5f)); }
};

/// One resolution of a volume as a metric sees it. The voxels of a metric that compares descriptors hold sixteen bytes, twelve of
/// the descriptor and one of the weight, which is 0 where a voxel is not real.
struct MetricLevel {
  ImageGeometry geometry;
  double voxelMm = 0.0;                 ///< geometric mean of the spacing
  int octave = 0;                       ///< log2(voxelMm), rounded: windows follow it, so that two volumes are seen alike
  Zeroed<SeenVoxel> seen;               ///< of a metric that compares values
  Zeroed<SeenVoxel> edges;              ///< the gradient's magnitude and the weight (lc2), else empty
  Zeroed<unsigned char> descriptors;    ///< 16 bytes per voxel (mind-ssc), else empty
  std::vector<std::int32_t> realBefore; ///< how many real voxels lie before each run of RunLength; the last: how many there are

  static constexpr std::ptrdiff_t RunLength = 64;
  std::ptrdiff_t RealVoxels() const { return realBefore.back(); }
  bool IsReal(std::ptrdiff_t voxel) const
  {
    const std::size_t i = static_cast<std::size_t>(voxel);
    return seen.empty() ? descriptors[16 * i + 12] > 0 : seen[i].IsReal();
  }
  void CountReal(); ///< fills realBefore
};

class MetricPyramid {
public:
  std::string metric, name;
  std::vector<MetricLevel> levels;                  ///< the finest first
  Eigen::Vector3d centre = Eigen::Vector3d::Zero(); ///< the centroid of the finest level's voxels, as its geometry stands, mm
};

/// Part of a row of voxels.
struct RowSpan {
  int first = 0, end = 0;
  bool Empty() const { return end <= first; }
  int Size() const { return end - first; }
  void Add(const RowSpan& other) ///< what lies between, too
  {
    if (!other.Empty())
      *this = Empty() ? other : RowSpan{other.first < first ? other.first : first, other.end > end ? other.end : end};
  }
};

/// The part of each row of a volume in which its real voxels lie: of a fan in its box a third or a quarter of all.
class RowSpans {
public:
  RowSpans() = default;
  explicit RowSpans(VolumeView<const float> intensity); ///< NaN where not real
  RowSpan At(int j, int k) const { return spans_[static_cast<std::size_t>(k) * rows_ + static_cast<std::size_t>(j)]; }

private:
  std::size_t rows_ = 0;
  std::vector<RowSpan> spans_;
};

/// What is read to build one level.
struct MetricSource {
  VolumeView<const float> intensity;   ///< NaN where not real
  VolumeView<const float> reliability; ///< [0, 1]; empty: all 1
  RowSpans spans;                      ///< of the intensity
  bool isFinest = true;                ///< of the pyramid's levels
  double Trust(std::ptrdiff_t i) const { return reliability.Empty() ? 1.0 : Clamped(reliability[i]); }

private:
  static double Clamped(float v) { return v > 0.0f ? (v < 1.0f ? static_cast<double>(v) : 1.0) : 0.0; } // NaN: 0
};

/// Of the real voxels, by their trust; two passes, in double precision.
struct MeanAndDeviation {
  double mean = 0.0, deviation = 0.0;
};
MeanAndDeviation MeanAndDeviationOf(const MetricSource& source);

constexpr std::ptrdiff_t NoLimit = std::ptrdiff_t{1} << 40;

/// A metric: how it sees, and how differences count.
struct Metric {
  const char* name;
  /// Differences beyond this count linearly instead of squared (pseudo-Huber), in the units of what is seen.
  double lossScale;
  /// Values are brought to one mean and deviation over the overlap at each pose, so that gain and offset do not matter.
  bool fitsOverlap;
  /// Levels with more voxels are left out, unless there is none with fewer.
  std::ptrdiff_t mostVoxels;
  /// Fills seen, edges or descriptors of a level whose geometry, voxelMm and octave are set.
  void (*see)(const MetricSource& source, MetricLevel& level);
};

extern const Metric LocalNccMetric, NccMetric, MadMetric, MindSscMetric, Lc2Metric;

/// \throws Error(InvalidParameter) for a name that is not one of MetricNames().
const Metric& MetricNamed(const std::string& name);

/// Sees intensities brought to mean 0 and deviation 1 over the volume (ncc, mad, lc2).
void SeeIntensity(const MetricSource& source, MetricLevel& level);

/// What both volumes say at one pose. Sums are over points of both, each point by the volume of tissue it stands for.
struct MetricSums {
  double weight = 0.0;                              ///< of the points compared, mm^3
  double similar = 0.0;                             ///< weight times similarity
  double loss = 0.0;                                ///< weight times loss
  double share = 0.0;                               ///< overlap: of the smaller volume, by reliability, [0, 1]
  Eigen::Vector3d moment = Eigen::Vector3d::Zero(); ///< weight times position, mm
  Eigen::Matrix<double, 6, 1> gradient = Eigen::Matrix<double, 6, 1>::Zero(); ///< of half the loss, by the twist
  Eigen::Matrix<double, 6, 6> hessian = Eigen::Matrix<double, 6, 6>::Zero();  ///< of half the loss, Gauss-Newton
};

/// The gradient of half the loss, by blocks of tissue.
using BlockGradients = std::vector<Eigen::Matrix<double, 6, 1>>;

/// Two volumes at one resolution, with the points at which they are compared.
class LevelComparison {
public:
  virtual ~LevelComparison() = default;
  /// At a pose of the moving volume; derivatives by the twist (translation mm, rotation vector) that acts as
  /// MotionAbout(centre, rotation, translation) * movingToWorld. \a blocks: if given, receives the gradient's parts.
  virtual MetricSums At(const Pose& movingToWorld, const Eigen::Vector3d& centre, BlockGradients* blocks = nullptr) const = 0;
  /// The weight of the smaller volume compared with itself, mm^3.
  double SmallerWeight() const { return smallerWeight_; }

protected:
  double smallerWeight_ = 0.0;
};

/// What the comparison of two levels needs to know.
struct ComparisonSetup {
  const Metric* metric = nullptr;
  const MetricLevel *fixed = nullptr, *moving = nullptr;
  Pose fixedToWorld = Pose::Identity();
  Pose startToWorld = Pose::Identity(); ///< of the moving volume: tells which points are in which part
  int points = 0, part = 0;
  double blockMm = 12.0; ///< size of the blocks of tissue: of parts, and of the gradient
  std::uint64_t seed = 1;
};
std::unique_ptr<LevelComparison> ComparePoints(const ComparisonSetup& setup);

/// Smooths volumes in place along all three axes with a Gaussian (separable, cut at 2.5 standard deviations, nothing beyond the
/// border), standard deviations in voxels per axis; below 0.2 an axis is left alone.
void GaussianSum(VolumeView<float> volume, const Eigen::Vector3d& sigmaVoxels);

/// The same for volumes that nobody needs to hold: \a make(k, slices) fills slice k of each of \a volumes volumes, one behind the
/// other, where they are not 0: in the spans of its rows; \a use(k, smoothed) gets them smoothed, and may look there. Chunks of
/// slices run in parallel; some are made twice.
void SmoothSlices(const std::array<int, 3>& dimensions, int volumes, const Eigen::Vector3d& sigmaVoxels, const RowSpans& spans,
                  const std::function<void(int k, VolumeView<float> slices)>& make,
                  const std::function<void(int k, VolumeView<const float> smoothed)>& use);

} // namespace echorama
