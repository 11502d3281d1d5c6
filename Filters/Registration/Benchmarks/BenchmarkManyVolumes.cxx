// SPDX-License-Identifier: BSD-3-Clause
// How aligning grows with the number of volumes. A probe is swept over invented tissue in rows, back and forth; each of its views
// has 32^3 voxels of 2 mm in a fan, its own speckle, and starts 5 mm and 3 degrees off.
//
// `sweep`: everything but the pairs themselves, which a stand-in answers that knows the truth: what is made of the volumes, which
// pairs overlap (peer: every volume against every other), the pose graph. `aligned`: with the pairs, with all the memory that
// they like and with a fifth of it. `chain`: how errors add up over a hundred volumes, in a row without loops, in a ring, and in
// two rows side by side. `neighbours`: what adds up there, the mean error of neighbours of a row along it and about the axis
// across.
//
//   BenchmarkManyVolumes [sweep|aligned|chain|neighbours]     default: all
#include "Core/Base/Random.h"
#include "Core/Imaging/ValidPoints.h"
#include "Filters/Phantoms/PhantomViews.h"
#include "Filters/Registration/AlignVolumes.h"
#include "Filters/Registration/LocalAlign.h"
#include "Filters/Registration/OverlappingPairs.h"
#include "Filters/Registration/PreparedVolume.h"
#include "Testing/Benchmark.h"
#include <algorithm>
#include <cmath>
#include <string>

using namespace echorama;

namespace {

constexpr double SpacingMm = 2.0, StepMm = 15.0, RowMm = 30.0;
constexpr int Size = 32;

std::size_t Index(int number)
{
  return static_cast<std::size_t>(number);
}

// Tissue: smoothed noise on a lattice that repeats, so that it goes on for ever.
class Tissue {
public:
  Tissue() : values_(Period * Period * Period)
  {
    Random random(17);
    for (float& value : values_)
      value = static_cast<float>(random.Normal());
    for (int pass = 0; pass < 2; ++pass)
      for (const int stride : {1, Period, Period * Period})
        Smooth(stride);
  }

  double At(const Eigen::Vector3d& mm) const
  {
    int cell[3];
    double share[3];
    for (int axis = 0; axis < 3; ++axis) {
      const double at = mm[axis] / LatticeMm, low = std::floor(at);
      cell[axis] = static_cast<int>(low);
      share[axis] = at - low;
    }
    double sum = 0.0;
    for (int corner = 0; corner < 8; ++corner) {
      double weight = 1.0;
      int at[3];
      for (int axis = 0; axis < 3; ++axis) {
        const int far = corner >> axis & 1;
        at[axis] = (cell[axis] + far) & (Period - 1);
        weight *= far ? share[axis] : 1.0 - share[axis];
      }
      sum += weight * static_cast<double>(values_[Index((at[2] * Period + at[1]) * Period + at[0])]);
    }
    return sum;
  }

private:
  static constexpr int Period = 64;
  static constexpr double LatticeMm = 3.0;

  void Smooth(int stride)
  {
    std::vector<float> out(values_.size());
    for (int i = 0; i < Period * Period * Period; ++i) {
      const int place = i / stride % Period, base = i - place * stride;
      const auto neighbour = [&](int step) { return values_[Index(base + ((place + step) & (Period - 1)) * stride)]; };
      out[Index(i)] = 0.5f * neighbour(0) + 0.25f * (neighbour(-1) + neighbour(1));
    }
    values_ = out;
  }

  std::vector<float> values_;
};

// Views of it, where they belong and where they start.
class Views {
public:
  explicit Views(const std::vector<Pose>& poses) : truth(poses)
  {
    static const Tissue tissue;
    for (std::size_t v = 0; v < truth.size(); ++v) {
      Random random(23, v);
      ImageGeometry geometry;
      geometry.dimensions = {Size, Size, Size};
      geometry.spacing.setConstant(SpacingMm);
      Volume<unsigned char> voxels(geometry.dimensions), valid(geometry.dimensions);
      constexpr double middle = 0.5 * (Size - 1);
      for (int k = 0; k < Size; ++k)
        for (int j = 0; j < Size; ++j)
          for (int i = 0; i < Size; ++i) {
            const double half = middle * (0.6 + 0.4 * k / (Size - 1.0)); // a fan, wider below
            valid.View()(i, j, k) = std::fabs(i - middle) <= half && std::fabs(j - middle) <= half ? 1 : 0;
            const double echo = tissue.At(truth[v] * (SpacingMm * Eigen::Vector3d(i, j, k))) * 220.0 + 10.0 * random.Normal();
            voxels.View()(i, j, k) = static_cast<unsigned char>(std::clamp(110.0 + echo, 1.0, 255.0));
          }
      geometries.push_back(geometry);
      pyramids.push_back(BuildPyramid<unsigned char>({voxels.View(), valid.View(), geometry}));
      points.push_back(ValidPoints<unsigned char>(voxels.View(), valid.View(), 200, 1));
      starts.push_back(v == 0 ? truth[v] : KnockedPose(2026, v, 5.0, 3.0, truth[v] * Middle()) * truth[v]);
    }
  }

  static Eigen::Vector3d Middle() { return Eigen::Vector3d::Constant(0.5 * SpacingMm * (Size - 1)); }

  std::vector<PlacedVolume> Placed() const
  {
    std::vector<PlacedVolume> volumes;
    for (std::size_t v = 0; v < truth.size(); ++v)
      volumes.push_back({&pyramids[v], starts[v], "volume " + std::to_string(v)});
    return volumes;
  }

  double ErrorMm(const AlignVolumesResult& result, std::size_t v) const
  {
    double sum = 0.0;
    for (const Eigen::Vector3d& index : points[v])
      sum += (result.volumes[v].volumeToWorld * (SpacingMm * index) - truth[v] * (SpacingMm * index)).norm();
    return sum / static_cast<double>(points[v].size());
  }

  PairAligner Knowing() const
  {
    return [this](const PlacedVolume& fixed, const std::shared_ptr<const MetricPyramid>&, const PlacedVolume& moving,
                  const std::shared_ptr<const MetricPyramid>&, const AlignPairParameters&, const Progress&) {
      const std::size_t a = Index(std::stoi(fixed.name.substr(7))), b = Index(std::stoi(moving.name.substr(7)));
      PairAlignment found;
      Random random(29, a * truth.size() + b);
      found.centre = fixed.volumeToWorld * Middle();
      found.volumeToWorld = MotionAbout(found.centre, random.Direction() * 0.002, random.Direction() * 0.1) *
                            fixed.volumeToWorld * truth[a].inverse(Eigen::Isometry) * truth[b];
      found.verdict = Verdict::Aligned;
      found.overlap = found.similarity = 0.5;
      found.voxelMm = SpacingMm;
      found.information.diagonal() << Eigen::Vector3d::Constant(100.0), Eigen::Vector3d::Constant(250000.0);
      return found;
    };
  }

  std::vector<Pose> truth, starts;
  std::vector<ImageGeometry> geometries;
  std::vector<std::vector<PyramidLevel>> pyramids;
  std::vector<std::vector<Eigen::Vector3d>> points;
};

// Rows of so many, back and forth, each view tilted a little.
std::vector<Pose> Sweep(int count, int perRow, double stepMm, double rowMm)
{
  std::vector<Pose> poses;
  for (int v = 0; v < count; ++v) {
    const int row = v / perRow, column = row % 2 == 0 ? v % perRow : perRow - 1 - v % perRow;
    Random random(31, Index(v));
    poses.push_back(MotionAbout(Views::Middle(), random.Direction() * random.Uniform(0.0, 0.15),
                                Eigen::Vector3d(stepMm * column, rowMm * row, 0.0)));
  }
  return poses;
}

AlignVolumesParameters Tracked()
{
  AlignVolumesParameters p;
  p.pair.start = AlignStart::Tracked;
  p.pair.soundSpeedError = 0.0;
  p.pair.points = 20000;
  return p;
}

double MeanErrorMm(const Views& views, const AlignVolumesResult& result)
{
  double sum = 0.0;
  for (std::size_t v = 0; v < views.truth.size(); ++v)
    sum += views.ErrorMm(result, v);
  return sum / static_cast<double>(views.truth.size());
}

nlohmann::ordered_json Numbers(const AlignVolumesResult& result)
{
  return {{"pairs", result.pairs.size()},           {"prepare_seconds", result.featureSeconds},
          {"pair_seconds", result.pairSeconds},     {"graph_seconds", result.graphSeconds},
          {"times_prepared", result.timesPrepared}, {"prepared_mb", 1e-6 * result.preparedBytes}};
}

// Everything but the pairs. Beside it, which volumes overlap: as AlignVolumes finds it, and every volume against every other.
void BenchmarkSweep(int count)
{
  const std::string testCase = "sweep of " + std::to_string(count);
  const Views views(Sweep(count, 25, StepMm, RowMm));
  AlignVolumesResult result;
  const double seconds = benchmark::Seconds([&] { result = AlignVolumes(views.Placed(), 0, Tracked(), {}, views.Knowing()); });
  benchmark::Report("many_volumes", testCase, "AlignVolumes", seconds, MeanErrorMm(views, result), "mm", Numbers(result));

  const std::vector<PlacedVolume> placed = views.Placed();
  std::vector<VolumeOutline> outlines;
  const double outlineSeconds = benchmark::Seconds([&] {
    for (const PlacedVolume& volume : placed)
      outlines.emplace_back(volume);
  });
  constexpr double ReachMm = 20.0, Least = 0.1;
  std::vector<OverlappingPair> pairs;
  const auto byTree = [&] { pairs = OverlappingPairs(outlines, views.starts, ReachMm, Least, [](int, int) { return true; }); };
  std::size_t found = 0;
  const auto byAll = [&] { // as far as their spheres meet
    found = 0;
    for (std::size_t a = 0; a < placed.size(); ++a)
      for (std::size_t b = a + 1; b < placed.size(); ++b) {
        const VolumeShape &one = outlines[a].shape, &other = outlines[b].shape;
        const Eigen::Vector3d way = views.starts[a] * one.centroid - views.starts[b] * other.centroid;
        if (way.norm() - ReachMm > one.reach + other.reach)
          continue;
        const auto overlap = [&](const Eigen::Vector3d& shift) {
          PlacedVolume moved = placed[b];
          moved.volumeToWorld = Eigen::Translation3d(shift) * views.starts[b];
          return std::max(OverlapOf({placed[a]}, moved, 1000), OverlapOf({moved}, placed[a], 1000));
        };
        found += overlap(Eigen::Vector3d::Zero()) >= Least || overlap(way * std::min(1.0, ReachMm / way.norm())) >= Least;
      }
  };
  const double ours = benchmark::MedianSeconds(byTree, 3), theirs = benchmark::Seconds(byAll);
  const double missed = std::fabs(static_cast<double>(found) - static_cast<double>(pairs.size()));
  benchmark::Report("many_volumes", testCase, "overlapping pairs", ours + outlineSeconds, missed, "pairs",
                    {{"pairs", pairs.size()}});
  benchmark::Report("many_volumes", testCase, "all against all", theirs, 0.0, "pairs", {{"pairs", found}});
}

// With the pairs; the volumes are prepared from their voxels, with all the memory that they need and with a fifth of it.
void BenchmarkAligned(int count)
{
  const Views views(Sweep(count, 5, StepMm, RowMm));
  std::vector<VolumeOnDemand> volumes;
  for (std::size_t v = 0; v < views.truth.size(); ++v) {
    PlacedVolume placed = views.Placed()[v];
    placed.pyramid = nullptr;
    volumes.push_back(
        {placed,
         [&views, v](bool withReliability, const Progress& progress) {
           const PyramidLevel& voxels = views.pyramids[v].front();
           return PrepareVolume<float>({voxels.intensity.View(), {}, voxels.geometry}, withReliability, {}, progress);
         },
         {}});
  }
  AlignVolumesParameters p = Tracked();
  p.resources.memoryGb = 1000.0;
  std::vector<Pose> poses;
  for (const double share : {1.0, 0.2}) {
    AlignVolumesResult result;
    const double seconds = benchmark::Seconds([&] { result = AlignVolumesOnDemand(volumes, 0, p); });
    nlohmann::ordered_json numbers = Numbers(result);
    bool isSame = true;
    for (std::size_t v = 0; v < poses.size(); ++v)
      isSame = isSame && poses[v].matrix() == result.volumes[v].volumeToWorld.matrix();
    numbers["same"] = isSame;
    benchmark::Report("many_volumes", "aligned " + std::to_string(count),
                      share < 1.0 ? "a fifth of the memory" : "all the memory", seconds, MeanErrorMm(views, result), "mm",
                      numbers);
    for (const VolumeAlignment& volume : result.volumes)
      poses.push_back(volume.volumeToWorld);
    p.resources.memoryGb = 1e-9 * 0.2 * result.preparedBytes;
  }
}

// How far the last volume is off, and how far it says that it may be.
void BenchmarkChain(const std::string& shape, const std::vector<Pose>& truth, std::size_t farthest)
{
  const Views views(truth);
  AlignVolumesParameters p = Tracked();
  p.pair.candidates = 4;
  p.pair.maximumErrorMm = 1000.0; // what drift is worth is not the question
  p.pairsPerVolume = 4;
  AlignVolumesResult result;
  const double seconds = benchmark::Seconds([&] { result = AlignVolumes(views.Placed(), 0, p); });
  nlohmann::ordered_json numbers = Numbers(result);
  double nextMm = 0.0; // a volume beside the one before it
  for (std::size_t v = 1; v < truth.size(); ++v) {
    const Pose wanted = truth[v - 1].inverse(Eigen::Isometry) * truth[v];
    const Pose is = result.volumes[v - 1].volumeToWorld.inverse(Eigen::Isometry) * result.volumes[v].volumeToWorld;
    nextMm += (is * Views::Middle() - wanted * Views::Middle()).norm() / static_cast<double>(truth.size() - 1);
  }
  int placed = 0;
  for (const VolumeAlignment& volume : result.volumes)
    placed += volume.verdict != Verdict::Failed;
  numbers.update({{"farthest_mm", views.ErrorMm(result, farthest)},
                  {"farthest_predicted_mm", result.volumes[farthest].errorMm},
                  {"last_mm", views.ErrorMm(result, truth.size() - 1)},
                  {"next_mm", nextMm},
                  {"placed", placed},
                  {"consistency", result.consistency}});
  benchmark::Report("many_volumes", shape, "AlignVolumes", seconds, MeanErrorMm(views, result), "mm", numbers);
}

// From where they belong, at full resolution alone.
void BenchmarkNeighbours(double stepMm)
{
  constexpr std::size_t Pairs = 48;
  std::vector<Pose> poses;
  for (std::size_t v = 0; v < 2 * Pairs; ++v) {
    Random place(41, v / 2), tilt(43, v);
    const Eigen::Vector3d first(place.Uniform(0.0, 150.0), place.Uniform(0.0, 150.0), place.Uniform(0.0, 150.0));
    poses.push_back(MotionAbout(Views::Middle(), tilt.Direction() * tilt.Uniform(0.0, 0.15),
                                first + Eigen::Vector3d(v % 2 == 0 ? 0.0 : stepMm, 0.0, 0.0)));
  }
  const Views views(poses);
  const std::vector<PlacedVolume> placed = views.Placed();
  LocalAlignParameters p;
  p.points = 20000;
  p.coarsestMm = SpacingMm;
  for (const char* metric : {"local-ncc", "mind-ssc", "ncc"}) {
    double overlap = 0.0, sum = 0.0, squares = 0.0, turn = 0.0, turnSquares = 0.0;
    const double seconds = benchmark::Seconds([&] {
      for (std::size_t pair = 0; pair < Pairs; ++pair) {
        const Pose &fixed = poses[2 * pair], &moving = poses[2 * pair + 1];
        const LocalAlignResult found = LocalAlign(*BuildMetricPyramid(placed[2 * pair], metric), fixed,
                                                  *BuildMetricPyramid(placed[2 * pair + 1], metric), moving, p);
        const Pose error = found.volumeToWorld * moving.inverse(Eigen::Isometry);
        const double along = (error * found.centre - found.centre).x(),
                     about = LogRotation(error.linear()).y() * 180.0 / EIGEN_PI;
        overlap += found.overlap / Pairs;
        sum += along / Pairs;
        squares += along * along / Pairs;
        turn += about / Pairs;
        turnSquares += about * about / Pairs;
      }
    });
    benchmark::Report("many_volumes", "neighbours, step " + std::to_string(static_cast<int>(stepMm)) + " mm", metric, seconds,
                      std::sqrt(squares), "mm",
                      {{"overlap", overlap},
                       {"along_mm", sum},
                       {"along_standard_error", std::sqrt((squares - sum * sum) / Pairs)},
                       {"turn_degrees", turn},
                       {"turn_standard_error", std::sqrt((turnSquares - turn * turn) / Pairs)}});
  }
}

std::vector<Pose> Ring(int count, double stepMm)
{
  std::vector<Pose> poses;
  const double radius = count * stepMm / (2.0 * EIGEN_PI);
  for (int v = 0; v < count; ++v) {
    const double angle = 2.0 * EIGEN_PI * v / count;
    Random random(37, Index(v));
    poses.push_back(MotionAbout(Views::Middle(), random.Direction() * random.Uniform(0.0, 0.15),
                                radius * Eigen::Vector3d(std::cos(angle), std::sin(angle), 0.0)));
  }
  return poses;
}

} // namespace

int main(int argc, char** argv)
{
  const std::string which = argc > 1 ? argv[1] : "";
  if (which.empty() || which == "sweep")
    for (const int count : {5, 20, 100, 1000})
      BenchmarkSweep(count);
  if (which.empty() || which == "aligned")
    BenchmarkAligned(25);
  if (which.empty() || which == "neighbours")
    for (const double stepMm : {15.0, 32.0, 44.0})
      BenchmarkNeighbours(stepMm);
  if (which.empty() || which == "chain") {
    constexpr double ChainMm = 32.0; // neighbours overlap by a half, the next but one not at all
    BenchmarkChain("chain of 100", Sweep(100, 100, ChainMm, 0.0), 99);
    BenchmarkChain("ring of 100", Ring(100, ChainMm), 50);
    BenchmarkChain("two rows of 50", Sweep(100, 50, ChainMm, ChainMm), 50);
  }
  return 0;
}
