// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Each struct of a scene lists its keys once, in Describe(): values by the descriptions of their parameters, and what is nested.
// Three visitors walk that list: SceneReader.cxx (JSON to struct, with every check), SceneWriter.cxx (back) and SceneSchema.cxx
// (the JSON Schema). So the reader, the text that is written and the schema cannot drift apart.
#include "Core/Base/DescribedJson.h"
#include "Filters/Phantoms/PhantomSceneKeys.h"
#include "SynthesisScene.h"
#include <type_traits>
#include <utility>

namespace echorama::scene {

[[noreturn]] inline void Refuse(const std::string& reason)
{
  throw Error(Error::Kind::InvalidParameter, reason);
}

using described::largestSeed, described::longestList, described::longestText;

inline constexpr const char* schemaName = "echorama-scene-1";

inline constexpr ParameterRange anywhere{-1e5, 1e5}; // mm; a hundred metres
inline constexpr ParameterRange turns{-3600, 3600}, weights{0, 1e9};

/// Things that are given as the rows of a matrix, too.
template <class T>
inline constexpr bool mayBeRows = std::is_same_v<T, ScenePlace> || std::is_same_v<T, ScenePose>;

/// What has values alone.
template <class A, class T>
auto Describe(A& a, T& value) -> decltype(Describe(value), void())
{
  Each(a, Describe(value));
}

/// The seed comes first, and is the scene's unless it is said.
template <class A>
void EachSeeded(A& a, ParameterList parameters)
{
  Parameter& seed = Named(parameters, "Seed");
  seed.help += " That of the scene, if it is not said here.";
  a.Value(seed);
  Each(a, Without(std::move(parameters), {"Seed"}));
}

/// A number that is not there unless it is said.
template <class A, class T>
void Maybe(A& a, std::optional<T>& value, const char* name, const ParameterRange& range, const char* unit, const char* help)
{
  T number = value.value_or(T());
  if (a.Maybe(Parameter(name, number, range, unit, help), value.has_value()))
    value = number;
}

template <class A>
void Describe(A& a, ScenePlace& place)
{
  Each(a, {Parameter("Translation", place.translation, anywhere, "mm", "Comes last."),
           Parameter("RotationDegrees", place.rotationDegrees, turns, "degrees", "Axis times angle."),
           Parameter("Scale", place.scale, {1e-6, 1e6}, "", "Comes first.")});
}

template <class A>
void Describe(A& a, ScenePose& pose)
{
  Each(a, {Parameter("Face", pose.face, anywhere, "mm", "Where the middle of the probe's face is."),
           Parameter("Target", pose.target, anywhere, "mm", "A point that the middle beam looks at."),
           Parameter("Fan", pose.fan, anywhere, "", "Direction of the fan.")});
}

template <class A>
void Describe(A& a, SceneProbe& probe)
{
  std::vector<std::string> names;
  for (const ProbePreset& preset : ProbePresets())
    names.push_back(preset.name);
  a.Value(Parameter("Preset", Choice(probe.preset, names), "The kind of probe; the other keys change it."));
  Maybe(a, probe.fanAngleDegrees, "FanAngleDegrees", {0, 350}, "degrees", "Whole fan.");
  Maybe(a, probe.fanRadiusMm, "FanRadiusMm", {0, 1e4}, "mm", "Radius of the array's arc.");
  Maybe(a, probe.fanWidthMm, "FanWidthMm", {0, 1000}, "mm", "Length of the array's arc, instead of its radius.");
  Maybe(a, probe.sweepAngleDegrees, "SweepAngleDegrees", {0, 350}, "degrees", "Whole sweep.");
  Maybe(a, probe.sweepRadiusMm, "SweepRadiusMm", {0, 1e4}, "mm", "How far the face is from the axis of the sweep.");
  Maybe(a, probe.sweepWidthMm, "SweepWidthMm", {0, 1000}, "mm",
        "Way of the array's middle during the sweep, instead of the radius.");
  Maybe(a, probe.depthMinMm, "DepthMinMm", {-100, 1000}, "mm", "First sample, from the face.");
  Maybe(a, probe.depthMaxMm, "DepthMaxMm", {0.1, 1000}, "mm", "Last sample, from the face.");
  Maybe(a, probe.elements, "Elements", {2, 4096}, "", "Beams across the fan.");
  Maybe(a, probe.sweepSteps, "SweepSteps", {1, 4096}, "", "Planes of the sweep; 1: the middle plane alone.");
  Maybe(a, probe.samples, "Samples", {2, 16384}, "", "Samples along each beam.");
}

template <class A>
void Describe(A& a, SceneMesh& mesh)
{
  a.Value(Parameter("File", mesh.file, "A closed surface, as a path from the scene's folder: .vtp, .ply, .stl, .obj, .glb."),
          Presence::Needed);
  Each(a, {Parameter("Unit", Choice(mesh.unit, {"mm", "m"}), "Of the file."),
           Parameter("Axes", Choice(mesh.axes, {"lps", "y-up"}), "Of the file: lps, or y up and z to the front (glTF).")});
  a.MaterialName("material", mesh.material, Presence::Needed);
  a.Object("transform", mesh.transform, "What is done with it then.");
}

template <class A>
void Describe(A& a, SceneSphere& sphere)
{
  Each(a, {Parameter("Centre", sphere.centre, anywhere, "mm", "Where its middle is."),
           Parameter("Radius", sphere.radius, {0, 1e4, true}, "mm", "From its middle to its surface.")});
  a.MaterialName("material", sphere.material, Presence::Needed);
}

template <class A>
void Describe(A& a, SceneBox& box)
{
  Each(a, {Parameter("Centre", box.centre, anywhere, "mm", "Where its middle is."),
           Parameter("Size", box.size, {0, 1e4, true}, "mm", "Its edges."),
           Parameter("RotationDegrees", box.rotationDegrees, turns, "degrees", "Axis times angle, about the centre.")});
  a.MaterialName("material", box.material, Presence::Needed);
}

template <class A>
void Describe(A& a, SceneCylinder& cylinder)
{
  Each(a, {Parameter("From", cylinder.from, anywhere, "mm", "Middle of one end."),
           Parameter("To", cylinder.to, anywhere, "mm", "Middle of the other end."),
           Parameter("Radius", cylinder.radius, {0, 1e4, true}, "mm", "From its axis to its surface.")});
  a.MaterialName("material", cylinder.material, Presence::Needed);
}

template <class A>
void Describe(A& a, ScenePacking& packing)
{
  EachSeeded(a, Describe(packing.tissue.packing));
  a.Shares("materials", packing.materials, "Materials of the spheres, each with its share beside the others'.");
  Each(a, Without(Describe(packing.tissue), {"ProbePosition", "MaxTriangles"}));
}

template <class A>
void Describe(A& a, AnatomyParameters& anatomy)
{
  EachSeeded(a, Describe(anatomy));
}

template <class A>
void Describe(A& a, Receiver& receiver)
{
  for (const Parameter& parameter : Describe(receiver)) {
    a.Value(parameter);
    if (parameter.name == "TgcDbPerCm")
      a.List("tgcPoints", receiver.tgcPoints, "Further gain, linear between points.");
  }
}

template <class A>
void Describe(A& a, CalibrationRigParameters& rig)
{
  a.List("balls", rig.balls, "Seven of different sizes and heights, if they are not said.");
  Each(a, Describe(rig));
}

template <class A>
void Describe(A& a, ScatterCounting& counting)
{
  Each(a, Without(Describe(counting), {"AssumedSoundSpeed", "Seed"}));
}

template <class A>
void Describe(A& a, EchoModel& echoes)
{
  Each(a, Describe(echoes));
  a.Object("counting", echoes.counting, "Of the mode counting.");
}

template <class A>
void Describe(A& a, ScenePhantom& phantom)
{
  a.Value(
      Parameter("Bodies", Choice(phantom.bodies, {"body", "jets"}), "The phantom's own, or the clouds that come and go in it."));
  a.MaterialName("background", phantom.background);
  echorama::Describe(a, phantom.listed);
}

template <class A>
void Describe(A& a, SceneItem& item)
{
  a.Value(Parameter("Name", item.name, "Of the body."));
  const ParameterRange views{1, SceneItem::mostViews};
  Each(a, {Parameter("FirstView", item.firstView, views, "", "The first view in which it is there."),
           Parameter("LastView", item.lastView, views, "", "The last one.")});
  a.OneOf(item.what, Form<ScenePacking>{"packing", "Packed spheres."}, Form<SceneMesh>{"mesh", "Triangles from a file."},
          Form<AnatomyParameters>{"anatomy", "An invented abdomen."},
          Form<CalibrationRigParameters>{"rig", "Balls in a water bath, to calibrate by."},
          Form<ScenePhantom>{"phantom", "Bodies of the phantom."}, Form<SceneSphere>{"sphere", "A ball."},
          Form<SceneBox>{"box", "A block."}, Form<SceneCylinder>{"cylinder", "A rod or a straight vessel."});
}

template <class A>
void Describe(A& a, SceneRow& row)
{
  Each(a, {Parameter("Count", row.count, {1, 1000}, "", "Views side by side along a convex body."),
           Parameter("Overlap", row.overlap, {0.05, 0.95}, "", "Fraction that neighbours share.")});
  a.Object("middle", row.middle, "Where the middle of the row is held.");
}

template <class A>
void Describe(A& a, SceneViews& views)
{
  a.List("poses", views.poses, "The views, one by one: ProbeToWorld.", Presence::Needed);
}

template <class A>
void EachOfPath(A& a, ScenePathViews& views)
{
  Each(a, Describe(views));
  a.Numbers("times", views.times, {-1e6, 1e6}, "s", "When volumes are taken, in rising order, instead of a count.");
}

template <class A>
void Describe(A& a, SceneRecording& recording)
{
  a.Value(Parameter("File", recording.file, "A tracked sequence, as a path from the scene's folder."), Presence::Needed);
  a.Value(Parameter("Transform", recording.transform, "From the probe to the tracker or a reference, by its name in the file."));
  a.Object("trackerToWorld", recording.trackerToWorld, "Where the tracker is in the world; rigid.");
  Each(a,
       {Parameter("SmoothSeconds", recording.smoothSeconds, {0, 60}, "s", "Sigma of the smoothing; 0: none."),
        Parameter("LongestGapSeconds", recording.longestGapSeconds, {0, 600, true}, "s", "Drop-outs up to this are bridged.")});
  EachOfPath(a, recording);
}

template <class A>
void Describe(A& a, SceneMotion::Key& key)
{
  Each(a, {Parameter("Seconds", key.seconds, {-1e6, 1e6}, "s", "When the probe is there; later than at the key before.")});
  a.Object("pose", key.pose, "Where the probe is held.");
}

template <class A>
void Describe(A& a, SceneMotion& motion)
{
  a.List("keys", motion.keys, "A path, straight from each pose to the next.", Presence::Needed);
  EachOfPath(a, motion);
}

/// {"recording": {...}}
struct RecordingKey {
  SceneRecording& recording;
};

template <class A>
void Describe(A& a, RecordingKey& key)
{
  a.Object("recording", key.recording, "Views along a recorded path.", Presence::Needed);
}

template <class A>
void Describe(A& a, SceneSweep& sweep)
{
  Each(a, {Parameter("Seconds", sweep.seconds, {0, 60}, "s", "How long a sweep takes; 0: all planes at once."),
           Parameter("VelocityMmPerSecond", sweep.velocityMmPerSecond, {-1e4, 1e4}, "mm/s",
                     "Of the probe during the sweep, in its own frame."),
           Parameter("TurnDegreesPerSecond", sweep.turnDegreesPerSecond, turns, "degrees/s",
                     "Axis times angle, in the probe's frame, about its face."),
           Parameter("AlongRecording", sweep.alongRecording,
                     "The motion is that of the recording, or of the keys; the views need such a path."),
           Parameter("States", sweep.states, {1, 64}, "",
                     "Over how many states of tissue and gel a sweep that moves is divided; each plane sees that of its part.")});
}

template <class A>
void Describe(A& a, SynthesisScene& scene)
{
  a.Constant("schema", schemaName);
  Each(a, {Parameter("Name", scene.name, "Short; files are named after it."), Parameter("About", scene.about, "For people."),
           Parameter("Seed", scene.seed, {0, static_cast<double>(largestSeed)}, "",
                     "Of everything random that has no seed of its own.")});
  a.Object("probe", scene.probe, "The probe: a preset, and what is to be different.");
  if constexpr (A::reads)
    scene.transducer = ProbePresetOf(scene.probe.preset).transducer;
  a.Object("transducer", scene.transducer, "How it sends and listens; numbers that are not said are the preset's.",
           Presence::FromPreset);
  a.Object("receiver", scene.receiver, "From echoes to grey.");
  a.Object("transport", scene.echoes, "How sound is followed, and how echoes are made.");
  a.Materials("materials", scene.materials, "Materials of this scene by name, beside the standard ones.");
  a.MaterialName("background", scene.background);
  a.List("tissue", scene.tissue, "What lies in the world; where several hold a point the later counts.");
  a.Views("views", scene.views, "From where the probe looks.");
  a.Object("sweep", scene.sweep, "The time a sweep takes, and the motion meanwhile.");
  a.Object("change", scene.change, "What sets views of one body apart, beside where the probe is.");
  a.MaybeObject("press", scene.press, "Tissue gives way to the probe; if it is not said, it does not.");
  a.MaybeObject("gel", scene.gel, "Gel on the face of the probe, in air; if it is not said, the background couples.");
  a.Object("volume", scene.volume, "The volumes that are made.");
}

} // namespace echorama::scene
