// SPDX-License-Identifier: BSD-3-Clause
// A sweep that moves is divided into parts of about as many planes each, and every part has the tissue and the gel of the moment
// in its middle. Between the parts of all views a path is cut by halves until no corner of the head goes too far in one piece.
#include "SceneViews.h"
#include "Filters/Phantoms/PhantomViews.h"
#include "ScenePath.h"
#include <algorithm>

namespace echorama {
namespace {

constexpr std::size_t mostMoments = 100000;

// Of all steps of a sweep the time from its middle.
std::vector<double> StepTimes(int steps, double seconds)
{
  std::vector<double> times;
  for (int step = 0; step < steps; ++step)
    times.push_back(steps == 1 ? 0.0 : seconds * (static_cast<double>(step) / (steps - 1) - 0.5));
  return times;
}

// Into how many states of tissue and gel a sweep is divided.
int StatesOf(const SynthesisScene& scene, int steps)
{
  const SceneSweep& sweep = scene.sweep;
  const bool moves = sweep.seconds > 0.0 &&
                     (sweep.alongRecording || !sweep.velocityMmPerSecond.isZero(0.0) || !sweep.turnDegreesPerSecond.isZero(0.0));
  return moves && (scene.press || scene.gel) ? std::min(sweep.states, steps) : 1;
}

SceneView ViewAt(const SynthesisScene& scene, int steps, double time, const Pose& pose, const ScenePath* path)
{
  SceneView view;
  view.probeToWorld = pose;
  const auto at = [&](double fromMiddle) {
    return TimedPose{time + fromMiddle, path ? path->At(time + fromMiddle) : scene.sweep.ProbeToWorldAt(pose, fromMiddle)};
  };
  if (scene.sweep.seconds > 0.0 && steps > 1)
    for (const double fromMiddle : StepTimes(steps, scene.sweep.seconds))
      view.steps.push_back(at(fromMiddle).pose);
  const int states = StatesOf(scene, steps);
  for (int state = 0; state < states; ++state) {
    SceneState part{{time, pose}, steps * state / states, steps * (state + 1) / states - 1};
    if (states > 1)
      part.probe = at(scene.sweep.seconds * (0.5 * (part.firstStep + part.lastStep) / (steps - 1) - 0.5));
    view.states.push_back(part);
  }
  return view;
}

// The farthest that a corner of the head goes.
double WayOf(const Eigen::AlignedBox3d& head, const Pose& from, const Pose& to)
{
  double longest = 0.0;
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3d point = head.corner(static_cast<Eigen::AlignedBox3d::CornerType>(corner));
    longest = std::max(longest, (to * point - from * point).norm());
  }
  return longest;
}

// The moments after \a from, up to \a to. Poses between are those of the path.
void Follow(const ScenePath& path, const Eigen::AlignedBox3d& head, double stepMm, const TimedPose& from, const TimedPose& to,
            std::vector<TimedPose>& way)
{
  constexpr double shortest = 1e-3; // s
  const double middle = 0.5 * (from.time + to.time);
  if (to.time - from.time > shortest && from.time < middle && middle < to.time) { // large times have nothing in between
    const TimedPose between{middle, path.At(middle)};
    // A probe that goes there and back is far off in the middle.
    if (WayOf(head, from.pose, to.pose) > stepMm || WayOf(head, from.pose, between.pose) > stepMm) {
      Follow(path, head, stepMm, from, between, way);
      Follow(path, head, stepMm, between, to, way);
      return;
    }
  }
  if (way.size() >= mostMoments)
    throw Error(Error::Kind::TooLarge, "views.stepMm: the path would have more than " + std::to_string(mostMoments) + " moments");
  way.push_back(to);
}

void AddWays(const SynthesisScene& scene, const ScenePath& path, double stepMm, const ProbeGeometry& probe,
             std::vector<SceneView>& views)
{
  const ProbeShape shape(probe, scene.press ? scene.press->head : ProbeHead());
  const Eigen::AlignedBox3d head(Eigen::Vector3d(shape.Low().x(), shape.Low().y(), -40.0),
                                 Eigen::Vector3d(shape.High().x(), shape.High().y(), 0.0));
  const TimedPose& first = views.front().states.front().probe;
  // It may be of the path's begin, but for rounding.
  TimedPose last = first.time > path.FirstTime() ? TimedPose{path.FirstTime(), path.At(path.FirstTime())} : first;
  std::size_t number = 0;
  for (SceneView& view : views) {
    if (number++ == 0)
      view.way.push_back(last);
    for (const SceneState& state : view.states) {
      const bool isFirst = view.way.size() == 1 && state.probe.time == last.time;
      if (!isFirst && !(state.probe.time > last.time))
        throw Error(Error::Kind::NotPossible,
                    "views: the sweep of view " + std::to_string(number) +
                        " begins before the one before it has ended; tissue and gel go on in time only");
      if (!isFirst)
        Follow(path, head, stepMm, last, state.probe, view.way);
      last = state.probe;
    }
  }
}

} // namespace

std::vector<SceneView> ViewsOf(const SynthesisScene& scene)
{
  const SynthesisParameters parameters = scene.Parameters();
  const int steps = parameters.BeamDimensions()[2];
  std::vector<SceneView> views;
  if (const auto* row = std::get_if<SceneRow>(&scene.views)) {
    for (const PhantomView& view : PhantomViews(parameters.probe, row->count, row->overlap))
      views.push_back(ViewAt(scene, steps, 0.0, row->middle.ProbeToWorld() * view.probeToWorld, nullptr));
  } else if (const auto* listed = std::get_if<SceneViews>(&scene.views)) {
    for (const ScenePose& pose : listed->poses)
      views.push_back(ViewAt(scene, steps, 0.0, pose.ProbeToWorld(), nullptr));
  } else {
    const ScenePath path = *ScenePath::Of(scene);
    const ScenePathViews& wanted = *scene.PathViews();
    const bool along = scene.sweep.alongRecording && steps > 1;
    // Without friction tissue forgets the way.
    const bool goesOn = scene.gel || (scene.press && scene.press->tissue.friction > 0.0);
    const bool takesTime = along || (goesOn && StatesOf(scene, steps) > 1);
    for (const double time : path.Times(wanted, takesTime ? scene.sweep.seconds : 0.0))
      views.push_back(ViewAt(scene, steps, time, path.At(time), along ? &path : nullptr));
    if (goesOn)
      AddWays(scene, path, wanted.stepMm, parameters.probe, views);
  }
  return views;
}

} // namespace echorama
