// SPDX-License-Identifier: BSD-3-Clause
// A C = C B splits into rotations, R_A R_C = R_C R_B, and translations, (R_A - I) t_C = R_C t_B - t_A. All but Daniilidis solve
// the first, then the second by linear least squares.
//
// Unit axes of small turns are mostly noise; where a method speaks of unit axes (Shiu-Ahmad, Horaud) a motion counts by the sine
// of half its angle, squared.
#include "Filters/Calibration/Benchmarks/HandEyeContestants.h"
#include "Core/Base/Error.h"
#include "Core/Base/SymmetricMatrix.h"
#include <cmath>

namespace echorama {
namespace {

using Vector9 = Eigen::Matrix<double, 9, 1>;
using Matrix9 = Eigen::Matrix<double, 9, 9>;
using Matrix8 = Eigen::Matrix<double, 8, 8>;

constexpr double LargeTurn = 2.6; // radians

// The turns of a motion as rotation vectors, whose signs belong together.
struct HandEyeTurn {
  Eigen::Vector3d a, b; // of A and B

  // sin(angle / 2) axis, cos(angle / 2)
  static Eigen::Vector4d Quaternion(const Eigen::Vector3d& v)
  {
    const double angle = v.norm();
    const double s = angle < 1e-6 ? 0.5 : std::sin(0.5 * angle) / angle;
    return {s * v.x(), s * v.y(), s * v.z(), std::cos(0.5 * angle)};
  }
};

// Andreff, Horaud, Espiau 1999: R_A X R_B^T = X in all nine numbers, linear, made a rotation.
Eigen::Matrix3d AndreffRotation(const std::vector<HandEyeMotion>& motions)
{
  Matrix9 sum = Matrix9::Zero();
  for (const HandEyeMotion& motion : motions)
    for (int row = 0; row < 3; ++row)
      for (int column = 0; column < 3; ++column)
        sum.block<3, 3>(3 * row, 3 * column) += motion.volume.linear()(row, column) * motion.sensor.linear();
  Matrix9 normal = -sum - sum.transpose();
  normal.diagonal().array() += 2.0 * static_cast<double>(motions.size());
  const Vector9 numbers = EigenOfSymmetric(normal).vectors.col(0);
  const Eigen::Matrix3d rotation = Eigen::Map<const Eigen::Matrix3d>(numbers.data());
  return NearestRotation(rotation.determinant() < 0.0 ? Eigen::Matrix3d(-rotation) : rotation);
}

// The turns of a motion have one axis on either side, k_A = R_C k_B. Its sign is lost at 180 degrees, where noise turns a into
// -a. So beyond 150 degrees the sign is taken from the rotation of the equation that knows no axes (Andreff's).
std::vector<HandEyeTurn> HandEyeTurns(const std::vector<HandEyeMotion>& motions)
{
  std::vector<HandEyeTurn> turns;
  turns.reserve(motions.size());
  bool large = false;
  for (const HandEyeMotion& motion : motions) {
    turns.push_back({LogRotation(motion.sensor.linear()), LogRotation(motion.volume.linear())});
    large = large || turns.back().a.norm() > LargeTurn || turns.back().b.norm() > LargeTurn;
  }
  if (large) {
    const Eigen::Matrix3d rotation = AndreffRotation(motions);
    for (HandEyeTurn& turn : turns)
      if (turn.b.norm() > LargeTurn && turn.a.dot(rotation * turn.b) < 0.0)
        turn.b *= (turn.b.norm() - 2.0 * EIGEN_PI) / turn.b.norm(); // the same turn, the other way round
  }
  return turns;
}

// The matrices of quaternion multiplication, x y z w: p q = Left(p) q = Right(q) p.
Eigen::Matrix4d Left(const Eigen::Vector4d& p)
{
  Eigen::Matrix4d m;
  m.topLeftCorner<3, 3>() = p[3] * Eigen::Matrix3d::Identity() + Hat(p.head<3>());
  m.topRightCorner<3, 1>() = p.head<3>();
  m.bottomLeftCorner<1, 3>() = -p.head<3>().transpose();
  m(3, 3) = p[3];
  return m;
}
Eigen::Matrix4d Right(const Eigen::Vector4d& q)
{
  Eigen::Matrix4d m = Left(q);
  m.topLeftCorner<3, 3>() = q[3] * Eigen::Matrix3d::Identity() - Hat(q.head<3>());
  return m;
}

Eigen::Matrix3d RotationOfQuaternion(const Eigen::Vector4d& q)
{
  return Eigen::Quaterniond(q[3], q[0], q[1], q[2]).normalized().toRotationMatrix();
}

Eigen::Vector3d TranslationOf(const Eigen::Matrix3d& rotation, const std::vector<HandEyeMotion>& motions)
{
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for (const HandEyeMotion& motion : motions) {
    const Eigen::Matrix3d turn = motion.sensor.linear() - Eigen::Matrix3d::Identity();
    normal += turn.transpose() * turn;
    right += turn.transpose() * (rotation * motion.volume.translation() - motion.sensor.translation());
  }
  return SolveSymmetric(normal, right);
}

// Daniilidis 1999: with dual quaternions, vector parts only, a motion gives six rows in the eight numbers (q, q') of C. Its
// null space has two dimensions; |q| = 1 and q q' = 0 pick the answer. Rotations and translations are weighed against each other
// by the unit of length, here the root mean square translation of the motions.
Pose DaniilidisPose(const std::vector<HandEyeMotion>& motions, const std::vector<HandEyeTurn>& turns)
{
  double unit = 0.0;
  for (const HandEyeMotion& motion : motions)
    unit += motion.sensor.translation().squaredNorm() + motion.volume.translation().squaredNorm();
  unit = std::sqrt(0.5 * unit / static_cast<double>(motions.size()));
  unit = unit > 0.0 ? unit : 1.0;

  Matrix8 normal = Matrix8::Zero();
  for (std::size_t i = 0; i < motions.size(); ++i) {
    const Eigen::Vector4d a = HandEyeTurn::Quaternion(turns[i].a), b = HandEyeTurn::Quaternion(turns[i].b);
    const auto dual = [unit](const Eigen::Vector3d& t, const Eigen::Vector4d& q) {
      return Eigen::Vector4d(0.5 / unit * (Left(Eigen::Vector4d(t.x(), t.y(), t.z(), 0.0)) * q));
    };
    const Eigen::Vector4d aDual = dual(motions[i].sensor.translation(), a), bDual = dual(motions[i].volume.translation(), b);
    const auto open = [](const Eigen::Vector4d& p, const Eigen::Vector4d& q) {
      Eigen::Vector4d pv = p, qv = q;
      pv[3] = qv[3] = 0.0; // the scalar parts are equal on both sides, and say nothing of C
      return Eigen::Matrix<double, 3, 4>((Left(pv) - Right(qv)).topRows<3>());
    };
    Eigen::Matrix<double, 6, 8> rows = Eigen::Matrix<double, 6, 8>::Zero();
    rows.topLeftCorner<3, 4>() = open(a, b);
    rows.bottomLeftCorner<3, 4>() = open(aDual, bDual);
    rows.bottomRightCorner<3, 4>() = rows.topLeftCorner<3, 4>();
    normal.noalias() += rows.transpose() * rows;
  }
  const Eigen::MatrixXd axes = EigenOfSymmetric(normal).vectors;
  const Eigen::Matrix<double, 8, 1> first = axes.col(0), second = axes.col(1);
  const Eigen::Vector4d u1 = first.head<4>(), v1 = first.tail<4>(), u2 = second.head<4>(), v2 = second.tail<4>();
  // (x u1 + y u2) . (x v1 + y v2) = 0, and of the two answers the one with the larger rotational part.
  const double aa = u1.dot(v1), ab = u1.dot(v2) + u2.dot(v1), bb = u2.dot(v2);
  const double root = std::sqrt(std::fmax(0.0, ab * ab - 4.0 * aa * bb));
  Eigen::Vector2d best(1.0, 0.0);
  double bestSize = -1.0;
  for (const double sign : {1.0, -1.0}) {
    // The two ways to write the roots of aa x^2 + ab x y + bb y^2; the better conditioned one of each.
    const double t = -0.5 * (ab + sign * root);
    for (const Eigen::Vector2d& candidate : {Eigen::Vector2d(t, aa), Eigen::Vector2d(bb, t)}) {
      if (candidate.norm() < 1e-300)
        continue;
      const Eigen::Vector2d xy = candidate.normalized();
      const double size = (xy[0] * u1 + xy[1] * u2).squaredNorm();
      if (size > bestSize) {
        bestSize = size;
        best = xy;
      }
    }
  }
  const double size = std::sqrt(std::fmax(bestSize, 1e-300));
  const Eigen::Vector4d q = (best[0] * u1 + best[1] * u2) / size, qDual = (best[0] * v1 + best[1] * v2) / size;
  const Eigen::Vector4d conjugate(-q[0], -q[1], -q[2], q[3]);
  Pose pose = Pose::Identity();
  pose.linear() = RotationOfQuaternion(q);
  pose.translation() = 2.0 * unit * (Left(qDual) * conjugate).head<3>();
  return pose;
}

// O, given C: the mean of the rotations S C M^-1, and the mean translation with it.
Pose WorldToTrackerOf(const Pose& C, const std::vector<HandEyePair>& pairs)
{
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (const HandEyePair& pair : pairs)
    sum += pair.sensorToTracker.linear() * C.linear() * pair.volumeToWorld.linear().transpose();
  Pose O = Pose::Identity();
  O.linear() = NearestRotation(sum);
  for (const HandEyePair& pair : pairs)
    O.translation() += (pair.sensorToTracker * C.translation() - O.linear() * pair.volumeToWorld.translation()) /
                       static_cast<double>(pairs.size());
  return O;
}

HandEyeSolution HandEyeSolutionOf(const Eigen::Matrix3d& rotation, const std::vector<HandEyeMotion>& motions,
                                  const std::vector<HandEyePair>& pairs)
{
  HandEyeSolution solution;
  solution.volumeToSensor.linear() = rotation;
  solution.volumeToSensor.translation() = TranslationOf(rotation, motions);
  solution.worldToTracker = WorldToTrackerOf(solution.volumeToSensor, pairs);
  return solution;
}

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

// Park and Martin 1994: the rotation that takes the rotation vectors of B closest to those of A.
Eigen::Matrix3d ParkMartinRotation(const std::vector<HandEyeTurn>& turns)
{
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (const HandEyeTurn& turn : turns)
    sum += turn.a * turn.b.transpose();
  return NearestRotation(sum);
}

template <Eigen::Matrix3d (*rotation)(const std::vector<HandEyeTurn>&)>
HandEyeSolution SolveByTurns(const std::vector<HandEyePair>& pairs)
{
  const std::vector<HandEyeMotion> motions = HandEyeMotions(pairs);
  return HandEyeSolutionOf(rotation(HandEyeTurns(motions)), motions, pairs);
}

HandEyeSolution SolveDaniilidis(const std::vector<HandEyePair>& pairs)
{
  const std::vector<HandEyeMotion> motions = HandEyeMotions(pairs);
  HandEyeSolution solution;
  solution.volumeToSensor = DaniilidisPose(motions, HandEyeTurns(motions));
  solution.worldToTracker = WorldToTrackerOf(solution.volumeToSensor, pairs);
  return solution;
}

HandEyeSolution SolveAndreff(const std::vector<HandEyePair>& pairs)
{
  const std::vector<HandEyeMotion> motions = HandEyeMotions(pairs);
  return HandEyeSolutionOf(AndreffRotation(motions), motions, pairs);
}

} // namespace

std::vector<HandEyeMotion> HandEyeMotions(const std::vector<HandEyePair>& pairs)
{
  if (pairs.size() < 2)
    throw Error(Error::Kind::NotPossible, "hand-eye calibration: a motion needs two scans at least");
  std::vector<HandEyeMotion> motions;
  motions.reserve(pairs.size() * (pairs.size() - 1) / 2);
  for (std::size_t i = 0; i < pairs.size(); ++i)
    for (std::size_t j = i + 1; j < pairs.size(); ++j)
      motions.push_back({pairs[i].sensorToTracker.inverse() * pairs[j].sensorToTracker,
                         pairs[i].volumeToWorld.inverse() * pairs[j].volumeToWorld});
  return motions;
}

const std::vector<HandEyeClosedForm>& HandEyeClosedForms()
{
  static const std::vector<HandEyeClosedForm> forms = {{"shiu-ahmad", SolveByTurns<ShiuAhmadRotation>},
                                                       {"tsai-lenz", SolveByTurns<TsaiLenzRotation>},
                                                       {"park-martin", SolveByTurns<ParkMartinRotation>},
                                                       {"horaud", SolveByTurns<HoraudRotation>},
                                                       {"daniilidis", SolveDaniilidis},
                                                       {"andreff", SolveAndreff}};
  return forms;
}

} // namespace echorama
