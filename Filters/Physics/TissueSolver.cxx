// SPDX-License-Identifier: BSD-3-Clause
// Newton's method on the energy with a line search. Linear systems are solved roughly while Newton is far off. Contact forces are
// updated inside of the loop, as soon as steps are short: each update then costs no Newton step of its own. What meets what is
// looked up anew before each step, and stays as it is while the energy is searched along it.
#include "TissueSolver.h"
#include "Core/Base/Parallel.h"
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace echorama {
namespace {

// Contact changes from step to step: more digits of the steps on the way would not bring the end nearer.
constexpr double LinearTolerance = 0.1, LastLinearTolerance = 0.02;
constexpr double KeepMatrix = 0.1; // in cells: as long as nothing moved farther, the matrix of the tissue is still good

constexpr double MostInside = 1.2; // cells; faces over a rounded edge are up to one deep, where a head went through more than two

// What a step promises.
struct Advance {
  double slope = 0.0, longest = 0.0;
  Advance& operator+=(const Advance& other)
  {
    slope += other.slope;
    longest = std::max(longest, other.longest);
    return *this;
  }
};

// Calls body(at) for all numbers of a field.
template <class Body>
void ForSlices(const LatticeShape& shape, const Body& body)
{
  ParallelFor(3 * (shape.nodes[2] + 2), [&](std::ptrdiff_t n) {
    for (std::ptrdiff_t at = n * shape.slice; at < (n + 1) * shape.slice; ++at)
      body(static_cast<std::size_t>(at));
  });
}

bool TieTheSame(const std::vector<LatticeLink>& a, const std::vector<LatticeLink>& b)
{
  const auto isSameNode = [](const auto& x, const auto& y) { return x.first == y.first; };
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [&](const LatticeLink& x, const LatticeLink& y) {
    return std::equal(x.nodes.begin(), x.nodes.end(), y.nodes.begin(), y.nodes.end(), isSameNode);
  });
}

} // namespace

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
    contact_(cells_, shape, spacing, live_), bodies_(cells_, shape, spacing), multigrid_(shape.nodes, spacing, live_)
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

// The energy of tissue and weight, and its derivative.
double TissueSolver::TissueTerms(const LatticeField<double>& displacement, LatticeField<double>& force) const
{
  const double stored = TissueForce(cells_, spacing_, displacement, force);
  const double lifted = ParallelSum<double>(shape_.nodes[2], 1, [&](std::ptrdiff_t k, std::ptrdiff_t) {
    double sum = 0.0;
    for (int c = 0; c < 3; ++c)
      for (std::ptrdiff_t at = (k + 1) * shape_.slice; at < (k + 2) * shape_.slice; ++at) {
        sum += weight_.Component(c)[at] * displacement.Component(c)[at];
        force.Component(c)[at] -= weight_.Component(c)[at];
      }
    return sum;
  });
  return stored - lifted;
}

// The matrix at the present state; if it is not new, that of the tissue remains as it was.
void TissueSolver::MakeMatrix(bool isNew, bool tame, bool withBends)
{
  const std::vector<ProbeContact::Node>& nodes = contact_.Nodes();
  LatticeMatrix& matrix = multigrid_.Matrix();
  if (isNew) {
    TissueStiffness(cells_, spacing_, displacement_, matrix, tame);
    own_.resize(nodes.size());
    for (std::size_t n = 0; n < nodes.size(); ++n)
      for (int entry = 0; entry < 9; ++entry)
        own_[n](entry / 3, entry % 3) =
            matrix.At(nodes[n].index[0], nodes[n].index[1], nodes[n].index[2], LatticeMatrix::Own, entry / 3, entry % 3);
  }
  std::vector<Eigen::Matrix3f> pushed = contact_.Stiffness(displacement_, own_, !withBends);
  for (std::size_t n = 0; n < nodes.size(); ++n) {
    const std::array<int, 3>& at = nodes[n].index;
    if (isNew) {
      for (int entry = 0; entry < 9; ++entry)
        matrix.At(at[0], at[1], at[2], LatticeMatrix::Own, entry / 3, entry % 3) += pushed[n](entry / 3, entry % 3);
    } else if (pushed[n] != pushed_[n]) {
      multigrid_.ChangeOwn(at, pushed[n] - pushed_[n]);
    }
  }
  pushed_ = std::move(pushed);
  if (isNew) {
    multigrid_.SetLinks(links_);
    multigrid_.Prepare();
  }
}

void TissueSolver::Return(const State& state)
{
  displacement_ = state.displacement;
  contact_.Nodes() = state.contact;
  bodies_.Forces() = state.bodies;
}

bool TissueSolver::Solve(bool isGuess, double toleranceMm, int maximumSteps, TissueWork& work, const Progress& progress)
{
  const State start = Now();
  const double width = spacing_.minCoeff();
  LatticeField<double> force(shape_), trial(shape_), trialForce(shape_);
  LatticeField<float> right(shape_), step(shape_), lastStep(shape_);
  double last = std::numeric_limits<double>::infinity(), moved = last, stored = TissueTerms(displacement_, force);
  bool isFound = false, tame = isGuess;
  double grip = 1.0, gripOfMatrix = 0.0;
  for (int n = 0; n < maximumSteps && !isFound; ++n) {
    progress(static_cast<double>(n) / maximumSteps);
    ForSlices(shape_, [&](std::size_t at) { trialForce.Data()[at] = force.Data()[at]; });
    contact_.AddForce(displacement_, trialForce);
    const bool isNear = last < 0.06 * width;
    if (bodies_.IsPossible()) {
      bodies_.Find(displacement_);
      bodies_.AddForce(displacement_, trialForce);
      grip = isNear ? grip : 1.0;
      std::vector<LatticeLink> links = bodies_.Stiffness(displacement_, grip);
      if (!TieTheSame(links, links_) || grip != gripOfMatrix) // the matrix has others
        moved = std::numeric_limits<double>::infinity();
      links_ = std::move(links);
      gripOfMatrix = grip;
      lastStep = step;
    }
    ForSlices(shape_, [&](std::size_t at) {
      right.Data()[at] = -live_[at % static_cast<std::size_t>(shape_.size)] * static_cast<float>(trialForce.Data()[at]);
    });
    LatticeMultigrid::Result solved;
    do {
      const bool isNew = tame || !(moved < KeepMatrix * width);
      MakeMatrix(isNew, tame, !tame && isNear);
      moved = isNew ? 0.0 : moved;
      solved = multigrid_.Solve(right, step, isNear ? LastLinearTolerance : LinearTolerance, 100);
      work.linearSteps += solved.steps;
    } while (!solved.isConvex && !std::exchange(tame, true));
    ++work.newtonSteps;
    if (!links_.empty() && isNear) // to and fro: it took too little; on and on: too much
      grip = std::clamp(grip * (SumOfProducts(step, lastStep) < 0.0 ? 3.0 : 0.4), 0.02, 1.0);
    const Advance advance = ParallelSum<Advance>(shape_.nodes[2], 1, [&](std::ptrdiff_t k, std::ptrdiff_t) {
      Advance sum;
      for (int c = 0; c < 3; ++c)
        for (std::ptrdiff_t at = (k + 1) * shape_.slice; at < (k + 2) * shape_.slice; ++at) {
          const auto moves = static_cast<double>(step.Component(c)[at]);
          sum.slope -= moves * static_cast<double>(right.Component(c)[at]);
          sum.longest = std::max(sum.longest, std::abs(moves));
        }
      return sum;
    });
    if (!std::isfinite(advance.slope) || !std::isfinite(advance.longest))
      break;
    // Along the step, half as far each time that the energy falls by less than a straight line promises.
    const double before = stored + ContactEnergy(displacement_);
    const double rounding = 1e-11 * std::abs(before) + 1e-9 * std::abs(advance.slope);
    double part = std::min(1.0, 2.0 * spacing_.maxCoeff() / std::max(advance.longest, 1e-300)), after = before, kept = stored;
    bool falls = false;
    for (int halving = 0; halving < 12 && !falls; ++halving, part *= falls ? 1.0 : 0.5) {
      ForSlices(shape_, [&](std::size_t at) {
        trial.Data()[at] = displacement_.Data()[at] + part * static_cast<double>(step.Data()[at]);
      });
      kept = TissueTerms(trial, trialForce);
      after = kept + ContactEnergy(trial);
      falls = after <= before + 1e-4 * part * advance.slope + rounding;
    }
    if (!falls && moved == 0.0)
      break;
    if (!falls) { // perhaps because the matrix is an old one
      moved = std::numeric_limits<double>::infinity();
      continue;
    }
    work.energyGrew = work.energyGrew || after > before + rounding;
    std::swap(displacement_, trial);
    std::swap(force, trialForce);
    stored = kept;
    const double shrinks = part * advance.longest / last;
    last = part * advance.longest;
    moved += last;
    tame = tame && last > 0.2 * width;
    if (part == 1.0 && last < 0.2 * width) {
      const double open = contact_.Update(displacement_);
      const BodyContact::Open bodies = bodies_.Update(displacement_);
      // Steps that get slowly shorter have farther to go than the last one was long; first guesses may stop earlier.
      const bool mayHaveFarToGo = shrinks > 0.5 && toleranceMm < 0.03 * width;
      // Of nodes of two bodies that hold a place from either side one may take over all force from the other, which takes long
      // and moves little.
      const double share = !mayHaveFarToGo ? 1.0 : links_.empty() ? 0.1 : 0.3;
      isFound = last < share * toleranceMm && open < 0.2 * toleranceMm;
      // What other tissue alone holds goes far along the errors of a rough solution.
      isFound = isFound && (isNear || !bodies_.IsPossible()) && bodies.entered < toleranceMm && bodies.apart < 4.0 * toleranceMm;
    }
  }
  if (!isFound || !(LeastVolume() > 0.0) || contact_.DeepestFace(displacement_) > MostInside * spacing_.maxCoeff()) {
    Return(start);
    return false;
  }
  return true;
}

} // namespace echorama
