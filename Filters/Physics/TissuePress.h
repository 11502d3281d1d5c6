// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Parameters.h"
#include "Core/Geometry/ImageGeometry.h"
#include "Filters/Physics/TissueSolver.h"

namespace echorama {

/// What tissue resists with.
struct TissueMaterial {
  double youngKPa = 20.0; ///< Young's modulus
  double poisson = 0.45;  ///< Poisson's ratio, 0 ... 0.499
  double densityGPerCm3 = 1.0;
  bool rigid = false; ///< does not move at all, as bone that is tied to the table
};

/// A block of tissue: the cells of a regular lattice, each of one material or of none.
struct TissueBody {
  ImageGeometry nodes;    ///< corners of the cells
  std::vector<int> cells; ///< which material, -1 is none; x fastest, one less than nodes along each axis
  std::vector<TissueMaterial> materials;
};

struct TissuePressParameters {
  bool fixXMin = false, fixXMax = false, fixYMin = false, fixYMax = false, fixZMin = false;
  bool fixZMax = true; ///< the back
  double friction = 0.0;
  Eigen::Vector3d gravity = Eigen::Vector3d::Zero(); ///< of the world, m/s^2
  double toleranceMm = 0.01;
};
ParameterList Describe(TissuePressParameters& p);

/// Where tissue is under a probe; TissuePress says what each is.
struct PressedTissue {
  ImageGeometry nodes;
  std::vector<Eigen::Vector3d> displacements;
  std::vector<unsigned char> tissueNodes, contactNodes;
  Eigen::Vector3d forceN = Eigen::Vector3d::Zero();
  double relativeVolume = 1.0, leastVolume = 1.0;
};

/// Tissue that a probe presses, at rest at every moment. The body is given as it is without the probe and without gravity.
///
/// Lattices of half, a quarter ... of the resolution find a first guess; each step is solved on the coarsest one first, in as
/// many parts as it takes, and what changes there starts the next finer one. Pieces of tissue with empty cells between them may
/// meet, without friction (BodyContact).
class TissuePress {
public:
  /// \throws Error(InvalidParameter, BadInput) for materials and bodies that are none, Error(NotPossible) where a piece of tissue
  /// hangs on nothing that is fixed, or cannot bear its own weight
  TissuePress(TissueBody body, const TissuePressParameters& parameters, const Progress& progress = {});
  ~TissuePress();
  TissuePress(const TissuePress&) = delete;
  TissuePress& operator=(const TissuePress&) = delete;

  /// Moves the probe, which must be clear of the tissue at first, straight to \a probeToWorld.
  /// \throws Error(NotPossible) when this state cannot be reached, with the part of the way in mm that can, and when one piece of
  /// tissue would enter another by more than a twentieth of a cell; the tissue is then in the state before
  void Move(const std::shared_ptr<const ProbeShape>& shape, const Pose& probeToWorld, const Progress& progress = {});

  /// Where every node went, mm along the axes of the world: what was at x is now at x + u. Where there is no tissue, what the
  /// nodes around have.
  std::vector<Eigen::Vector3d> Displacements() const;
  /// 1 for nodes of tissue.
  std::vector<unsigned char> TissueNodes() const;
  /// 1 for nodes that the probe touches.
  std::vector<unsigned char> ContactNodes() const;
  /// Of the probe on the tissue, N, in the world.
  Eigen::Vector3d Force() const;
  /// The volume of all tissue now over that at rest, and the least of any cell's part.
  double RelativeVolume() const;
  double LeastVolume() const;
  PressedTissue Now() const;
  const TissueWork& Work() const { return work_; }
  /// The steps on the finest lattice alone.
  const TissueWork& FinestWork() const { return finestWork_; }

private:
  struct Level;
  bool Step(std::size_t level, const Pose& from, const Pose& to, const Progress& progress, double& reached);
  bool Walk(std::size_t level, const Pose& from, const Pose& to, const Progress& progress, double& reached);
  void Predict(std::size_t level);
  void CheckTied() const;

  TissueBody body_;
  TissuePressParameters parameters_;
  Pose latticeToWorld_;
  std::vector<std::unique_ptr<Level>> levels_; ///< the finest first
  std::shared_ptr<const ProbeShape> shape_;
  Pose pose_ = Pose::Identity(); ///< of the probe, to the lattice
  TissueWork work_, finestWork_;
};

} // namespace echorama
