// SPDX-License-Identifier: BSD-3-Clause
// In the coordinates of the beams (the exact inverse of the geometry) each face is a plane, so the signed distance of a point
// from the fan is the greatest of six numbers in mm, and cheap. Its gradient is analytic: a face moves under a parameter by minus
// its normal times the derivative of its point.
#include "Core/Geometry/FanModel.h"
#include <cmath>

namespace echorama {
namespace {

double Sinc(double a)
{
  return std::abs(a) < 1e-4 ? 1.0 - a * a / 6.0 : std::sin(a) / a;
}
double SincDerivative(double a)
{
  return std::abs(a) < 1e-2 ? a * (-1.0 / 3.0 + a * a / 30.0) : (std::cos(a) - std::sin(a) / a) / a;
}

// How ProbeArc::PointOf moves with the angle and with the width, at a fixed place.
struct ArcDerivatives {
  Eigen::Vector2d angle, width;
};
ArcDerivatives DerivativesOf(const ProbeArc& arc, const ProbeArc::Place& at)
{
  const double s = at.along, turn = arc.angle * s, half = 0.5 * turn;
  const double sine = std::sin(half), cosine = std::cos(half);
  ArcDerivatives d;
  d.width = Eigen::Vector2d(s * Sinc(turn), -s * sine * Sinc(half));
  d.angle.x() = arc.width * s * s * SincDerivative(turn) + at.depth * s * std::cos(turn);
  d.angle.y() = -0.5 * arc.width * s * s * (cosine * Sinc(half) + sine * SincDerivative(half)) - at.depth * s * std::sin(turn);
  return d;
}

} // namespace

FanPlace LocateInFan(const ProbeGeometry& shape, const Eigen::Vector3d& inProbe)
{
  FanPlace at;
  const bool plane = shape.IsPlane();
  at.sweep = plane ? ProbeArc::Place{0.0, inProbe.z()} : shape.Sweep().PlaceOf(inProbe.y(), inProbe.z());
  at.fan = shape.Fan().PlaceOf(inProbe.x(), at.sweep.depth);
  at.fan.along -= shape.fanOffset;
  const auto beyond = [&at](FanPlace::Face face, double distance) {
    if (distance > at.distance) {
      at.distance = distance;
      at.face = face;
    }
  };
  at.distance = (std::abs(at.fan.along) - 0.5) * std::abs(shape.Fan().Span(at.fan.depth));
  if (!plane)
    beyond(FanPlace::SweepSide, (std::abs(at.sweep.along) - 0.5) * std::abs(shape.Sweep().Span(at.sweep.depth)));
  beyond(FanPlace::Near, shape.depthMin - at.fan.depth);
  beyond(FanPlace::Far, at.fan.depth - shape.depthMax);
  return at;
}

// How the signed distance of a point changes with the fanUnknowns.
FanVector FanGradient(const ProbeGeometry& shape, const Eigen::Vector3d& inProbe, FanPlace at)
{
  const double fanSign = at.fan.along < 0.0 ? -1.0 : 1.0, sweepSign = at.sweep.along < 0.0 ? -1.0 : 1.0;
  // The foot of the point on the face.
  if (at.face == FanPlace::FanSide)
    at.fan.along = 0.5 * fanSign;
  else if (at.face == FanPlace::SweepSide)
    at.sweep.along = 0.5 * sweepSign;
  else
    at.fan.depth = at.face == FanPlace::Near ? shape.depthMin : shape.depthMax;
  at.fan.along += shape.fanOffset;
  const double phi = shape.fanAngle * at.fan.along, psi = shape.sweepAngle * at.sweep.along;
  const Eigen::Vector3d outward(0.0, std::sin(psi), std::cos(psi)); // along the middle beam of the plane
  const Eigen::Vector3d beam = std::sin(phi) * Eigen::Vector3d::UnitX() + std::cos(phi) * outward;
  Eigen::Vector3d normal = at.face == FanPlace::Far ? beam : Eigen::Vector3d(-beam);
  if (at.face == FanPlace::FanSide)
    normal = fanSign * (std::cos(phi) * Eigen::Vector3d::UnitX() - std::sin(phi) * outward);
  else if (at.face == FanPlace::SweepSide)
    normal = sweepSign * Eigen::Vector3d(0.0, std::cos(psi), -std::sin(psi));

  FanVector gradient;
  gradient.head<3>() = -normal;
  gradient.segment<3>(3) = normal.cross(inProbe);
  const ArcDerivatives fan = DerivativesOf(shape.Fan(), at.fan), sweep = DerivativesOf(shape.Sweep(), at.sweep);
  const double outwardPart = normal.dot(outward);
  gradient[FanModel::FanAngle] = -(normal.x() * fan.angle.x() + outwardPart * fan.angle.y());
  gradient[FanModel::FanWidth] = -(normal.x() * fan.width.x() + outwardPart * fan.width.y());
  gradient[FanModel::SweepAngle] = -normal.tail<2>().dot(sweep.angle);
  gradient[FanModel::SweepWidth] = -normal.tail<2>().dot(sweep.width);
  gradient[FanModel::Length] = at.face == FanPlace::Far ? -1.0 : 0.0;
  gradient[FanModel::FanOffset] = at.face == FanPlace::FanSide ? -fanSign * shape.Fan().Span(at.fan.depth) : 0.0;
  return gradient;
}

double FanVolume(const ProbeGeometry& geometry)
{
  // Over depth the area is a polynomial of degree 2 at most (Simpson's rule is exact), over the fan it is smooth (Gauss).
  constexpr int nodes = 5;
  constexpr double places[nodes] = {0.0, 0.2692346550528415, -0.2692346550528415, 0.4530899229693320, -0.4530899229693320};
  constexpr double shares[nodes] = {0.2844444444444444, 0.2393143352496832, 0.2393143352496832, 0.1184634425280945,
                                    0.1184634425280945};
  const double depths[3] = {geometry.depthMin, 0.5 * (geometry.depthMin + geometry.depthMax), geometry.depthMax};
  const double parts[3] = {1.0 / 6.0, 4.0 / 6.0, 1.0 / 6.0};
  double sum = 0.0;
  for (int d = 0; d < 3; ++d) {
    double across = 1.0;
    if (!geometry.IsPlane()) {
      across = 0.0;
      for (int f = 0; f < nodes; ++f)
        across +=
            shares[f] * std::abs(geometry.Sweep().Span(geometry.Fan().PointOf({places[f] + geometry.fanOffset, depths[d]}).y()));
    }
    sum += parts[d] * geometry.Fan().Span(depths[d]) * across;
  }
  return sum * (geometry.depthMax - geometry.depthMin);
}

} // namespace echorama
