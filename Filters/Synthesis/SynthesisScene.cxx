// SPDX-License-Identifier: BSD-3-Clause
// Each struct lists its keys once, in Describe(), with their ranges and what they mean. Three visitors walk that list: Reader
// (JSON to struct, with every check), Writer (back) and SchemaMaker (the JSON Schema). So the reader, the text that is written
// and the schema cannot drift apart. Check() writes a scene and reads it again, and so says the same as the reader.
#include "SynthesisScene.h"
#include "Core/Base/Angles.h"
#include "Core/Base/Error.h"
#include "Core/Base/NumberText.h"
#include "Core/Base/TextFile.h"
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <set>

namespace echorama {
namespace {

using Json = nlohmann::ordered_json;
using Eigen::Vector3d;

constexpr const char* schemaName = "echorama-scene-1";
constexpr std::size_t longestText = 4096, longestList = 100000;

/// What a number may be.
struct Range {
  double low, high;
  bool open = false; ///< low itself is not in it

  bool Holds(double value) const { return value <= high && (open ? value > low : value >= low); }
  std::string Text() const { return (open ? "(" : "[") + NumberText(low) + ", " + NumberText(high) + "]"; }
};

constexpr Range anywhere{-1e5, 1e5}; // mm; a hundred metres
constexpr Range turns{-3600.0, 3600.0}, weights{0.0, 1e9};

template <class T>
using Choices = std::vector<std::pair<const char*, T>>;

/// One form that an item of the list of tissue may have.
template <class T>
struct Form {
  const char* key;
  const char* help;
};

std::string Shown(const Json& value)
{
  const std::string text = value.dump(-1, ' ', true);
  return text.size() <= 60 ? text : text.substr(0, 60) + " ...";
}

std::string Join(const std::vector<std::string>& names)
{
  std::string text;
  for (const std::string& name : names)
    text += (text.empty() ? "" : ", ") + name;
  return text;
}

bool IsAffine(const Eigen::Matrix4d& rows)
{
  return rows.allFinite() && rows.row(3) == Eigen::RowVector4d(0.0, 0.0, 0.0, 1.0);
}

// ---- checks beyond the ranges; a message without its place ----

[[noreturn]] void RefuseScene(const std::string& reason)
{
  throw Error(Error::Kind::InvalidParameter, reason);
}

template <class T>
void Validate(const T&)
{
}

void Validate(const ScenePlace& place)
{
  if (!place.rows)
    return;
  if (!IsAffine(*place.rows))
    RefuseScene("the last row must be 0 0 0 1");
  const Eigen::Matrix3d linear = place.rows->topLeftCorner<3, 3>();
  if (!(linear.determinant() > 1e-12 * std::pow(linear.norm(), 3)))
    RefuseScene("the matrix mirrors or flattens what it moves");
}

void Validate(const ScenePose& pose)
{
  if (pose.rows) {
    if (!IsAffine(*pose.rows) || !IsRotation(pose.rows->topLeftCorner<3, 3>()))
      RefuseScene("the matrix is not rigid: a rotation and a translation, with 0 0 0 1 as its last row");
    return;
  }
  const Vector3d beam = pose.target - pose.face;
  if (!(beam.norm() > 1e-6))
    RefuseScene("face and target are the same point");
  if (!(pose.fan.cross(beam).norm() > 1e-6 * pose.fan.norm() * beam.norm()))
    RefuseScene("the fan lies along the beam");
}

void Validate(const SceneProbe& probe)
{
  probe.Resolve();
}

void Validate(const ScenePacking& packing)
{
  packing.spheres.Check();
  if (std::none_of(packing.materials.begin(), packing.materials.end(), [](const auto& share) { return share.weight > 0.0; }))
    RefuseScene("no material has a weight above 0");
}

void Validate(const AnatomyParameters& anatomy)
{
  anatomy.Check();
}

void Validate(const CalibrationRigParameters& rig)
{
  rig.Check();
}

void Validate(const SceneTransport& transport)
{
  transport.sound.Check();
  transport.counting.Check();
}

void Validate(const Transducer& transducer)
{
  transducer.Check();
}

void Validate(const Receiver& receiver)
{
  receiver.Check();
}

void Validate(const SceneCylinder& cylinder)
{
  if (!((cylinder.to - cylinder.from).norm() > 1e-6))
    RefuseScene("from and to are the same point");
}

void Validate(const SceneRecording& recording)
{
  const Eigen::Matrix4d matrix = recording.trackerToWorld.Matrix().matrix();
  if (!IsRotation(matrix.topLeftCorner<3, 3>()))
    RefuseScene("trackerToWorld is not rigid");
}

constexpr std::uint64_t largestSeed = 9223372036854775807u; // VTK's seeds have a sign

// What an item has from its scene unless it says otherwise.
template <class T>
void Inherit(const SynthesisScene&, T&)
{
}

void Inherit(const SynthesisScene& scene, ScenePacking& packing)
{
  packing.spheres.seed = scene.seed;
}

void Inherit(const SynthesisScene& scene, AnatomyParameters& anatomy)
{
  anatomy.seed = scene.seed;
}

// ---- the keys of everything ----

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
  a.Text("file", mesh.file, true, "A closed surface, as a path from the scene's folder: .vtp, .ply, .stl, .obj, .glb.");
  a.Choice("unit", mesh.unit, Choices<SceneMesh::Unit>{{"mm", SceneMesh::Unit::Millimetres}, {"m", SceneMesh::Unit::Metres}},
           "Of the file.");
  a.Choice("axes", mesh.axes, Choices<SceneMesh::Axes>{{"lps", SceneMesh::Axes::Lps}, {"y-up", SceneMesh::Axes::YUp}},
           "Of the file: lps, or y up and z to the front (glTF).");
  a.MaterialName("material", mesh.material, true);
  a.Matrix("transform", mesh.transform, "What is done with it then.");
}

template <class A>
void Describe(A& a, SceneSphere& sphere)
{
  a.Vector("centre", sphere.centre, anywhere, "mm");
  a.Number("radius", sphere.radius, {0.0, 1e4, true}, "mm");
  a.MaterialName("material", sphere.material, true);
}

template <class A>
void Describe(A& a, SceneBox& box)
{
  a.Vector("centre", box.centre, anywhere, "mm");
  a.Vector("size", box.size, {0.0, 1e4, true}, "Edges, mm.");
  a.Vector("rotationDegrees", box.rotationDegrees, turns, "Axis times angle, about the centre.");
  a.MaterialName("material", box.material, true);
}

template <class A>
void Describe(A& a, SceneCylinder& cylinder)
{
  a.Vector("from", cylinder.from, anywhere, "Middle of one end, mm.");
  a.Vector("to", cylinder.to, anywhere, "Middle of the other end, mm.");
  a.Number("radius", cylinder.radius, {0.0, 1e4, true}, "mm");
  a.MaterialName("material", cylinder.material, true);
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
  a.List("tgcPoints", receiver.tgcPoints, false, "Further gain, linear between points.");
  a.Number("dynamicRangeDb", receiver.dynamicRangeDb, {10.0, 200.0}, "How many dB the 255 steps of grey span.");
  a.Number("referenceGrey", receiver.referenceGrey, {0.0, 255.0}, "Mean grey of the reference tissue at a gain of 0.");
  a.Number("noiseDb", receiver.noiseDb, {Receiver::noNoiseDb, 100.0}, "Of the electronics, before all gain; -200: none.");
  a.Seed("noiseSeed", receiver.noiseSeed, "Of that noise.");
}

template <class A>
void Describe(A& a, CalibrationRigParameters::Ball& ball)
{
  a.Text("name", ball.name, false, "Of the landmark.");
  a.Vector("centre", ball.centre, {-1000.0, 1000.0}, "mm, in the rig: z = 0 is the plate's upper side, -z is up to the probe.");
  a.Number("radius", ball.radius, {0.5, 30.0}, "mm");
}

template <class A>
void Describe(A& a, CalibrationRigParameters& rig)
{
  a.List("balls", rig.balls, false, "Seven of different sizes and heights, if they are not said.");
  a.Number("scale", rig.scale, {0.2, 5.0}, "Size of the whole rig.");
  a.Number("plateDepthMm", rig.plateDepthMm, {10.0, 500.0}, "z of the plate's upper side in the world.");
  a.Number("plateMm", rig.plateMm, {0.0, 50.0}, "Thickness of the glass; 0: neither plate nor stems.");
  a.Number("baseMm", rig.baseMm, {0.0, 20.0}, "Thickness of the slab on the glass that the pins stand on; 0: none.");
  a.Number("stemRadiusMm", rig.stemRadiusMm, {0.0, 5.0}, "Of the pins that carry the balls; 0: none.");
  a.Number("waterCelsius", rig.waterCelsius, {0.0, 95.0}, "Temperature of the bath, which sets its speed of sound.");
  a.Number("detailMm", rig.detailMm, {0.1, 5.0}, "Edge of the triangles of the balls.");
  a.Text("material", rig.material, false, "Of balls and stems: a standard one.");
}

constexpr std::pair<const char*, Sampling> samplings[] = {
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
  a.Object("counting", transport.counting, false, "Of the mode counting.");
}

template <class A>
void Describe(A& a, SceneItem& item)
{
  a.Text("name", item.name, false, "Of the body.");
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
  a.Matrix("middle", row.middle, "Where the middle of the row is held.");
}

template <class A>
void Describe(A& a, SceneViews& views)
{
  a.List("poses", views.poses, true, "The views, one by one: ProbeToWorld.");
}

template <class A>
void Describe(A& a, SceneRecording& recording)
{
  a.Text("file", recording.file, true, "A tracked sequence, as a path from the scene's folder.");
  a.Text("transform", recording.transform, false, "From the probe to the tracker or a reference, by its name in the file.");
  a.Matrix("trackerToWorld", recording.trackerToWorld, "Where the tracker is in the world; rigid.");
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
  a.Object("recording", key.recording, true, "Views along a recorded path.");
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
  a.Text("name", scene.name, false, "Short; files are named after it.");
  a.Text("about", scene.about, false, "For people.");
  a.Seed("seed", scene.seed, "Of everything random that has no seed of its own.");
  a.Object("probe", scene.probe, false, "The probe: a preset, and what is to be different.");
  if constexpr (A::reads)
    scene.transducer = ProbePresetOf(scene.probe.preset).transducer;
  a.ObjectOfPreset("transducer", scene.transducer, "How it sends and listens; numbers that are not said are the preset's.");
  a.Object("receiver", scene.receiver, false, "From echoes to grey.");
  a.Object("transport", scene.transport, false, "How sound is followed, and how echoes are made.");
  a.Materials("materials", scene.materials, "Materials of this scene by name, beside the standard ones.");
  a.MaterialName("background", scene.background, false);
  a.List("tissue", scene.tissue, false, "What lies in the world; where several hold a point the later counts.");
  a.Views("views", scene.views, "From where the probe looks.");
  a.Object("sweep", scene.sweep, false, "The time a sweep takes, and the motion meanwhile.");
  a.Object("volume", scene.volume, false, "The volumes that are made.");
}

// ---- reading ----

/// One object of the text, key by key.
class Reader {
public:
  static constexpr bool reads = true;
  struct Source {
    std::string name;
    const SynthesisScene* scene = nullptr; ///< whose materials are read so far
  };

  Reader(const Source& text, const Json& object, std::string path) : text_(text), object_(object), path_(std::move(path))
  {
    if (!object.is_object())
      Fail(path_, "an object is needed, not " + Shown(object));
  }

  /// Reads all of \a value, whose keys must all be known.
  template <class T>
  static void Read(const Source& text, const Json& json, const std::string& path, T& value)
  {
    Reader reader(text, json, path);
    Describe(reader, value);
    reader.Finish();
    reader.Try(path, [&value] { Validate(value); });
  }

  void Constant(const char* key, const char* wanted)
  {
    const Json* found = Find(key);
    if (!found)
      Fail(path_, Missing(key));
    if (!found->is_string() || found->get<std::string>() != wanted)
      Fail(At(key), Shown(*found) + " is not known; \"" + wanted + "\" is needed");
  }

  void Text(const char* key, std::string& value, bool needed, const char*)
  {
    if (const Json* found = FindNeeded(key, needed)) {
      if (!found->is_string())
        Fail(At(key), "a text is needed, not " + Shown(*found));
      value = found->get<std::string>();
      if (value.size() > longestText || value.find('\0') != std::string::npos || (needed && value.empty()))
        Fail(At(key), "the text must be of 1 to " + std::to_string(longestText) + " characters");
    }
  }

  template <class T>
  void Number(const char* key, T& value, const Range& range, const char*)
  {
    if (const Json* found = Find(key))
      value = NumberFrom<T>(*found, At(key), range);
  }
  template <class T>
  void Number(const char* key, std::optional<T>& value, const Range& range, const char*)
  {
    if (const Json* found = Find(key))
      value = NumberFrom<T>(*found, At(key), range);
  }

  void Seed(const char* key, std::uint64_t& value, const char*)
  {
    if (const Json* found = Find(key)) {
      if (!found->is_number_unsigned() || found->get<std::uint64_t>() > largestSeed)
        Fail(At(key), "a whole number in [0, 2^63) is needed, not " + Shown(*found));
      value = found->get<std::uint64_t>();
    }
  }

  void Flag(const char* key, bool& value, const char*)
  {
    if (const Json* found = Find(key)) {
      if (!found->is_boolean())
        Fail(At(key), "true or false is needed, not " + Shown(*found));
      value = found->get<bool>();
    }
  }

  template <class T>
  void Choice(const char* key, T& value, const Choices<T>& choices, const char*)
  {
    if (const Json* found = Find(key)) {
      std::string names;
      for (const auto& [name, choice] : choices) {
        if (found->is_string() && found->get<std::string>() == name) {
          value = choice;
          return;
        }
        names += std::string(names.empty() ? "\"" : ", \"") + name + "\"";
      }
      Fail(At(key), Shown(*found) + " is not known; there are " + names);
    }
  }

  void Vector(const char* key, Vector3d& value, const Range& range, const char*)
  {
    if (const Json* found = Find(key)) {
      if (!found->is_array() || found->size() != 3)
        Fail(At(key), "a list of 3 numbers is needed, not " + Shown(*found));
      for (std::size_t i = 0; i < 3; ++i)
        value[static_cast<Eigen::Index>(i)] = NumberFrom<double>((*found)[i], At(key, i), range);
    }
  }

  void MaterialName(const char* key, std::string& value, bool needed)
  {
    Text(key, value, needed, nullptr);
    Try(At(key), [this, &value] { text_.scene->MaterialOf(value); });
  }

  template <class T>
  void Object(const char* key, T& value, bool needed, const char*)
  {
    if (const Json* found = FindNeeded(key, needed))
      Read(text_, *found, At(key), value);
  }

  template <class T>
  void ObjectOfPreset(const char* key, T& value, const char* help)
  {
    Object(key, value, false, help);
  }

  /// Rows, or an object.
  template <class T>
  void Matrix(const char* key, T& value, const char*)
  {
    if (const Json* found = Find(key))
      ReadMatrix(*found, At(key), value);
  }

  template <class T>
  void List(const char* key, std::vector<T>& values, bool needed, const char*)
  {
    const Json* found = FindNeeded(key, needed);
    if (!found)
      return;
    if (!found->is_array() || found->size() > longestList || (needed && found->empty()))
      Fail(At(key), "a list of up to " + std::to_string(longestList) + (needed ? " and at least one" : "") + " is needed, not " +
                        Shown(*found));
    values.clear();
    for (std::size_t i = 0; i < found->size(); ++i) {
      values.emplace_back();
      if constexpr (std::is_same_v<T, ScenePose>)
        ReadMatrix((*found)[i], At(key, i), values.back());
      else
        Read(text_, (*found)[i], At(key, i), values.back());
    }
  }

  template <class Variant, class... T>
  void OneOf(Variant& value, const Form<T>&... forms)
  {
    const int there = (static_cast<int>(object_.contains(forms.key)) + ...);
    if (there != 1)
      Fail(path_, (there == 0 ? "one of " : "just one of ") + Join({forms.key...}) + " is needed");
    const auto read = [this, &value](const auto& form, auto fresh) {
      if (const Json* found = Find(form.key)) {
        Inherit(*text_.scene, fresh);
        Read(text_, *found, At(form.key), fresh);
        value = std::move(fresh);
      }
    };
    (read(forms, T()), ...);
  }

  void Shares(const char* key, std::vector<ScenePacking::Share>& shares, const char*)
  {
    const Json* found = Find(key);
    if (!found)
      return;
    if (!found->is_object())
      Fail(At(key), "an object of weights by material is needed, not " + Shown(*found));
    shares.clear();
    for (const auto& [name, weight] : found->items()) {
      Try(At(key), [this, &name = name] { text_.scene->MaterialOf(name); });
      shares.push_back({name, NumberFrom<double>(weight, At(key) + "." + name, weights)});
    }
  }

  template <class Variant>
  void Views(const char* key, Variant& value, const char*)
  {
    const Json* found = Find(key);
    if (!found)
      return;
    if (found->is_object() && found->contains("recording")) {
      RecordingKey recording{value.template emplace<SceneRecording>()};
      Read(text_, *found, At(key), recording);
    } else if (found->is_object() && found->contains("poses"))
      Read(text_, *found, At(key), value.template emplace<SceneViews>());
    else
      Read(text_, *found, At(key), value.template emplace<SceneRow>());
  }

  void Materials(const char* key, std::vector<Material>& materials, const char*)
  {
    const Json* found = Find(key);
    if (!found)
      return;
    if (!found->is_object())
      Fail(At(key), "an object of materials by name is needed, not " + Shown(*found));
    materials.clear();
    for (const auto& [name, json] : found->items()) {
      const std::string place = At(key) + "." + name;
      if (name.empty() || name.size() > 100)
        Fail(At(key), "the name of a material must be of 1 to 100 characters");
      Reader reader(text_, json, place);
      std::string like;
      reader.Text("like", like, false, nullptr);
      Material material;
      if (!like.empty())
        reader.Try(place + ".like", [this, &like, &material] { material = text_.scene->MaterialOf(like); });
      material.name = name;
      Describe(reader, material);
      reader.Finish();
      reader.Try(place, [&material] { material.Check(); });
      materials.push_back(material);
    }
  }

  /// Refuses keys that nobody asked for.
  void Finish() const
  {
    for (const auto& item : object_.items())
      if (std::find(known_.begin(), known_.end(), item.key()) == known_.end())
        Fail(At(item.key().c_str()), "there is no such key; there are " + Join(known_));
  }

  /// Names the key to what other kernels complain of.
  template <class F>
  void Try(const std::string& path, F&& f) const
  {
    try {
      f();
    } catch (const Error& error) {
      Fail(path, error.what());
    }
  }

  [[noreturn]] void Fail(const std::string& path, const std::string& reason) const
  {
    throw Error(Error::Kind::BadFile, text_.name + ": " + (path.empty() ? "" : path + ": ") + reason);
  }

private:
  std::string At(const char* key) const { return path_.empty() ? key : path_ + "." + key; }
  std::string At(const char* key, std::size_t index) const { return At(key) + "[" + std::to_string(index) + "]"; }
  static std::string Missing(const char* key) { return std::string("\"") + key + "\" is missing"; }

  const Json* Find(const char* key)
  {
    known_.push_back(key);
    const auto found = object_.find(key);
    return found == object_.end() ? nullptr : &*found;
  }

  const Json* FindNeeded(const char* key, bool needed)
  {
    const Json* found = Find(key);
    if (!found && needed)
      Fail(path_, Missing(key));
    return found;
  }

  template <class T>
  T NumberFrom(const Json& json, const std::string& path, const Range& range) const
  {
    if (!json.is_number())
      Fail(path, "a number is needed, not " + Shown(json));
    const auto value = json.get<double>();
    if (!range.Holds(value))
      Fail(path, Shown(json) + " is out of range; it must be in " + range.Text());
    if constexpr (std::is_integral_v<T>)
      if (value != std::floor(value))
        Fail(path, "a whole number is needed, not " + Shown(json));
    return static_cast<T>(value);
  }

  template <class T>
  void ReadMatrix(const Json& json, const std::string& path, T& value) const
  {
    if (!json.is_array()) {
      Read(text_, json, path, value);
      return;
    }
    const auto wrong = [this, &json, &path] { Fail(path, "4 rows of 4 numbers are needed, not " + Shown(json)); };
    if (json.size() != 4)
      wrong();
    Eigen::Matrix4d rows;
    for (std::size_t i = 0; i < 4; ++i) {
      if (!json[i].is_array() || json[i].size() != 4)
        wrong();
      for (std::size_t j = 0; j < 4; ++j)
        rows(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) =
            NumberFrom<double>(json[i][j], path + "[" + std::to_string(i) + "][" + std::to_string(j) + "]", {-1e9, 1e9});
    }
    value.rows = rows;
    Try(path, [&value] { Validate(value); });
  }

  const Source& text_;
  const Json& object_;
  std::string path_;
  std::vector<std::string> known_;
};

Json Parse(const std::string& name, const std::string& text)
{
  const auto fail = [&name](const std::string& reason) { throw Error(Error::Kind::BadFile, name + ": " + reason); };
  std::vector<std::set<std::string>> keys; // of the objects that are open
  const auto watch = [&fail, &keys](int depth, Json::parse_event_t event, const Json& parsed) {
    if (depth > 32)
      fail("its lists are nested more than 32 deep"); // an attack on the stack
    if (event == Json::parse_event_t::object_start)
      keys.emplace_back();
    else if (event == Json::parse_event_t::object_end)
      keys.pop_back();
    else if (event == Json::parse_event_t::key && !keys.back().insert(parsed.get<std::string>()).second)
      fail("the key " + Shown(parsed) + " is there twice in one object");
    return true;
  };
  try {
    return Json::parse(text.begin(), text.end(), watch);
  } catch (const nlohmann::json::exception& problem) {
    fail("it is not JSON (" + std::string(problem.what()).substr(0, 200) + ")");
  }
  return {};
}

// ---- writing ----

class Writer {
public:
  static constexpr bool reads = false;
  template <class T>
  static Json Write(T& value)
  {
    Writer writer;
    Describe(writer, value);
    return std::move(writer.object_);
  }

  void Constant(const char* key, const char* text) { object_[key] = text; }
  void Text(const char* key, const std::string& value, bool needed, const char*)
  {
    if (needed || !value.empty())
      object_[key] = value;
  }
  template <class T>
  void Number(const char* key, const T& value, const Range&, const char*)
  {
    object_[key] = value;
  }
  template <class T>
  void Number(const char* key, const std::optional<T>& value, const Range&, const char*)
  {
    if (value)
      object_[key] = *value;
  }
  void Seed(const char* key, std::uint64_t value, const char*) { object_[key] = value; }
  void Flag(const char* key, bool value, const char*) { object_[key] = value; }
  template <class T>
  void Choice(const char* key, const T& value, const Choices<T>& choices, const char*)
  {
    for (const auto& [name, choice] : choices)
      if (choice == value)
        object_[key] = name;
    if (!object_.contains(key)) {
      if constexpr (std::is_same_v<T, std::string>)
        object_[key] = value; // for the reader to refuse
    }
  }
  void Vector(const char* key, const Vector3d& value, const Range&, const char*)
  {
    object_[key] = Json::array({value.x(), value.y(), value.z()});
  }
  void MaterialName(const char* key, const std::string& value, bool) { object_[key] = value; }
  template <class T>
  void Object(const char* key, T& value, bool, const char*)
  {
    object_[key] = Write(value);
  }
  template <class T>
  void ObjectOfPreset(const char* key, T& value, const char*)
  {
    object_[key] = Write(value);
  }
  template <class T>
  void Matrix(const char* key, T& value, const char*)
  {
    object_[key] = MatrixOf(value);
  }
  template <class T>
  void List(const char* key, std::vector<T>& values, bool, const char*)
  {
    Json list = Json::array();
    for (T& value : values)
      if constexpr (std::is_same_v<T, ScenePose>)
        list.push_back(MatrixOf(value));
      else
        list.push_back(Write(value));
    object_[key] = std::move(list);
  }
  template <class Variant, class... T>
  void OneOf(Variant& value, const Form<T>&... forms)
  {
    const auto write = [this](const auto& form, auto* held) {
      if (held)
        object_[form.key] = Write(*held);
    };
    (write(forms, std::get_if<T>(&value)), ...);
  }
  template <class Variant>
  void Views(const char* key, Variant& value, const char*)
  {
    if (auto* recording = std::get_if<SceneRecording>(&value)) {
      RecordingKey under{*recording};
      object_[key] = Write(under);
    } else if (auto* views = std::get_if<SceneViews>(&value))
      object_[key] = Write(*views);
    else
      object_[key] = Write(std::get<SceneRow>(value));
  }
  void Shares(const char* key, const std::vector<ScenePacking::Share>& shares, const char*)
  {
    Json object = Json::object();
    for (const ScenePacking::Share& share : shares)
      object[share.material] = share.weight;
    object_[key] = std::move(object);
  }
  void Materials(const char* key, std::vector<Material>& materials, const char*)
  {
    Json object = Json::object();
    for (Material& material : materials)
      object[material.name] = Write(material);
    object_[key] = std::move(object);
  }

private:
  template <class T>
  static Json MatrixOf(T& value)
  {
    if (!value.rows)
      return Write(value);
    Json rows = Json::array();
    for (Eigen::Index i = 0; i < 4; ++i)
      rows.push_back(Json::array({(*value.rows)(i, 0), (*value.rows)(i, 1), (*value.rows)(i, 2), (*value.rows)(i, 3)}));
    return rows;
  }

  Json object_ = Json::object();
};

// ---- the schema ----

class SchemaMaker {
public:
  static constexpr bool reads = false;
  /// Of the objects that have the keys of T.
  template <class T>
  static Json Make(T&& value)
  {
    SchemaMaker maker;
    Describe(maker, value);
    Json schema{{"type", "object"}, {"properties", std::move(maker.properties_)}, {"additionalProperties", false}};
    if (!maker.required_.empty())
      schema["required"] = std::move(maker.required_);
    if (!maker.oneOf_.empty())
      schema["oneOf"] = std::move(maker.oneOf_);
    return schema;
  }

  void Constant(const char* key, const char* text)
  {
    properties_[key] = {{"const", text}};
    required_.push_back(key);
  }
  void Text(const char* key, const std::string& value, bool needed, const char* help)
  {
    Add(key, {{"type", "string"}, {"maxLength", longestText}}, help, needed);
    if (needed)
      properties_[key]["minLength"] = 1;
    else
      properties_[key]["default"] = value;
  }
  template <class T>
  void Number(const char* key, const T& value, const Range& range, const char* help)
  {
    Add(key, NumberSchema<T>(range), help);
    properties_[key]["default"] = value;
  }
  template <class T>
  void Number(const char* key, const std::optional<T>&, const Range& range, const char* help)
  {
    Add(key, NumberSchema<T>(range), help);
  }
  void Seed(const char* key, std::uint64_t value, const char* help)
  {
    Add(key, {{"type", "integer"}, {"minimum", 0}, {"maximum", largestSeed}, {"default", value}}, help);
  }
  void Flag(const char* key, bool value, const char* help) { Add(key, {{"type", "boolean"}, {"default", value}}, help); }
  template <class T>
  void Choice(const char* key, const T& value, const Choices<T>& choices, const char* help)
  {
    Json names = Json::array();
    Json standard;
    for (const auto& [name, choice] : choices) {
      names.push_back(name);
      if (choice == value)
        standard = name;
    }
    Add(key, {{"enum", std::move(names)}, {"default", std::move(standard)}}, help);
  }
  void Vector(const char* key, const Vector3d& value, const Range& range, const char* help)
  {
    Add(key,
        {{"type", "array"},
         {"items", NumberSchema<double>(range)},
         {"minItems", 3},
         {"maxItems", 3},
         {"default", Json::array({value.x(), value.y(), value.z()})}},
        help);
  }
  void MaterialName(const char* key, const std::string& value, bool needed)
  {
    Add(key, {{"type", "string"}}, "Name of a material.", needed);
    if (!needed)
      properties_[key]["default"] = value;
  }
  template <class T>
  void Object(const char* key, T& value, bool needed, const char* help)
  {
    Add(key, Make(value), help, needed);
  }
  template <class T>
  void ObjectOfPreset(const char* key, T& value, const char* help)
  {
    Add(key, WithoutDefaults(Make(value)), help);
  }
  template <class T>
  void Matrix(const char* key, T& value, const char* help)
  {
    Add(key, MatrixSchema(value), help);
  }
  template <class T>
  void List(const char* key, std::vector<T>&, bool needed, const char* help)
  {
    Json items;
    if constexpr (std::is_same_v<T, ScenePose>)
      items = MatrixSchema(T());
    else
      items = Make(T());
    Add(key, {{"type", "array"}, {"items", std::move(items)}, {"maxItems", longestList}}, help, needed);
    if (needed)
      properties_[key]["minItems"] = 1;
  }
  template <class Variant, class... T>
  void OneOf(Variant&, const Form<T>&... forms)
  {
    (Add(forms.key, Make(T()), forms.help), ...);
    oneOf_ = Json::array();
    (oneOf_.push_back({{"required", {forms.key}}}), ...);
  }
  template <class Variant>
  void Views(const char* key, Variant&, const char* help)
  {
    SceneRecording recording;
    Add(key, {{"oneOf", Json::array({Make(SceneRow()), Make(SceneViews()), Make(RecordingKey{recording})})}}, help);
  }
  void Materials(const char* key, std::vector<Material>&, const char* help)
  {
    Json material = WithoutDefaults(Make(Material())); // they are those of the material which this one is like
    material["properties"]["like"] = {{"type", "string"},
                                      {"description", "The material that it is like but for what is said here."}};
    Add(key, {{"type", "object"}, {"additionalProperties", std::move(material)}}, help);
  }
  void Shares(const char* key, const std::vector<ScenePacking::Share>& shares, const char* help)
  {
    Json standard = Json::object();
    for (const ScenePacking::Share& share : shares)
      standard[share.material] = share.weight;
    Add(key, {{"type", "object"}, {"additionalProperties", NumberSchema<double>(weights)}, {"default", std::move(standard)}},
        help);
  }

private:
  static Json WithoutDefaults(Json schema)
  {
    for (auto& property : schema["properties"])
      property.erase("default");
    return schema;
  }

  void Add(const char* key, Json schema, const char* help, bool needed = false)
  {
    schema["description"] = help;
    properties_[key] = std::move(schema);
    if (needed)
      required_.push_back(key);
  }

  template <class T>
  static Json NumberSchema(const Range& range)
  {
    return {{"type", std::is_integral_v<T> ? "integer" : "number"},
            {range.open ? "exclusiveMinimum" : "minimum", range.low},
            {"maximum", range.high}};
  }

  template <class T>
  static Json MatrixSchema(T&& value)
  {
    Json row{{"type", "array"}, {"items", {{"type", "number"}}}, {"minItems", 4}, {"maxItems", 4}};
    Json rows{{"type", "array"}, {"items", std::move(row)}, {"minItems", 4}, {"maxItems", 4}};
    rows["description"] = "The rows of a 4 x 4 matrix.";
    return {{"oneOf", Json::array({std::move(rows), Make(value)})}};
  }

  Json properties_ = Json::object(), required_ = Json::array(), oneOf_;
};

} // namespace

Eigen::Affine3d ScenePlace::Matrix() const
{
  if (rows)
    return Eigen::Affine3d(*rows);
  Eigen::Affine3d matrix = Eigen::Affine3d::Identity();
  matrix.linear() = scale * ExpRotation(RadiansPerDegree * rotationDegrees);
  matrix.translation() = translation;
  return matrix;
}

Pose ScenePose::ProbeToWorld() const
{
  Pose pose = Pose::Identity();
  if (rows) {
    pose.matrix() = *rows;
    // Rows that were rounded for a file are made a rotation again.
    const Eigen::Matrix3d rotation = pose.linear();
    if (!IsRotation(rotation, 1e-12))
      pose.linear() = Eigen::Quaterniond(rotation).normalized().toRotationMatrix();
    return pose;
  }
  const Vector3d z = (target - face).normalized(), x = (fan - fan.dot(z) * z).normalized();
  pose.linear().col(0) = x;
  pose.linear().col(1) = z.cross(x);
  pose.linear().col(2) = z;
  pose.translation() = face;
  return pose;
}

ProbePreset SceneProbe::Resolve() const
{
  ProbePreset probe = ProbePresetOf(preset);
  ProbeGeometry& head = probe.probe;
  const auto bend = [](const char* what, const std::optional<double>& angleDegrees, const std::optional<double>& radius,
                       const std::optional<double>& newWidth, double& angle, double& width) {
    if (radius && newWidth)
      RefuseScene(std::string(what) + "RadiusMm and " + what + "WidthMm say the same; give one of them");
    const double oldRadius = angle > 0.0 ? width / angle : 0.0;
    const bool bent = angle > 0.0;
    if (angleDegrees)
      angle = RadiansPerDegree * *angleDegrees;
    if (newWidth)
      width = *newWidth;
    else if (radius)
      width = angle * *radius;
    else if (angleDegrees && bent)
      width = angle * oldRadius;
  };
  bend("fan", fanAngleDegrees, fanRadiusMm, fanWidthMm, head.fanAngle, head.fanWidth);
  bend("sweep", sweepAngleDegrees, sweepRadiusMm, sweepWidthMm, head.sweepAngle, head.sweepWidth);
  head.depthMin = depthMinMm.value_or(head.depthMin);
  head.depthMax = depthMaxMm.value_or(head.depthMax);
  probe.elements = elements.value_or(probe.elements);
  probe.samples = samples.value_or(probe.samples);
  probe.sweepSteps = sweepSteps.value_or(probe.sweepSteps);
  if (!sweepSteps && probe.sweepSteps == 1 && !head.IsPlane())
    RefuseScene("the preset is of a single plane; say sweepSteps to sweep it");
  if (probe.sweepSteps > 1 && head.IsPlane())
    RefuseScene("sweepSteps is " + std::to_string(probe.sweepSteps) + ", but the sweep has neither angle nor width");
  head.Check();
  if (probe.sweepSteps == 1)
    head.sweepAngle = head.sweepWidth = 0.0;
  return probe;
}

Eigen::Affine3d SceneMesh::ToWorld() const
{
  Eigen::Matrix3d linear = Eigen::Matrix3d::Identity();
  if (axes == Axes::YUp)
    linear << 1, 0, 0, 0, 0, -1, 0, 1, 0;
  return transform.Matrix() * Eigen::Affine3d((unit == Unit::Metres ? 1000.0 : 1.0) * linear);
}

Pose SceneSweep::ProbeToWorldAt(const Pose& middle, double secondsFromMiddle) const
{
  Pose motion(ExpRotation(secondsFromMiddle * RadiansPerDegree * turnDegreesPerSecond));
  motion.translation() = secondsFromMiddle * velocityMmPerSecond;
  return middle * motion;
}

const Material& SynthesisScene::MaterialOf(const std::string& wanted) const
{
  std::string names;
  for (const std::vector<Material>* list : {&materials, &StandardMaterials()})
    for (const Material& material : *list) {
      if (material.name == wanted)
        return material;
      names += (names.empty() ? "" : ", ") + material.name;
    }
  throw Error(Error::Kind::InvalidParameter, "there is no material " + Shown(wanted) + "; there are " + names);
}

SynthesisParameters SynthesisScene::Parameters() const
{
  const ProbePreset resolved = probe.Resolve();
  SynthesisParameters parameters;
  parameters.mode = transport.mode;
  parameters.probe = resolved.probe;
  parameters.elements = resolved.elements;
  parameters.steps = resolved.sweepSteps;
  parameters.samples = resolved.samples;
  parameters.transducer = transducer;
  parameters.transport = transport.sound;
  parameters.subRays = transport.subRays;
  parameters.sampling = transport.sampling;
  parameters.mirrorDb = transport.mirrorDb;
  parameters.counting = transport.counting;
  parameters.counting.assumedSoundSpeed = transducer.assumedSoundSpeed;
  parameters.counting.seed = seed;
  parameters.receiver = receiver;
  parameters.seed = seed;
  return parameters;
}

PackedTissueParameters SynthesisScene::ParametersOf(const ScenePacking& packing) const
{
  PackedTissueParameters parameters;
  parameters.packing = packing.spheres;
  parameters.background = MaterialOf(background);
  parameters.materials.clear();
  for (const ScenePacking::Share& share : packing.materials)
    parameters.materials.push_back({MaterialOf(share.material), share.weight});
  parameters.cell.mm = packing.cellMm;
  parameters.cell.growth = packing.cellGrowth;
  parameters.deviation = packing.deviation;
  parameters.trueVolume = packing.trueVolume;
  parameters.turned = packing.turned;
  return parameters;
}

std::string SynthesisScene::PathOf(const std::string& file) const
{
  const std::filesystem::path path(file);
  if (!dataFolder.empty())
    return (std::filesystem::path(dataFolder) / path.filename()).string();
  return path.is_absolute() || folder.empty() ? file : (std::filesystem::path(folder) / path).lexically_normal().string();
}

void SynthesisScene::Check(const std::string& title) const
{
  for (std::size_t i = 0; i < materials.size(); ++i)
    for (std::size_t j = 0; j < i; ++j)
      if (materials[i].name == materials[j].name)
        throw Error(Error::Kind::BadFile, title + ": materials." + materials[i].name + ": it is there twice");
  SynthesisScene copy = *this;
  SceneFromJson(Writer::Write(copy).dump(), title);
}

SynthesisScene SceneFromJson(const std::string& text, const std::string& name, const std::optional<std::uint64_t>& seed)
{
  SynthesisScene scene;
  const Reader::Source place{name, &scene};
  Json json = Parse(name, text);
  if (json.is_object())
    json.erase("$schema"); // a hint for editors
  if (seed && json.is_object())
    json["seed"] = *seed;
  Reader::Read(place, json, "", scene);
  if (scene.sweep.alongRecording && !std::holds_alternative<SceneRecording>(scene.views))
    throw Error(Error::Kind::BadFile, name + ": sweep.alongRecording: the views are not those of a recording");
  return scene;
}

SynthesisScene ReadScene(const std::string& path, const std::optional<std::uint64_t>& seed)
{
  SynthesisScene scene = SceneFromJson(ReadTextFile(path), path, seed);
  scene.folder = std::filesystem::path(path).parent_path().string();
  return scene;
}

std::string SceneToJson(const SynthesisScene& scene)
{
  scene.Check();
  SynthesisScene copy = scene;
  return Writer::Write(copy).dump(2) + "\n";
}

std::string SceneSchema()
{
  Json schema{{"$schema", "https://json-schema.org/draft/2020-12/schema"},
              {"title", "Scene of synthetic ultrasound"},
              {"description",
               "What lies in the world, which probe looks at it from where, and how it is made into volumes. Lengths "
               "in mm, angles in degrees; missing keys have their defaults."}};
  schema.update(SchemaMaker::Make(SynthesisScene()));
  schema["properties"]["$schema"] = {{"type", "string"}, {"description", "For editors."}};
  return schema.dump(2) + "\n";
}

} // namespace echorama
