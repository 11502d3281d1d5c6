// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Geometry/ProbeGeometry.h"
#include "Core/Geometry/ProbePresets.h"
#include "Filters/Phantoms/Anatomy.h"
#include "Filters/Phantoms/CalibrationRig.h"
#include "Filters/Physics/GelCoat.h"
#include "Filters/Physics/ProbeShape.h"
#include "Filters/Physics/TissueLattice.h"
#include "Filters/Tissue/Material.h"
#include "Filters/Tissue/PackedTissue.h"
#include "Receiver.h"
#include "Synthesize.h"
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

/// One entry of the list of tissue; it may stand for many bodies. Where several hold a point the later counts.
struct SceneItem {
  std::string name; ///< may be empty
  std::variant<ScenePacking, SceneMesh, AnatomyParameters, CalibrationRigParameters, SceneSphere, SceneBox, SceneCylinder> what;
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

/// Views along the path of a tracked probe that was recorded.
struct SceneRecording {
  std::string file;                         ///< a sequence file; PathOf() resolves it
  std::string transform = "ProbeToTracker"; ///< which of its transforms; "ProbeToReference" may be composed
  ScenePlace trackerToWorld;                ///< rigid
  double smoothSeconds = 0.1;               ///< sigma of the smoothing
  double longestGapSeconds = 0.5;           ///< drop-outs up to this are bridged
  int count = 3;                            ///< evenly from the first pose to the last
};

/// The time a sweep takes and how the probe moves meanwhile; each plane is then imaged at its own pose.
struct SceneSweep {
  double seconds = 0.0;                                           ///< 0: all planes at once
  Eigen::Vector3d velocityMmPerSecond = Eigen::Vector3d::Zero();  ///< in the probe's frame
  Eigen::Vector3d turnDegreesPerSecond = Eigen::Vector3d::Zero(); ///< axis times angle in the probe's frame, about its face
  bool alongRecording = false; ///< the motion is that of the recording around the moment of the view; views need one

  /// Where the probe is at \a seconds from the middle of the sweep, when the recording does not say it.
  Pose ProbeToWorldAt(const Pose& middle, double secondsFromMiddle) const;
};

struct SceneVolume {
  double spacingMm = 1.0;                   ///< of the cubic voxels
  double knockMm = 8.0, knockDegrees = 6.0; ///< how far every volume but the first is put out of place
};

ParameterList Describe(SceneVolume& volume);

/// How tissue gives way to the probe: each view presses it from rest.
struct ScenePress {
  TissueLatticeParameters lattice;
  TissuePressParameters tissue;
  ProbeHead head;
};
ParameterList Describe(ScenePress& press);

/// Gel on the face of the probe, pressed by each view; all around is air.
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
  std::variant<SceneRow, SceneViews, SceneRecording> views;
  SceneSweep sweep;
  std::optional<ScenePress> press; ///< none: tissue is where it is, whatever the probe does
  std::optional<SceneGel> gel;     ///< none: the background couples wherever it is no gas
  SceneVolume volume;

  // Where files are looked for; not part of the JSON.
  std::string folder;     ///< that of the scene: relative paths begin here
  std::string dataFolder; ///< if not empty, all files lie in it, whatever folder the scene names

  /// The scene's material of that name, or the standard one. \throws Error(InvalidParameter) that lists the names.
  const Material& MaterialOf(const std::string& name) const;

  /// What one volume is made with, the probe's pose apart. \throws Error(InvalidParameter) as SceneProbe::Resolve().
  SynthesisParameters Parameters() const;

  /// With the scene's materials. \throws Error(InvalidParameter) for a material that is not there.
  PackedTissueParameters ParametersOf(const ScenePacking& packing) const;

  /// A file as it can be opened.
  std::string PathOf(const std::string& file) const;

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
