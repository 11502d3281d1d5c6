// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "BodySet.h"
#include "Core/Base/Progress.h"
#include "CornerNormals.h"
#include "Filters/Tissue/TissueSurface.h"
#include "SceneLattice.h"
#include "SceneShells.h"
#include "SceneTree.h"
#include <optional>

namespace echorama {

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
  using Notes = SceneShells::Notes;

  /// Where the normals of a triangle and of its corner differ by more than \a creaseDegrees there is an edge; with 0 all
  /// triangles are flat. \throws what TissueSurface::Check throws.
  explicit AcousticScene(const TissueSurface& surface, const Progress& progress = {}, double creaseDegrees = 30.0);

  const std::vector<Material>& Materials() const { return materials_; }
  const Notes& GetNotes() const { return notes_; }
  bool Empty() const { return triangles_.empty(); } ///< no triangle

  /// Hits closer than this along a ray are one, mm: a few steps of the coordinates' single precision.
  double Tolerance() const { return tolerance_; }

  /// The material in a set of shells.
  int MediumOf(const BodySet& inside) const;

  /// The shells that hold a point: three rays each give a vote, five when they disagree.
  BodySet BodiesAt(const Eigen::Vector3d& point) const;

  /// The materials at points. A lattice of cells knows where it is the same all over a cell; elsewhere a short ray from the
  /// middle of the cell tells. Thread safe.
  void MediumAt(const Eigen::Vector3f* points, std::size_t count, std::int32_t* materials) const
  {
    lattice_.MediumAt(*this, points, count, materials);
  }

  /// The next crossing along the ray, at most \a limit mm from its origin; the ray is then behind it. Surfaces that do not
  /// change the medium are passed. \returns false when there is none. Thread safe.
  bool NextCrossing(SceneRay& ray, double limit, Crossing& crossing) const;

  /// All that the scene holds, bytes.
  std::size_t MemoryBytes() const;

private:
  friend class SceneLattice;

  // Hits within the tolerance, taken as one.
  struct Meeting {
    struct Change {
      std::int32_t shell;
      int balance;        // how often it was entered less how often it was left; 0 of sheets
      SceneTree::Hit hit; // one of them
    };
    std::vector<Change> changes;
    double first = 0.0, last = 0.0; // mm along the ray
    int asked = 0;                  // how often the tree was
  };

  // What a hit needs to know of a triangle, in a quarter of a cache line.
  struct Triangle {
    std::int32_t shell;
    CornerNormals normals;
  };

  void FindCavities(const SceneShells& parts);
  SceneTree::Line LineOf(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const;
  bool Meet(const SceneTree::Line& line, double from, double to, Meeting& meeting) const;
  static void Pass(const Meeting& meeting, BodySet& inside);

  // Calls see(meeting) for every meeting from one place of a ray to another, in their order.
  template <class F>
  void EachMeeting(const SceneTree::Line& line, double from, double to, F&& see) const
  {
    for (Meeting meeting; Meet(line, from, to, meeting); from = meeting.first + tolerance_)
      see(meeting);
  }

  std::vector<Material> materials_;
  std::vector<int> materialOf_; // of a body
  std::vector<SceneShells::Shell> shells_;
  std::vector<Triangle> triangles_; // of the tree
  Notes notes_;
  Eigen::Vector3d centre_, low_, high_; // of the box: see SceneShells
  double tolerance_;
  std::optional<SceneTree> tree_;
  SceneLattice lattice_;
};

} // namespace echorama
