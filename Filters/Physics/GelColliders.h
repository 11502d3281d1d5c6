// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Parameters.h"
#include "Core/Geometry/ImageGeometry.h"
#include "Filters/Physics/ProbeShape.h"
#include <array>
#include <memory>
#include <vector>

namespace echorama {

/// A solid as its signed distance, in mm and in its own frame: negative inside.
class GelShape {
public:
  virtual ~GelShape() = default;
  /// \a when: 0 at the begin of a motion, 1 at its end, for shapes that deform.
  virtual double Distance(const Eigen::Vector3d& point, double when) const = 0;
  /// Unit vector that points out of the solid.
  virtual Eigen::Vector3d Normal(const Eigen::Vector3d& point, double when) const;
  /// How far what the solid is made of goes during a motion, mm, near a point whose Normal is known.
  virtual Eigen::Vector3d Shift(const Eigen::Vector3d& /*point*/, const Eigen::Vector3d& /*normal*/) const
  {
    return Eigen::Vector3d::Zero();
  }
};

/// What lies below z = 0.
class GelPlane : public GelShape {
public:
  double Distance(const Eigen::Vector3d& point, double when) const override;
  Eigen::Vector3d Normal(const Eigen::Vector3d& point, double when) const override;
};

/// The head of a probe, in the probe's frame.
class GelProbe : public GelShape {
public:
  explicit GelProbe(ProbeShape shape) : shape_(std::move(shape)) {}
  double Distance(const Eigen::Vector3d& point, double /*when*/) const override { return shape_.Distance(point); }

private:
  ProbeShape shape_;
};

/// Anything sampled on a grid, for instance the skin: distances are interpolated linearly, and beyond the grid
/// those of its border hold.
class GelDistanceGrid : public GelShape {
public:
  /// A solid at rest. \throws Error(BadInput) when sizes differ or a distance is not finite
  GelDistanceGrid(const ImageGeometry& geometry, std::vector<float> distances);
  /// One that deforms during a motion. \a shifts: how far it goes; none: no further than distances tell, along its normals.
  GelDistanceGrid(const ImageGeometry& geometry, std::vector<float> atBegin, std::vector<float> atEnd,
                  std::vector<Eigen::Vector3f> shifts = {});
  double Distance(const Eigen::Vector3d& point, double when) const override;
  Eigen::Vector3d Shift(const Eigen::Vector3d& point, const Eigen::Vector3d& normal) const override;

private:
  struct Corners { // of the cell that holds a point
    std::array<std::size_t, 8> at;
    std::array<double, 8> weight;
  };
  Corners CornersOf(const Eigen::Vector3d& point) const;
  static double ValueAt(const std::vector<float>& values, const Corners& corners)
  {
    double sum = 0.0;
    for (std::size_t n = 0; n < 8; ++n)
      sum += corners.weight[n] * static_cast<double>(values[corners.at[n]]);
    return sum;
  }
  ImageGeometry geometry_;
  Eigen::Affine3d toIndex_;
  std::vector<float> begin_, end_;
  std::vector<Eigen::Vector3f> shifts_;
};

/// What happens where gel touches a solid.
struct GelContact {
  bool stick = true;     ///< gel keeps to the solid, as it does to skin and to a probe
  double friction = 0.0; ///< Coulomb's coefficient of gel that slides; it may also leave the solid
};
ParameterList Describe(GelContact& p);

/// A solid that moves while gel advances. Its motion is even from \a begin to \a end.
struct GelCollider {
  std::shared_ptr<const GelShape> shape;
  GelContact contact;
  Pose begin = Pose::Identity(), end = Pose::Identity(); ///< shape to world
};

/// Colliders as they are during one step.
class GelColliders {
public:
  /// \throws Error(InvalidParameter) that names the collider
  GelColliders(const std::vector<GelCollider>& colliders, double seconds);

  /// The step from \a from to \a to, in parts of the motion.
  void SetStep(double from, double to);
  std::size_t Size() const { return colliders_.size(); }
  bool Sticks(std::size_t n) const { return colliders_[n].contact.stick; }
  /// mm from collider \a n, negative inside.
  double Distance(std::size_t n, const Eigen::Vector3d& point) const;
  /// Unit vector that points out of it.
  Eigen::Vector3d Normal(std::size_t n, const Eigen::Vector3d& point) const;
  /// mm/s, of what it is made of. \param normal Normal() there
  Eigen::Vector3d Velocity(std::size_t n, const Eigen::Vector3d& point, const Eigen::Vector3d& normal) const;
  /// What contact with collider \a n leaves of the velocity of gel in it.
  Eigen::Vector3d Collide(std::size_t n, const Eigen::Vector3d& point, const Eigen::Vector3d& velocity) const;

private:
  std::vector<GelCollider> colliders_;
  double seconds_, when_ = 0.0;
  std::vector<Pose> toShape_; ///< at the step's begin
  std::vector<Pose> motion_;  ///< of the world with the solid, in the step
  double step_ = 0.0;
};

} // namespace echorama
