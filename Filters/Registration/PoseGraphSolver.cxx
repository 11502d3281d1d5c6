// SPDX-License-Identifier: BSD-3-Clause
// Least squares are Ceres' (Levenberg-Marquardt, sparse Cholesky). A volume's unknowns are its rotation and where the mean
// centre of its edges lies, so that rotation and translation hardly depend on each other however far away the origin is.
//
// Covariances are blocks of the inverse of J^T J. Only blocks of volumes that share an edge are ever asked for, and these
// lie on the pattern of the Cholesky factor, where the inverse follows from the factor column by column, from the last to
// the first (Takahashi, Fagan, Chin 1973). The cost is that of the factor; no column of the inverse is formed whole.
#include "PoseGraphSolver.h"
#include "Core/Base/SymmetricMatrix.h"
#include <algorithm>
#include <ceres/ceres.h>
#include <ceres/rotation.h>
#include <cmath>
#include <Eigen/SparseCholesky>

namespace echorama {
namespace {

constexpr double WorstMm = 1000.0; // standard deviation of what an edge says nothing about

// The disagreement of an edge as Ceres wants it, from the unknowns of its volumes: a quaternion (x, y, z, w) and a place.
class EdgeCost {
public:
  EdgeCost(const WeighedEdge& edge, const Eigen::Vector3d& fromCentre, const Eigen::Vector3d& toCentre)
    : root_(edge.root), back_(Eigen::Quaterniond(edge.fromInTo.linear())), centre_(edge.centre - fromCentre),
      centreInTo_(edge.fromInTo * edge.centre - toCentre)
  {
  }

  template <class T>
  bool operator()(const T* from, const T* to, T* residual) const
  {
    using Vector = Eigen::Matrix<T, 3, 1>;
    const Eigen::Map<const Eigen::Quaternion<T>> fromTurn(from), toTurn(to);
    const Eigen::Map<const Vector> fromPlace(from + 4), toPlace(to + 4);
    const Vector inWorld = toTurn * centreInTo_.cast<T>() + toPlace;
    const Eigen::Quaternion<T> turn = fromTurn.conjugate() * toTurn * back_.cast<T>();
    const T wxyz[4] = {turn.w(), turn.x(), turn.y(), turn.z()};
    Eigen::Matrix<T, 6, 1> twist;
    twist.template head<3>() = fromTurn.conjugate() * (inWorld - fromPlace) - centre_.cast<T>();
    ceres::QuaternionToAngleAxis(wxyz, twist.data() + 3);
    Eigen::Map<Eigen::Matrix<T, 6, 1>> result(residual);
    result = root_.cast<T>() * twist;
    return true;
  }

private:
  Information root_;
  Eigen::Quaterniond back_;
  Eigen::Vector3d centre_, centreInTo_;
};

} // namespace

WeighedEdge::WeighedEdge(const PoseEdge& edge, const PoseGraphParameters& p)
  : from(edge.from), to(edge.to), toInFrom(edge.toInFrom), centre(edge.centre), verified(edge.verified)
{
  toInFrom.linear() = Eigen::Quaterniond(toInFrom.linear()).normalized().toRotationMatrix();
  fromInTo = toInFrom.inverse();
  // In mm at the radius all six directions are alike, so that one floor serves them all.
  Twist scale;
  scale << 1.0, 1.0, 1.0, p.radiusMm, p.radiusMm, p.radiusMm;
  const Information symmetric = 0.5 * (edge.information + edge.information.transpose());
  const Information scaled = scale.cwiseInverse().asDiagonal() * symmetric * scale.cwiseInverse().asDiagonal();
  const SymmetricEigen solver = EigenOfSymmetric(scaled);
  variance = 0.0;
  for (int i = 0; i < 6; ++i) {
    const double own = std::max(0.0, solver.values[i]);
    const double weight = own / (1.0 + own * p.floorMm * p.floorMm) + 1.0 / (WorstMm * WorstMm);
    const Twist direction = solver.vectors.col(i);
    root.row(i) = std::sqrt(weight) * direction.cwiseProduct(scale).transpose();
    variance += (direction.head<3>().squaredNorm() + direction.tail<3>().squaredNorm() * 2.0 / 3.0) / weight;
  }
}

Twist Disagreement(const WeighedEdge& edge, const Pose& from, const Pose& to)
{
  const Pose motion = from.inverse(Eigen::Isometry) * to * edge.fromInTo;
  Twist twist;
  twist.head<3>() = motion * edge.centre - edge.centre;
  twist.tail<3>() = LogRotation(motion.linear());
  return twist;
}

std::vector<Eigen::Vector3d> MeanCentres(const std::vector<WeighedEdge>& edges, const std::vector<bool>& isUsed,
                                         std::size_t volumes)
{
  std::vector<Eigen::Vector3d> sums(volumes, Eigen::Vector3d::Zero());
  std::vector<int> counts(volumes, 0);
  const auto add = [&](int volume, const Eigen::Vector3d& centre) {
    sums[static_cast<std::size_t>(volume)] += centre;
    ++counts[static_cast<std::size_t>(volume)];
  };
  for (std::size_t e = 0; e < edges.size(); ++e)
    if (isUsed[e]) {
      add(edges[e].from, edges[e].centre);
      add(edges[e].to, edges[e].fromInTo * edges[e].centre);
    }
  for (std::size_t v = 0; v < volumes; ++v)
    sums[v] /= std::max(1, counts[v]);
  return sums;
}

void MinimiseDisagreement(const std::vector<WeighedEdge>& edges, const std::vector<bool>& isUsed,
                          const std::vector<bool>& isFixed, double lossSigmas, std::vector<Pose>& poses)
{
  const std::vector<Eigen::Vector3d> centres = MeanCentres(edges, isUsed, poses.size());
  std::vector<std::array<double, 7>> unknowns(poses.size());
  for (std::size_t v = 0; v < poses.size(); ++v) {
    const Eigen::Quaterniond turn = Eigen::Quaterniond(poses[v].linear()).normalized();
    const Eigen::Vector3d place = poses[v] * centres[v];
    unknowns[v] = {turn.x(), turn.y(), turn.z(), turn.w(), place.x(), place.y(), place.z()};
  }

  ceres::EigenQuaternionManifold turns;
  ceres::EuclideanManifold<3> places;
  ceres::ProductManifold<ceres::EigenQuaternionManifold, ceres::EuclideanManifold<3>> manifold(turns, places);
  ceres::CauchyLoss cauchy(lossSigmas > 0.0 ? lossSigmas : 1.0);
  ceres::Problem::Options ours;
  ours.manifold_ownership = ours.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ceres::Problem problem(ours);
  for (std::size_t e = 0; e < edges.size(); ++e) {
    if (!isUsed[e])
      continue;
    const auto from = static_cast<std::size_t>(edges[e].from), to = static_cast<std::size_t>(edges[e].to);
    problem.AddResidualBlock(
        new ceres::AutoDiffCostFunction<EdgeCost, 6, 7, 7>(new EdgeCost(edges[e], centres[from], centres[to])),
        lossSigmas > 0.0 ? &cauchy : nullptr, unknowns[from].data(), unknowns[to].data());
  }
  bool isFree = false;
  for (std::size_t v = 0; v < poses.size(); ++v) {
    if (!problem.HasParameterBlock(unknowns[v].data()))
      continue;
    problem.SetManifold(unknowns[v].data(), &manifold);
    if (isFixed[v])
      problem.SetParameterBlockConstant(unknowns[v].data());
    else
      isFree = true;
  }
  if (!isFree)
    return;

  ceres::Solver::Options options;
  options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  options.sparse_linear_algebra_library_type = ceres::EIGEN_SPARSE;
  options.num_threads = 1;
  options.logging_type = ceres::SILENT;
  options.max_num_iterations = 100;
  options.function_tolerance = lossSigmas > 0.0 ? 1e-8 : 1e-16; // the robust solution is only a start
  options.gradient_tolerance = 1e-14;
  options.parameter_tolerance = 1e-13;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);

  for (std::size_t v = 0; v < poses.size(); ++v) {
    if (isFixed[v] || !problem.HasParameterBlock(unknowns[v].data()))
      continue;
    const auto& u = unknowns[v];
    poses[v].linear() = Eigen::Quaterniond(u[3], u[0], u[1], u[2]).normalized().toRotationMatrix();
    poses[v].translation() = Eigen::Vector3d(u[4], u[5], u[6]) - poses[v].linear() * centres[v];
  }
}

Information Turned(const Information& information, const Eigen::Matrix3d& rotation)
{
  Information turn = Information::Zero();
  turn.topLeftCorner<3, 3>() = turn.bottomRightCorner<3, 3>() = rotation;
  return turn * information * turn.transpose();
}

MarginalCovariances::MarginalCovariances(const std::vector<WeighedEdge>& edges, const std::vector<bool>& isUsed,
                                         const std::vector<bool>& isAsked, const std::vector<bool>& isFixed,
                                         const std::vector<Pose>& poses)
  : edges_(edges), poses_(poses), centres_(MeanCentres(edges, isUsed, poses.size())), first_(poses.size(), -1)
{
  int unknowns = 0;
  for (std::size_t v = 0; v < poses.size(); ++v) {
    centres_[v] = poses[v] * centres_[v];
    if (!isFixed[v]) {
      first_[v] = unknowns;
      unknowns += 6;
    }
  }
  if (unknowns == 0)
    return;

  std::vector<Eigen::Triplet<double>> entries;
  const auto add = [&entries](int row, int column, const Information& block) {
    for (int i = 0; row >= 0 && column >= 0 && i < 6; ++i)
      for (int j = 0; j < 6; ++j)
        if (row + i >= column + j)
          entries.emplace_back(row + i, column + j, block(i, j));
  };
  for (std::size_t e = 0; e < edges.size(); ++e) {
    if (!isUsed[e] && !isAsked[e])
      continue;
    const int from = first_[static_cast<std::size_t>(edges[e].from)], to = first_[static_cast<std::size_t>(edges[e].to)];
    Jacobians J{Information::Zero(), Information::Zero()}; // zeros keep the place in the pattern
    if (isUsed[e]) {
      J = Of(edges[e]);
      J.from = edges[e].root * J.from;
      J.to = edges[e].root * J.to;
    }
    add(from, from, J.from.transpose() * J.from);
    add(to, to, J.to.transpose() * J.to);
    add(from, to, J.from.transpose() * J.to);
    add(to, from, J.to.transpose() * J.from);
  }
  Eigen::SparseMatrix<double> hessian(unknowns, unknowns);
  hessian.setFromTriplets(entries.begin(), entries.end());
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor(hessian);
  const Eigen::SparseMatrix<double> lower = factor.matrixL();
  place_.assign(factor.permutationP().indices().data(), factor.permutationP().indices().data() + unknowns);

  starts_.assign(1, 0);
  std::vector<double> factorOf;
  for (int column = 0; column < unknowns; ++column) {
    for (Eigen::SparseMatrix<double>::InnerIterator entry(lower, column); entry; ++entry)
      if (entry.row() > column) {
        rows_.push_back(static_cast<int>(entry.row()));
        factorOf.push_back(entry.value());
      }
    starts_.push_back(static_cast<int>(rows_.size()));
  }
  lower_.assign(rows_.size(), 0.0);
  diagonal_.assign(static_cast<std::size_t>(unknowns), 0.0);
  std::vector<double> column(static_cast<std::size_t>(unknowns), 0.0), sums(column); // of the factor; of products with it
  for (int j = unknowns - 1; j >= 0; --j) {
    const auto begin = static_cast<std::size_t>(starts_[static_cast<std::size_t>(j)]),
               end = static_cast<std::size_t>(starts_[static_cast<std::size_t>(j) + 1]);
    for (std::size_t i = begin; i < end; ++i)
      column[static_cast<std::size_t>(rows_[i])] = factorOf[i];
    for (std::size_t i = begin; i < end; ++i) {
      const auto k = static_cast<std::size_t>(rows_[i]);
      sums[k] += factorOf[i] * diagonal_[k];
      for (auto below = static_cast<std::size_t>(starts_[k]); below < static_cast<std::size_t>(starts_[k + 1]); ++below) {
        const auto row = static_cast<std::size_t>(rows_[below]);
        sums[row] += factorOf[i] * lower_[below]; // rows outside the column's pattern are not looked at
        sums[k] += column[row] * lower_[below];
      }
    }
    double corner = 1.0 / factor.vectorD()[j];
    for (std::size_t i = begin; i < end; ++i) {
      const auto row = static_cast<std::size_t>(rows_[i]);
      lower_[i] = -sums[row];
      corner += factorOf[i] * sums[row];
    }
    diagonal_[static_cast<std::size_t>(j)] = corner;
    for (std::size_t i = begin; i < end; ++i) {
      const auto k = static_cast<std::size_t>(rows_[i]);
      column[k] = sums[k] = 0.0;
      for (auto below = static_cast<std::size_t>(starts_[k]); below < static_cast<std::size_t>(starts_[k + 1]); ++below)
        sums[static_cast<std::size_t>(rows_[below])] = 0.0;
    }
  }
}

// Close to the solution: how the disagreement follows small motions of both volumes about their centres.
MarginalCovariances::Jacobians MarginalCovariances::Of(const WeighedEdge& edge) const
{
  const auto from = static_cast<std::size_t>(edge.from), to = static_cast<std::size_t>(edge.to);
  const Eigen::Matrix3d back = poses_[from].linear().transpose();
  const Eigen::Vector3d centre = poses_[from] * edge.centre;
  const auto jacobian = [&](std::size_t volume) {
    Information J = Information::Zero();
    J.topLeftCorner<3, 3>() = J.bottomRightCorner<3, 3>() = back;
    J.topRightCorner<3, 3>() = -back * Hat(centre - centres_[volume]);
    return J;
  };
  return {-jacobian(from), jacobian(to)};
}

double MarginalCovariances::Entry(int row, int column) const
{
  const int a = place_[static_cast<std::size_t>(row)], b = place_[static_cast<std::size_t>(column)];
  const auto low = static_cast<std::size_t>(std::min(a, b));
  if (a == b)
    return diagonal_[low];
  const auto begin = rows_.begin() + starts_[low], end = rows_.begin() + starts_[low + 1];
  const auto found = std::lower_bound(begin, end, std::max(a, b));
  return lower_[static_cast<std::size_t>(found - rows_.begin())];
}

Information MarginalCovariances::Block(int a, int b) const
{
  Information block = Information::Zero();
  const int row = first_[static_cast<std::size_t>(a)], column = first_[static_cast<std::size_t>(b)];
  for (int i = 0; row >= 0 && column >= 0 && i < 6; ++i)
    for (int j = 0; j < 6; ++j)
      block(i, j) = Entry(row + i, column + j);
  return block;
}

Information MarginalCovariances::OfVolume(int volume) const
{
  return Block(volume, volume);
}

Information MarginalCovariances::OfEdge(std::size_t e) const
{
  const WeighedEdge& edge = edges_[e];
  const Jacobians J = Of(edge);
  const Information cross = J.from * Block(edge.from, edge.to) * J.to.transpose();
  return J.from * Block(edge.from, edge.from) * J.from.transpose() + J.to * Block(edge.to, edge.to) * J.to.transpose() + cross +
         cross.transpose();
}

} // namespace echorama
