// SPDX-License-Identifier: BSD-3-Clause
// On its way a hand lifts the light and speeds up and down smoothly (minimum jerk); the light still shows on the skin below it.
// At rest it trembles: two sines per axis at frequencies of the seed's between 6 and 12 Hz.
#include "SimulatedHand.h"
#include "Core/Base/Angles.h"
#include "Core/Base/Random.h"
#include <algorithm>
#include <cmath>

namespace echorama {

ParameterList Describe(SimulatedHandParameters& p)
{
  return {
      Parameter("MoveSeconds", p.moveSeconds, {0.01, 60}, "s", "How long the way from mark to mark takes."),
      Parameter("LiftMm", p.liftMm, {0, 100}, "mm", "How far the light is lifted on its way."),
      Parameter("PlacementMm", p.placementMm, {0, 20}, "mm", "How far from a mark it is put down: standard deviation per axis."),
      Parameter("TremorMm", p.tremorMm, {0, 20}, "mm", "How it trembles there: standard deviation per axis."),
      Parameter("WrongMarks", p.wrongMarks, {0, 1}, "", "Share of marks that it mistakes for one of their neighbours."),
      Parameter("HandSeed", p.seed, {}, "", "Of its errors.")};
}

namespace {

constexpr std::uint64_t TremorItem = std::uint64_t{1} << 40;

double MinimumJerk(double share)
{
  return share * share * share * (10.0 + share * (6.0 * share - 15.0));
}

} // namespace

SimulatedHand::SimulatedHand(const SimulatedHandParameters& parameters, std::vector<Eigen::Vector3d> marks,
                             std::function<Eigen::Vector3d(const Eigen::Vector3d&)> toSkin)
  : parameters_(parameters), marks_(std::move(marks)), toSkin_(std::move(toSkin))
{
  CheckRanges(parameters);
  if (marks_.empty())
    throw Error(Error::Kind::InvalidParameter, "a simulated hand needs marks to go to");
}

void SimulatedHand::GoTo(std::size_t mark, double time)
{
  if (mark >= marks_.size() || (!stays_.empty() && !(time >= stays_.back().leave)))
    throw Error(Error::Kind::InvalidParameter, "the simulated hand is told a mark that is not there, or a time that is past");
  Random random(parameters_.seed, stays_.size());
  const bool isWrong = random.Uniform() < parameters_.wrongMarks && marks_.size() > 1;
  std::size_t target = mark;
  if (isWrong) { // one of the three nearest
    std::vector<std::size_t> others;
    for (std::size_t i = 0; i < marks_.size(); ++i)
      if (i != mark)
        others.push_back(i);
    const auto nearest = others.begin() + static_cast<std::ptrdiff_t>(std::min<std::size_t>(3, others.size()));
    std::partial_sort(others.begin(), nearest, others.end(), [&](std::size_t a, std::size_t b) {
      return (marks_[a] - marks_[mark]).squaredNorm() < (marks_[b] - marks_[mark]).squaredNorm();
    });
    target = others[random.Below(static_cast<std::uint64_t>(nearest - others.begin()))];
  }
  const Eigen::Vector3d error(random.Normal(), random.Normal(), random.Normal());
  const Eigen::Vector3d place = toSkin_(marks_[target] + parameters_.placementMm * error);
  if (stays_.empty()) // it begins there
    stays_.push_back({time, time, target, place, place});
  else
    stays_.push_back({time, time + parameters_.moveSeconds, target, At(time).point, place});
}

LightOnSkin SimulatedHand::At(double time) const
{
  LightOnSkin light;
  light.peak = 0.0;
  const auto next = std::upper_bound(stays_.begin(), stays_.end(), time, [](double t, const Stay& s) { return t < s.leave; });
  if (next == stays_.begin())
    return light; // nobody has told it anything yet
  const Stay& stay = *(next - 1);
  light.peak = parameters_.peak;
  if (time < stay.arrive) {
    const double share = (time - stay.leave) / (stay.arrive - stay.leave);
    light.point = toSkin_(stay.from + MinimumJerk(share) * (stay.place - stay.from));
    light.hoverMm = parameters_.liftMm * std::sin(Pi * share);
    return light;
  }
  Random random(parameters_.seed, TremorItem);
  Eigen::Vector3d tremor;
  for (int axis = 0; axis < 3; ++axis) { // each sine has a variance of a half
    const double slow = random.Uniform(6.0, 9.0), fast = random.Uniform(9.0, 12.0), phase = random.Uniform(0.0, 2.0 * Pi);
    tremor[axis] = std::sin(2.0 * Pi * slow * time + phase) + std::sin(2.0 * Pi * fast * time);
  }
  light.point = toSkin_(stay.place + parameters_.tremorMm * tremor);
  return light;
}

} // namespace echorama
