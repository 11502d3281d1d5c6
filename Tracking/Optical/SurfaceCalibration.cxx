// SPDX-License-Identifier: BSD-3-Clause
// A fit takes a fraction of a second, so it is made anew whenever a tenth more marks are there. It always begins at the nominal
// lens: then it depends on what was taken alone, not on the way there. How the camera is turned about its axis is found by
// trying: the turn whose marks lie nearest to where they were seen, by their median, which wrong marks do not move.
#include "SurfaceCalibration.h"
#include "Core/Base/Angles.h"
#include "Core/Base/FormatText.h"
#include "Core/Base/Percentile.h"
#include <algorithm>
#include <cmath>
#include <numeric>

namespace echorama {

namespace {

constexpr double GrowthOfFits = 1.1;       // marks from fit to fit
constexpr int MarksToJudgeBrightness = 20; // before that nobody knows how bright a touching light is
constexpr double KnownBrightness = 0.125;  // of the picture's width: how near one must have been
constexpr int TriedTurns = 36;             // of the camera about its axis
constexpr int CoverageColumns = 40;        // of places in the picture where a map is measured
constexpr double EnoughCoverage = 0.9, EnoughFall = 0.95, EnoughOwn = 0.5, EarlierMarks = 0.75;
constexpr double Radius95 = 2.4477; // of a plane's normal distribution, over its standard deviation

int MarkNumber(std::size_t index)
{
  return static_cast<int>(index) + 1;
}

// 0, 2, 1, 3 of four passes: each into the middle of the largest gap.
std::vector<int> OffsetsOfPasses(int passes)
{
  int count = 1;
  while (count < passes)
    count *= 2;
  std::vector<int> offsets;
  for (int i = 0; i < count; ++i) {
    int offset = 0; // the bits of i, the other way round
    for (int bit = 1, value = count / 2; bit < count; bit *= 2, value /= 2)
      offset += (i & bit) != 0 ? value : 0;
    if (offset < passes)
      offsets.push_back(offset);
  }
  return offsets;
}

// From a mark to the one that is nearest but \a rank others.
double NeighbourMm(const std::vector<Eigen::Vector3d>& marks, std::size_t mark, std::size_t rank)
{
  std::vector<double> distances;
  for (std::size_t i = 0; i < marks.size(); ++i)
    if (i != mark)
      distances.push_back((marks[i] - marks[mark]).norm());
  const auto nth = distances.begin() + static_cast<std::ptrdiff_t>(std::min(rank, distances.size() - 1));
  std::nth_element(distances.begin(), nth, distances.end());
  return *nth;
}

} // namespace

ParameterList Describe(SurfaceCalibrationParameters& p)
{
  return Join(
      {Describe(p.rest),
       {Parameter("Passes", p.passes, {1, 16}, "", "Marks come thinned out, in so many passes: 1 is one after the other."),
        Parameter("MarksForMap", p.marksForMap, {12, 1000}, "", "With so many marks the map is fitted first."),
        Parameter("NearMm", p.nearMm, {0.1, 100}, "mm", "A light that rests within this of a mark rests on it."),
        Parameter("WantedMm", p.wantedMm, {0.01, 100}, "mm", "The accuracy that is wanted, in 95% of places.")},
       Describe(p.map)});
}

SurfaceCalibration::SurfaceCalibration(std::vector<Eigen::Vector3d> marks, std::shared_ptr<const TrackedSkin> skin,
                                       const FisheyeLens& lens, const Pose& cameraToShell,
                                       const SurfaceCalibrationParameters& parameters)
  : marks_(std::move(marks)), skin_(std::move(skin)), lens_(lens), cameraToShell_(cameraToShell), parameters_(parameters),
    rest_(parameters.rest), wasRepeated_(marks_.size(), false)
{
  CheckRanges(parameters);
  lens.Check();
  if (!cameraToShell.matrix().allFinite() || !IsRotation(cameraToShell.linear()))
    throw Error(Error::Kind::InvalidParameter, "the place of the camera in the shell is not a rigid transform");
  if (static_cast<int>(marks_.size()) < parameters.marksForMap)
    throw Error(Error::Kind::BadInput, Format("a calibration needs %d marks at least; there are %d", parameters.marksForMap,
                                              static_cast<int>(marks_.size())));
  for (std::size_t i = 0; i < marks_.size(); ++i) {
    const auto place = skin_->NearestTo(marks_[i]);
    if (!place)
      throw Error(Error::Kind::BadInput, Format("mark %d is not finite", MarkNumber(i)));
    if (place->distanceMm > parameters.map.mostFromSkinMm)
      throw Error(Error::Kind::BadInput, Format("mark %d lies %.1f mm from the skin: are these the marks of this mesh?",
                                                MarkNumber(i), place->distanceMm));
  }
  for (const int offset : OffsetsOfPasses(parameters.passes))
    for (std::size_t i = static_cast<std::size_t>(offset); i < marks_.size(); i += static_cast<std::size_t>(parameters.passes))
      todo_.push_back(MarkNumber(i));
  status_.marks = static_cast<int>(marks_.size());
}

void SurfaceCalibration::Skip()
{
  if (todo_.size() > 1)
    std::rotate(todo_.begin(), todo_.begin() + 1, todo_.end());
  refused_.reset();
}

void SurfaceCalibration::Back()
{
  if (!history_.empty())
    GoTo(history_.back());
}

void SurfaceCalibration::GoTo(int mark)
{
  if (mark < 1 || mark > status_.marks)
    throw Error(Error::Kind::InvalidParameter, Format("there is no mark %d; there are 1 to %d", mark, status_.marks));
  todo_.erase(std::remove(todo_.begin(), todo_.end(), mark), todo_.end());
  todo_.push_front(mark);
  history_.erase(std::remove(history_.begin(), history_.end(), mark), history_.end());
  if (taken_.erase(mark) > 0)
    isFresh_ = false;
  status_.taken = static_cast<int>(taken_.size());
  refused_.reset();
}

bool SurfaceCalibration::LooksLifted(const RestingLight& rest) const
{
  if (static_cast<int>(taken_.size()) < MarksToJudgeBrightness)
    return false;
  const double known = KnownBrightness * lens_.width;
  if (std::none_of(taken_.begin(), taken_.end(),
                   [&](const auto& item) { return (item.second.contact.position - rest.position).norm() < known; }))
    return false;
  return rest.TouchBy(Brightness()) == Touch::Hover;
}

// The mark that a light rests on, by the map; 0: none.
int SurfaceCalibration::OwnerOf(const MappedPoint& mapped, int asked) const
{
  const double near = std::max(parameters_.nearMm, 4.0 * std::hypot(mapped.SigmaMm(), status_.scatterMm));
  if ((mapped.point - PlaceOf(asked)).norm() <= near)
    return asked;
  const auto nearest = std::min_element(marks_.begin(), marks_.end(), [&](const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
    return (a - mapped.point).squaredNorm() < (b - mapped.point).squaredNorm();
  });
  return (*nearest - mapped.point).norm() <= near ? MarkNumber(static_cast<std::size_t>(nearest - marks_.begin())) : 0;
}

CalibrationStep SurfaceCalibration::Update(const TrackedLight& light)
{
  CalibrationStep step;
  const auto rest = rest_.Update(light, Touch::Unknown);
  const int asked = Next();
  if (!rest || asked == 0)
    return step;
  step.mark = asked;
  const bool isInsisted = refused_ && (rest->position - *refused_).norm() <= parameters_.rest.leavePx;
  refused_.reset();
  if (!isInsisted && LooksLifted(*rest)) {
    step.event = CalibrationStep::Event::NotTouching;
    step.message =
        Format("the light is too weak or too wide there for one that touches the skin: press it onto mark %d, or lift it "
               "and put it there again",
               asked);
    refused_ = rest->position;
    return step;
  }
  const MappedPoint mapped = status_.hasMap ? fitted_.map.Map(rest->position, rest->covariance) : MappedPoint();
  const bool isMapped = mapped.status == MappedPoint::Status::Mapped;
  const int owner = isMapped && !isInsisted ? OwnerOf(mapped, asked) : asked;
  if (isMapped)
    step.distanceMm = (mapped.point - PlaceOf(owner > 0 ? owner : asked)).norm();
  if (owner == 0) {
    step.event = CalibrationStep::Event::Nobodys;
    step.message =
        Format("the light rests %.1f mm from mark %d, and on no other: not taken. If it is on the mark, lift it and put it "
               "there again",
               *step.distanceMm, asked);
    refused_ = rest->position;
    return step;
  }
  step.event = owner == asked ? CalibrationStep::Event::Taken : CalibrationStep::Event::TakenFor;
  step.mark = owner;
  step.message = owner == asked ? Format("mark %d taken", owner) : Format("that is mark %d, not %d: taken for it", owner, asked);
  if (isMapped)
    step.message += Format(", %.2f mm from where %d others put it", *step.distanceMm, static_cast<int>(fitted_.report.inliers));
  Take(owner, *rest);
  return step;
}

void SurfaceCalibration::Take(int mark, const RestingLight& rest)
{
  const auto index = static_cast<std::size_t>(mark) - 1;
  if (taken_.count(mark) > 0)
    wasRepeated_[index] = true;
  taken_[mark] = {{rest.position, rest.covariance, marks_[index], mark}, {rest.position, rest.peak, rest.size}};
  history_.erase(std::remove(history_.begin(), history_.end(), mark), history_.end());
  history_.push_back(mark);
  todo_.erase(std::remove(todo_.begin(), todo_.end(), mark), todo_.end());
  status_.taken = static_cast<int>(taken_.size());
  isFresh_ = false;
  const double least = fittedMarks_ > 0 ? GrowthOfFits * static_cast<double>(fittedMarks_) : parameters_.marksForMap;
  if (status_.taken < parameters_.marksForMap || (status_.taken < least && !todo_.empty()))
    return;
  try {
    Refit({});
  } catch (const Error& error) { // it goes on: marks to come may mend it
    status_.complaint = error.what();
    fittedMarks_ = taken_.size();
  }
}

std::vector<SurfaceObservation> SurfaceCalibration::Observations() const
{
  std::vector<SurfaceObservation> observations;
  for (const auto& [mark, taken] : taken_)
    observations.push_back(taken.observation);
  return observations;
}

BrightnessCalibration SurfaceCalibration::Brightness() const
{
  std::vector<ContactSample> samples;
  for (const auto& [mark, taken] : taken_)
    samples.push_back(taken.contact);
  return BrightnessCalibration::Fit(samples, lens_.width, lens_.height);
}

const FittedSurfaceMap& SurfaceCalibration::Fit(const Progress& progress)
{
  if (!isFresh_)
    Refit(progress);
  return fitted_;
}

Pose SurfaceCalibration::RoughPose(const std::vector<SurfaceObservation>& observations) const
{
  Pose best = cameraToShell_;
  double least = HUGE_VAL;
  for (int turn = 0; turn < TriedTurns; ++turn) {
    const Pose pose = cameraToShell_ * Eigen::AngleAxisd(2.0 * Pi * turn / TriedTurns, Eigen::Vector3d::UnitZ());
    const Pose shellToCamera = pose.inverse();
    std::vector<double> distances;
    for (const SurfaceObservation& observation : observations) {
      const auto pixel = lens_.Project(shellToCamera * observation.point);
      distances.push_back(pixel ? (*pixel - observation.pixel).norm() : HUGE_VAL);
    }
    const double median = Median(std::move(distances));
    if (median < least) {
      least = median;
      best = pose;
    }
  }
  return best;
}

void SurfaceCalibration::Refit(const Progress& progress)
{
  const std::vector<SurfaceObservation> observations = Observations();
  if (observations.empty())
    throw Error(Error::Kind::BadInput, "no mark has been taken");
  fitted_ = FitSurfaceMap(observations, skin_, lens_, RoughPose(observations), parameters_.map, progress);
  isFresh_ = true;
  fittedMarks_ = taken_.size();
  status_.hasMap = true;
  status_.complaint.clear();
  status_.report = fitted_.report;
  MeasureMap();
  MeasureCoverage();
  JudgeEnough();
}

// Outliers, which come again at the end, and the scatter of all others.
void SurfaceCalibration::MeasureMap()
{
  const std::vector<SurfaceObservation> observations = Observations();
  std::vector<bool> isOutlier(observations.size(), false);
  for (const SurfaceOutlier& outlier : fitted_.report.outliers)
    isOutlier[outlier.observation] = true;
  status_.outliers.clear();
  double squares = 0.0, equations = -13.0 - fitted_.report.residualFreedoms; // less what was fitted: lens, pose and residual
  for (std::size_t i = 0; i < observations.size(); ++i) {
    const SurfaceObservation& observation = observations[i];
    const MappedPoint mapped = fitted_.map.Map(observation.pixel, observation.covariance);
    const bool isMapped = mapped.status == MappedPoint::Status::Mapped;
    const double distance = isMapped ? (mapped.point - observation.point).norm() : HUGE_VAL;
    if (isOutlier[i]) {
      const bool wasRepeated = wasRepeated_[static_cast<std::size_t>(observation.mark) - 1];
      status_.outliers.push_back({observation.mark, distance, wasRepeated});
      if (!wasRepeated && std::find(todo_.begin(), todo_.end(), observation.mark) == todo_.end())
        todo_.push_back(observation.mark);
    } else {
      todo_.erase(std::remove(todo_.begin(), todo_.end(), observation.mark), todo_.end());
      if (isMapped) {
        squares += distance * distance;
        equations += 2.0;
      }
    }
  }
  status_.scatterMm = std::sqrt(squares / std::max(equations, 1.0));
  std::stable_sort(status_.outliers.begin(), status_.outliers.end(),
                   [](const CalibrationOutlier& a, const CalibrationOutlier& b) { return a.distanceMm > b.distanceMm; });
}

// Every place of the picture that shows skin belongs to the mark that is nearest in the picture, if it is near on the skin.
void SurfaceCalibration::MeasureCoverage()
{
  const SurfaceMap& map = fitted_.map;
  const Pose& cameraToShell = map.State().cameraToShell;
  struct Seen {
    std::size_t mark;
    Eigen::Vector2d pixel;
    double reachMm;
    bool isCovered;
  };
  std::vector<Seen> seen;
  double ownSquares = 0.0;
  int mapped = 0;
  for (std::size_t i = 0; i < marks_.size(); ++i) {
    const auto pixel = map.PixelOf(marks_[i]);
    if (!pixel || !lens_.Covers(*pixel))
      continue;
    const MappedPoint there = map.Map(*pixel);
    const bool isMapped = there.status == MappedPoint::Status::Mapped;
    seen.push_back({i, *pixel, NeighbourMm(marks_, i, 2), isMapped || taken_.count(MarkNumber(i)) > 0});
    if (isMapped) {
      ownSquares += 0.5 * there.covariance.trace();
      ++mapped;
    }
  }
  const double step = static_cast<double>(lens_.width) / CoverageColumns;
  int all = 0, covered = 0;
  for (double y = 0.5 * step; y < lens_.height && !seen.empty(); y += step)
    for (double x = 0.5 * step; x < lens_.width; x += step) {
      const Eigen::Vector2d pixel(x, y);
      const auto direction = map.State().optics.DirectionOf(pixel);
      const auto place =
          direction ? skin_->Along(cameraToShell.translation(), cameraToShell.linear() * *direction) : std::nullopt;
      if (!place)
        continue;
      const Seen& nearest = *std::min_element(seen.begin(), seen.end(), [&](const Seen& a, const Seen& b) {
        return (a.pixel - pixel).squaredNorm() < (b.pixel - pixel).squaredNorm();
      });
      if ((place->point - marks_[nearest.mark]).norm() > nearest.reachMm)
        continue;
      ++all;
      covered += nearest.isCovered;
    }
  status_.coverage = all > 0 ? static_cast<double>(covered) / all : 0.0;
  status_.ownMm = mapped > 0 ? Radius95 * std::sqrt(ownSquares / mapped) : HUGE_VAL;
  status_.gapMark = 0;
  status_.gapPx = 0.0;
  for (const Seen& open : seen)
    if (taken_.count(MarkNumber(open.mark)) == 0) {
      double nearest = HUGE_VAL;
      for (const auto& [mark, taken] : taken_)
        nearest = std::min(nearest, (taken.observation.pixel - open.pixel).norm());
      if (nearest > status_.gapPx) {
        status_.gapPx = nearest;
        status_.gapMark = MarkNumber(open.mark);
      }
    }
}

void SurfaceCalibration::JudgeEnough()
{
  const double now = status_.report.heldOut95Mm;
  const auto count = static_cast<double>(taken_.size());
  heldOut_.erase(
      std::remove_if(heldOut_.begin(), heldOut_.end(), [&](const auto& earlier) { return earlier.first >= taken_.size(); }),
      heldOut_.end()); // after going back
  heldOut_.emplace_back(taken_.size(), now);
  const auto earlier = std::find_if(heldOut_.rbegin(), heldOut_.rend(),
                                    [&](const auto& item) { return static_cast<double>(item.first) <= EarlierMarks * count; });
  status_.isEnough = earlier != heldOut_.rend() && status_.coverage >= EnoughCoverage && now >= EnoughFall * earlier->second &&
                     status_.ownMm <= EnoughOwn * now;
}

std::vector<std::string> CalibrationStatus::Lines(double wantedMm) const
{
  std::vector<std::string> lines;
  if (!hasMap) {
    lines.push_back(Format("%d of %d marks", taken, marks) + (complaint.empty() ? "" : "; no map yet: " + complaint));
    return lines;
  }
  lines.push_back(
      Format("%d of %d marks, %.0f%% of the skin's picture; left out and found again they are off by %.2f mm in the median, "
             "%.2f mm in 95%%, %.2f mm at most",
             taken, marks, 100.0 * coverage, report.heldOutMedianMm, report.heldOut95Mm, report.heldOutMostMm));
  lines.push_back(
      Format("the lens alone leaves %.3f px, lens and residual %.3f px (RMS per axis); the light is put down within %.2f mm; "
             "the map itself is within %.2f mm (95%%)",
             report.lensPx, report.residualPx, scatterMm, ownMm));
  for (const CalibrationOutlier& outlier : outliers) {
    const std::string where = std::isfinite(outlier.distanceMm) ? Format("lies %.1f mm from where %d others put it",
                                                                         outlier.distanceMm, static_cast<int>(report.inliers))
                                                                : std::string("is seen where no skin is");
    lines.push_back(Format("mark %d ", outlier.mark) + where +
                    (outlier.wasRepeated ? ", again: it is left out; is it where the mesh has it?"
                     : isEnough          ? ": it is left out"
                                         : ": repeat it"));
  }
  if (isEnough)
    lines.push_back("more marks would not help" +
                    (report.heldOut95Mm > wantedMm
                         ? Format(", although %.2f mm are wanted: the light must be put down more exactly, "
                                  "or print and mesh differ",
                                  wantedMm)
                         : std::string()));
  else if (gapMark > 0)
    lines.push_back(Format("the largest gap, %.0f px, is about mark %d", gapPx, gapMark));
  if (!complaint.empty())
    lines.push_back("the map is that of before: " + complaint);
  return lines;
}

std::vector<int> DriftMarks(const SurfaceMap& map, const std::vector<Eigen::Vector3d>& marks, int count)
{
  std::vector<std::pair<int, Eigen::Vector2d>> seen;
  for (std::size_t i = 0; i < marks.size(); ++i)
    if (const auto pixel = map.PixelOf(marks[i]); pixel && map.Map(*pixel).status == MappedPoint::Status::Mapped)
      seen.emplace_back(MarkNumber(i), *pixel);
  // The outermost first, then always the one that is furthest from all chosen ones.
  const FisheyeLens& lens = map.State().optics.lens;
  const Eigen::Vector2d centre(lens.centreX, lens.centreY);
  std::vector<double> nearest(seen.size(), HUGE_VAL);
  std::vector<int> chosen;
  while (chosen.size() < std::min(seen.size(), static_cast<std::size_t>(std::max(count, 0)))) {
    std::size_t next = 0;
    for (std::size_t i = 1; i < seen.size(); ++i) {
      const bool isFurther =
          chosen.empty() ? (seen[i].second - centre).norm() > (seen[next].second - centre).norm() : nearest[i] > nearest[next];
      if (isFurther)
        next = i;
    }
    chosen.push_back(seen[next].first);
    for (std::size_t i = 0; i < seen.size(); ++i)
      nearest[i] = std::min(nearest[i], (seen[i].second - seen[next].second).norm());
  }
  return chosen;
}

std::vector<DriftPoint> DriftPoints(const SurfaceMap& map, const std::vector<SurfaceObservation>& again, double scatterMm)
{
  // The camera moved a little along and about each axis of the shell.
  constexpr double stepMm = 0.1, stepTurn = 1e-3;
  std::vector<SurfaceMap> moved;
  for (int i = 0; i < 6; ++i) {
    SurfaceMapState state = map.State();
    if (i < 3)
      state.cameraToShell.translation()[i] += stepMm;
    else
      state.cameraToShell.linear() = ExpRotation(stepTurn * Eigen::Vector3d::Unit(i - 3)) * state.cameraToShell.linear();
    moved.emplace_back(std::move(state), map.Skin());
  }
  std::vector<DriftPoint> points;
  for (const SurfaceObservation& observation : again) {
    const auto expected = map.PixelOf(observation.point);
    if (!expected)
      continue;
    DriftPoint point;
    point.mark = observation.mark;
    point.difference = observation.pixel - *expected;
    bool isSeen = true;
    for (int i = 0; i < 6; ++i) {
      const auto pixel = moved[static_cast<std::size_t>(i)].PixelOf(observation.point);
      isSeen = isSeen && pixel;
      if (pixel)
        point.motion.col(i) = (*pixel - *expected) / (i < 3 ? stepMm : stepTurn);
    }
    const MappedPoint mapped = map.Map(*expected);
    if (!isSeen || mapped.status != MappedPoint::Status::Mapped)
      continue;
    // A mark that moves and a camera that moves the other way look the same.
    const Eigen::Matrix<double, 2, 3> byPlace = -point.motion.leftCols<3>();
    const Eigen::Matrix3d alongSkin =
        scatterMm * scatterMm * (Eigen::Matrix3d::Identity() - mapped.normal * mapped.normal.transpose());
    point.covariance = observation.covariance + byPlace * (mapped.covariance + alongSkin) * byPlace.transpose();
    points.push_back(point);
  }
  return points;
}

} // namespace echorama
