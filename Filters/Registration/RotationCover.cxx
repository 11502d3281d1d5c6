// SPDX-License-Identifier: BSD-3-Clause
// Small cones are a ball of lattice points. A large one is 24 pieces, one around each rotation of a cube; a piece is the set
// of rotations that no other of the 24 is nearer to, and reaches 62.8 degrees from its middle, where the map from rotation
// vectors is still nearly even (0.91 at the far corners). The lattices do not fit where pieces meet: points just beyond a piece
// are added as long as nothing lies near. Points just beyond the cone are drawn back onto its rim, so that the rim is
// covered as well as the inside.
#include "RotationCover.h"
#include "Core/Base/Angles.h"
#include "Core/Base/Error.h"
#include "Core/Geometry/RigidTransform.h"
#include <algorithm>
#include <array>
#include <cmath>

namespace echorama {
namespace {

constexpr double LargestPlainCone = 60.0 * RadiansPerDegree;
constexpr double LargestInPiece = 63.0 * RadiansPerDegree;
constexpr double FillDistance = 0.65; // of the step

// The lattice points within \a radius of the origin, the origin first. Neighbours are \a step apart.
std::vector<Eigen::Vector3d> LatticeBall(double radius, double step)
{
  const double half = step / std::sqrt(3.0); // half the edge of the cube: its centre is a neighbour of its corners
  const int reach = static_cast<int>(std::ceil(radius / half));
  std::vector<Eigen::Vector3d> points;
  for (int k = -reach; k <= reach; ++k)
    for (int j = -reach; j <= reach; ++j)
      for (int i = -reach; i <= reach; ++i) {
        const bool corner = i % 2 == 0 && j % 2 == 0 && k % 2 == 0, centre = i % 2 != 0 && j % 2 != 0 && k % 2 != 0;
        const Eigen::Vector3d p = half * Eigen::Vector3d(i, j, k);
        if ((corner || centre) && p.norm() <= radius)
          points.push_back(p);
      }
  std::stable_sort(points.begin(), points.end(),
                   [](const Eigen::Vector3d& a, const Eigen::Vector3d& b) { return a.norm() < b.norm(); });
  return points;
}

// The 24 rotations that take a cube to itself: permutations of the axes with signs, of determinant 1.
std::vector<Eigen::Matrix3d> CubeRotations()
{
  std::vector<Eigen::Matrix3d> rotations;
  std::array<int, 3> axis{0, 1, 2};
  do
    for (int signs = 0; signs < 8; ++signs) {
      Eigen::Matrix3d m = Eigen::Matrix3d::Zero();
      for (int row = 0; row < 3; ++row)
        m(row, axis[row]) = signs >> row & 1 ? -1.0 : 1.0;
      if (m.determinant() > 0.0)
        rotations.push_back(m);
    }
  while (std::next_permutation(axis.begin(), axis.end()));
  return rotations; // the identity first
}

// A cover of all rotations: lattices around the 24 rotations of a cube.
std::vector<Eigen::Vector3d> FullCover(double step)
{
  const std::vector<Eigen::Matrix3d> cube = CubeRotations();
  std::vector<Eigen::Matrix3d> inside, beyond; // of the piece around the identity
  for (const Eigen::Vector3d& v : LatticeBall(LargestInPiece + step, step)) {
    const Eigen::Matrix3d R = ExpRotation(v);
    const double own = R.trace(); // 1 + 2 cos(angle): the nearest has the largest
    const bool nearest =
        std::all_of(cube.begin(), cube.end(), [&](const Eigen::Matrix3d& g) { return R.cwiseProduct(g).sum() <= own + 1e-9; });
    (nearest ? inside : beyond).push_back(R);
  }
  std::vector<Eigen::Matrix3d> cover;
  for (const Eigen::Matrix3d& R : inside)
    for (const Eigen::Matrix3d& g : cube)
      cover.push_back(g * R);
  const double apart = 1.0 + 2.0 * std::cos(FillDistance * step);
  for (const Eigen::Matrix3d& R : beyond)
    for (const Eigen::Matrix3d& g : cube) {
      const Eigen::Matrix3d candidate = g * R;
      if (std::all_of(cover.begin(), cover.end(),
                      [&](const Eigen::Matrix3d& c) { return candidate.cwiseProduct(c).sum() < apart; }))
        cover.push_back(candidate);
    }
  std::vector<Eigen::Vector3d> vectors;
  for (const Eigen::Matrix3d& R : cover)
    vectors.push_back(LogRotation(R));
  std::stable_sort(vectors.begin(), vectors.end(),
                   [](const Eigen::Vector3d& a, const Eigen::Vector3d& b) { return a.norm() < b.norm(); });
  return vectors;
}

} // namespace

std::vector<Eigen::Matrix3d> RotationCover(double coneDegrees, double stepDegrees)
{
  if (!(coneDegrees >= 0.0 && coneDegrees <= 180.0))
    throw Error(Error::Kind::InvalidParameter, "the cone of rotations must be in [0, 180] degrees");
  if (!(stepDegrees >= 2.0 && stepDegrees <= 90.0))
    throw Error(Error::Kind::InvalidParameter, "the step between rotations must be in [2, 90] degrees");
  const double cone = coneDegrees * RadiansPerDegree, step = stepDegrees * RadiansPerDegree;
  const double coveringRadius = std::sqrt(5.0 / 12.0) * step;

  std::vector<Eigen::Vector3d> vectors;
  const auto add = [&](const Eigen::Vector3d& v) {
    const double angle = v.norm();
    if (angle <= cone)
      vectors.push_back(v);
    else if (angle <= cone + 0.75 * coveringRadius)
      vectors.push_back(v * (cone / angle));
  };
  const bool plain = cone <= LargestPlainCone;
  for (const Eigen::Vector3d& v : plain ? LatticeBall(cone > 0.0 ? cone + coveringRadius : 0.0, step) : FullCover(step))
    add(v);
  std::vector<Eigen::Matrix3d> cover;
  for (const Eigen::Vector3d& v : vectors)
    cover.push_back(ExpRotation(v));
  return cover;
}

} // namespace echorama
