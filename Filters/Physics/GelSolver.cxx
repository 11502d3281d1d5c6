// SPDX-License-Identifier: BSD-3-Clause
// A step: particles to tiles, tiles to nodes, nodes moved (gravity, colliders), nodes to tiles, tiles to particles, which move on
// and flow. Each pass is parallel over blocks that write to places of their own.
#include "GelSolver.h"
#include "Core/Base/CheckRange.h"
#include "Core/Base/NumberText.h"
#include "Core/Base/Parallel.h"
#include "GelTransfer.h"
#include <algorithm>
#include <cmath>

namespace echorama {
namespace {

constexpr std::ptrdiff_t gelBlocksAtOnce = 4;
constexpr std::int64_t gelStepsUntilOrder = 64;
constexpr double inSolid = -1.0; // the mass of a node that a solid moves
constexpr double mirrored = 1.6; // cells: deeper nodes touch no gel outside
constexpr double farCells = 2.0; // from a solid: the nodes of a particle that it holds are nearer

GelTransferFrame FrameOf(const GelGrid& grid, int home, double seconds)
{
  const GelDomain& domain = grid.Domain();
  const std::array<int, 3> corner = grid.CornerOf(home);
  GelTransferFrame frame{};
  for (std::size_t axis = 0; axis < 3; ++axis)
    frame.origin[axis] = domain.origin[static_cast<int>(axis)] + domain.cellMm * corner[axis];
  frame.cellMm = domain.cellMm;
  frame.seconds = seconds;
  return frame;
}

} // namespace

ParameterList Describe(GelStepping& p)
{
  return {
      Parameter("Gravity", p.gravity, {}, "mm/s^2", "Which way gel falls, and how fast."),
      Parameter("Courant", p.courant, {0.01, 0.9}, "", "Steps are this part of the time in which pressure crosses a cell.")
          .Advanced(),
  };
}

GelSolver::Extremes& GelSolver::Extremes::operator+=(const Extremes& other)
{
  speed = std::max(speed, other.speed);
  gradient = std::max(gradient, other.gradient);
  infinite += other.infinite;
  torn += other.torn;
  gone += other.gone;
  return *this;
}

GelReport& GelReport::operator+=(const GelReport& later)
{
  if (later.steps > 0) {
    shortestStep = steps == 0 ? later.shortestStep : std::min(shortestStep, later.shortestStep);
    largestSpeed = later.largestSpeed;
  }
  steps += later.steps;
  particleSteps += later.particleSteps;
  gone += later.gone;
  goneMm3 += later.goneMm3;
  torn += later.torn;
  return *this;
}

GelSolver::GelSolver(const GelDomain& domain, const GelMaterial& material, const GelStepping& stepping)
  : law_(material), stepping_(stepping), grid_(domain)
{
  CheckRanges(stepping);
}

void GelSolver::Fill(const std::function<bool(const Eigen::Vector3d&)>& inside, const std::array<int, 3>& perCell)
{
  for (std::size_t axis = 0; axis < 3; ++axis)
    CheckRange(std::string("particles per cell along ") + "xyz"[axis], perCell[axis], 1, 8);
  const GelDomain& domain = grid_.Domain();
  const Eigen::Array3d apart(domain.cellMm / perCell[0], domain.cellMm / perCell[1], domain.cellMm / perCell[2]);
  const auto& [x, y, z] = domain.from;
  for (int k = z * perCell[2]; k < (z + domain.cells[2]) * perCell[2]; ++k)
    for (int j = y * perCell[1]; j < (y + domain.cells[1]) * perCell[1]; ++j)
      for (int i = x * perCell[0]; i < (x + domain.cells[0]) * perCell[0]; ++i) {
        const Eigen::Vector3d at = domain.origin.array() + (Eigen::Array3d(i, j, k) + 0.5) * apart;
        if (!inside(at))
          continue;
        GelParticle particle{};
        Eigen::Map<Eigen::Vector3d>(particle.position) = at;
        particle.volume = apart.prod();
        particle.block = grid_.BlockOf(particle.position);
        if (particle.block < 0)
          continue; // the outermost cells have no nodes on their far side
        particle.id = made_++;
        particles_.push_back(particle);
      }
}

void GelSolver::Include(const Eigen::AlignedBox3d& box)
{
  const GelDomain domain = Domain().With(box);
  if (domain.from == Domain().from && domain.cells == Domain().cells)
    return;
  grid_ = GelGrid(domain);
  for (GelParticle& particle : particles_)
    particle.block = grid_.BlockOf(particle.position);
}

void GelSolver::SetVelocity(const std::function<Eigen::Vector3d(const Eigen::Vector3d&)>& velocity,
                            const Eigen::Matrix3d& gradient)
{
  for (GelParticle& particle : particles_) {
    Eigen::Map<Eigen::Vector3d>(particle.velocity) = velocity(Eigen::Map<const Eigen::Vector3d>(particle.position));
    Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(particle.gradient) = gradient;
    extremes_.speed = std::max(extremes_.speed, Eigen::Map<Eigen::Vector3d>(particle.velocity).norm());
  }
  extremes_.gradient = std::max(extremes_.gradient, gradient.cwiseAbs().maxCoeff());
}

GelTotals GelSolver::Totals() const
{
  GelTotals totals;
  const double spread = 0.25 * grid_.Domain().cellMm * grid_.Domain().cellMm;
  for (const GelParticle& particle : particles_) {
    const double mass = law_.density * particle.volume;
    const Eigen::Map<const Eigen::Vector3d> position(particle.position), velocity(particle.velocity);
    const double* C = particle.gradient;
    totals.mass += mass;
    totals.volume += particle.volume * particle.strain.J;
    totals.restVolume += particle.volume;
    totals.momentum += mass * velocity;
    totals.angularMomentum += mass * (position.cross(velocity) + spread * Eigen::Vector3d(C[7] - C[5], C[2] - C[6], C[3] - C[1]));
  }
  return totals;
}

void GelSolver::Scatter(double seconds)
{
  ParallelRanges(grid_.Homes(), gelBlocksAtOnce, {}, [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
    for (int home = static_cast<int>(begin); home < end; ++home)
      ScatterGel(law_, FrameOf(grid_, home, seconds), particles_.data(), grid_.ParticlesOf(home), grid_.CountOf(home),
                 grid_.TileOf(home));
  });
}

// In the end nodes hold which part of their cell is filled in place of their mass.
void GelSolver::MoveNodes(double seconds, const GelColliders& colliders)
{
  const GelDomain& domain = grid_.Domain();
  const double cell = domain.cellMm, far = farCells * cell, reach = 2.6 * cell; // half of a block's diagonal
  const double perFullCell = 1.0 / (law_.density * cell * cell * cell);
  const double gained[4] = {seconds * stepping_.gravity[0], seconds * stepping_.gravity[1], seconds * stepping_.gravity[2], 0.0};
  ghosts_.resize(static_cast<std::size_t>((grid_.Blocks() + gelBlocksAtOnce - 1) / gelBlocksAtOnce));
  walls_.resize(static_cast<std::size_t>(grid_.Blocks()) * GelGrid::BlockNodes);
  const auto lowestOf = [&](int block) {
    const std::array<int, 3> corner = grid_.CornerOfNodes(block);
    return Eigen::Vector3d(domain.origin + cell * Eigen::Vector3d(corner[0], corner[1], corner[2]));
  };
  const auto placeOf = [cell](const Eigen::Vector3d& lowest, int n) {
    return Eigen::Vector3d(lowest + cell * Eigen::Vector3d(n & 3, n >> 2 & 3, n >> 4));
  };
  const auto distanceOfBlock = [&](std::size_t c, const Eigen::Vector3d& lowest) { // no distance falls faster than one moves
    return colliders.Distance(c, lowest + Eigen::Vector3d::Constant(1.5 * cell)) - reach;
  };
  ParallelRanges(grid_.Blocks(), gelBlocksAtOnce, {}, [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
    std::vector<Ghost>& ghosts = ghosts_[static_cast<std::size_t>(begin / gelBlocksAtOnce)];
    ghosts.clear();
    for (int block = static_cast<int>(begin); block < end; ++block) {
      grid_.SumTiles(block);
      GelNode* nodes = grid_.NodesOf(block);
      double* walls = walls_.data() + static_cast<std::size_t>(block) * GelGrid::BlockNodes;
      std::fill(walls, walls + GelGrid::BlockNodes, far);
      const Eigen::Vector3d lowest = lowestOf(block);
      for (std::size_t c = 0; c < colliders.Size(); ++c) {
        if (!colliders.Sticks(c) || distanceOfBlock(c, lowest) > far)
          continue;
        for (int n = 0; n < GelGrid::BlockNodes; ++n) {
          const double* raw = nodes[n].value;
          if (!(raw[3] > 0.0))
            continue;
          const Eigen::Vector3d place = placeOf(lowest, n);
          const double distance = colliders.Distance(c, place);
          walls[n] = std::min(walls[n], distance);
          if (distance > 0.0)
            continue;
          const Eigen::Vector3d normal = colliders.Normal(c, place);
          Ghost ghost{&nodes[n], {raw[0], raw[1], raw[2], raw[3]}, colliders.Velocity(c, place, normal), {}, {}, 0.0};
          const Eigen::Array3d mirror = ((place - 2.0 * distance * normal - domain.origin) / cell).array() + 1e-9;
          const Eigen::Array3d floor = mirror.floor(), part = mirror - floor;
          for (int axis = 0; axis < 3; ++axis)
            ghost.place[static_cast<std::size_t>(axis)] = static_cast<int>(floor[axis]);
          const bool isNear = distance > -mirrored * cell;
          for (unsigned corner = 0; corner < 8; ++corner)
            ghost.weight[corner] = isNear ? (corner & 1 ? part[0] : 1.0 - part[0]) * (corner & 2 ? part[1] : 1.0 - part[1]) *
                                                (corner & 4 ? part[2] : 1.0 - part[2])
                                          : 0.0;
          ghosts.push_back(ghost);
          nodes[n].value[3] = inSolid;
        }
      }
    }
  });
  Mirror(seconds);
  ParallelRanges(grid_.Blocks(), gelBlocksAtOnce, {}, [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
    for (int block = static_cast<int>(begin); block < end; ++block) {
      GelNode* nodes = grid_.NodesOf(block);
      for (int n = 0; n < GelGrid::BlockNodes; ++n) {
        const double mass = nodes[n].value[3];
        if (mass > 0.0) {
          for (int axis = 0; axis < 3; ++axis)
            nodes[n].value[axis] = nodes[n].value[axis] / mass + gained[axis];
          nodes[n].value[3] = mass * perFullCell;
        }
      }
      const Eigen::Vector3d lowest = lowestOf(block);
      for (std::size_t c = 0; c < colliders.Size(); ++c) {
        if (colliders.Sticks(c) || distanceOfBlock(c, lowest) > cell)
          continue;
        for (int n = 0; n < GelGrid::BlockNodes; ++n) {
          if (!(nodes[n].value[3] > 0.0))
            continue;
          const Eigen::Vector3d place = placeOf(lowest, n);
          const double distance = colliders.Distance(c, place);
          if (distance < cell)
            nodes[n].value[3] = 1.0; // along this wall gel has no image that would fill what lies behind
          if (distance <= 0.0)
            Eigen::Map<Eigen::Vector3d>(nodes[n].value) =
                colliders.Collide(c, place, Eigen::Map<Eigen::Vector3d>(nodes[n].value));
        }
      }
    }
  });
  ParallelRanges(static_cast<std::ptrdiff_t>(ghosts_.size()), 1, {}, [&](std::ptrdiff_t range, std::ptrdiff_t) {
    for (Ghost& ghost : ghosts_[static_cast<std::size_t>(range)]) {
      Eigen::Vector3d sum = Eigen::Vector3d::Zero(); // relative to the solid, where it is 0
      ghost.fill = 0.0;
      for (int corner = 0; corner < 8; ++corner) {
        const double weight = ghost.weight[static_cast<std::size_t>(corner)];
        const GelNode* node = weight > 1e-6 ? NodeOf(ghost, corner) : nullptr;
        if (!node)
          continue;
        sum += weight * (Eigen::Vector3d(node->value[0], node->value[1], node->value[2]) - ghost.velocity);
        ghost.fill += weight * node->value[3];
      }
      Eigen::Map<Eigen::Vector3d>(ghost.node->value) = ghost.velocity - sum;
    }
  });
  ParallelRanges(static_cast<std::ptrdiff_t>(ghosts_.size()), 1, {}, [&](std::ptrdiff_t range, std::ptrdiff_t) {
    for (const Ghost& ghost : ghosts_[static_cast<std::size_t>(range)])
      ghost.node->value[3] = ghost.fill;
  });
}

GelNode* GelSolver::NodeOf(const Ghost& ghost, int corner)
{
  GelNode* node =
      grid_.NodeAt({ghost.place[0] + (corner & 1), ghost.place[1] + (corner >> 1 & 1), ghost.place[2] + (corner >> 2)});
  return node && node->value[3] > 0.0 ? node : nullptr;
}

// What sticks to a wall goes on behind it, as its own image that moves the other way: its nodes beside the wall also feel the
// image's mass, momentum and stress, which is what particles gave the nodes behind. In order, by one thread: these are few.
void GelSolver::Mirror(double seconds)
{
  for (const std::vector<Ghost>& ghosts : ghosts_)
    for (const Ghost& ghost : ghosts)
      for (int corner = 0; corner < 8; ++corner) {
        const double weight = ghost.weight[static_cast<std::size_t>(corner)];
        GelNode* node = weight > 1e-6 ? NodeOf(ghost, corner) : nullptr;
        if (!node)
          continue;
        const double mass = ghost.raw[3];
        for (int axis = 0; axis < 3; ++axis)
          node->value[axis] +=
              weight * (2.0 * mass * (ghost.velocity[axis] - seconds * stepping_.gravity[axis]) - ghost.raw[axis]);
        node->value[3] += weight * mass;
      }
}

GelSolver::Extremes GelSolver::Gather(double seconds)
{
  return ParallelSum<Extremes>(grid_.Homes(), gelBlocksAtOnce, [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
    Extremes extremes;
    std::array<double, GelGrid::TileNodes> walls;
    const double far = farCells * grid_.Domain().cellMm;
    for (int home = static_cast<int>(begin); home < end; ++home) {
      grid_.FillTile(home);
      const std::int32_t* order = grid_.ParticlesOf(home);
      const int count = grid_.CountOf(home);
      GelTransferFrame frame = FrameOf(grid_, home, seconds);
      frame.walls = grid_.FillTileOf(home, walls_, far, walls.data()) ? walls.data() : nullptr;
      extremes.torn += GatherGel(law_, frame, particles_.data(), order, count, grid_.TileOf(home));
      double square = 0.0, gradient = 0.0;
      for (int n = 0; n < count; ++n) {
        GelParticle& p = particles_[static_cast<std::size_t>(order[n])];
        const double own = p.velocity[0] * p.velocity[0] + p.velocity[1] * p.velocity[1] + p.velocity[2] * p.velocity[2];
        square = std::max(square, own);
        extremes.infinite += std::isfinite(own) ? 0 : 1;
        for (const double entry : p.gradient)
          gradient = std::max(gradient, std::abs(entry));
        p.block = grid_.BlockOf(p.position);
        extremes.gone += p.block < 0 ? 1 : 0;
      }
      extremes += Extremes{std::sqrt(square), gradient, 0, 0, 0};
    }
    return extremes;
  });
}

GelReport GelSolver::Advance(double seconds, const std::vector<GelCollider>& colliders, const Progress& progress)
{
  CheckRange("the time by which gel advances", seconds, 0.0, 1e6);
  GelColliders solids(colliders, seconds);
  GelReport report;
  const double cell = grid_.Domain().cellMm, sound = law_.SoundSpeed();
  double done = 0.0;
  while (done < seconds && !particles_.empty()) {
    progress(done / seconds);
    // The second limit keeps what one step does to a particle small.
    double step = stepping_.courant * cell / (sound + extremes_.speed);
    step = std::min(step, 0.15 / std::max(extremes_.gradient, 1e-30));
    const double left = seconds - done;
    step = step >= left ? left : std::min(step, 0.5 * left); // no sliver at the end
    const double next = step == left ? seconds : done + step;

    grid_.Sort(particles_);
    if (steps_++ % gelStepsUntilOrder == 0) {
      particles_ = grid_.InOrder(particles_);
      grid_.Sort(particles_);
    }
    solids.SetStep(done / seconds, next / seconds);
    Scatter(step);
    MoveNodes(step, solids);
    extremes_ = Gather(step);
    if (extremes_.infinite > 0)
      throw Error(Error::Kind::NotPossible, "the gel became unstable after " + NumberText(done) +
                                                " s; shorter steps (Courant) or a lower bulk modulus may help");
    report.particleSteps += static_cast<std::int64_t>(particles_.size());
    if (extremes_.gone > 0) {
      const auto isLeft = [](const GelParticle& p) { return p.block >= 0; };
      const auto end = std::stable_partition(particles_.begin(), particles_.end(), isLeft);
      for (auto particle = end; particle != particles_.end(); ++particle)
        report.goneMm3 += particle->volume;
      particles_.erase(end, particles_.end());
    }
    report.gone += extremes_.gone;
    report.torn += extremes_.torn;
    report.shortestStep = report.steps == 0 ? step : std::min(report.shortestStep, step);
    ++report.steps;
    done = next;
  }
  report.largestSpeed = particles_.empty() ? 0.0 : extremes_.speed;
  progress(1.0);
  return report;
}

} // namespace echorama
