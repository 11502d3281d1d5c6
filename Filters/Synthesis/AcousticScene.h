// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Progress.h"
#include "TissueSurface.h"
#include <array>
#include <cstdint>
#include <Eigen/Core>
#include <memory>
#include <vector>

namespace echorama {

/// The shells (connected closed surfaces) that hold a point: a sorted set of small numbers. A few are kept in place, more on
/// the heap.
class BodySet {
public:
  const std::int32_t* begin() const { return count_ <= few ? few_.data() : many_.data(); }
  const std::int32_t* end() const { return begin() + count_; }
  int Count() const { return count_; }
  bool Contains(std::int32_t shell) const;
  /// Both may be asked for what is so already.
  void Insert(std::int32_t shell);
  void Erase(std::int32_t shell);
  bool operator==(const BodySet& other) const;

private:
  static constexpr int few = 10;
  int count_ = 0;
  std::array<std::int32_t, few> few_{};
  std::vector<std::int32_t> many_; ///< all of them, when they are more than a few
};

/// Where a ray goes from one medium into another.
struct Crossing {
  double distance = 0.0;                              ///< mm along the ray
  double behind = 0.0;                                ///< the same, of the last of several surfaces that are taken as one
  Eigen::Vector3d normal = -Eigen::Vector3d::UnitZ(); ///< of the curved surface: unit vector against the ray
  Eigen::Vector3d facet = -Eigen::Vector3d::UnitZ();  ///< of the triangle: unit vector against the ray
  int before = 0, after = 0;                          ///< materials
  /// The material of an open surface, or -1. Sound is reflected as if its material lay behind, and goes on in the medium
  /// that it came from.
  int sheet = -1;
};

/// A ray as it goes through the scene: its line, how far it is, and which shells hold it there.
struct SceneRay {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();     ///< mm, world
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ(); ///< unit vector
  BodySet inside;                                       ///< at the origin, then behind the last crossing
  BodySet came;                                         ///< before the last crossing
  /// Whether it begins on a surface that the set takes into account: just what lies beyond it is looked for then.
  bool fromSurface = false;
  double passed = 0.0;    ///< mm from the origin to behind the last crossing
  std::int64_t asked = 0; ///< how often the scene's tree was asked

  /// What the tree is asked, written down for benchmarks.
  struct Question {
    std::array<float, 3> origin, direction;
    float from, to;
  };
  std::vector<Question>* record = nullptr;
};

/// The surfaces of a scene, ready for rays (Embree).
///
/// A *shell* is a connected piece of a body's surface. A ray that enters a shell puts it into its set, one that leaves takes it
/// out; both may be repeated, so a hit that was missed (or met twice) does no lasting harm. Hits closer together than
/// Tolerance() are taken as one, and only the medium before and behind counts: touching bodies and layers without thickness
/// leave no gap. The medium is that of the last body in the list with the point inside; inside means within more outer shells
/// than cavities of that body.
///
/// Triangles stand for curved surfaces: normals are interpolated between those of the corners, but not across an edge. Without
/// that, spheres would glitter like cut stones.
///
/// What is odd about surfaces is mended or worked around, and noted: see Notes.
class AcousticScene {
public:
  struct Notes {
    std::int64_t degenerateTriangles = 0; ///< without area; left out
    int shells = 0;                       ///< connected pieces of surfaces
    int turnedShells = 0;                 ///< were inside out, or had triangles that disagree, and are taken the right way round
    int cavities = 0;                     ///< shells that bound a hole within their body
    /// Have holes of up to a tenth of their area: they keep their inside, and what enters by a hole is put right where it
    /// leaves.
    int leakyShells = 0;
    int sheets = 0; ///< open, without an inside: see Crossing::sheet
  };

  /// Where the normals of a triangle and of its corner differ by more than \a creaseDegrees there is an edge; with 0 all
  /// triangles are flat. \throws what TissueSurface::Check throws.
  explicit AcousticScene(const TissueSurface& surface, const Progress& progress = {}, double creaseDegrees = 30.0);
  ~AcousticScene();
  AcousticScene(AcousticScene&&) noexcept;
  AcousticScene& operator=(AcousticScene&&) noexcept;

  const std::vector<Material>& Materials() const;
  const Notes& GetNotes() const;
  bool Empty() const; ///< no triangle

  /// Hits closer than this along a ray are one, mm: a few steps of the coordinates' single precision.
  double Tolerance() const;

  /// The material in a set of shells.
  int MediumOf(const BodySet& inside) const;

  /// The shells that hold a point: three rays each give a vote, five when they disagree.
  BodySet BodiesAt(const Eigen::Vector3d& point) const;

  /// The materials at points. A lattice of cells knows where it is the same all over a cell; elsewhere a short ray from the
  /// middle of the cell tells. Thread safe.
  void MediumAt(const Eigen::Vector3f* points, std::size_t count, std::int32_t* materials) const;

  /// The next crossing along the ray, at most \a limit mm from its origin; the ray is then behind it. Surfaces that do not
  /// change the medium are passed. \returns false when there is none. Thread safe.
  bool NextCrossing(SceneRay& ray, double limit, Crossing& crossing) const;

  /// All that the scene holds, bytes.
  std::size_t MemoryBytes() const;

  /// For benchmarks: asks the tree again what was asked, one by one in the same order. \returns how many were hits.
  std::int64_t Ask(const SceneRay::Question* questions, std::size_t count) const;

private:
  struct State;
  std::unique_ptr<State> state_;
};

} // namespace echorama
