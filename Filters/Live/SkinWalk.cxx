// SPDX-License-Identifier: BSD-3-Clause
// Over an edge, a direction keeps its part along the edge and its part across it: that is laying the next triangle flat.
//
// What is shown is another matter. The normal is smooth, so the direction within the triangle has to be carried to the plane
// across that normal, in a way on which both triangles of an edge agree. Turning by the smallest rotation would not do: the two
// results differ by the area between three normals on the unit sphere. At an edge, both agree when the direction of the edge
// itself is carried to its projection. So each edge asks for a small turn on top of the smallest rotation, and within the
// triangle these are blended with weights of which that of an edge is 1 on it, and 0 on the two others.
#include "Filters/Live/SkinWalk.h"
#include "Core/Base/CheckRange.h"
#include "Core/Base/Error.h"
#include <cmath>

namespace echorama {
namespace {

using Eigen::Vector3d;

constexpr double longestStepMm = 1e4;
constexpr int knotTurns = 4096; // edges without a step forward; a point of a mesh has some six

Vector3d Within(const Vector3d& direction, const Vector3d& normal)
{
  return direction - direction.dot(normal) * normal;
}

// Change of the weights per mm in a direction.
Vector3d Rates(const SkinMesh::Face& face, const Vector3d& direction)
{
  Vector3d rates;
  for (Eigen::Index k = 0; k < 3; ++k) {
    const auto n = static_cast<std::size_t>(k);
    rates[k] = face.normal.cross(face.corner[(n + 2) % 3] - face.corner[(n + 1) % 3]).dot(direction) / face.twiceArea;
  }
  return rates;
}

Eigen::Index Next(Eigen::Index k)
{
  return (k + 1) % 3;
}

} // namespace

SkinWalk::SkinWalk(std::shared_ptr<const SkinMesh> mesh) : mesh_(std::move(mesh)), heading_(1.0, 0.0, 0.0)
{
  if (!mesh_)
    throw Error(Error::Kind::BadInput, "there is no skin to walk on");
  SurfacePoint place{0, Vector3d::Constant(1.0 / 3.0)};
  while (mesh_->FaceOf(place.triangle).flat) // a mesh has one that is not
    ++place.triangle;
  Put(place, heading_);
}

void SkinWalk::Put(const SurfacePoint& place, const Vector3d& heading)
{
  if (place.triangle >= mesh_->TriangleCount() || mesh_->FaceOf(place.triangle).flat)
    throw Error(Error::Kind::InvalidParameter,
                "triangle " + std::to_string(place.triangle) + " of the skin is not there, or is flat");
  if (!(place.weights.minCoeff() >= -1e-6) || !(std::abs(place.weights.sum() - 1.0) <= 1e-6))
    throw Error(Error::Kind::InvalidParameter, "the weights are not those of a place on a triangle");
  const SkinMesh::Face face = mesh_->FaceOf(place.triangle);
  Vector3d within = Within(heading, face.normal);
  if (!heading.allFinite() || !(within.norm() > 1e-9 * heading.norm())) {
    within = Within(heading_, face.normal);
    if (!(within.norm() > 1e-6))
      within = face.Edge(0);
  }
  place_.triangle = place.triangle;
  place_.weights = place.weights.cwiseMax(0.0) / place.weights.cwiseMax(0.0).sum();
  heading_ = within.normalized();
}

void SkinWalk::PutNearest(const Vector3d& point)
{
  const auto nearest = mesh_->NearestTo(point);
  if (!nearest)
    throw Error(Error::Kind::InvalidParameter, "the point to be brought to the skin is not finite");
  Put(nearest->place, Heading());
}

bool SkinWalk::PutWhereHit(const Vector3d& origin, const Vector3d& direction)
{
  const auto hit = mesh_->FirstHit(origin, direction);
  if (hit)
    Put(hit->place, Heading());
  return hit.has_value();
}

void SkinWalk::Turn(double angle)
{
  CheckRange("the angle to turn by", angle, -1e6, 1e6);
  const SkinMesh::Face face = mesh_->FaceOf(place_.triangle);
  heading_ = Within(Eigen::AngleAxisd(angle, -face.normal) * heading_, face.normal).normalized();
}

// Goes over an edge, with \a direction and our own, to a triangle that is not flat: \a face becomes that one.
// \returns the edge of it that was crossed, -1 at a border.
int SkinWalk::Cross(SkinMesh::Face& face, int edge, Vector3d& direction)
{
  const Vector3d along = face.Edge(edge), outward = along.cross(face.normal);
  const double parts[] = {direction.dot(along), direction.dot(outward), heading_.dot(along), heading_.dot(outward)};
  SurfacePoint next = place_;
  for (int flat = 0; flat < knotTurns; ++flat) {
    const std::uint32_t beyond = mesh_->Beyond(next.triangle, edge);
    if (beyond == SkinMesh::none)
      return -1;
    const double part = next.weights[Next(edge)]; // of the point that their edge comes to
    const auto m = static_cast<Eigen::Index>(beyond % 3);
    next.triangle = beyond / 3;
    next.weights[m] = 0.0;
    next.weights[Next(m)] = 1.0 - part;
    next.weights[Next(Next(m))] = part;
    edge = static_cast<int>(m);
    face = mesh_->FaceOf(next.triangle);
    if (!face.flat) {
      place_ = next;
      const Vector3d theirs = -face.Edge(edge), inward = theirs.cross(face.normal);
      direction = (parts[0] * theirs + parts[1] * inward).normalized();
      heading_ = (parts[2] * theirs + parts[3] * inward).normalized();
      return edge;
    }
    // A line from a to b with c on it, or beyond an end: the way goes on over the edge on the other side of this place.
    const Vector3d &a = face.corner[static_cast<std::size_t>(Next(m))], &b = face.corner[static_cast<std::size_t>(Next(Next(m)))],
                   &c = face.corner[static_cast<std::size_t>(m)];
    const double at = (c - a).dot(b - a) / (b - a).squaredNorm();
    if (part < at) { // over a c
      next.weights[m] = part / at;
      next.weights[Next(m)] = 1.0 - part / at;
      next.weights[Next(Next(m))] = 0.0;
      edge = static_cast<int>(Next(Next(m)));
    } else {
      const double rest = at < 1.0 ? (1.0 - part) / (1.0 - at) : 0.0;
      next.weights[m] = rest;
      next.weights[Next(m)] = 0.0;
      next.weights[Next(Next(m))] = 1.0 - rest;
      edge = static_cast<int>(Next(m));
    }
  }
  return -1;
}

SkinWalk::Moved SkinWalk::Step(double alongMm, double acrossMm)
{
  CheckRange("the step along the array, in mm,", alongMm, -longestStepMm, longestStepMm);
  CheckRange("the step across the array, in mm,", acrossMm, -longestStepMm, longestStepMm);
  const double length = std::hypot(alongMm, acrossMm);
  if (length == 0.0)
    return {};
  SkinMesh::Face face = mesh_->FaceOf(place_.triangle);
  Vector3d direction = (alongMm * heading_ + acrossMm * heading_.cross(face.normal)).normalized();
  double gone = 0.0;
  int entry = -1; // a straight line does not leave a triangle where it came in
  for (int turns = 0; turns < knotTurns; ++turns) {
    const Vector3d rates = Rates(face, direction);
    double way = length - gone;
    int exit = -1;
    for (int k = 0; k < 3; ++k)
      if (k != entry && rates[k] < 0.0 && place_.weights[k] < -rates[k] * way) {
        way = place_.weights[k] / -rates[k];
        exit = k;
      }
    place_.weights += way * rates;
    if (exit >= 0)
      place_.weights[exit] = 0.0;
    if (entry >= 0 && way == 0.0)
      place_.weights[entry] = 0.0;
    place_.weights = place_.weights.cwiseMax(0.0);
    place_.weights /= place_.weights.sum();
    if (exit < 0) {
      heading_ = Within(heading_, face.normal).normalized();
      return {length, Stop::None};
    }
    if (way > 1e-12 * length)
      turns = 0;
    gone += way;
    entry = Cross(face, exit, direction);
    if (entry < 0)
      return {gone, Stop::Border};
  }
  return {gone, Stop::Knot};
}

Vector3d SkinWalk::Heading() const
{
  const SkinMesh::Face face = mesh_->FaceOf(place_.triangle);
  const Vector3d normal = Normal();
  const Eigen::Quaterniond smallest = Eigen::Quaterniond::FromTwoVectors(face.normal, normal);
  const Vector3d heading = smallest * heading_;
  double turn = 0.0, weights = 0.0;
  for (Eigen::Index k = 0; k < 3; ++k) {
    const double weight = place_.weights[Next(k)] * place_.weights[Next(Next(k))];
    const Vector3d edge = face.Edge(static_cast<int>(k)), wanted = Within(edge, normal);
    if (wanted.norm() > 1e-6) { // else the normal lies along the edge
      const Vector3d carried = smallest * edge;
      turn += weight * std::atan2(carried.cross(wanted).dot(normal), carried.dot(wanted));
    }
    weights += weight;
  }
  if (weights > 0.0)
    turn /= weights;
  return Within(Eigen::AngleAxisd(turn, normal) * heading, normal).normalized();
}

Pose SkinWalk::PoseOf(const ProbeHold& hold) const
{
  const Vector3d x = Heading(), z = -Normal();
  Pose pose = Pose::Identity();
  pose.linear().col(0) = x;
  pose.linear().col(1) = z.cross(x);
  pose.linear().col(2) = z;
  pose.translation() = Point() + hold.pressMm * z;
  pose.rotate(Eigen::AngleAxisd(hold.rotate, Vector3d::UnitZ()));
  pose.rotate(Eigen::AngleAxisd(hold.rock, Vector3d::UnitY()));
  pose.rotate(Eigen::AngleAxisd(hold.tilt, Vector3d::UnitX()));
  return pose;
}

} // namespace echorama
