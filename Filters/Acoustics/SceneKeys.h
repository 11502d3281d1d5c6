// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Each struct of a scene lists its keys once, in Describe(), with their ranges and what they mean. Three visitors walk that list:
// SceneReader.cxx (JSON to struct, with every check), SceneWriter.cxx (back) and SceneSchema.cxx (the JSON Schema). So the
// reader, the text that is written and the schema cannot drift apart.
#include "Core/Base/Error.h"
#include "Core/Base/NumberText.h"
#include "SynthesisScene.h"
#include <type_traits>
#include <utility>

namespace echorama::scene {

[[noreturn]] inline void Refuse(const std::string& reason)
{
  throw Error(Error::Kind::InvalidParameter, reason);
}

/// As JSON, and shortened.
std::string Quoted(const std::string& text);

inline constexpr const char* schemaName = "echorama-scene-1";
inline constexpr std::size_t longestText = 4096, longestList = 100000;
inline constexpr std::uint64_t largestSeed = 9223372036854775807u; // VTK's seeds have a sign
/// What a number may be.
struct Range {
  double low, high;
  bool open = false; ///< low itself is not in it

  bool Holds(double value) const { return value <= high && (open ? value > low : value >= low); }
  std::string Text() const { return (open ? "(" : "[") + NumberText(low) + ", " + NumberText(high) + "]"; }
};

inline constexpr Range anywhere{-1e5, 1e5}; // mm; a hundred metres
inline constexpr Range turns{-3600.0, 3600.0}, weights{0.0, 1e9};

/// Whether a key must be there. What comes from a preset has no default of its own.
enum class Presence { Optional, Needed, FromPreset };

template <class T>
using Choices = std::vector<std::pair<const char*, T>>;

/// One form that an item of the list of tissue may have.
template <class T>
struct Form {
  const char* key;
  const char* help;
};

/// Things that are given as the rows of a matrix, too.
template <class T>
inline constexpr bool mayBeRows = std::is_same_v<T, ScenePlace> || std::is_same_v<T, ScenePose>;

template <class A>
void Describe(A& a, ScenePlace& place)
{
  a.Vector("translation", place.translation, anywhere, "Comes last, mm.");
  a.Vector("rotationDegrees", place.rotationDegrees, turns, "Axis times angle.");
  a.Number("scale", place.scale, {1e-6, 1e6}, "Comes first.");
}

template <class A>
void Describe(A& a, ScenePose& pose)
{
  a.Vector("face", pose.face, anywhere, "Where the middle of the probe's face is, mm.");
  a.Vector("target", pose.target, anywhere, "A point that the middle beam looks at, mm.");
  a.Vector("fan", pose.fan, anywhere, "Direction of the fan.");
}

template <class A>
void Describe(A& a, SceneProbe& probe)
{
  Choices<std::string> names;
  for (const ProbePreset& preset : ProbePresets())
    names.emplace_back(preset.name.c_str(), preset.name);
  a.Choice("preset", probe.preset, names, "The kind of probe; the other keys change it.");
  a.Number("fanAngleDegrees", probe.fanAngleDegrees, {0.0, 350.0}, "Whole fan.");
  a.Number("fanRadiusMm", probe.fanRadiusMm, {0.0, 1e4}, "Of the array's arc.");
  a.Number("fanWidthMm", probe.fanWidthMm, {0.0, 1000.0}, "Length of the array's arc, instead of its radius.");
  a.Number("sweepAngleDegrees", probe.sweepAngleDegrees, {0.0, 350.0}, "Whole sweep.");
  a.Number("sweepRadiusMm", probe.sweepRadiusMm, {0.0, 1e4}, "How far the face is from the axis of the sweep.");
  a.Number("sweepWidthMm", probe.sweepWidthMm, {0.0, 1000.0},
           "Way of the array's middle during the sweep, instead of the radius.");
  a.Number("depthMinMm", probe.depthMinMm, {-100.0, 1000.0}, "First sample, from the face.");
  a.Number("depthMaxMm", probe.depthMaxMm, {0.1, 1000.0}, "Last sample.");
  a.Number("elements", probe.elements, {2, 4096}, "Beams across the fan.");
  a.Number("sweepSteps", probe.sweepSteps, {1, 4096}, "Planes of the sweep; 1: the middle plane alone.");
  a.Number("samples", probe.samples, {2, 16384}, "Along each beam.");
}

template <class A>
void Describe(A& a, Material& material)
{
  a.Number("soundSpeed", material.soundSpeed, {100.0, 10000.0}, "m/s");
  a.Number("density", material.density, {0.1, 20000.0}, "kg/m^3");
  a.Number("attenuation", material.attenuation, {0.0, 200.0}, "dB/cm at 1 MHz, one way.");
  a.Number("attenuationPower", material.attenuationPower, {0.0, 2.0}, "Exponent of the frequency.");
  a.Number("scattererDensity", material.scattererDensity, {0.0, 1000.0}, "Per mm^3; 0: clear.");
  a.Number("backscatterDb", material.backscatterDb, {-120.0, 60.0}, "Beside liver.");
  a.Number("roughness", material.roughness, {0.0, 1.0}, "Of its surface: 0 mirrors, 1 sends sound every way alike.");
  a.Number("scatterProbability", material.scatterProbability, {0.0, 1.0}, "Per mm, when scatters are counted.");
  a.Number("youngsModulusKPa", material.youngsModulusKPa, {0.0, 1e9}, "Stiffness.");
}

template <class A>
void Describe(A& a, SceneMesh& mesh)
{
  a.Text("file", mesh.file, "A closed surface, as a path from the scene's folder: .vtp, .ply, .stl, .obj, .glb.",
         Presence::Needed);
  a.Choice("unit", mesh.unit, Choices<SceneMesh::Unit>{{"mm", SceneMesh::Unit::Millimetres}, {"m", SceneMesh::Unit::Metres}},
           "Of the file.");
  a.Choice("axes", mesh.axes, Choices<SceneMesh::Axes>{{"lps", SceneMesh::Axes::Lps}, {"y-up", SceneMesh::Axes::YUp}},
           "Of the file: lps, or y up and z to the front (glTF).");
  a.MaterialName("material", mesh.material, Presence::Needed);
  a.Object("transform", mesh.transform, "What is done with it then.");
}

template <class A>
void Describe(A& a, SceneSphere& sphere)
{
  a.Vector("centre", sphere.centre, anywhere, "mm");
  a.Number("radius", sphere.radius, {0.0, 1e4, true}, "mm");
  a.MaterialName("material", sphere.material, Presence::Needed);
}

template <class A>
void Describe(A& a, SceneBox& box)
{
  a.Vector("centre", box.centre, anywhere, "mm");
  a.Vector("size", box.size, {0.0, 1e4, true}, "Edges, mm.");
  a.Vector("rotationDegrees", box.rotationDegrees, turns, "Axis times angle, about the centre.");
  a.MaterialName("material", box.material, Presence::Needed);
}

template <class A>
void Describe(A& a, SceneCylinder& cylinder)
{
  a.Vector("from", cylinder.from, anywhere, "Middle of one end, mm.");
  a.Vector("to", cylinder.to, anywhere, "Middle of the other end, mm.");
  a.Number("radius", cylinder.radius, {0.0, 1e4, true}, "mm");
  a.MaterialName("material", cylinder.material, Presence::Needed);
}

template <class A>
void Describe(A& a, ScenePacking& packing)
{
  using Spheres = SpherePackingParameters;
  Spheres& spheres = packing.spheres;
  a.Seed("seed", spheres.seed, "The scene's, if it is not said here.");
  a.Choice("method", spheres.method,
           Choices<Spheres::Method>{{"random", Spheres::Method::Random}, {"empty-space", Spheres::Method::EmptySpace}},
           "random: sizes are drawn first; empty-space: the largest sphere that fits a random place.");
  a.Choice("region", spheres.region, Choices<Spheres::Region>{{"box", Spheres::Region::Box}, {"ball", Spheres::Region::Ball}},
           "The box, or the largest ball in it.");
  a.Vector("boxMin", spheres.boxMin, anywhere, "mm");
  a.Vector("boxMax", spheres.boxMax, anywhere, "mm");
  a.Choice("radii", spheres.radii,
           Choices<Spheres::Radii>{{"uniform", Spheres::Radii::Uniform},
                                   {"log-uniform", Spheres::Radii::LogUniform},
                                   {"power-law", Spheres::Radii::PowerLaw}},
           "Distribution of the sizes, of the method random.");
  a.Number("exponent", spheres.exponent, {-10.0, 10.0}, "Of the power law.");
  a.Number("radiusMin", spheres.radiusMin, {1e-6, 1e5}, "mm");
  a.Number("radiusMax", spheres.radiusMax, {1e-6, 1e5}, "mm");
  a.Number("gapMm", spheres.gapMm, {0.0, 1000.0}, "Least way between two surfaces.");
  a.Number("fillFraction", spheres.fillFraction, {0.0, 1.0}, "Wanted share of the region within spheres.");
  a.Number("count", spheres.count, {0.0, static_cast<double>(Spheres::mostSpheres)}, "It ends at so many spheres.");
  a.Number("misses", spheres.misses, {1.0, 1e9}, "So many in a row mean that there is no more room.");
  a.Shares("materials", packing.materials, "Materials of the spheres, each with its share beside the others'.");
  a.Number("cellMm", packing.cellMm, {0.01, 100.0}, "Resolution cell at the origin: the level of detail follows it.");
  a.Number("cellGrowth", packing.cellGrowth, {0.0, 1.0}, "mm more per mm from there.");
  a.Number("deviation", packing.deviation, {0.001, 10.0}, "How far meshes may leave their spheres, in cells.");
  a.Flag("trueVolume", packing.trueVolume, "Meshes have the volume of their spheres, and may overlap a little.");
  a.Flag("turned", packing.turned, "Each mesh is turned at random.");
}

template <class A>
void Describe(A& a, AnatomyParameters& anatomy)
{
  a.Seed("seed", anatomy.seed, "The scene's, if it is not said here.");
  for (const AnatomyParameter& one : AnatomyParameterTable()) {
    const char* help = "As in the anatomy's own description.";
    if (const auto* number = std::get_if<double AnatomyParameters::*>(&one.member))
      a.Number(one.name, anatomy.**number, {one.from, one.to}, help);
    else if (const auto* count = std::get_if<int AnatomyParameters::*>(&one.member))
      a.Number(one.name, anatomy.**count, {one.from, one.to}, help);
    else
      a.Flag(one.name, anatomy.*std::get<bool AnatomyParameters::*>(one.member), help);
  }
}

template <class A>
void Describe(A& a, Transducer& transducer)
{
  a.Number("frequencyMHz", transducer.frequencyMHz, {0.5, 50.0}, "Centre frequency.");
  a.Number("bandwidth", transducer.bandwidth, {0.05, 1.5}, "-6 dB width of the two-way spectrum beside the frequency.");
  a.Number("lateralApertureMm", transducer.lateralApertureMm, {0.1, 100.0}, "Active aperture along the fan.");
  a.Number("lateralFocusMm", transducer.lateralFocusMm, {1.0, 1000.0}, "Transmit focus along the fan.");
  a.Flag("dynamicReceive", transducer.dynamicReceive, "Receiving is focused everywhere.");
  a.Number("smallestFNumber", transducer.smallestFNumber, {0.5, 10.0}, "Of dynamic receiving.");
  a.Number("elevationApertureMm", transducer.elevationApertureMm, {0.1, 100.0}, "Of the lens along the sweep.");
  a.Number("elevationFocusMm", transducer.elevationFocusMm, {1.0, 1000.0}, "Of the lens, sending and receiving.");
  a.Number("assumedSoundSpeed", transducer.assumedSoundSpeed, {500.0, 5000.0}, "m/s: how the scanner turns time into depth.");
}

template <class A>
void Describe(A& a, Receiver::GainPoint& point)
{
  a.Number("depthMm", point.depthMm, {-1000.0, 10000.0}, "Rises from point to point.");
  a.Number("gainDb", point.gainDb, {-200.0, 200.0}, "At that depth.");
}

template <class A>
void Describe(A& a, Receiver& receiver)
{
  a.Number("gainDb", receiver.gainDb, {-200.0, 200.0}, "Of everything.");
  a.Number("tgcDbPerCm", receiver.tgcDbPerCm, {-20.0, 100.0}, "Further gain per cm of depth.");
  a.List("tgcPoints", receiver.tgcPoints, "Further gain, linear between points.");
  a.Number("dynamicRangeDb", receiver.dynamicRangeDb, {10.0, 200.0}, "How many dB the 255 steps of grey span.");
  a.Number("referenceGrey", receiver.referenceGrey, {0.0, 255.0}, "Mean grey of the reference tissue at a gain of 0.");
  a.Number("noiseDb", receiver.noiseDb, {Receiver::noNoiseDb, 100.0}, "Of the electronics, before all gain; -200: none.");
  a.Seed("noiseSeed", receiver.noiseSeed, "Of that noise.");
}

template <class A>
void Describe(A& a, CalibrationRigParameters::Ball& ball)
{
  a.Text("name", ball.name, "Of the landmark.");
  a.Vector("centre", ball.centre, {-1000.0, 1000.0}, "mm, in the rig: z = 0 is the plate's upper side, -z is up to the probe.");
  a.Number("radius", ball.radius, {0.5, 30.0}, "mm");
}

template <class A>
void Describe(A& a, CalibrationRigParameters& rig)
{
  a.List("balls", rig.balls, "Seven of different sizes and heights, if they are not said.");
  a.Number("scale", rig.scale, {0.2, 5.0}, "Size of the whole rig.");
  a.Number("plateDepthMm", rig.plateDepthMm, {10.0, 500.0}, "z of the plate's upper side in the world.");
  a.Number("plateMm", rig.plateMm, {0.0, 50.0}, "Thickness of the glass; 0: neither plate nor stems.");
  a.Number("baseMm", rig.baseMm, {0.0, 20.0}, "Thickness of the slab on the glass that the pins stand on; 0: none.");
  a.Number("stemRadiusMm", rig.stemRadiusMm, {0.0, 5.0}, "Of the pins that carry the balls; 0: none.");
  a.Number("waterCelsius", rig.waterCelsius, {0.0, 95.0}, "Temperature of the bath, which sets its speed of sound.");
  a.Number("detailMm", rig.detailMm, {0.1, 5.0}, "Edge of the triangles of the balls.");
  a.Text("material", rig.material, "Of balls and stems: a standard one.");
}

inline constexpr std::pair<const char*, Sampling> samplings[] = {
    {"random", Sampling::Random}, {"stratified", Sampling::Stratified}, {"sobol", Sampling::Sobol}};

template <class A>
void Describe(A& a, ScatterCounting& counting)
{
  a.Number("raysPerElement", counting.raysPerElement, {1.0, 1e7}, "Rays that each element sends.");
  a.Number("clarity", counting.clarity, {0.0, 200.0}, "Exponent c of the angle at which an echo comes in.");
  a.Number("coneDegrees", counting.coneDegrees, {0.0, 180.0}, "Half angle within which a scattered ray goes on.");
  a.Number("maxEvents", counting.maxEvents, {1.0, 1e6}, "Of one ray.");
  a.Choice("sampling", counting.sampling, Choices<Sampling>(std::begin(samplings), std::end(samplings)), "How rays are drawn.");
}

template <class A>
void Describe(A& a, SceneTransport& transport)
{
  using Mode = SynthesisParameters::Mode;
  SoundTransport& sound = transport.sound;
  a.Choice("mode", transport.mode, Choices<Mode>{{"coherent", Mode::Coherent}, {"counting", Mode::Counting}},
           "coherent: echoes of scatterers are summed with their phases; counting: random scatter events are counted.");
  a.Number("maxBounces", sound.maxBounces, {0.0, 100.0}, "Reflections that are followed.");
  a.Number("dynamicRangeDb", sound.dynamicRangeDb, {10.0, 300.0}, "A way ends where its echoes are this far below a mirror's.");
  a.Flag("refraction", sound.refraction, "Rays bend where the speed of sound changes.");
  a.Number("faceReflection", sound.faceReflection, {0.0, 1.0}, "Share of the pressure that the probe's face turns back.");
  a.Number("faceRadiusMm", sound.faceRadius, {0.0, 1000.0}, "How far from the middle of the face that happens.");
  a.Number("acceptanceDegrees", sound.acceptanceDegrees, {0.1, 90.0},
           "How far from the normal a mirror's echo is still received.");
  a.Number("maxSegments", sound.maxSegments, {1.0, 1e8}, "Pieces of one ray's way.");
  a.Number("subRays", transport.subRays, {1.0, 4096.0}, "Rays of an element, spread over its aperture.");
  a.Choice("sampling", transport.sampling, Choices<Sampling>(std::begin(samplings), std::end(samplings)), "How they are spread.");
  a.Number("mirrorDb", transport.mirrorDb, {0.0, 120.0}, "A perfect mirror's echo beside the speckle of the reference tissue.");
  a.Object("counting", transport.counting, "Of the mode counting.");
}

template <class A>
void Describe(A& a, SceneItem& item)
{
  a.Text("name", item.name, "Of the body.");
  a.OneOf(item.what, Form<ScenePacking>{"packing", "Packed spheres."}, Form<SceneMesh>{"mesh", "Triangles from a file."},
          Form<AnatomyParameters>{"anatomy", "An invented abdomen."},
          Form<CalibrationRigParameters>{"rig", "Balls in a water bath, to calibrate by."},
          Form<SceneSphere>{"sphere", "A ball."}, Form<SceneBox>{"box", "A block."},
          Form<SceneCylinder>{"cylinder", "A rod or a straight vessel."});
}

template <class A>
void Describe(A& a, SceneRow& row)
{
  a.Number("count", row.count, {1, 1000}, "Views side by side along a convex body.");
  a.Number("overlap", row.overlap, {0.05, 0.95}, "Fraction that neighbours share.");
  a.Object("middle", row.middle, "Where the middle of the row is held.");
}

template <class A>
void Describe(A& a, SceneViews& views)
{
  a.List("poses", views.poses, "The views, one by one: ProbeToWorld.", Presence::Needed);
}

template <class A>
void Describe(A& a, SceneRecording& recording)
{
  a.Text("file", recording.file, "A tracked sequence, as a path from the scene's folder.", Presence::Needed);
  a.Text("transform", recording.transform, "From the probe to the tracker or a reference, by its name in the file.");
  a.Object("trackerToWorld", recording.trackerToWorld, "Where the tracker is in the world; rigid.");
  a.Number("smoothSeconds", recording.smoothSeconds, {0.0, 60.0}, "Sigma of the smoothing; 0: none.");
  a.Number("longestGapSeconds", recording.longestGapSeconds, {0.0, 600.0, true}, "Drop-outs up to this are bridged.");
  a.Number("count", recording.count, {1, 1000}, "Views, evenly from the first pose to the last.");
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
  a.Number("seconds", sweep.seconds, {0.0, 60.0}, "How long a sweep takes; 0: all planes at once.");
  a.Vector("velocityMmPerSecond", sweep.velocityMmPerSecond, {-1e4, 1e4}, "Of the probe during the sweep, in its own frame.");
  a.Vector("turnDegreesPerSecond", sweep.turnDegreesPerSecond, {-3600.0, 3600.0}, "Axis times angle, in the probe's frame.");
  a.Flag("alongRecording", sweep.alongRecording, "The motion is that of the recording; the views need one.");
}

template <class A>
void Describe(A& a, SceneVolume& volume)
{
  a.Number("spacingMm", volume.spacingMm, {0.05, 20.0}, "Edge of the cubic voxels.");
  a.Number("knockMm", volume.knockMm, {0.0, 1000.0}, "How far every volume but the first is put out of place.");
  a.Number("knockDegrees", volume.knockDegrees, {0.0, 180.0}, "And turned.");
}

template <class A>
void Describe(A& a, SynthesisScene& scene)
{
  a.Constant("schema", schemaName);
  a.Text("name", scene.name, "Short; files are named after it.");
  a.Text("about", scene.about, "For people.");
  a.Seed("seed", scene.seed, "Of everything random that has no seed of its own.");
  a.Object("probe", scene.probe, "The probe: a preset, and what is to be different.");
  if constexpr (A::reads)
    scene.transducer = ProbePresetOf(scene.probe.preset).transducer;
  a.Object("transducer", scene.transducer, "How it sends and listens; numbers that are not said are the preset's.",
           Presence::FromPreset);
  a.Object("receiver", scene.receiver, "From echoes to grey.");
  a.Object("transport", scene.transport, "How sound is followed, and how echoes are made.");
  a.Materials("materials", scene.materials, "Materials of this scene by name, beside the standard ones.");
  a.MaterialName("background", scene.background);
  a.List("tissue", scene.tissue, "What lies in the world; where several hold a point the later counts.");
  a.Views("views", scene.views, "From where the probe looks.");
  a.Object("sweep", scene.sweep, "The time a sweep takes, and the motion meanwhile.");
  a.Object("volume", scene.volume, "The volumes that are made.");
}

} // namespace echorama::scene
