// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Geometry/ProbeGeometry.h"
#include "Core/Geometry/ProbePresets.h"
#include "Filters/Acoustics/Synthesize.h"
#include "Filters/Phantoms/Anatomy.h"
#include "Filters/Phantoms/CalibrationRig.h"
#include "Filters/Phantoms/PhantomScene.h"
#include "Filters/Physics/GelCoat.h"
#include "Filters/Physics/ProbeShape.h"
#include "Filters/Physics/TissueLattice.h"
#include "Filters/Tissue/Material.h"
#include "Filters/Tissue/PackedTissue.h"
#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

namespace echorama {

/// A scene on disk: what lies in the world, which probe looks at it from where, and how it is made into volumes. JSON of the
/// schema "echorama-scene-1" (Examples/scenes/echorama-scene-1.schema.json says it key by key, as SceneSchema() does).
///
/// Numbers are kept as the file says them, so that a scene which is written comes back bit by bit. Lengths are in mm and angles
/// in degrees. Materials are named, here and in the file; MaterialOf() finds them.

/// Where something is turned and moved to.
struct ScenePlace {
  /// Both may be given as one matrix (rows; affine) instead of the three below.
  std::optional<Eigen::Matrix4d> rows;
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();     ///< mm, comes last
  Eigen::Vector3d rotationDegrees = Eigen::Vector3d::Zero(); ///< axis times angle
  double scale = 1.0;                                        ///< comes first

  Eigen::Affine3d Matrix() const;
};

/// Where a probe is held.
struct ScenePose {
  std::optional<Eigen::Matrix4d> rows;            ///< ProbeToWorld, rigid, instead of the three below
  Eigen::Vector3d face = Eigen::Vector3d::Zero(); ///< where the middle of the face is, mm
  Eigen::Vector3d target = {0.0, 0.0, 50.0};      ///< a point that the middle beam looks at, mm
  Eigen::Vector3d fan = Eigen::Vector3d::UnitX(); ///< direction of the fan; its part along the beam is taken off

  Pose ProbeToWorld() const;
};

/// The probe: a preset, and what is to be different. A radius goes with its angle (width = angle * radius); a change of the
/// angle alone keeps the preset's radius.
struct SceneProbe {
  std::string preset = "mechanical-3d"; ///< one of ProbePresets()
  std::optional<double> fanAngleDegrees, fanRadiusMm, fanWidthMm;
  std::optional<double> sweepAngleDegrees, sweepRadiusMm, sweepWidthMm;
  std::optional<double> depthMinMm, depthMaxMm;
  std::optional<int> elements, sweepSteps, samples;

  /// The preset with these changes. One step of the sweep is the middle plane alone, whatever the sweep's angle.
  /// \throws Error(InvalidParameter) that names the number.
  ProbePreset Resolve() const;
};

/// Triangles from a file.
struct SceneMesh {
  enum class Unit { Millimetres, Metres };
  enum class Axes {
    Lps, ///< +x to the patient's left, +y to the back, +z to the head
    YUp, ///< +x to the patient's left, +y to the head, +z to the front, as in glTF
  };
  std::string file; ///< as the scene says it; PathOf() resolves it
  Unit unit = Unit::Millimetres;
  Axes axes = Axes::Lps;
  std::string material = "tissue";
  ScenePlace transform; ///< after unit and axes

  /// From the file's coordinates to the world.
  Eigen::Affine3d ToWorld() const;
};

struct SceneSphere {
  Eigen::Vector3d centre = {0.0, 0.0, 50.0}; ///< mm
  double radius = 10.0;                      ///< mm
  std::string material = "liver";
};

struct SceneBox {
  Eigen::Vector3d centre = {0.0, 0.0, 50.0};                 ///< mm
  Eigen::Vector3d size = {20.0, 20.0, 20.0};                 ///< mm
  Eigen::Vector3d rotationDegrees = Eigen::Vector3d::Zero(); ///< axis times angle, about the centre
  std::string material = "liver";
};

struct SceneCylinder {
  Eigen::Vector3d from = {0.0, -50.0, 50.0}; ///< mm, the middle of one end
  Eigen::Vector3d to = {0.0, 50.0, 50.0};    ///< mm, of the other
  double radius = 5.0;                       ///< mm
  std::string material = "blood";
};

/// Packed spheres, with materials by name. Without a seed of its own it has the scene's.
struct ScenePacking {
  struct Share {
    std::string material;
    double weight = 1.0; ///< beside the others'
  };
  PackedTissueParameters tissue; ///< but its materials
  std::vector<Share> materials = {{"lesion-dark", 2.0}, {"liver", 2.0}, {"lesion-bright", 2.0}, {"cyst", 1.0}};
};

/// Bodies of the phantom, by how loud they echo beside a background. As surfaces: a wall is a body around another.
struct ScenePhantom {
  enum class Bodies {
    Body, ///< DefaultScene()
    Jets, ///< Jets(), which come and go
  };
  Bodies bodies = Bodies::Body;
  PhantomScene listed;               ///< if not empty, these instead
  std::string background = "tissue"; ///< the material of 0 dB

  PhantomScene Scene() const;
};

/// One entry of the list of tissue; it may stand for many bodies. Where several hold a point the later counts.
struct SceneItem {
  static constexpr int mostViews = 1000;

  std::string name; ///< may be empty
  std::variant<ScenePacking, SceneMesh, AnatomyParameters, CalibrationRigParameters, ScenePhantom, SceneSphere, SceneBox,
               SceneCylinder>
      what;
  int firstView = 1, lastView = mostViews; ///< it is there in these alone, counted from 1: a body that comes and goes
};

/// Views side by side along a convex body, as PhantomViews() places them.
struct SceneRow {
  int count = 3;
  double overlap = 0.55; ///< fraction that neighbours share
  ScenePose middle;      ///< where the middle of the row is held
};

/// Views one by one.
struct SceneViews {
  std::vector<ScenePose> poses;
};

/// When volumes are taken along a path, and how finely what the probe moves is followed.
struct ScenePathViews {
  int count = 3;             ///< evenly from the first pose to the last
  std::vector<double> times; ///< s; if not empty, these instead, in rising order
  double stepMm = 4.0;       ///< the farthest that any part of the probe's head goes between two states of tissue and gel
};
ParameterList Describe(ScenePathViews& views);

/// Views along the path of a tracked probe that was recorded.
struct SceneRecording : ScenePathViews {
  std::string file;                         ///< a sequence file; PathOf() resolves it
  std::string transform = "ProbeToTracker"; ///< which of its transforms; "ProbeToReference" may be composed
  ScenePlace trackerToWorld;                ///< rigid
  double smoothSeconds = 0.1;               ///< sigma of the smoothing
  double longestGapSeconds = 0.5;           ///< drop-outs up to this are bridged
};

/// Views along a path of poses that the scene states, straight from each to the next.
struct SceneMotion : ScenePathViews {
  struct Key {
    double seconds = 0.0; ///< in rising order
    ScenePose pose;
  };
  std::vector<Key> keys;
};

/// The time a sweep takes and how the probe moves meanwhile; each plane is then imaged at its own pose.
struct SceneSweep {
  double seconds = 0.0;                                           ///< 0: all planes at once
  Eigen::Vector3d velocityMmPerSecond = Eigen::Vector3d::Zero();  ///< in the probe's frame
  Eigen::Vector3d turnDegreesPerSecond = Eigen::Vector3d::Zero(); ///< axis times angle in the probe's frame, about its face
  bool alongRecording = false; ///< the motion is that of the recording or the keys around the moment of the view
  /// Over how many states of tissue and gel a sweep that moves is divided; each plane sees the state of its part.
  int states = 3;

  /// Where the probe is at \a seconds from the middle of the sweep, when no path says it.
  Pose ProbeToWorldAt(const Pose& middle, double secondsFromMiddle) const;
};

/// What sets views of one body apart, beside where the probe is.
struct SceneChange {
  double decorrelation = 0.0; ///< of the speckle, between any two views
  double ribShare = 0.0;      ///< of the fan, in the shadow of a rib before every view but the first
  double gainDb = 0.0;        ///< of every second view, beside the others
};
ParameterList Describe(SceneChange& change);

struct SceneVolume {
  double spacingMm = 1.0;                   ///< of the cubic voxels
  double knockMm = 8.0, knockDegrees = 6.0; ///< how far every volume but the first is put out of place
};

ParameterList Describe(SceneVolume& volume);

/// How tissue gives way to the probe. Views along a path press it on the way; others press it from rest.
struct ScenePress {
  TissueLatticeParameters lattice;
  TissuePressParameters tissue;
  ProbeHead head;
};
ParameterList Describe(ScenePress& press);

/// Gel on the face of the probe; all around is air. It is put on once for views along a path, else anew for each view.
struct SceneGel {
  GelCoatParameters coat;
  GelMaterial material;
};
ParameterList Describe(SceneGel& gel);

struct SynthesisScene {
  std::string name = "scene";
  std::string about;      ///< for people; may be empty
  std::uint64_t seed = 1; ///< of everything random that has no seed of its own
  SceneProbe probe;
  Transducer transducer = ProbePresetOf("mechanical-3d").transducer; ///< numbers that a file does not say are the preset's
  Receiver receiver = SynthesisParameters::DefaultReceiver();
  EchoModel echoes;                ///< counting's speed of sound is the transducer's, its seed the scene's
  std::vector<Material> materials; ///< the scene's own, which come before the standard ones
  std::string background = "water";
  std::vector<SceneItem> tissue;
  std::variant<SceneRow, SceneViews, SceneRecording, SceneMotion> views;
  SceneSweep sweep;
  SceneChange change;
  std::optional<ScenePress> press; ///< none: tissue is where it is, whatever the probe does
  std::optional<SceneGel> gel;     ///< none: the background couples wherever it is no gas
  SceneVolume volume;

  // Where files are looked for; not part of the JSON.
  std::string folder;     ///< that of the scene: relative paths begin here
  std::string dataFolder; ///< if not empty, all files lie in it, whatever folder the scene names

  /// The scene's material of that name, or the standard one. \throws Error(InvalidParameter) that lists the names.
  const Material& MaterialOf(const std::string& name) const;

  /// Those of a path, or nullptr.
  const ScenePathViews* PathViews() const;

  /// What one volume is made with, the probe's pose apart. \throws Error(InvalidParameter) as SceneProbe::Resolve().
  SynthesisParameters Parameters() const;

  /// With the scene's materials. \throws Error(InvalidParameter) for a material that is not there.
  PackedTissueParameters ParametersOf(const ScenePacking& packing) const;

  /// A file as it can be opened.
  std::string PathOf(const std::string& file) const;

  /// Names all files by their full paths, so that they stay what they are in a scene that is written. \returns them.
  std::vector<std::string> MakeFilesAbsolute();
  /// When they were last changed, as a text; files that cannot be found are left out.
  std::string TimesOfFiles() const;

  /// \throws Error(BadFile) as SceneFromJson does, with \a name in the place of the file.
  void Check(const std::string& name = "scene") const;
};

/// Reads a scene. Keys that are missing have the defaults above; keys that are not known are errors, as is a key that is there
/// twice.
/// \param name what messages call the text
/// \param seed stands in the place of the scene's, also for the items that have none of their own
/// \throws Error(BadFile) with the path to the wrong key: "scene.json: tissue[2].mesh.material: there is no material
/// \"lver\"; there are ..."; for numbers it tells the range.
SynthesisScene SceneFromJson(const std::string& text, const std::string& name, const std::optional<std::uint64_t>& seed = {});

/// The same from a file, in whose folder other files are looked for. \throws also Error(FileSystem).
SynthesisScene ReadScene(const std::string& path, const std::optional<std::uint64_t>& seed = {});

/// Every number of the scene, in a form that is read back bit by bit. \throws Error as Check().
std::string SceneToJson(const SynthesisScene& scene);

/// The JSON Schema (draft 2020-12) of scenes, made from the same list of keys and ranges that the reader uses.
std::string SceneSchema();

} // namespace echorama
