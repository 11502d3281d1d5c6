// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "BodySurface.h"
#include <string>

namespace echorama {

/// Places for calibration on a dome about the origin, the upper half of a sphere: one at the top, the others along a spiral, such
/// that there are \a horizon times as many per mm^2 at the horizon as at the top, for a lens compresses what is near the horizon.
/// The lowest lie \a lowestDegrees above it. \throws Error(InvalidParameter)
std::vector<Eigen::Vector3d> DomeMarks(int count, double radiusMm, double horizon = 3.0, double lowestDegrees = 5.0);

/// An order in which a person finds the next one: rings from the top down, each all around, beginning near where the one above
/// ended. \a up is a unit vector. \returns places in the list, first to last
std::vector<std::size_t> OrderMarks(const std::vector<Eigen::Vector3d>& marks, const Eigen::Vector3d& up);

/// How well a proxy stands for a body.
struct ProxyFit {
  double meanMm = 0.0, mostMm = 0.0;                  ///< from places of the body to the proxy
  double farthestMarkMm = 0.0;                        ///< from any place of the body to the nearest mark
  Eigen::Vector3d farthest = Eigen::Vector3d::Zero(); ///< that place
};

/// At the body's points whose height along \a up is at least \a level. \throws Error(BadInput) for a proxy without triangles or
/// no marks
ProxyFit MeasureProxy(const TriangleSurface& body, const TriangleSurface& proxy, const std::vector<Eigen::Vector3d>& marks,
                      const Eigen::Vector3d& up, double level, const Progress& progress = {});

/// A page to print: a map of numbered marks as seen against \a up, joined in their order, and a table of their coordinates. HTML
/// with an SVG picture; it needs no other file.
std::string MarksGuide(const std::vector<Eigen::Vector3d>& marks, const Eigen::Vector3d& up);

} // namespace echorama
