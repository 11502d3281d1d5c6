// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Parameters.h"
#include "Core/Geometry/RigidTransform.h"
#include <string>
#include <variant>
#include <vector>

namespace echorama {

/// An ellipsoid in the world.
struct Ellipsoid {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  Eigen::Vector3d radii = Eigen::Vector3d::Ones();
  Eigen::Vector3d rotation = Eigen::Vector3d::Zero();
};

/// Everything within a radius of a line through points: a vessel. The ends are round.
struct Tube {
  std::vector<Eigen::Vector3d> path; ///< mm, at least two points
  double radius = 1.0;
};

/// A body in the scene. How loud it echoes is given in dB beside the background.
struct Inclusion {
  /// Echogenicity of clear fluid: nothing comes back.
  static constexpr double anechoicDb = -120.0;

  std::string name;
  std::variant<Ellipsoid, Tube> shape;
  double echogenicityDb = 0.0;
  double wallMm = 0.0;
  double wallDb = 0.0;
  double attenuationDbPerMm = 0.0;
};

/// Without the path, and without name and shape.
ParameterList Describe(Ellipsoid& ellipsoid);
ParameterList Describe(Tube& tube);
ParameterList Describe(Inclusion& inclusion);

/// What lies in the world: a background of 0 dB and bodies in it. Where bodies overlap the later one counts.
struct PhantomScene {
  std::vector<Inclusion> inclusions;

  /// Throws Error(InvalidParameter) that names the inclusion and the number which is out of range.
  void Check() const;
};

/// An invented piece of abdomen below a probe at the origin that looks along +z: an organ with a capsule, under a layer of
/// muscle; curved and branching vessels, cysts, bright and dark lesions, a kidney-like body, grains, and a stone that casts
/// a shadow. No symmetry. About 200 x 130 x 110 mm: room for three or four overlapping views.
PhantomScene DefaultScene();

/// Bodies that come and go, as the jets of urine in a bladder do: clouds of echoes in the fluids of the default scene and two
/// bright puffs in its tissue. Added to the scene of one volume of two, they are there in that one only.
std::vector<Inclusion> Jets();

/// Only background: uniform speckle.
inline PhantomScene UniformScene()
{
  return {};
}

/// {"schema": "echorama-phantom-1", "inclusions": [{"name": .., "ellipsoid": {"centre": [3], "radii": [3], "rotation": [3]}
/// or "tube": {"path": [[3], ...], "radius": ..}, "echogenicityDb": .., "wallMm": .., "wallDb": .., "attenuationDbPerMm":
/// ..}, ...]}; millimetres, rotation in radians. Numbers are written so that they come back bit by bit.
std::string PhantomToJson(const PhantomScene& scene);

/// Reads it back, also from what DescribePhantom() says; the numbers besides the shape may be missing (0).
/// \throws Error(BadFile) with the way to the key that is wrong, and what Check() throws.
PhantomScene PhantomFromJson(const std::string& text);

/// Distance in mm from \a point to the surface, negative inside. Exact for tubes; for ellipsoids exact on the surface and
/// good to first order near it.
double SignedDistance(const Ellipsoid& ellipsoid, const Eigen::Vector3d& point);
double SignedDistance(const Tube& tube, const Eigen::Vector3d& point);

/// Answers for many points what lies there. Keeps a copy of the scene, which must pass Check().
class SceneLookup {
public:
  explicit SceneLookup(const PhantomScene& scene);

  /// Echogenicity in dB at a point of the world.
  double EchogenicityAt(const Eigen::Vector3d& point) const;

  /// The same as a factor on amplitudes, 10^(dB / 20).
  double AmplitudeAt(const Eigen::Vector3d& point) const;

private:
  struct Body {
    Eigen::AlignedBox3d box;
    std::variant<Ellipsoid, Tube> shape;
    Eigen::Matrix3d worldToAxes; // of an ellipsoid
    double wallMm, db, wallDb, amplitude, wallAmplitude;
  };
  /// The body that counts at the point and whether the point is in its wall; nullptr: background.
  const Body* BodyAt(const Eigen::Vector3d& point, bool& inWall) const;

  std::vector<Body> bodies_; // the one that counts most comes first
};

} // namespace echorama
