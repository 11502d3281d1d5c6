// SPDX-License-Identifier: BSD-3-Clause
// Loads are applied in steps where that is cheap, on the coarsest lattice. A finer one starts from its own last state, to which
// it adds what the coarser one changed, and takes contact forces from there; as a rule two or three Newton steps are then left.
// Only where that start is no good are loads applied in steps on a finer lattice also.
#include "TissuePress.h"
#include "Core/Base/CheckRange.h"
#include "Core/Base/NumberText.h"
#include "Core/Base/Parallel.h"
#include <algorithm>
#include <cmath>

namespace echorama {
namespace {

constexpr int FewestNodes = 6;          // along each axis of the coarsest lattice
constexpr double CoarseTolerance = 0.1; // of a cell, where only a first guess is wanted
constexpr double LeastStep = 0.02;      // of a cell, between what can be reached and what can not
constexpr int MostNewtonSteps = 30;

std::array<int, 3> CoarseNodes(const std::array<int, 3>& nodes)
{
  return {nodes[0] / 2 + 1, nodes[1] / 2 + 1, nodes[2] / 2 + 1};
}

// A coarse lattice covers the same box as the fine one: cells of a body without symmetry would move it to a side. With an odd
// number of cells along an axis these are somewhat less than twice as long. What part of a coarse cell fine ones are, along an
// axis:
std::vector<std::vector<std::pair<int, float>>> PartsOfCells(int fine, int coarse)
{
  std::vector<std::vector<std::pair<int, float>>> parts(static_cast<std::size_t>(coarse));
  for (int i = 0; i < coarse; ++i)
    for (int n = i * fine / coarse; n < fine && n * coarse < (i + 1) * fine; ++n) {
      const int overlap = std::min((n + 1) * coarse, (i + 1) * fine) - std::max(n * coarse, i * fine);
      parts[static_cast<std::size_t>(i)].emplace_back(n, static_cast<float>(overlap) / static_cast<float>(fine));
    }
  return parts;
}

// The mean of what lies in a coarse cell, or nothing if most of it is empty.
TissueCells Coarsen(const TissueCells& fine, const std::array<int, 3>& nodes)
{
  TissueCells coarse(nodes);
  std::vector<std::vector<std::pair<int, float>>> parts[3];
  for (std::size_t axis = 0; axis < 3; ++axis)
    parts[axis] = PartsOfCells(fine.cells[axis], coarse.cells[axis]);
  ForNodes(coarse.cells, [&](int i, int j, int k) {
    float shear = 0.0f, bulk = 0.0f, density = 0.0f, filled = 0.0f;
    for (const auto& [fk, partZ] : parts[2][static_cast<std::size_t>(k)])
      for (const auto& [fj, partY] : parts[1][static_cast<std::size_t>(j)])
        for (const auto& [fi, partX] : parts[0][static_cast<std::size_t>(i)]) {
          if (!fine.IsTissue(fi, fj, fk))
            continue;
          const std::size_t at = fine.At(fi, fj, fk);
          const float part = partX * partY * partZ;
          filled += part;
          shear += part * fine.shear[at];
          bulk += part * fine.bulk[at];
          density += part * fine.density[at];
        }
    if (filled > 0.4999f) {
      const std::size_t at = coarse.At(i, j, k);
      coarse.shear[at] = shear;
      coarse.bulk[at] = bulk;
      coarse.density[at] = density;
    }
  });
  return coarse;
}

// Calls body(coarse node, weight) for those that a fine node lies between.
template <class Body>
void ForCorners(const std::array<int, 3>& index, const LatticeShape& fine, const LatticeShape& coarse, const Body& body)
{
  std::array<int, 3> low{};
  double fraction[3];
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const int scaled = index[axis] * (coarse.nodes[axis] - 1), all = fine.nodes[axis] - 1;
    low[axis] = scaled / all;
    fraction[axis] = static_cast<double>(scaled % all) / all;
  }
  for (int corner = 0; corner < 8; ++corner) {
    std::array<int, 3> at = low;
    double weight = 1.0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const bool isHigh = (corner >> axis & 1) != 0;
      at[axis] += isHigh ? 1 : 0;
      weight *= isHigh ? fraction[axis] : 1.0 - fraction[axis];
    }
    if (weight > 0.0)
      body(at, weight);
  }
}

bool HasCell(const TissueCells& cells, int i, int j, int k)
{
  for (int corner = 0; corner < 8; ++corner)
    if (cells.IsTissue(i - (corner & 1), j - (corner >> 1 & 1), k - (corner >> 2)))
      return true;
  return false;
}

double Travel(const Pose& from, const Pose& to)
{
  return (to.translation() - from.translation()).norm();
}

} // namespace

ParameterList Describe(TissuePressParameters& p)
{
  return {
      Parameter("FixXMin", p.fixXMin, "The first layer of nodes along x does not move."),
      Parameter("FixXMax", p.fixXMax, "The last layer of nodes along x does not move."),
      Parameter("FixYMin", p.fixYMin, "The first layer of nodes along y does not move."),
      Parameter("FixYMax", p.fixYMax, "The last layer of nodes along y does not move."),
      Parameter("FixZMin", p.fixZMin, "The first layer of nodes along z does not move."),
      Parameter("FixZMax", p.fixZMax, "The last layer of nodes along z does not move: the back."),
      Parameter("Friction", p.friction, {0.0, 2.0}, "", "Coulomb's coefficient between probe and skin; gel makes it 0."),
      Parameter("Gravity", p.gravity, {-100.0, 100.0}, "m/s^2", "Acceleration in the world; the body is given without it."),
      Parameter("ToleranceMm", p.toleranceMm, {1e-6, 1.0}, "mm", "How far off the state of rest tissue may be.").Advanced(),
  };
}

struct TissuePress::Level {
  Level(TissueCells cells, const LatticeShape& shape, const Eigen::Vector3d& spacing, std::vector<float> live,
        const Eigen::Vector3d& gravity)
    : solver(std::move(cells), shape, spacing, std::move(live), gravity), before(solver.Now())
  {
  }
  TissueSolver solver;
  TissueSolver::State before;        ///< when the step began
  std::vector<Eigen::Vector3d> held; ///< places of nodes that do not move, mm
};

TissuePress::~TissuePress() = default;

TissuePress::TissuePress(TissueBody body, const TissuePressParameters& parameters, const Progress& progress)
  : body_(std::move(body)), parameters_(parameters)
{
  CheckRanges(parameters_);
  body_.nodes.Check("the lattice of the tissue");
  for (const int count : body_.nodes.dimensions)
    if (count < 2)
      throw Error(Error::Kind::BadInput, "the lattice of the tissue needs at least two nodes along each axis");
  const auto& size = body_.nodes.dimensions;
  const auto count =
      static_cast<std::size_t>(size[0] - 1) * static_cast<std::size_t>(size[1] - 1) * static_cast<std::size_t>(size[2] - 1);
  if (body_.cells.size() != count)
    throw Error(Error::Kind::BadInput,
                "the tissue has " + std::to_string(body_.cells.size()) + " cells; its lattice has " + std::to_string(count));
  for (std::size_t n = 0; n < body_.materials.size(); ++n) {
    const TissueMaterial& material = body_.materials[n];
    const std::string name = " of material " + std::to_string(n);
    CheckRange("Young's modulus (kPa)" + name, material.youngKPa, 1e-3, 1e9);
    CheckRange("Poisson's ratio" + name, material.poisson, 0.0, 0.499);
    CheckRange("the density (g/cm^3)" + name, material.densityGPerCm3, 0.0, 100.0);
  }
  latticeToWorld_.linear() = body_.nodes.direction;
  latticeToWorld_.translation() = body_.nodes.origin;
  latticeToWorld_.makeAffine();

  // The finest lattice.
  LatticeShape shape(size);
  TissueCells cells(size);
  std::vector<float> live(static_cast<std::size_t>(shape.size), 0.0f);
  std::vector<unsigned char> rigid(static_cast<std::size_t>(shape.size), 0);
  std::size_t at = 0;
  for (int k = 0; k < cells.cells[2]; ++k)
    for (int j = 0; j < cells.cells[1]; ++j)
      for (int i = 0; i < cells.cells[0]; ++i, ++at) {
        const int label = body_.cells[at];
        if (label < -1 || label >= static_cast<int>(body_.materials.size()))
          throw Error(Error::Kind::BadInput, "cell " + std::to_string(at) + " of the tissue is of material " +
                                                 std::to_string(label) + ", which there is not");
        if (label < 0)
          continue;
        const TissueMaterial& material = body_.materials[static_cast<std::size_t>(label)];
        const std::size_t to = cells.At(i, j, k);
        cells.shear[to] = static_cast<float>(material.youngKPa / (2.0 * (1.0 + material.poisson)));
        cells.bulk[to] = static_cast<float>(material.youngKPa * material.poisson /
                                            ((1.0 + material.poisson) * (1.0 - 2.0 * material.poisson)));
        cells.density[to] = static_cast<float>(material.densityGPerCm3);
        for (int corner = 0; corner < 8; ++corner) {
          const auto node = static_cast<std::size_t>(shape.At(i + (corner & 1), j + (corner >> 1 & 1), k + (corner >> 2)));
          live[node] = 1.0f;
          rigid[node] |= material.rigid ? 1 : 0;
        }
      }
  const TissuePressParameters& p = parameters_;
  ForNodes(size, [&](int i, int j, int k) {
    const auto node = static_cast<std::size_t>(shape.At(i, j, k));
    if (rigid[node] || (p.fixXMin && i == 0) || (p.fixXMax && i == size[0] - 1) || (p.fixYMin && j == 0) ||
        (p.fixYMax && j == size[1] - 1) || (p.fixZMin && k == 0) || (p.fixZMax && k == size[2] - 1))
      live[node] = 0.0f;
  });
  const Eigen::Vector3d gravity = latticeToWorld_.linear().transpose() * p.gravity;
  Eigen::Vector3d spacing = body_.nodes.spacing;
  while (true) {
    levels_.push_back(std::make_unique<Level>(cells, shape, spacing, live, gravity));
    Level& level = *levels_.back();
    ForNodes(shape.nodes, [&](int i, int j, int k) {
      if (live[static_cast<std::size_t>(shape.At(i, j, k))] == 0.0f && HasCell(cells, i, j, k))
        level.held.push_back(spacing.cwiseProduct(Eigen::Vector3d(i, j, k)));
    });
    if (levels_.size() == 1)
      CheckTied();
    const std::array<int, 3> nodes = CoarseNodes(shape.nodes);
    if (*std::min_element(nodes.begin(), nodes.end()) < FewestNodes)
      break;
    TissueCells coarse = Coarsen(cells, nodes);
    const LatticeShape coarseShape(nodes);
    std::vector<float> coarseLive(static_cast<std::size_t>(coarseShape.size), 0.0f);
    bool isTied = false;
    ForNodes(nodes, [&](int i, int j, int k) {
      // A coarse node is held where the nearest fine one is.
      const auto nearest = [&](int n, std::size_t axis) {
        const int all = nodes[axis] - 1;
        return (n * (shape.nodes[axis] - 1) + all / 2) / all;
      };
      const int fi = nearest(i, 0), fj = nearest(j, 1), fk = nearest(k, 2);
      if (!HasCell(coarse, i, j, k))
        return;
      const bool isHeld = live[static_cast<std::size_t>(shape.At(fi, fj, fk))] == 0.0f && HasCell(cells, fi, fj, fk);
      coarseLive[static_cast<std::size_t>(coarseShape.At(i, j, k))] = isHeld ? 0.0f : 1.0f;
      isTied = isTied || isHeld;
    });
    if (!isTied)
      break;
    for (std::size_t axis = 0; axis < 3; ++axis)
      spacing[static_cast<int>(axis)] *= static_cast<double>(shape.nodes[axis] - 1) / (nodes[axis] - 1);
    cells = std::move(coarse);
    shape = coarseShape;
    live = std::move(coarseLive);
  }

  if (!gravity.isZero()) {
    double reached = 0.0;
    if (!Step(0, pose_, pose_, progress, reached))
      throw Error(Error::Kind::NotPossible, "the tissue cannot bear its own weight");
  }
}

// Every piece of tissue whose cells share faces must hang on fixed nodes; cells that meet along an edge alone are hinges.
void TissuePress::CheckTied() const
{
  const TissueSolver& finest = levels_.front()->solver;
  const TissueCells& cells = finest.Cells();
  std::vector<unsigned char> seen(cells.shear.size(), 0);
  bool any = false;
  for (int k = 0; k < cells.cells[2]; ++k)
    for (int j = 0; j < cells.cells[1]; ++j)
      for (int i = 0; i < cells.cells[0]; ++i) {
        if (!cells.IsTissue(i, j, k) || seen[cells.At(i, j, k)])
          continue;
        any = true;
        bool isTied = false;
        std::vector<std::array<int, 3>> queue{{i, j, k}};
        seen[cells.At(i, j, k)] = 1;
        while (!queue.empty()) {
          const auto cell = queue.back();
          queue.pop_back();
          int held = 0;
          for (int corner = 0; corner < 8; ++corner)
            held += finest.Live()[static_cast<std::size_t>(
                        finest.Shape().At(cell[0] + (corner & 1), cell[1] + (corner >> 1 & 1), cell[2] + (corner >> 2)))] == 0.0f;
          isTied = isTied || held >= 3;
          for (int side = 0; side < 6; ++side) {
            auto next = cell;
            next[static_cast<std::size_t>(side / 2)] += side % 2 ? 1 : -1;
            if (cells.IsTissue(next[0], next[1], next[2]) && !seen[cells.At(next[0], next[1], next[2])]) {
              seen[cells.At(next[0], next[1], next[2])] = 1;
              queue.push_back(next);
            }
          }
        }
        if (!isTied)
          throw Error(Error::Kind::NotPossible, "nothing holds the tissue at cell (" + std::to_string(i) + ", " +
                                                    std::to_string(j) + ", " + std::to_string(k) +
                                                    "): fix a side of the lattice, or give it a rigid material");
      }
  if (!any)
    throw Error(Error::Kind::BadInput, "there is no tissue: every cell is empty");
}

// Adds to a level what the next coarser one changed in this step, and takes its contact forces.
void TissuePress::Predict(std::size_t n)
{
  Level &fine = *levels_[n], &coarse = *levels_[n + 1];
  const LatticeShape &to = fine.solver.Shape(), &from = coarse.solver.Shape();
  std::vector<double> pressure(static_cast<std::size_t>(from.size)); // kPa, by how much it changed
  std::vector<unsigned char> isSkin(static_cast<std::size_t>(from.size), 0);
  LatticeField<double> drag(from);
  const auto& skin = coarse.solver.Contact().Nodes();
  for (std::size_t m = 0; m < skin.size(); ++m) {
    const auto at = static_cast<std::size_t>(skin[m].at);
    isSkin[at] = 1;
    pressure[at] = (skin[m].force - coarse.before.contact[m].force) / skin[m].area;
    drag.Set(skin[m].at, skin[m].drag / skin[m].area);
  }
  LatticeField<double>& u = fine.solver.Displacement();
  const std::vector<float>& live = fine.solver.Live();
  const TissueCells& coarseCells = coarse.solver.Cells();
  ParallelFor(to.nodes[2], [&](std::ptrdiff_t slice) {
    const int k = static_cast<int>(slice);
    for (int j = 0; j < to.nodes[1]; ++j)
      for (int i = 0; i < to.nodes[0]; ++i) {
        const std::ptrdiff_t at = to.At(i, j, k);
        if (live[static_cast<std::size_t>(at)] == 0.0f)
          continue;
        Eigen::Vector3d change = Eigen::Vector3d::Zero();
        double weights = 0.0;
        ForCorners({i, j, k}, to, from, [&](const std::array<int, 3>& corner, double weight) {
          if (!HasCell(coarseCells, corner[0], corner[1], corner[2])) // nothing is known there
            return;
          const std::ptrdiff_t there = from.At(corner[0], corner[1], corner[2]);
          change += weight * (coarse.solver.Displacement().Get(there) - coarse.before.displacement.Get(there));
          weights += weight;
        });
        if (weights > 0.0)
          u.Set(at, u.Get(at) + change / weights);
      }
  });
  for (auto& node : fine.solver.Contact().Nodes()) {
    double force = 0.0, weights = 0.0;
    Eigen::Vector3d dragged = Eigen::Vector3d::Zero();
    ForCorners(node.index, to, from, [&](const std::array<int, 3>& corner, double weight) {
      const std::ptrdiff_t at = from.At(corner[0], corner[1], corner[2]);
      if (isSkin[static_cast<std::size_t>(at)]) {
        force += weight * pressure[static_cast<std::size_t>(at)];
        dragged += weight * drag.Get(at);
        weights += weight;
      }
    });
    if (weights > 0.0) {
      node.force = std::max(0.0, node.force + force / weights * node.area);
      node.drag = dragged / weights * node.area;
    }
  }
}

// The whole step at once on a level, from what the coarser ones found; else in parts.
bool TissuePress::Step(std::size_t n, const Pose& from, const Pose& to, const Progress& progress, double& reached)
{
  Level& level = *levels_[n];
  level.before = level.solver.Now();
  const bool isCoarsest = n + 1 == levels_.size();
  double ignored = 0.0;
  if (!isCoarsest && Step(n + 1, from, to, progress.Part(0.0, 0.3), ignored)) {
    Predict(n);
    level.solver.Contact().Place(shape_, to, parameters_.friction);
    level.solver.Contact().BeginStep(level.solver.Displacement());
    TissueWork work;
    const bool isFound =
        level.solver.Solve(true, n == 0 ? parameters_.toleranceMm : CoarseTolerance * level.solver.Spacing().minCoeff(),
                           MostNewtonSteps, work, progress.Part(0.3, 1.0));
    work_ += work;
    if (n == 0)
      finestWork_ += work;
    if (isFound)
      return true;
    level.solver.Return(level.before);
  }
  // The last resort on the finest lattice, the rule on the coarsest.
  if (isCoarsest || n == 0)
    return Walk(n, from, to, progress, reached);
  return false;
}

bool TissuePress::Walk(std::size_t n, const Pose& from, const Pose& to, const Progress& progress, double& reached)
{
  Level& level = *levels_[n];
  TissueSolver& solver = level.solver;
  const double tolerance = n == 0 ? parameters_.toleranceMm : CoarseTolerance * solver.Spacing().minCoeff();
  // Until it touches the probe may go as far as it likes.
  double at = 0.0, size = 1.0, travel = Travel(from, to);
  if (shape_ && travel > 0.0) {
    const double clear = solver.Contact().Clearance(*shape_, from, solver.Displacement());
    at = std::clamp(clear / travel, 0.0, 1.0) * 0.999;
    size = std::min(1.0, 2.0 * solver.Spacing().maxCoeff() / travel);
  }
  LatticeField<double> last = solver.Displacement();
  const double least = std::min(0.1, LeastStep * solver.Spacing().minCoeff() / std::max(travel, 1e-9));
  double lastSize = 0.0;
  bool mayGrow = true;
  while (at < 1.0) {
    size = std::min(size, 1.0 - at);
    const double next = at + size > 1.0 - 1e-9 ? 1.0 : at + size;
    const TissueSolver::State now = solver.Now();
    if (lastSize > 0.0) // it goes on as it went
      for (std::size_t m = 0; m < last.Data().size(); ++m)
        solver.Displacement().Data()[m] += size / lastSize * (now.displacement.Data()[m] - last.Data()[m]);
    solver.Contact().Place(shape_, Interpolate(from, to, at), parameters_.friction); // not where a part that failed had it
    solver.Contact().BeginStep(now.displacement);
    solver.Contact().Place(shape_, Interpolate(from, to, next), parameters_.friction);
    TissueWork work;
    work.loadSteps = 1;
    const bool isFound = solver.Solve(false, tolerance, MostNewtonSteps, work, progress.Part(at, next));
    work_ += work;
    if (n == 0)
      finestWork_ += work;
    if (isFound) {
      last = now.displacement;
      lastSize = next - at;
      at = next;
      size *= mayGrow && work.newtonSteps < 8 ? 2.0 : 1.0;
    } else {
      solver.Return(now);
      if (lastSize == 0.0 || size * travel < 0.5 * solver.Spacing().minCoeff())
        size *= 0.5;
      lastSize = 0.0;  // perhaps the guess was bad, of a long part above all
      mayGrow = false; // what was too far is close to what is impossible
      if (size < least) {
        solver.Return(level.before);
        reached = at;
        return false;
      }
    }
  }
  return true;
}

void TissuePress::Move(const std::shared_ptr<const ProbeShape>& shape, const Pose& probeToWorld, const Progress& progress)
{
  if (!shape)
    throw Error(Error::Kind::BadInput, "there is no probe to press with");
  if (!probeToWorld.matrix().allFinite() || !IsRotation(probeToWorld.linear()))
    throw Error(Error::Kind::BadInput, "the pose of the probe is not rigid");
  const Pose to = latticeToWorld_.inverse() * probeToWorld;
  Pose from = pose_;
  const TissueSolver& finest = levels_.front()->solver;
  if (shape != shape_) {
    // It comes from behind, from where it is clear of the tissue.
    const Eigen::Vector3d back = -to.linear().col(2);
    from = to;
    double clear = finest.Contact().Clearance(*shape, from, finest.Displacement());
    for (double moved = 0.0; clear <= 0.0; clear = finest.Contact().Clearance(*shape, from, finest.Displacement())) {
      const double step = std::max(-clear, 0.5 * finest.Spacing().minCoeff());
      moved += step;
      if (moved > 1e4)
        throw Error(Error::Kind::NotPossible, "the probe comes from nowhere: tissue lies all the way behind it");
      from.pretranslate(step * back);
    }
  }
  const std::shared_ptr<const ProbeShape> shapeBefore = shape_;
  for (auto& level : levels_)
    level->before = level->solver.Now();
  const auto restore = [&] {
    for (std::size_t n = 0; n < levels_.size(); ++n) {
      levels_[n]->solver.Return(levels_[n]->before);
      levels_[n]->solver.Contact().Place(shapeBefore, pose_, parameters_.friction);
    }
    shape_ = shapeBefore;
  };
  shape_ = shape;
  // What does not move can not be passed.
  double free = 1.0;
  const std::vector<Eigen::Vector3d>& held = levels_.front()->held;
  const auto isFree = [&](double part) {
    const Pose toProbe = Interpolate(from, to, part).inverse();
    return std::none_of(held.begin(), held.end(), [&](const Eigen::Vector3d& place) {
      return shape->Distance(toProbe * place) < -parameters_.toleranceMm;
    });
  };
  const double depth = Travel(from, to);
  if (!isFree(1.0)) {
    double low = 0.0, high = 1.0;
    while (high - low > 1e-3)
      (isFree(0.5 * (low + high)) ? low : high) = 0.5 * (low + high);
    free = low;
  }
  double reached = 0.0;
  bool isReached = false;
  try {
    if (free < 1.0) {
      // How far it can be pressed, on the coarsest lattice, for the message.
      if (Walk(levels_.size() - 1, from, Interpolate(from, to, free), progress, reached))
        reached = 1.0;
      reached *= free;
    } else {
      isReached = Step(0, from, to, progress, reached);
    }
  } catch (const Error&) { // stopped
    restore();
    throw;
  }
  if (!isReached) {
    restore();
    throw Error(Error::Kind::NotPossible, std::string("the probe cannot go all the way of ") +
                                              NumberText(std::round(10.0 * depth) / 10.0) + " mm" +
                                              (free < 1.0 ? " because something rigid is in it" : "") + "; it came " +
                                              NumberText(std::round(10.0 * reached * depth) / 10.0) + " mm far");
  }
  if (const auto cell = finest.Bodies().EnteredCell(finest.Cells(), finest.Displacement())) {
    restore();
    throw Error(Error::Kind::NotPossible, "two pieces of tissue would enter each other at the empty cell (" +
                                              std::to_string((*cell)[0]) + ", " + std::to_string((*cell)[1]) + ", " +
                                              std::to_string((*cell)[2]) + ") between them");
  }
  pose_ = to;
}

std::vector<unsigned char> TissuePress::TissueNodes() const
{
  const TissueSolver& finest = levels_.front()->solver;
  std::vector<unsigned char> nodes;
  ForNodes(finest.Shape().nodes, [&](int i, int j, int k) { nodes.push_back(HasCell(finest.Cells(), i, j, k) ? 1 : 0); });
  return nodes;
}

std::vector<unsigned char> TissuePress::ContactNodes() const
{
  const TissueSolver& finest = levels_.front()->solver;
  const auto& size = finest.Shape().nodes;
  std::vector<unsigned char> nodes(static_cast<std::size_t>(finest.Shape().Count()), 0);
  for (const auto& node : finest.Contact().Nodes())
    nodes[static_cast<std::size_t>((static_cast<std::ptrdiff_t>(node.index[2]) * size[1] + node.index[1]) * size[0] +
                                   node.index[0])] = node.force > 0.0 ? 1 : 0;
  return nodes;
}

std::vector<Eigen::Vector3d> TissuePress::Displacements() const
{
  const TissueSolver& finest = levels_.front()->solver;
  const auto& size = finest.Shape().nodes;
  std::vector<Eigen::Vector3d> result;
  ForNodes(size, [&](int i, int j, int k) {
    result.emplace_back(latticeToWorld_.linear() * finest.Displacement().Get(finest.Shape().At(i, j, k)));
  });
  // Layer by layer outwards from the tissue, the mean of the neighbours that have one.
  std::vector<unsigned char> known = TissueNodes();
  const std::ptrdiff_t strides[3] = {1, size[0], static_cast<std::ptrdiff_t>(size[0]) * size[1]};
  std::vector<std::ptrdiff_t> added;
  do {
    added.clear();
    std::ptrdiff_t at = 0;
    ForNodes(size, [&](int i, int j, int k) {
      const int index[3] = {i, j, k};
      Eigen::Vector3d sum = Eigen::Vector3d::Zero();
      int count = 0;
      for (std::size_t axis = 0; axis < 3 && !known[static_cast<std::size_t>(at)]; ++axis)
        for (const int side : {-1, 1}) {
          const int there = index[axis] + side;
          const auto other = static_cast<std::size_t>(at + side * strides[axis]);
          if (there >= 0 && there < size[axis] && known[other] == 1) {
            sum += result[other];
            ++count;
          }
        }
      if (count > 0) {
        result[static_cast<std::size_t>(at)] = sum / count;
        added.push_back(at);
      }
      ++at;
    });
    for (const std::ptrdiff_t node : added)
      known[static_cast<std::size_t>(node)] = 1;
  } while (!added.empty());
  return result;
}

Eigen::Vector3d TissuePress::Force() const
{
  return 1e-3 * (latticeToWorld_.linear() * levels_.front()->solver.Contact().Total());
}

double TissuePress::RelativeVolume() const
{
  return TissueVolumeRatio(levels_.front()->solver.Cells(), levels_.front()->solver.Spacing(),
                           levels_.front()->solver.Displacement());
}

double TissuePress::LeastVolume() const
{
  return levels_.front()->solver.LeastVolume();
}

PressedTissue TissuePress::Now() const
{
  return {body_.nodes, Displacements(), TissueNodes(), ContactNodes(), Force(), RelativeVolume(), LeastVolume()};
}

} // namespace echorama
