// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "AcousticScene.h"
#include "Core/Base/Parameters.h"
#include "Interface.h"
#include "RaySamples.h"
#include "SoundPath.h"

namespace echorama {

/// How sound is followed through a scene.
struct SoundTransport {
  int maxBounces = 4;
  double dynamicRangeDb = 120.0;
  bool refraction = true;
  double faceReflection = 0.2;
  double faceRadius = 20.0; ///< mm, of a disc in the plane of the element
  double acceptanceDegrees = 5.0;
  int maxSegments = 10000;
};

ParameterList Describe(SoundTransport& t);

/// What the scanner sends and assumes.
struct SoundConditions {
  double frequencyMHz = 3.5;
  double assumedSoundSpeed = 1540.0; ///< m/s
  double maxScanDepth = 150.0;       ///< mm
};

ParameterList Describe(SoundConditions& c);

/// Where a ray begins.
struct RayStart {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();     ///< mm, world
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ(); ///< unit vector
  Eigen::Vector3d across = Eigen::Vector3d::UnitX();    ///< unit vector along the fan, perpendicular to the direction
  BodySet inside;                                       ///< AcousticScene::BodiesAt(origin)
  double scanDepth = 0.0;                               ///< mm that it has behind it: for sub-apertures
  double amplitude = 1.0;                               ///< there and back
  /// What has been reflected is not followed, nor its echoes kept, below this amplitude; the dynamic range counts too.
  double leastReflected = 0.0;
};

/// Follows rays through a scene: the direct way first, bent where the speed of sound changes, then what was reflected, and what
/// is reflected from there.
///
/// Amplitudes count there and back, for echoes return the way they came: what passes an interface keeps its transmitted
/// energy T, what is reflected by it and comes back to it once more keeps R, and R + T = 1. An echo of the surface itself has
/// the signed reflected pressure, times how much of it turns back to the element: a Gaussian in the angle to the normal
/// (mirror), and for rough surfaces a Lambert lobe of which the aperture catches a part.
///
/// The scene must outlive it. Thread safe.
class SoundTracer {
public:
  /// \throws Error(InvalidParameter) for a number out of its range.
  SoundTracer(const AcousticScene& scene, const SoundTransport& transport, const SoundConditions& conditions);

  /// \a path is overwritten (its memory is used again). \a samples, if any, turn the reflections of rough surfaces: each is a
  /// mirror, or with the probability of its roughness goes any way (Lambert). Without them all are mirrors.
  void Trace(const RayStart& start, SoundPath& path, RaySamples* samples = nullptr) const;

private:
  struct Way;
  struct Medium {
    Fluid fluid;
    double attenuation; ///< nepers per mm, there and back
    double depthPerMm;
    double roughness;
    double taken; ///< of what the face gives off: all, but for gas, which takes next to nothing
  };
  double WayToFace(const RayStart& start, const Eigen::Vector3d& place, const Eigen::Vector3d& direction) const;
  void Follow(Way& way, const RayStart& start, SoundPath& path, RaySamples* samples, std::vector<Way>& reflections) const;

  const AcousticScene& scene_;
  SoundTransport transport_;
  SoundConditions conditions_;
  std::vector<Medium> media_;
  double leastAmplitude_;
  double acceptance_; ///< radians
  double caught_;     ///< share of a Lambert lobe's energy that the aperture catches, seen head-on
};

/// The way of one ray: see SoundTracer, which is faster for many.
SoundPath TracePath(const AcousticScene& scene, const SoundTransport& transport, const SoundConditions& conditions,
                    const RayStart& start, RaySamples* samples = nullptr);

} // namespace echorama
