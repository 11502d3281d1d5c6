// SPDX-License-Identifier: BSD-3-Clause
// The points are drawn once, in the moving volume at full resolution. A level of the search picks, in each volume, the
// coarsest resolution whose voxels are not larger than its step; there the moving volume is read at the points once,
// and each of the n^6 poses reads the fixed volumes at the moved points. A pose is one affine map from the points to
// the fixed voxels.
//
// What limits the speed is memory: at full resolution the points touch more of the fixed volume than a cache holds. So
// tasks are blocks of neighbouring points, and all poses pass over a block before the next one is touched; poses of one
// level differ so little that they read the same voxels. Sums are kept per block and pose and are added in the order of
// the blocks, whichever thread did them.
//
// Cost: rounds * n^6 * points trilinear reads.
#include "Filters/Registration/Benchmarks/AlignSearch.h"
#include "Core/Base/Angles.h"
#include "Core/Base/Parallel.h"
#include "Core/Imaging/Sampling.h"
#include "Core/Imaging/ValidPoints.h"
#include "Filters/Registration/LocalAlign.h"
#include "Filters/Registration/MetricBlock.h"
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

namespace echorama {
namespace {

// The voxels of one resolution of a fixed volume, NaN where not real; at least two along each axis.
struct PlainField {
  const float* voxels;
  int nx, ny, nz;
};

// Points with the moving volume's values there, one array per component.
struct SearchPoints {
  std::vector<float> x, y, z, value;
  std::ptrdiff_t Count() const { return static_cast<std::ptrdiff_t>(x.size()); }
};

// What a pose amounts to.
struct Comparison {
  double sum = 0.0;           // of absolute differences
  std::ptrdiff_t pairs = 0;   // that were compared
  std::ptrdiff_t covered = 0; // points that lie in a fixed volume

  double Error() const { return pairs > 0 ? sum / static_cast<double>(pairs) : std::numeric_limits<double>::infinity(); }
  void operator+=(const Comparison& c)
  {
    sum += c.sum;
    pairs += c.pairs;
    covered += c.covered;
  }
};

// Points that are read together. Their voxels fit in the second cache and stay there while all poses pass.
constexpr int ReadTogether = 512;
constexpr int SearchLanes = 16;

// One corner of a cell: adds weight w and the weighted difference to v0, unless the corner is not real.
inline void AddCorner(float v, float v0, float w, float& sum, float& weights)
{
  const float real = v == v ? w : 0.0f;
  sum += real > 0.0f ? w * (v - v0) : 0.0f;
  weights += real;
}

// Reads a field at up to BlockSize moved points: the difference to the values they carry, and whether they lie inside.
// The reading is Sampler::Linear in single precision on voxels that are their own mask: the nearest voxel decides what is
// inside, corners that are not real have no say. No branches, so that compilers make it wide.
void Differences(const PlainField& field, const Map& m, const float* px, const float* py, const float* pz, const float* value,
                 int count, float* difference, int* inside)
{
  const float* voxels = field.voxels;
  const int row = field.nx, slice = field.nx * field.ny;
  const int lastX = field.nx - 2, lastY = field.ny - 2, lastZ = field.nz - 2;
  const float endX = static_cast<float>(field.nx - 1), endY = static_cast<float>(field.ny - 1),
              endZ = static_cast<float>(field.nz - 1);
  for (int p = 0; p < count; ++p) {
    const float x = m.xx * px[p] + m.xy * py[p] + m.xz * pz[p] + m.x0;
    const float y = m.yx * px[p] + m.yy * py[p] + m.yz * pz[p] + m.y0;
    const float z = m.zx * px[p] + m.zy * py[p] + m.zz * pz[p] + m.z0;
    const float cx = x > 0.0f ? (x < endX ? x : endX) : 0.0f;
    const float cy = y > 0.0f ? (y < endY ? y : endY) : 0.0f;
    const float cz = z > 0.0f ? (z < endZ ? z : endZ) : 0.0f;
    const int ix = static_cast<int>(cx), iy = static_cast<int>(cy), iz = static_cast<int>(cz);
    const int i = ix < lastX ? ix : lastX, j = iy < lastY ? iy : lastY, k = iz < lastZ ? iz : lastZ;
    const float tx = cx - static_cast<float>(i), ty = cy - static_cast<float>(j), tz = cz - static_cast<float>(k);
    const int c = k * slice + j * row + i;
    const float v0 = voxels[c + (tx >= 0.5f ? 1 : 0) + (ty >= 0.5f ? row : 0) + (tz >= 0.5f ? slice : 0)];
    const int in =
        (x >= -0.5f) & (y >= -0.5f) & (z >= -0.5f) & (x < endX + 0.5f) & (y < endY + 0.5f) & (z < endZ + 0.5f) & (v0 == v0);
    const float ux = 1.0f - tx, uy = 1.0f - ty, uz = 1.0f - tz;
    float sum = 0.0f, weights = 0.0f;
    AddCorner(voxels[c], v0, ux * uy * uz, sum, weights);
    AddCorner(voxels[c + 1], v0, tx * uy * uz, sum, weights);
    AddCorner(voxels[c + row], v0, ux * ty * uz, sum, weights);
    AddCorner(voxels[c + row + 1], v0, tx * ty * uz, sum, weights);
    AddCorner(voxels[c + slice], v0, ux * uy * tz, sum, weights);
    AddCorner(voxels[c + slice + 1], v0, tx * uy * tz, sum, weights);
    AddCorner(voxels[c + slice + row], v0, ux * ty * tz, sum, weights);
    AddCorner(voxels[c + slice + row + 1], v0, tx * ty * tz, sum, weights);
    const float v = v0 + sum / weights;
    difference[p] = in ? std::fabs(v - value[p]) : 0.0f;
    inside[p] = in;
  }
}

// Compares a block of points with every field. Sums run in lanes of their own, so that their order, and with it the last
// digit, does not depend on how wide the machine is.
Comparison Compare(const std::vector<PlainField>& fields, const Map* maps, const SearchPoints& points, std::ptrdiff_t begin,
                   int count)
{
  Comparison result;
  float difference[ReadTogether];
  int inside[ReadTogether], covered[ReadTogether] = {};
  for (std::size_t f = 0; f < fields.size(); ++f) {
    Differences(fields[f], maps[f], &points.x[begin], &points.y[begin], &points.z[begin], &points.value[begin], count, difference,
                inside);
    float lanes[SearchLanes] = {};
    int pairs = 0, p = 0;
    for (; p + SearchLanes <= count; p += SearchLanes)
      for (int lane = 0; lane < SearchLanes; ++lane)
        lanes[lane] += difference[p + lane];
    for (; p < count; ++p)
      lanes[0] += difference[p];
    for (p = 0; p < count; ++p) {
      pairs += inside[p];
      covered[p] |= inside[p];
    }
    for (const float lane : lanes)
      result.sum += static_cast<double>(lane);
    result.pairs += pairs;
  }
  for (int p = 0; p < count; ++p)
    result.covered += covered[p];
  return result;
}

double LargestSpacing(const PyramidLevel& level)
{
  return level.geometry.spacing.maxCoeff();
}

// The coarsest resolution with voxels not larger than \a spacing; the finest when there is none.
const PyramidLevel& LevelFor(const PlacedVolume& volume, double spacing)
{
  const auto& levels = *volume.pyramid;
  std::size_t chosen = 0;
  while (chosen + 1 < levels.size() && LargestSpacing(levels[chosen + 1]) <= spacing)
    ++chosen;
  return levels[chosen];
}

// The fixed volumes at one resolution, ready to be compared with moved points.
class Target {
public:
  Target(const std::vector<PlacedVolume>& fixed, double spacing)
  {
    for (const PlacedVolume& volume : fixed) {
      const PyramidLevel& level = LevelFor(volume, spacing);
      const VolumeView<const float> view = level.intensity.View();
      const auto& n = view.Dimensions();
      fields_.push_back({view.Data(), n[0], n[1], n[2]});
      worldToIndex_.push_back(level.geometry.Moved(volume.volumeToWorld).WorldToIndex());
    }
  }

  /// Compares the points at each of the poses.
  std::vector<Comparison> At(const std::vector<Pose>& poses, const SearchPoints& points, const Progress& progress) const
  {
    const std::size_t fields = fields_.size();
    std::vector<Map> maps;
    maps.reserve(poses.size() * fields);
    for (const Pose& pose : poses)
      for (const Eigen::Affine3d& toIndex : worldToIndex_)
        maps.push_back(MapOf(Eigen::Affine3d(toIndex.matrix() * pose.matrix())));
    // Neighbouring blocks form a task when there are many, so that the parts of the sums stay few.
    const std::ptrdiff_t blocks = (points.Count() + ReadTogether - 1) / ReadTogether, blocksPerTask = (blocks + 63) / 64;
    const std::ptrdiff_t tasks = (blocks + blocksPerTask - 1) / blocksPerTask;
    const std::size_t share = poses.size();
    std::vector<Comparison> parts(static_cast<std::size_t>(tasks) * share), sums(share);
    ParallelFor(tasks, progress, [&](std::ptrdiff_t task) {
      Comparison* part = &parts[static_cast<std::size_t>(task) * share];
      for (std::ptrdiff_t block = task * blocksPerTask; block < std::min(blocks, (task + 1) * blocksPerTask); ++block) {
        const std::ptrdiff_t begin = block * ReadTogether;
        const int count = static_cast<int>(std::min<std::ptrdiff_t>(ReadTogether, points.Count() - begin));
        for (std::size_t i = 0; i < share; ++i)
          part[i] += Compare(fields_, &maps[i * fields], points, begin, count);
      }
    });
    for (std::size_t part = 0; part < parts.size(); ++part)
      sums[part % share] += parts[part];
    return sums;
  }

private:
  std::vector<PlainField> fields_;
  std::vector<Eigen::Affine3d> worldToIndex_;
};

// The points (mm, as the geometry of the volume stands, relative to \a centre) with the volume's values at one
// resolution. Points that the coarse volume does not hold are left out.
SearchPoints Read(const PyramidLevel& level, const std::vector<Eigen::Vector3d>& world, const Eigen::Vector3d& centre)
{
  const Sampler<float> sampler(level.intensity.View(), {});
  const Eigen::Affine3d toIndex = level.geometry.WorldToIndex();
  SearchPoints points;
  for (const Eigen::Vector3d& p : world) {
    const Eigen::Vector3d at = toIndex * p;
    double value = 0.0;
    if (!sampler.Linear(at.x(), at.y(), at.z(), value))
      continue;
    points.x.push_back(static_cast<float>(p.x() - centre.x()));
    points.y.push_back(static_cast<float>(p.y() - centre.y()));
    points.z.push_back(static_cast<float>(p.z() - centre.z()));
    points.value.push_back(static_cast<float>(value));
  }
  return points;
}

std::string Percent(double share)
{
  char text[32];
  std::snprintf(text, sizeof text, "%.1f%%", 100.0 * share);
  return text;
}

// Offset number i of a level's n^6, in steps: three of the rotation, three of the translation.
std::array<int, 6> OffsetOf(std::ptrdiff_t i, int n)
{
  std::array<int, 6> offset;
  for (int d = 0; d < 6; ++d, i /= n)
    offset[d] = static_cast<int>(i % n) - n / 2;
  return offset;
}

// The moving volume, ready for the search: the points drawn, its centre found.
struct Moving {
  Moving(const PyramidLevel& level, const AlignSearchParameters& p)
  {
    const Eigen::Affine3d toWorld = level.geometry.IndexToWorld();
    std::ptrdiff_t real = 0;
    centre = toWorld * ValidCentroid<float>(level.intensity.View(), {}, real);
    points = ValidPoints<float>(level.intensity.View(), {}, p.points, p.seed);
    for (Eigen::Vector3d& point : points)
      point = toWorld * point;
  }
  Eigen::Vector3d centre; // as the geometry stands, mm
  std::vector<Eigen::Vector3d> points;
};

// From points relative to the centre to where a pose of the volume takes them.
Pose FromCentre(const Pose& volumeToWorld, const Eigen::Vector3d& centre)
{
  Pose pose = volumeToWorld;
  pose.translation() = volumeToWorld * centre;
  return pose;
}

} // namespace

ParameterList Describe(AlignSearchParameters& p)
{
  return {
      Parameter("MinimumOverlap", p.minimumOverlap, {0.01, 1}, "",
                "The share of the moving volume that must lie in others for a pose to count."),
      Parameter("Samples", p.samples, {3, 7}, "", "Poses tried along each of the six dimensions: 3, 5 or 7."),
      Parameter("Levels", p.levels, {1, 20}, "", "How often the steps are halved, plus one."),
      Parameter("FirstStepMm", p.firstStepMm, {0, 1000, true}, "mm", "Between poses on the first level."),
      Parameter("FirstStepDegrees", p.firstStepDegrees, {0, 60, true}, "degrees", "Between poses on the first level."),
      Parameter("Repeats", p.repeats, {0, 100}, "",
                "How often a level starts again from a better pose. 0 is the dissertation's search."),
      Parameter("Points", p.points, ComparedPoints, "", "Random points of the moving volume that are compared."),
      Parameter("Pyramid", p.pyramid,
                "Whether averaged volumes are compared while steps are larger than voxels, or always the finest."),
  };
}

void AlignSearchParameters::Check() const
{
  CheckRanges(*this);
  if (samples % 2 == 0)
    throw Error(Error::Kind::InvalidParameter, "Samples is " + std::to_string(samples) + "; it must be 3, 5 or 7");
}

AlignSearchResult AlignSearch(const std::vector<PlacedVolume>& fixed, const PlacedVolume& moving, const AlignSearchParameters& p,
                              const Progress& progress)
{
  p.Check();
  if (fixed.empty())
    throw Error(Error::Kind::BadInput, "two volumes are needed: there is none to align " + moving.name + " with");
  for (const PlacedVolume& volume : fixed)
    CheckPlacedVolume(volume);
  CheckPlacedVolume(moving);

  const Moving drawn(moving.pyramid->front(), p);
  const int n = p.samples;
  const std::ptrdiff_t candidates = static_cast<std::ptrdiff_t>(n) * n * n * n * n * n, middle = candidates / 2;

  AlignSearchResult result;
  result.volumeToWorld = moving.volumeToWorld;
  result.centre = moving.volumeToWorld * drawn.centre;
  double stepMm = p.firstStepMm, stepDegrees = p.firstStepDegrees;
  for (int level = 0; level < p.levels; ++level, stepMm *= 0.5, stepDegrees *= 0.5) {
    const double spacing = p.pyramid ? stepMm : 0.0;
    const Target target(fixed, spacing);
    const SearchPoints points = Read(LevelFor(moving, spacing), drawn.points, drawn.centre);
    const double m = static_cast<double>(points.Count()), needed = p.minimumOverlap * m;
    AlignSearchLevel trace{stepMm, stepDegrees, LargestSpacing(LevelFor(fixed.front(), spacing)), 0, 0, 0.0, 0.0};

    // The best pose may lie beyond those tried: the same steps start again from it, as often as allowed.
    for (bool moved = true; moved && trace.rounds <= p.repeats; ++trace.rounds) {
      const Eigen::Vector3d centre = result.volumeToWorld * drawn.centre;
      std::vector<Pose> poses, fromCentre;
      for (std::ptrdiff_t i = 0; i < candidates; ++i) {
        const auto o = OffsetOf(i, n);
        poses.push_back(MotionAbout(centre, stepDegrees * RadiansPerDegree * Eigen::Vector3d(o[0], o[1], o[2]),
                                    stepMm * Eigen::Vector3d(o[3], o[4], o[5])) *
                        result.volumeToWorld);
        fromCentre.push_back(FromCentre(poses.back(), drawn.centre));
      }
      const double share = 1.0 / (p.repeats + 1.0), from = level + trace.rounds * share;
      const std::vector<Comparison> compared =
          target.At(fromCentre, points, progress.Part(from / p.levels, (from + share) / p.levels));
      result.evaluations += candidates;

      std::ptrdiff_t best = -1, most = 0;
      double bestError = std::numeric_limits<double>::infinity(), bestForbidden = bestError;
      trace.allowed = 0;
      for (std::ptrdiff_t k = 0; k < candidates; ++k) {
        const std::ptrdiff_t i = k == 0 ? middle : k <= middle ? k - 1 : k; // the pose so far comes first
        const Comparison& c = compared[static_cast<std::size_t>(i)];
        most = std::max(most, c.covered);
        if (c.pairs == 0)
          continue;
        if (static_cast<double>(c.covered) < needed) {
          bestForbidden = std::min(bestForbidden, c.Error());
          continue;
        }
        ++trace.allowed;
        if (c.Error() < bestError) {
          bestError = c.Error();
          best = i;
        }
      }
      if (most == 0)
        throw Error(Error::Kind::NotPossible, moving.name +
                                                  " does not overlap the volumes it is to be aligned with in any pose that "
                                                  "the search tried; bring it closer, or make the first step larger");
      if (best < 0)
        throw Error(Error::Kind::NotPossible, moving.name + ": no pose that the search tried reaches the minimum overlap of " +
                                                  Percent(p.minimumOverlap) + "; the largest found is " +
                                                  Percent(static_cast<double>(most) / m));
      moved = best != middle;
      if (level + 1 == p.levels && (!moved || trace.rounds == p.repeats) && bestForbidden < bestError)
        throw Error(Error::Kind::NotPossible,
                    moving.name + ": the search ended at the minimum overlap of " + Percent(p.minimumOverlap) +
                        ", and less overlap would fit better still; lower it if the volumes overlap less than that");
      result.error = trace.error = bestError;
      result.overlap = trace.overlap = static_cast<double>(compared[static_cast<std::size_t>(best)].covered) / m;
      result.volumeToWorld = poses[static_cast<std::size_t>(best)];
    }
    result.trace.push_back(trace);
  }
  progress(1.0);
  // Some products of rotations later: back to a rotation to the last digit.
  result.volumeToWorld.linear() = Eigen::Quaterniond(result.volumeToWorld.linear()).normalized().toRotationMatrix();
  return result;
}

} // namespace echorama
