// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Parameters.h"
#include "Core/Base/Progress.h"
#include "Core/Imaging/DisplacementField.h"
#include "Filters/Tissue/Material.h"
#include <cstdint>
#include <Eigen/Geometry>
#include <functional>
#include <memory>
#include <vector>

namespace echorama {

class ScattererCache;

/// Which material there is at many points of the world (mm): an index per point; a negative one stands for none. Called from
/// several threads at once.
using MediumLookup = std::function<void(const Eigen::Vector3f* points, std::size_t count, std::int32_t* materials)>;

/// Whether scatterers in a box of the world are wanted. Called from several threads at once.
using BoxPredicate = std::function<bool(const Eigen::AlignedBox3d& box)>;

/// How scatterers are strewn.
struct ScattererParameters {
  std::uint64_t seed = 1;
  double densityPerMm3 = 0.0;
  /// Where the material has gone: world = material + displacement at the material's place. None: it is at rest. Must live
  /// until the scatterers are made.
  const DisplacementField* displacement = nullptr;
  double maxBytes = 8.0e9;
  double decorrelation = 0.0;
  std::uint64_t changeSeed = 1;
};

ParameterList Describe(ScattererParameters& p);

/// The points that scatter sound, fixed to the material.
///
/// One lies at random in every cell of a lattice in the material's own coordinates; its place, its sign (as likely plus as
/// minus) and its rank are hashed from the seed and the cell (Philox). So the same tissue has the same scatterers in every
/// volume, and where it is displaced they go along. A material with fewer scatterers than the lattice keeps those of low rank:
/// sparser ones are subsets of denser ones. The amplitude of a scatterer is its sign times
/// sqrt(backscattered power of its material / density of its material), so that the speckle of a material has the same level
/// however many there are.
///
/// Tissue that has changed (decorrelation d) has the same scatterers, but some of them, 1 - sqrt(1 - d), have a sign of their
/// own, hashed with changeSeed. So echoes of two changes that are seen alike correlate by 1 - d, and by sqrt(1 - d) with those of
/// tissue that has not changed.
///
/// All of a material are equally strong: with n in the resolution cell (BeamWidth::ResolutionCellMm3) the intensity I of the
/// speckle has <I^2> / <I>^2 = 2 + (1 - 2 c) / n, where c in [0, 1] tells how evenly they lie: nearly 0 where a cell of the
/// lattice is larger than the pulse is long. At n = 30 that is Rayleigh's speckle to 1%.
///
/// They lie in bricks: blocks of the lattice wherever they went in the world, with places relative to the brick in
/// single precision (1e-6 mm, however far away the world is).
class Scatterers {
public:
  /// Lists of a brick are padded to a multiple of this, for whole vectors, with silent points far from everything.
  static constexpr int lanes = 16;

  /// One brick: x, y, z and amplitude of \a count scatterers, one list after the other, each \a stride floats long.
  struct Brick {
    Eigen::Vector3d centre;   ///< mm, world
    Eigen::Vector3f halfSize; ///< of the box around the scatterers, about the centre, mm
    std::uint32_t count = 0, stride = 0;
    std::uint32_t part = 0; ///< in which part of the memory
    std::size_t first = 0;  ///< where its lists begin there
  };

  Scatterers() = default;

  /// All scatterers of the bricks that \a wanted wants (an empty function: all) and that may reach into \a region (world, mm).
  /// Same result for any number of threads, and with a \a cache or without.
  /// \throws Error(InvalidParameter) for a parameter out of range, for a region that is not finite or further away than 1e7 mm,
  /// and for materials that are wrong; Error(TooLarge) when they would need more than maxBytes or the memory that is free;
  /// Error(Cancelled).
  static Scatterers Make(const ScattererParameters& parameters, const std::vector<Material>& materials,
                         const MediumLookup& mediumAt, const Eigen::AlignedBox3d& region, const BoxPredicate& wanted = {},
                         const Progress& progress = {}, ScattererCache* cache = nullptr);

  /// Given ones, such as wires: points of the world (mm) and an amplitude each.
  /// \throws Error(BadInput) for lists of different lengths and numbers that are not finite.
  static Scatterers At(const std::vector<Eigen::Vector3d>& points, const std::vector<float>& amplitudes);

  std::size_t Count() const { return count_; }
  std::size_t MemoryBytes() const;
  const std::vector<Brick>& Bricks() const { return bricks_; }

  const float* X(const Brick& brick) const { return parts_[brick.part]->data() + brick.first; }
  const float* Y(const Brick& brick) const { return X(brick) + brick.stride; }
  const float* Z(const Brick& brick) const { return X(brick) + 2 * static_cast<std::size_t>(brick.stride); }
  const float* Amplitude(const Brick& brick) const { return X(brick) + 3 * static_cast<std::size_t>(brick.stride); }

  /// How far from a line bricks are looked for: the radius (mm) that serves all of it from \a begin to \a end mm.
  using RadiusAlong = std::function<double(double begin, double end)>;

  /// Appends the bricks that may hold scatterers beside the line from \a from along \a direction (unit vector), \a length
  /// mm long: within the radius of it, and not before its beginning or behind its end. Always the same in the same order, each
  /// once; also some that do not.
  void FindBeside(const Eigen::Vector3d& from, const Eigen::Vector3d& direction, double length, const RadiusAlong& radius,
                  std::vector<std::uint32_t>& found) const;

private:
  friend class ScattererCache;
  using Memory = std::shared_ptr<const std::vector<float>>; // shared with a cache

  void MakeGrid(double cell);

  std::vector<Memory> parts_;
  std::vector<Brick> bricks_;
  std::size_t count_ = 0;

  // Bricks by where their centre lies: those of a cell are starts_[cell] to starts_[cell + 1].
  Eigen::Vector3d gridFirst_ = Eigen::Vector3d::Zero();
  Eigen::Array3i gridSize_ = Eigen::Array3i::Zero();
  double gridCell_ = 1.0;
  double largestRadius_ = 0.0; // of a brick about its centre
  std::vector<std::uint32_t> starts_;
  std::vector<Eigen::Vector3f> centres_; // of the bricks, from the grid's first point, mm
};

} // namespace echorama
