// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Filters/Tissue/TissueSurface.h"
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <functional>
#include <string>
#include <vector>

namespace echorama {

/// Closed surfaces that most bodies are made of: each call adds a body to a tissue, oriented outward, that does not cut itself.
/// They return the new body's index and throw Error(InvalidParameter) for shapes that are none.

/// The distance from the centre to the surface, mm, > 0, in a direction (unit vector). Such bodies are seen whole from their
/// centre.
using RadiusOf = std::function<double(const Eigen::Vector3d& direction)>;

/// A blob: an icosphere, its edges 0.6 to 1.3 times \a detailMm long for a ball, up to the finest there is.
int AddBlob(TissueSurface& tissue, const std::string& name, const Material& material, const Eigen::Vector3d& centre,
            const RadiusOf& radius, double detailMm);

/// The radius of a blob whose surface lies about \a thickness outside of another's, measured along its normal (inside, when
/// negative).
RadiusOf Shell(const RadiusOf& radius, double thickness);

/// An ellipsoid: \a radii along the columns of \a axes.
RadiusOf EllipsoidRadius(const Eigen::Vector3d& radii, const Eigen::Matrix3d& axes = Eigen::Matrix3d::Identity());

/// A tube around a path with round ends, a radius at each point of the path: rings of about \a detailMm between their corners,
/// one at each point. It does not cut itself as long as the path bends less sharply than its radius.
int AddTube(TissueSurface& tissue, const std::string& name, const Material& material, const std::vector<Eigen::Vector3d>& path,
            const std::vector<double>& radius, double detailMm);

/// The height z of a surface above a point of the xy plane.
using HeightOf = std::function<double(double x, double y)>;

/// A block with walls along x and y, between an upper side (the smaller z) and a flat lower one.
int AddBlock(TissueSurface& tissue, const std::string& name, const Material& material, const Eigen::Vector2d& low,
             const Eigen::Vector2d& high, const HeightOf& upperSide, double lowerSide, double detailMm);

} // namespace echorama
