// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Geometry/Landmark.h"
#include "Core/Geometry/ProbeGeometry.h"
#include "Core/Geometry/RigidTransform.h"
#include <cstdint>
#include <vector>

namespace echorama {

/// One volume of a set: where the probe was, and how loud the scanner was set.
struct PhantomView {
  Pose probeToWorld = Pose::Identity();
  double gainDb = 0.0;
};

/// Poses of \a count views that follow each other along a convex body: the probe slides along x, a little along y, and
/// turns as it goes, so that the views see the same tissue under different angles. Neighbours share the fraction
/// \a overlap of the volume that one of them sees, to within 0.01. The middle of the set is at the world's origin, looking
/// along +z. Gains alternate within 2.5 dB.
/// \param count >= 1
/// \param overlap in [0.05, 0.95]
/// \throws Error(InvalidParameter) for anything else, and what ProbeGeometry::Check() throws.
std::vector<PhantomView> PhantomViews(const ProbeGeometry& probe, int count, double overlap = 0.55);

/// The fraction of what \a probe sees at the identity that it also sees at \a pose, by counting points of a 48^3 grid.
double OverlapFraction(const ProbeGeometry& probe, const Pose& pose);

/// A known error of placement: a move by \a mm in a random direction after a turn by \a degrees about a random axis
/// through \a centre, the same for the same \a seed and \a item. Multiply it from the left: knocked * VolumeToWorld.
/// \throws Error(InvalidParameter) when a number is not finite or a size is negative.
Pose KnockedPose(std::uint64_t seed, std::uint64_t item, double mm, double degrees, const Eigen::Vector3d& centre);

/// Places of the tissue that two views at least see, at random: \a count of them, or fewer when they are hard to find.
std::vector<Landmark> SharedPlaces(std::uint64_t seed, int count, const ProbeGeometry& probe, const std::vector<Pose>& views);

} // namespace echorama
