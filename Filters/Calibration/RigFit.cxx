// SPDX-License-Identifier: BSD-3-Clause
// Candidates: local maxima that are bright beside what lies around them across the beam, and before them along it. The glass
// plate is brighter than any ball, but just as bright all around. Each candidate is the top of a cap, so a ball of radius r has
// its centre r further along the beam.
//
// Matching: two candidates whose distance is that of two balls, and a third whose distances to both are those of a third ball,
// give a pose by three points. It is scored by the balls that then lie at a candidate. Ball by ball radii differ, so that the
// centres of a candidate differ, too, by which ball it is taken for. Some 10^5 triples are tried, a microsecond each.
//
// Refinement: voxels of a cap are put where they are (depths divided by the scale), and a sphere of the ball's radius is fitted
// to them, weighted by how bright they are. Where a cap is brightest it faces the probe, so the bright middle must lie on the
// beam through the centre, which ties the centre down across the beam better than a shallow cap's curvature does. Poses follow
// from the centres by least squares; the scale is the one with which the centres fit best, by a parabola through a search.
#include "RigFit.h"
#include "Core/Base/CheckRange.h"
#include "Core/Base/Error.h"
#include "Core/Base/NumberText.h"
#include "Core/Base/Parallel.h"
#include "Core/Base/SymmetricMatrix.h"
#include "Core/Imaging/Sampling.h"
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

namespace echorama {
namespace {

using Eigen::Vector3d;

// A volume in the frame of its probe.
class Scene {
public:
  Scene(const VolumeView<const float>& intensity, const VolumeView<const unsigned char>& valid, const ImageGeometry& geometry,
        const PlacedProbe& probe)
    : sampler_(intensity, valid), probe_(probe.geometry), probeToIndex_(geometry.WorldToIndex() * probe.probeToWorld),
      indexToProbe_(probeToIndex_.inverse()), spacing_(geometry.spacing.minCoeff()), dimensions_(geometry.dimensions)
  {
    // Beyond what was imaged a ball may still have its centre.
    wide_ = probe_;
    wide_.depthMax += 100.0;
    for (std::ptrdiff_t i = 0; i < intensity.Size(); ++i)
      if (sampler_.IsReal(i))
        brightest_ = std::max(brightest_, static_cast<double>(intensity[i]));
  }

  double Value(const Vector3d& inProbe) const
  {
    const Vector3d at = probeToIndex_ * inProbe;
    double value = 0.0;
    sampler_.Linear(at.x(), at.y(), at.z(), value);
    return value;
  }
  bool Real(std::ptrdiff_t index) const { return sampler_.IsReal(index); }
  Vector3d Place(int i, int j, int k) const { return indexToProbe_ * Vector3d(i, j, k); }
  Vector3d Index(const Vector3d& inProbe) const { return probeToIndex_ * inProbe; }
  double Spacing() const { return spacing_; }
  double Brightest() const { return brightest_; } ///< of the whole volume
  const std::array<int, 3>& Dimensions() const { return dimensions_; }

  // Where something truly is that the image shows at a place, and the other way; nothing outside of the fan.
  std::optional<Vector3d> True(const Vector3d& shown, double scale) const { return Scaled(shown, 1.0 / scale); }
  std::optional<Vector3d> Shown(const Vector3d& truly, double scale) const { return Scaled(truly, scale); }
  std::optional<Vector3d> Beam(const Vector3d& place) const
  {
    const auto beam = BeamPointAt(wide_, place, 0.05);
    return beam ? std::optional<Vector3d>(DirectionOf(wide_, *beam)) : std::nullopt;
  }

private:
  std::optional<Vector3d> Scaled(const Vector3d& place, double factor) const
  {
    auto beam = BeamPointAt(wide_, place, 0.05);
    if (!beam)
      return std::nullopt;
    return place + (factor - 1.0) * beam->depth * DirectionOf(wide_, *beam);
  }

  Sampler<float> sampler_;
  ProbeGeometry probe_, wide_;
  Eigen::Affine3d probeToIndex_, indexToProbe_;
  double spacing_, brightest_ = 0.0;
  std::array<int, 3> dimensions_;
};

struct Candidate {
  Vector3d top, beam; // shown
  double score = 0.0;
};

// Two unit vectors across a direction.
std::array<Vector3d, 2> Across(const Vector3d& direction)
{
  const Vector3d u = direction.unitOrthogonal();
  return {u, direction.cross(u)};
}

std::vector<Candidate> FindCandidates(const Scene& scene, const VolumeView<const float>& intensity, std::size_t count,
                                      const Progress& progress)
{
  const auto& n = scene.Dimensions();
  const auto least = static_cast<float>(0.1 * scene.Brightest());
  std::vector<std::vector<Candidate>> found(static_cast<std::size_t>(n[2]));
  ParallelFor(n[2], progress, [&](std::ptrdiff_t slice) {
    const int k = static_cast<int>(slice);
    if (k == 0 || k == n[2] - 1)
      return;
    for (int j = 1; j + 1 < n[1]; ++j)
      for (int i = 1; i + 1 < n[0]; ++i) {
        const float value = intensity(i, j, k);
        const std::ptrdiff_t index = k * intensity.SliceStride() + j * intensity.RowStride() + i;
        if (!(value > least) || !scene.Real(index))
          continue;
        bool highest = true;
        for (int c = -1; c <= 1 && highest; ++c)
          for (int b = -1; b <= 1 && highest; ++b)
            for (int a = -1; a <= 1; ++a) {
              const float other = intensity(i + a, j + b, k + c);
              if (other > value || (other == value && (c < 0 || (c == 0 && (b < 0 || (b == 0 && a < 0)))))) {
                highest = false;
                break;
              }
            }
        if (!highest)
          continue;
        Candidate candidate;
        candidate.top = scene.Place(i, j, k);
        const auto beam = scene.Beam(candidate.top);
        if (!beam)
          continue;
        candidate.beam = *beam;
        // Beside it, at the same depth, and before it, there is water.
        double around = 0.0, before = 0.0;
        const auto across = Across(*beam);
        constexpr int directions = 16;
        for (int d = 0; d < directions; ++d) {
          const double angle = 6.283185307179586 * d / directions;
          const Vector3d side = std::cos(angle) * across[0] + std::sin(angle) * across[1];
          double there = 0.0;
          for (int s = -2; s <= 2; ++s)
            there = std::max(there, scene.Value(candidate.top + 14.0 * side + s * *beam));
          around += there / directions;
        }
        for (int s = 3; s <= 10; ++s)
          before = std::max(before, scene.Value(candidate.top - s * *beam));
        candidate.score = value - 2.0 * around - before;
        if (candidate.score > 0.3 * least)
          found[static_cast<std::size_t>(k)].push_back(candidate);
      }
  });
  std::vector<Candidate> all, kept;
  for (const auto& slice : found)
    all.insert(all.end(), slice.begin(), slice.end());
  std::stable_sort(all.begin(), all.end(), [](const Candidate& a, const Candidate& b) { return a.score > b.score; });
  for (const Candidate& candidate : all) {
    if (kept.size() == count)
      break;
    const bool apart =
        std::all_of(kept.begin(), kept.end(), [&](const Candidate& other) { return (other.top - candidate.top).norm() > 4.0; });
    if (apart)
      kept.push_back(candidate);
  }
  return kept;
}

// The pose that brings \a from nearest to \a to, in the sense of least squares.
Pose Nearest(const std::vector<Vector3d>& from, const std::vector<Vector3d>& to)
{
  Vector3d a = Vector3d::Zero(), b = Vector3d::Zero();
  for (std::size_t i = 0; i < from.size(); ++i) {
    a += from[i] / static_cast<double>(from.size());
    b += to[i] / static_cast<double>(from.size());
  }
  Eigen::Matrix3d product = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < from.size(); ++i)
    product += (to[i] - b) * (from[i] - a).transpose();
  Pose pose = Pose::Identity();
  pose.linear() = NearestRotation(product); // no mirror, though three points, which lie in a plane, would fit as well
  pose.translation() = b - pose.linear() * a;
  return pose;
}

struct Match {
  Pose rigToProbe = Pose::Identity();
  int balls = 0;
  double quality = 0.0; // of matches with equally many balls
};

class Matcher {
public:
  Matcher(const Scene& scene, const std::vector<Candidate>& candidates, const std::vector<RigBall>& balls, double scale,
          double tolerance)
    : balls_(balls), tolerance_(tolerance)
  {
    for (const Candidate& candidate : candidates) {
      const auto top = scene.True(candidate.top, scale);
      if (top)
        tops_.push_back({*top, candidate.beam});
    }
  }

  // The best matches, of poses that differ, the best first.
  std::vector<Match> Find(const Progress& progress) const
  {
    const std::ptrdiff_t n = static_cast<std::ptrdiff_t>(tops_.size()), m = static_cast<std::ptrdiff_t>(balls_.size());
    std::vector<std::vector<Match>> found(static_cast<std::size_t>(n));
    ParallelFor(n, progress, [&](std::ptrdiff_t i) {
      std::vector<Match>& mine = found[static_cast<std::size_t>(i)];
      for (std::ptrdiff_t j = 0; j < n; ++j)
        for (std::ptrdiff_t a = 0; j != i && a < m; ++a)
          for (std::ptrdiff_t b = a + 1; b < m; ++b) {
            if (!Agree(i, a, j, b))
              continue;
            for (std::ptrdiff_t l = 0; l < n; ++l)
              for (std::ptrdiff_t c = b + 1; l != i && l != j && c < m; ++c)
                if (Agree(i, a, l, c) && Agree(j, b, l, c))
                  Keep(mine, Score(Nearest({Ball(a).centre, Ball(b).centre, Ball(c).centre},
                                           {Centre(i, a), Centre(j, b), Centre(l, c)})));
          }
    });
    std::vector<Match> best;
    for (const auto& matches : found)
      for (const Match& match : matches)
        Keep(best, match);
    return best;
  }

private:
  struct Top {
    Vector3d place, beam;
  };

  const RigBall& Ball(std::ptrdiff_t ball) const { return balls_[static_cast<std::size_t>(ball)]; }

  Vector3d Centre(std::ptrdiff_t top, std::ptrdiff_t ball) const
  {
    const Top& seen = tops_[static_cast<std::size_t>(top)];
    return seen.place + Ball(ball).radius * seen.beam;
  }

  bool Agree(std::ptrdiff_t i, std::ptrdiff_t a, std::ptrdiff_t j, std::ptrdiff_t b) const
  {
    const double apart = (Ball(a).centre - Ball(b).centre).norm();
    return std::abs((Centre(i, a) - Centre(j, b)).norm() - apart) < tolerance_;
  }

  Match Score(const Pose& pose) const
  {
    // Again with all balls that lie at a candidate: three points leave much room.
    Match match;
    match.rigToProbe = pose;
    for (int round = 0; round < 3; ++round) {
      std::vector<Vector3d> from, to;
      double residual = 0.0;
      for (std::size_t b = 0; b < balls_.size(); ++b) {
        const Vector3d place = match.rigToProbe * balls_[b].centre;
        double nearest = tolerance_;
        Vector3d at;
        for (std::size_t t = 0; t < tops_.size(); ++t) {
          const Vector3d centre = Centre(static_cast<std::ptrdiff_t>(t), static_cast<std::ptrdiff_t>(b));
          const double away = (centre - place).norm();
          if (away < nearest) {
            nearest = away;
            at = centre;
          }
        }
        if (nearest < tolerance_) {
          from.push_back(balls_[b].centre);
          to.push_back(at);
          residual += nearest * nearest;
        }
      }
      match.balls = static_cast<int>(from.size());
      match.quality = -residual;
      if (match.balls < 3)
        return match;
      match.rigToProbe = Nearest(from, to);
    }
    return match;
  }

  // A short list of the best, one of each pose.
  void Keep(std::vector<Match>& list, const Match& match) const
  {
    constexpr std::size_t longest = 8;
    if (match.balls < 3)
      return;
    const auto better = [](const Match& a, const Match& b) {
      return a.balls != b.balls ? a.balls > b.balls : a.quality > b.quality;
    };
    for (Match& other : list)
      if (Same(other, match)) {
        if (better(match, other))
          other = match;
        return;
      }
    list.push_back(match);
    std::stable_sort(list.begin(), list.end(), better);
    if (list.size() > longest)
      list.pop_back();
  }

  bool Same(const Match& a, const Match& b) const
  {
    double apart = 0.0;
    for (const RigBall& ball : balls_)
      apart = std::max(apart, (a.rigToProbe * ball.centre - b.rigToProbe * ball.centre).norm());
    return apart < 2.0 * tolerance_;
  }

  const std::vector<RigBall>& balls_;
  double tolerance_;
  std::vector<Top> tops_;
};

// Whether the image shows a cap around a centre (true): bright over most of what faces the probe, with water before it. Dust is
// bright in one place alone, noise nowhere.
bool ShowsCap(const Scene& scene, const Vector3d& centre, double radius, double scale)
{
  const auto beam = scene.Beam(centre);
  if (!beam)
    return false;
  const auto across = Across(*beam);
  const auto brightest = [&](const Vector3d& direction, double from, double to) {
    double value = 0.0;
    for (double distance = from; distance <= to; distance += 0.5)
      if (const auto shown = scene.Shown(centre + distance * direction, scale))
        value = std::max(value, scene.Value(*shown));
    return value;
  };
  std::vector<double> cap;
  double water = 0.0, largest = 0.0;
  for (const double angle : {0.0, 0.2, 0.4})
    for (int d = 0; d < (angle == 0.0 ? 1 : 8); ++d) {
      const double turn = 0.7853981633974483 * d;
      const Vector3d direction =
          -std::cos(angle) * *beam + std::sin(angle) * (std::cos(turn) * across[0] + std::sin(turn) * across[1]);
      cap.push_back(brightest(direction, radius - 1.5, radius + 1.5));
      water += brightest(direction, radius + 4.0, radius + 6.0) / 17.0;
      largest = std::max(largest, cap.back());
    }
  const auto bright = std::count_if(cap.begin(), cap.end(), [&](double value) { return value > 0.3 * largest; });
  return largest > 0.08 * scene.Brightest() && largest > 3.0 * water && 2 * static_cast<std::size_t>(bright) > cap.size();
}

// The centre of a ball near \a guess (true), by the cap that the image shows; nothing where there is none.
std::optional<Vector3d> FitBall(const Scene& scene, const VolumeView<const float>& intensity, const Vector3d& guess,
                                double radius, double scale, double tolerance)
{
  struct Echo {
    Vector3d place;
    double weight;
  };
  const auto shown = scene.Shown(guess, scale);
  const auto beam = scene.Beam(guess);
  if (!shown || !beam)
    return std::nullopt;
  // All echoes around the cap.
  const double reach = radius + tolerance + 1.0;
  const Vector3d middle = scene.Index(*shown);
  const int steps = static_cast<int>(std::ceil(reach / scene.Spacing()));
  std::vector<Echo> echoes;
  double brightest = 0.0;
  for (int k = -steps; k <= steps; ++k)
    for (int j = -steps; j <= steps; ++j)
      for (int i = -steps; i <= steps; ++i) {
        const Eigen::Array3i at = (middle.array() + Eigen::Array3d(i, j, k)).round().cast<int>();
        const auto& n = scene.Dimensions();
        if ((at < 0).any() || at[0] >= n[0] || at[1] >= n[1] || at[2] >= n[2])
          continue;
        if (!scene.Real(at[2] * intensity.SliceStride() + at[1] * intensity.RowStride() + at[0]))
          continue;
        const double value = intensity(at[0], at[1], at[2]);
        if (!(value > 0.0))
          continue;
        const auto place = scene.True(scene.Place(at[0], at[1], at[2]), scale);
        if (!place)
          continue;
        const Vector3d away = *place - guess;
        const double distance = away.norm();
        if (std::abs(distance - radius) > tolerance || away.dot(*beam) > -0.3 * distance)
          continue;
        echoes.push_back({*place, value});
        brightest = std::max(brightest, value);
      }
  if (echoes.size() < 8)
    return std::nullopt;
  for (Echo& echo : echoes)
    echo.weight = std::max(0.0, echo.weight - 0.4 * brightest);
  Vector3d centre = guess;
  for (int round = 0; round < 20; ++round) {
    const Vector3d direction = scene.Beam(centre).value_or(*beam);
    Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
    Vector3d right = Vector3d::Zero(), centroid = Vector3d::Zero();
    double total = 0.0;
    for (const Echo& echo : echoes) {
      const Vector3d away = echo.place - centre;
      const double distance = away.norm();
      // Echoes of something else near by count less and less.
      const double off = (distance - radius) / 1.5, weight = echo.weight / (1.0 + off * off);
      if (distance < 1e-6 || weight <= 0.0)
        continue;
      const Vector3d jacobian = -away / distance;
      normal += weight * jacobian * jacobian.transpose();
      right -= weight * (distance - radius) * jacobian;
      centroid += weight * echo.place;
      total += weight;
    }
    if (!(total > 0.0))
      return std::nullopt;
    centroid /= total;
    // The bright middle lies on the beam through the centre.
    const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - direction * direction.transpose();
    normal += 0.5 * total * across;
    right += 0.5 * total * across * (centroid - centre);
    const Vector3d step = SolveSymmetric(normal, right);
    centre += step;
    if (step.norm() < 1e-4)
      break;
  }
  return (centre - guess).norm() < 2.0 * tolerance && ShowsCap(scene, centre, radius, scale) ? std::optional<Vector3d>(centre)
                                                                                             : std::nullopt;
}

struct RefinedPose {
  Pose pose = Pose::Identity();
  double squared = 0.0;
  std::vector<std::optional<Vector3d>> centres;
  int found = 0;
};

RefinedPose Refine(const Scene& scene, const VolumeView<const float>& intensity, const std::vector<RigBall>& balls, Pose pose,
                   double scale, double tolerance)
{
  RefinedPose refined;
  for (int round = 0; round < 4; ++round) {
    refined = {};
    std::vector<Vector3d> from, to;
    for (const RigBall& ball : balls) {
      const Vector3d place = pose * ball.centre;
      refined.centres.push_back(FitBall(scene, intensity, place, ball.radius, scale, tolerance));
      if (refined.centres.back()) {
        from.push_back(ball.centre);
        to.push_back(*refined.centres.back());
      }
    }
    refined.found = static_cast<int>(from.size());
    if (refined.found < 3)
      return refined;
    pose = Nearest(from, to);
    // One that is far from where the others put it is another thing.
    for (std::size_t b = 0; b < balls.size(); ++b)
      if (refined.centres[b] && (*refined.centres[b] - pose * balls[b].centre).norm() > tolerance) {
        refined.centres[b].reset();
        --refined.found;
      }
    refined.pose = pose;
    refined.squared = 0.0;
    for (std::size_t b = 0; b < balls.size(); ++b)
      if (refined.centres[b])
        refined.squared += (*refined.centres[b] - pose * balls[b].centre).squaredNorm();
  }
  return refined;
}

} // namespace

ParameterList Describe(RigFitParameters& p)
{
  return {
      Parameter("DepthScale", p.depthScale, {0, 1.1}, "",
                "Depth in the image over true depth, at least 0.9: the scanner's speed of sound over the bath's, 1540 / 1482 in "
                "water at 20 degrees Celsius. 0: found out from the distances between the balls."),
      Parameter("ToleranceMm", p.toleranceMm, {0.1, 20}, "mm", "How far a ball may be from where the others say."),
      Parameter("FewestBalls", p.fewestBalls, {3, 1000}, "", "Balls that must be found."),
      Parameter("LargestRmsMm", p.largestRmsMm, {0.01, 20}, "mm",
                "Root mean square distance of the balls from where the pose puts them, at most."),
      Parameter("Candidates", p.candidates, {4, 1000}, "", "The volume's brightest echoes of their kind, that may be balls."),
  };
}

void RigFitParameters::Check() const
{
  CheckRanges(*this);
  if (depthScale != 0.0)
    CheckRange("rig fit: DepthScale", depthScale, 0.9, 1.1);
}

RigFit FitRig(const VolumeView<const float>& intensity, const VolumeView<const unsigned char>& valid,
              const ImageGeometry& geometry, const PlacedProbe& probe, const std::vector<RigBall>& balls,
              const RigFitParameters& p, const Progress& progress)
{
  p.Check();
  probe.geometry.Check();
  for (const RigBall& ball : balls)
    if (!(ball.radius > 0.0 && ball.radius < 1000.0 && ball.centre.allFinite()))
      throw Error(Error::Kind::BadInput, "rig fit: the ball " + ball.name + " needs a centre and a radius above 0");
  if (static_cast<int>(balls.size()) < p.fewestBalls)
    throw Error(Error::Kind::BadInput, "rig fit: the rig has " + std::to_string(balls.size()) + " balls; at least " +
                                           std::to_string(p.fewestBalls) + " are needed");
  const Scene scene(intensity, valid, geometry, probe);
  const auto candidates = FindCandidates(scene, intensity, static_cast<std::size_t>(p.candidates), progress.Part(0.0, 0.3));
  // The scale matters little for recognition: 2% of distances of some 50 mm.
  double scale = p.depthScale > 0.0 ? p.depthScale : 1.02;
  const std::vector<Match> matches = Matcher(scene, candidates, balls, scale, p.toleranceMm).Find(progress.Part(0.3, 0.7));
  const int most = matches.empty() ? 0 : matches.front().balls;
  if (most < p.fewestBalls)
    throw Error(Error::Kind::NotPossible, "rig fit: the rig was not found: of " + std::to_string(candidates.size()) +
                                              " candidate echoes at most " + std::to_string(most) +
                                              " match the layout of the rig");

  // The few best are refined; what counts is how well they fit then.
  std::vector<RefinedPose> fits;
  for (const Match& match : matches)
    if (match.balls + 1 >= most)
      fits.push_back(Refine(scene, intensity, balls, match.rigToProbe, scale, p.toleranceMm));
  RefinedPose best = *std::min_element(fits.begin(), fits.end(), [](const RefinedPose& a, const RefinedPose& b) {
    return a.found != b.found ? a.found > b.found : a.squared < b.squared;
  });
  const auto check = [&] {
    if (best.found < p.fewestBalls)
      throw Error(Error::Kind::NotPossible,
                  "rig fit: the rig was not found: at most " + std::to_string(best.found) + " balls match");
    const double rms = std::sqrt(best.squared / best.found);
    if (!(rms <= p.largestRmsMm))
      throw Error(Error::Kind::NotPossible, "rig fit: the rig was not found: where it would fit best, " +
                                                std::to_string(best.found) + " balls lie " +
                                                NumberText(std::round(100.0 * rms) / 100.0) +
                                                " mm (RMS) from their places, more than " + NumberText(p.largestRmsMm));
  };
  check();
  for (const RefinedPose& other : fits) {
    double apart = 0.0;
    for (const RigBall& ball : balls)
      apart = std::max(apart, (other.pose * ball.centre - best.pose * ball.centre).norm());
    if (other.found == best.found && apart > 2.0 * p.toleranceMm && other.squared < 2.0 * best.squared)
      throw Error(Error::Kind::NotPossible, "rig fit: two poses of the rig explain " + std::to_string(best.found) +
                                                " balls equally well; a scan that shows more balls is needed");
  }
  progress(0.75);

  RigFit fit;
  if (p.depthScale == 0.0) {
    // The sum of squares is a parabola near its minimum: coarse to fine around it.
    const auto cost = [&](double at) {
      const RefinedPose refined = Refine(scene, intensity, balls, best.pose, at, p.toleranceMm);
      return refined.found < best.found ? 1e30 : refined.squared;
    };
    double step = 0.01;
    double here = cost(scale);
    for (int round = 0; round < 24 && step > 2e-4; ++round) {
      const double low = scale - step >= 0.9 ? cost(scale - step) : 1e30, high = scale + step <= 1.1 ? cost(scale + step) : 1e30;
      if (low < here && low <= high) {
        scale -= step;
        here = low;
      } else if (high < here) {
        scale += step;
        here = high;
      } else {
        step *= 0.5;
      }
      progress(0.75 + 0.01 * round);
    }
    constexpr double h = 0.01;
    const double curvature = (cost(scale - h) + cost(scale + h) - 2.0 * here) / (h * h);
    // Unknowns: six of the pose, and this one.
    const double variance = here / std::max(1, 3 * best.found - 7);
    fit.depthScaleError = curvature > 0.0 && curvature < 1e20 ? std::sqrt(2.0 * variance / curvature) : 0.1;
    best = Refine(scene, intensity, balls, best.pose, scale, p.toleranceMm);
    check();
  }
  fit.rigToProbe = best.pose;
  fit.depthScale = scale;
  fit.found = best.found;
  fit.rmsMm = std::sqrt(best.squared / best.found);
  for (std::size_t b = 0; b < balls.size(); ++b) {
    RigFit::Ball ball;
    ball.name = balls[b].name;
    ball.found = best.centres[b].has_value();
    const Vector3d place = best.pose * balls[b].centre;
    ball.centre = best.centres[b].value_or(place);
    ball.residualMm = (ball.centre - place).norm();
    fit.balls.push_back(ball);
  }
  progress(1.0);
  return fit;
}

} // namespace echorama
