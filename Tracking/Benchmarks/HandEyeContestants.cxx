// SPDX-License-Identifier: BSD-3-Clause
// Unit axes of small turns are mostly noise; where a method speaks of unit axes (Shiu-Ahmad, Horaud) a motion counts by the sine
// of half its angle, squared.
#include "Tracking/Benchmarks/HandEyeContestants.h"
#include "Core/Base/SymmetricMatrix.h"
#include "Tracking/Calibration/HandEyeClosedForms.h"
#include <cmath>

namespace echorama {
namespace {

using Vector9 = Eigen::Matrix<double, 9, 1>;
using Matrix9 = Eigen::Matrix<double, 9, 9>;

// Shiu and Ahmad 1989: each motion leaves the turn of C about its axis open, C = k_A k_B^T + cos(b) Y + sin(b) Z; all these are
// linear in the nine numbers of C and each motion's cosine and sine, which are eliminated.
Eigen::Matrix3d ShiuAhmadRotation(const std::vector<HandEyeTurn>& turns)
{
  Matrix9 normal = Matrix9::Zero();
  Vector9 right = Vector9::Zero();
  for (const HandEyeTurn& turn : turns) {
    if (turn.a.norm() < 1e-9 || turn.b.norm() < 1e-9)
      continue;
    const Eigen::Vector3d a = turn.a.normalized(), b = turn.b.normalized();
    const double weight = std::pow(std::sin(0.5 * turn.b.norm()), 2);
    const Eigen::Matrix3d some = Eigen::Quaterniond::FromTwoVectors(b, a).toRotationMatrix(); // takes k_B to k_A
    const Eigen::Matrix3d x = a * b.transpose(), y = some - x, z = Hat(a) * some;
    // |Y|^2 = |Z|^2 = 2, and Y, Z are orthogonal to each other and to X.
    normal.diagonal().array() += weight;
    for (const Eigen::Matrix3d* m : {&y, &z}) {
      const Eigen::Map<const Vector9> vec(m->data());
      normal -= 0.5 * weight * vec * vec.transpose();
    }
    right += weight * Eigen::Map<const Vector9>(x.data());
  }
  const Vector9 numbers = SolveSymmetric(normal, right);
  const Eigen::Matrix3d rotation = Eigen::Map<const Eigen::Matrix3d>(numbers.data());
  return NearestRotation(rotation.determinant() < 0.0 ? Eigen::Matrix3d(-rotation) : rotation);
}

// Tsai and Lenz 1989: (P_A + P_B) x p = P_B - P_A with P the axis times 2 sin(angle / 2) and p that of C times tan(angle / 2).
// p is infinite where C turns by 180 degrees. So C is sought as C' Q, with Q the identity or half a turn about an axis of the
// volume: of the four, one C' turns by 120 degrees at most. The one that takes the axes of B closest to those of A counts.
Eigen::Matrix3d TsaiLenzRotation(const std::vector<HandEyeTurn>& turns)
{
  Eigen::Matrix3d best = Eigen::Matrix3d::Identity();
  double bestError = -1.0;
  for (int half = 0; half < 4; ++half) {
    Eigen::Vector3d q = -Eigen::Vector3d::Ones(); // the diagonal of Q
    if (half == 3)
      q.setOnes();
    else
      q[half] = 1.0;
    Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    for (const HandEyeTurn& turn : turns) {
      const Eigen::Vector3d a = 2.0 * HandEyeTurn::Quaternion(turn.a).head<3>();
      const Eigen::Vector3d b = q.cwiseProduct(2.0 * HandEyeTurn::Quaternion(turn.b).head<3>());
      const Eigen::Matrix3d cross = Hat(a + b);
      normal += cross.transpose() * cross;
      right += cross.transpose() * (b - a);
    }
    const Eigen::Vector3d p = SolveSymmetric(normal, right);
    if (!p.allFinite())
      continue;
    const Eigen::Matrix3d rotation =
        Eigen::Quaterniond(1.0, p.x(), p.y(), p.z()).normalized().toRotationMatrix() * q.asDiagonal();
    double error = 0.0;
    for (const HandEyeTurn& turn : turns)
      error += (turn.a - rotation * turn.b).squaredNorm();
    if (bestError < 0.0 || error < bestError) {
      bestError = error;
      best = rotation;
    }
  }
  return best;
}

// Horaud and Dornaika 1995: q_A q = q q_B for unit quaternions, with |q| = 1.
Eigen::Matrix3d HoraudRotation(const std::vector<HandEyeTurn>& turns)
{
  Eigen::Matrix4d normal = Eigen::Matrix4d::Zero();
  for (const HandEyeTurn& turn : turns) {
    const Eigen::Vector4d a = HandEyeTurn::Quaternion(turn.a), b = HandEyeTurn::Quaternion(turn.b), difference = a - b;
    Eigen::Matrix4d open = difference[3] * Eigen::Matrix4d::Identity(); // a q - q b
    open.topLeftCorner<3, 3>() += Hat(Eigen::Vector3d((a + b).head<3>()));
    open.topRightCorner<3, 1>() = difference.head<3>();
    open.bottomLeftCorner<1, 3>() = -difference.head<3>().transpose();
    normal += open.transpose() * open;
  }
  const Eigen::Vector4d q = EigenOfSymmetric(normal).vectors.col(0);
  return Eigen::Quaterniond(q[3], q[0], q[1], q[2]).normalized().toRotationMatrix();
}

template <Eigen::Matrix3d (*rotation)(const std::vector<HandEyeTurn>&)>
HandEyeSolution SolveByTurns(const std::vector<HandEyePair>& pairs)
{
  const std::vector<HandEyeMotion> motions = HandEyeMotions(pairs);
  return HandEyeSolutionOf(rotation(HandEyeTurns(motions)), motions, pairs);
}

HandEyeSolution SolveAndreff(const std::vector<HandEyePair>& pairs)
{
  const std::vector<HandEyeMotion> motions = HandEyeMotions(pairs);
  return HandEyeSolutionOf(AndreffRotation(motions), motions, pairs);
}

} // namespace

const std::vector<HandEyeClosedForm>& HandEyeClosedForms()
{
  static const std::vector<HandEyeClosedForm> forms = {
      {"shiu-ahmad", SolveByTurns<ShiuAhmadRotation>}, {"tsai-lenz", SolveByTurns<TsaiLenzRotation>},
      {"park-martin", SolveHandEyeParkMartin},         {"horaud", SolveByTurns<HoraudRotation>},
      {"daniilidis", SolveHandEyeDaniilidis},          {"andreff", SolveAndreff}};
  return forms;
}

} // namespace echorama
