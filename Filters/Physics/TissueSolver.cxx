// SPDX-License-Identifier: BSD-3-Clause
// Newton's method on the energy with a line search. Linear systems are solved roughly while Newton is far off. Contact forces are
// updated inside of the loop, as soon as steps are short: each update then costs no Newton step of its own.
#include "TissueSolver.h"
#include "Core/Base/Parallel.h"
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace echorama {

TissueWork& TissueWork::operator+=(const TissueWork& other)
{
  newtonSteps += other.newtonSteps;
  linearSteps += other.linearSteps;
  loadSteps += other.loadSteps;
  energyGrew = energyGrew || other.energyGrew;
  return *this;
}

TissueSolver::TissueSolver(TissueCells cells, const LatticeShape& shape, const Eigen::Vector3d& spacing, std::vector<float> live,
                           const Eigen::Vector3d& gravity)
  : cells_(std::move(cells)), shape_(shape), spacing_(spacing), live_(std::move(live)), weight_(shape), displacement_(shape),
    contact_(cells_, shape, spacing, live_), multigrid_(shape.nodes, spacing, live_)
{
  // 1 g/cm^3 times 1 m/s^2 is 1e-3 mN/mm^3; a cell gives each corner an eighth.
  const double part = 1e-3 * spacing.prod() / 8.0;
  for (int k = 0; k < cells_.cells[2]; ++k)
    for (int j = 0; j < cells_.cells[1]; ++j)
      for (int i = 0; i < cells_.cells[0]; ++i)
        for (int corner = 0; corner < 8 && cells_.IsTissue(i, j, k); ++corner) {
          const std::ptrdiff_t at = shape_.At(i + (corner & 1), j + (corner >> 1 & 1), k + (corner >> 2));
          const double density = static_cast<double>(cells_.density[cells_.At(i, j, k)]);
          weight_.Set(at, weight_.Get(at) + part * density * gravity);
        }
}

double TissueSolver::Energy(const LatticeField<double>& displacement) const
{
  const double lifted = ParallelSum<double>(shape_.nodes[2], 1, [&](std::ptrdiff_t k, std::ptrdiff_t) {
    double sum = 0.0;
    for (int c = 0; c < 3; ++c)
      for (std::ptrdiff_t at = (k + 1) * shape_.slice; at < (k + 2) * shape_.slice; ++at)
        sum += weight_.Component(c)[at] * displacement.Component(c)[at];
    return sum;
  });
  return TissueEnergy(cells_, spacing_, displacement) - lifted + contact_.Energy(displacement);
}

bool TissueSolver::Solve(bool isGuess, double toleranceMm, int maximumSteps, TissueWork& work, const Progress& progress)
{
  const LatticeField<double> start = displacement_;
  const std::vector<ProbeContact::Node> nodes = contact_.Nodes();
  LatticeField<double> force(shape_), trial(shape_);
  LatticeField<float> right(shape_), step(shape_);
  double last = std::numeric_limits<double>::infinity();
  bool isFound = false, tame = isGuess;
  for (int n = 0; n < maximumSteps && !isFound; ++n) {
    progress(static_cast<double>(n) / maximumSteps);
    TissueForce(cells_, spacing_, displacement_, force);
    contact_.AddForce(displacement_, force);
    for (int c = 0; c < 3; ++c)
      ForNodes(shape_.nodes, [&](int i, int j, int k) {
        const std::ptrdiff_t at = shape_.At(i, j, k);
        right.Component(c)[at] =
            live_[static_cast<std::size_t>(at)] * static_cast<float>(weight_.Component(c)[at] - force.Component(c)[at]);
      });
    const double tolerance = std::min(0.1, std::max(0.02, 0.1 * last / spacing_.minCoeff()));
    LatticeMultigrid::Result solved;
    do {
      TissueStiffness(cells_, spacing_, displacement_, multigrid_.Matrix(), tame);
      contact_.AddStiffness(displacement_, multigrid_.Matrix(), tame || last > 0.03 * spacing_.minCoeff());
      multigrid_.Prepare();
      solved = multigrid_.Solve(right, step, tolerance, 100);
      work.linearSteps += solved.steps;
    } while (!solved.isConvex && !std::exchange(tame, true));
    ++work.newtonSteps;
    double slope = 0.0, longest = 0.0;
    for (std::size_t at = 0; at < step.Data().size(); ++at) {
      slope -= static_cast<double>(step.Data()[at]) * static_cast<double>(right.Data()[at]);
      longest = std::max(longest, std::abs(static_cast<double>(step.Data()[at])));
    }
    if (!std::isfinite(slope) || !std::isfinite(longest))
      break;
    // Along the step, half as far each time that the energy falls by less than a straight line promises.
    const double before = Energy(displacement_);
    const double rounding = 1e-11 * std::abs(before) + 1e-9 * std::abs(slope);
    double part = std::min(1.0, 2.0 * spacing_.maxCoeff() / std::max(longest, 1e-300)), after = before;
    bool falls = false;
    for (int halving = 0; halving < 12 && !falls; ++halving, part *= falls ? 1.0 : 0.5) {
      for (std::size_t at = 0; at < step.Data().size(); ++at)
        trial.Data()[at] = displacement_.Data()[at] + part * static_cast<double>(step.Data()[at]);
      after = Energy(trial);
      falls = after <= before + 1e-4 * part * slope + rounding;
    }
    if (!falls)
      break;
    work.energyGrew = work.energyGrew || after > before + rounding;
    std::swap(displacement_, trial);
    last = part * longest;
    tame = tame && last > 0.2 * spacing_.minCoeff();
    if (part == 1.0 && last < 0.2 * spacing_.minCoeff()) {
      const double open = contact_.Update(displacement_);
      isFound = last < toleranceMm && open < toleranceMm;
    }
  }
  if (!isFound || !(LeastVolume() > 0.0)) {
    displacement_ = start;
    contact_.Nodes() = nodes;
    return false;
  }
  return true;
}

} // namespace echorama
