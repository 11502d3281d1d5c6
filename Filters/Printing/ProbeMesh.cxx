// SPDX-License-Identifier: BSD-3-Clause
// The face is a grid over fan and sweep at depth 0. As long as neither bends by more than a quarter turn to each side it is a
// height over the xy plane, and its border seen from above is a star about the origin: every half-plane that begins in the z
// axis meets it once. So everything else is built in those half-planes, one per point of the border: from the border on a
// circle that begins along the face and ends straight down (the edge), then down to a common height (the wall), then in
// loops at one height each, whose radius goes from the wall's to the handle's (neck, handle, rounded end). Each loop is a
// star again, and each lies below the one before; hence nothing is cut.
#include "ProbeMesh.h"
#include "Core/Base/Angles.h"
#include "Core/Base/Error.h"
#include "Core/Base/NumberText.h"
#include <algorithm>
#include <cmath>

namespace echorama {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

[[noreturn]] void RefuseProbe(const std::string& reason)
{
  throw Error(Error::Kind::InvalidParameter, "probe mesh: " + reason);
}

// The geometry of the physical face, symmetric, with a size in both directions.
ProbeGeometry FaceOf(const ProbeGeometry& geometry, const ProbeHousing& housing)
{
  constexpr double pointLike = 1e-3; // mm
  ProbeGeometry face = geometry;
  const double whole = 1.0 + 2.0 * std::abs(geometry.fanOffset);
  face.fanOffset = 0.0;
  face.fanAngle *= whole;
  face.fanWidth *= whole;
  face.depthMin = std::min(face.depthMin, 0.0);
  if (face.fanWidth < pointLike) {
    face.fanAngle = 0.0;
    face.fanWidth = housing.faceWidthMm;
  }
  if (face.sweepWidth < pointLike) {
    face.sweepAngle = 0.0;
    face.sweepWidth = housing.faceThicknessMm;
  }
  if (face.fanAngle > Pi * (1.0 + 1e-9))
    RefuseProbe("the fan is " + NumberText(face.fanAngle / RadiansPerDegree) +
                " degrees wide; a face of more than 180 cannot be put on a handle");
  if (face.sweepAngle >= 178.0 * RadiansPerDegree)
    RefuseProbe("the sweep is " + NumberText(face.sweepAngle / RadiansPerDegree) + " degrees wide; it must be below 178");
  const double edge = face.Fan().PointOf({0.5, 0.0}).y(), span = face.Sweep().Span(edge);
  if (span < 0.1)
    RefuseProbe("the ends of the fan lie " + NumberText(-edge) + " mm behind its middle and so reach the axis of the sweep, " +
                NumberText(face.sweepWidth / face.sweepAngle) +
                " mm behind it, where the face would cut itself; a larger sweep radius or a smaller fan avoids that");
  return face;
}

int Steps(double length, double resolution)
{
  return std::max(1, static_cast<int>(std::ceil(length / resolution)));
}

// One half-plane: the direction away from the z axis, and what the walls do in it.
struct Column {
  Vector2d away;
  double radius, height; ///< of the face's border
  double slope;          ///< angle by which the face goes down there
  double wall;           ///< radius of the wall
  double handle;         ///< radius of the handle
};

class Builder {
public:
  Builder(const ProbeGeometry& geometry, const ProbeHousing& housing) : housing_(housing)
  {
    mesh_.face = FaceOf(geometry, housing);
  }

  ProbeMesh Build()
  {
    MakeFace();
    MakeEdge();
    MakeHandle();
    return std::move(mesh_);
  }

private:
  std::uint32_t Add(const Vector3d& point)
  {
    mesh_.points.push_back(point);
    return static_cast<std::uint32_t>(mesh_.points.size() - 1);
  }

  void Add(std::uint32_t a, std::uint32_t b, std::uint32_t c, ProbeMesh::Part part)
  {
    mesh_.triangles.push_back({a, b, c});
    mesh_.part.push_back(part);
  }

  void MakeFace()
  {
    const ProbeGeometry& face = mesh_.face;
    const double r = housing_.resolutionMm;
    const int across = std::max(2, Steps(face.fanWidth, r)), along = std::max(2, Steps(face.sweepWidth, r));
    const double height = housing_.skirtMm + housing_.neckMm + housing_.handleMm + face.fanWidth;
    if (2.0 * across * along + 4.0 * (across + along) * (height / r + 20.0) > 5e6)
      throw Error(Error::Kind::TooLarge, "probe mesh: at a resolution of " + NumberText(r) +
                                             " mm it would have more than 5 million triangles; ask for a coarser one");
    const auto index = [across](int i, int j) { return static_cast<std::uint32_t>(j * (across + 1) + i); };
    for (int j = 0; j <= along; ++j)
      for (int i = 0; i <= across; ++i)
        Add(PointOf(face, {0.0, PositionOf(i, across + 1), PositionOf(j, along + 1)}));
    for (int j = 0; j < along; ++j)
      for (int i = 0; i < across; ++i) {
        // The diagonals run alike in opposite quarters, so that the face is as symmetric as the probe.
        const std::uint32_t a = index(i, j), b = index(i + 1, j), c = index(i + 1, j + 1), d = index(i, j + 1);
        if ((2 * i < across) == (2 * j < along)) {
          Add(a, b, c, ProbeMesh::Face);
          Add(a, c, d, ProbeMesh::Face);
        } else {
          Add(a, b, d, ProbeMesh::Face);
          Add(b, c, d, ProbeMesh::Face);
        }
      }
    mesh_.facePoints = mesh_.points.size();
    const auto border = [&](int i, int j) {
      loop_.push_back(index(i, j));
      const Vector3d point = mesh_.points[loop_.back()];
      const Vector3d normal = DirectionOf(face, {0.0, PositionOf(i, across + 1), PositionOf(j, along + 1)});
      Column column;
      column.radius = point.head<2>().norm();
      column.away = point.head<2>() / column.radius;
      column.height = point.z();
      column.slope = std::clamp(std::atan2(normal.head<2>().dot(column.away), normal.z()), 0.0, 0.5 * Pi);
      column.wall = column.radius + housing_.rimMm * (1.0 - std::sin(column.slope));
      column.handle = std::pow(std::pow(std::abs(column.away.x()) / (0.5 * housing_.handleWidthMm), handleRoundness) +
                                   std::pow(std::abs(column.away.y()) / (0.5 * housing_.handleThicknessMm), handleRoundness),
                               -1.0 / handleRoundness);
      columns_.push_back(column);
    };
    for (int i = 0; i < across; ++i)
      border(i, 0);
    for (int j = 0; j < along; ++j)
      border(across, j);
    for (int i = across; i > 0; --i)
      border(i, along);
    for (int j = along; j > 0; --j)
      border(0, j);
  }

  // Adds a loop below the last, by radius and height in each column.
  template <class F>
  void AddLoop(F&& radiusAndHeight, ProbeMesh::Part part)
  {
    std::vector<std::uint32_t> next;
    for (const Column& column : columns_) {
      const auto [radius, height] = radiusAndHeight(column);
      next.push_back(Add({radius * column.away.x(), radius * column.away.y(), height}));
    }
    for (std::size_t i = 0; i < loop_.size(); ++i) {
      const std::size_t j = (i + 1) % loop_.size();
      Add(loop_[i], next[i], next[j], part);
      Add(loop_[i], next[j], loop_[j], part);
    }
    loop_ = std::move(next);
  }

  void MakeEdge()
  {
    using Place = std::pair<double, double>;
    const double rim = housing_.rimMm;
    const int bends = std::max(3, Steps(0.5 * Pi * rim, housing_.resolutionMm));
    const auto edge = [rim](const Column& column, double t) {
      const double angle = column.slope + t * (0.5 * Pi - column.slope);
      // A face that ends straight down has no edge; its loops must not fall into one.
      const double drop = rim * (std::cos(column.slope) - std::cos(angle)) + 1e-3 * t * rim;
      return Place{column.radius + rim * (std::sin(angle) - std::sin(column.slope)), column.height - drop};
    };
    for (int i = 1; i <= bends; ++i)
      AddLoop([&](const Column& column) { return edge(column, static_cast<double>(i) / bends); }, ProbeMesh::Housing);
    double lowest = 0.0, highest = -1e300;
    for (const Column& column : columns_) {
      lowest = std::min(lowest, edge(column, 1.0).second);
      highest = std::max(highest, edge(column, 1.0).second);
    }
    height_ = lowest - housing_.skirtMm;
    const int steps = Steps(highest - height_, housing_.resolutionMm);
    for (int i = 1; i <= steps; ++i)
      AddLoop(
          [&](const Column& column) {
            const double t = static_cast<double>(i) / steps, from = edge(column, 1.0).second;
            return Place{column.wall, i == steps ? height_ : from + t * (height_ - from)};
          },
          ProbeMesh::Housing);
  }

  void MakeHandle()
  {
    using Place = std::pair<double, double>;
    const double r = housing_.resolutionMm;
    const int neck = std::max(4, Steps(housing_.neckMm, r));
    for (int i = 1; i <= neck; ++i) {
      const double t = static_cast<double>(i) / neck, share = t * t * (3.0 - 2.0 * t);
      AddLoop(
          [&](const Column& column) {
            return Place{column.wall + share * (column.handle - column.wall), height_ - t * housing_.neckMm};
          },
          ProbeMesh::Housing);
    }
    height_ -= housing_.neckMm;
    const double round = std::min(0.3 * std::min(housing_.handleWidthMm, housing_.handleThicknessMm), 0.9 * housing_.handleMm);
    const double straight = housing_.handleMm - round;
    const int steps = Steps(straight, r), bends = std::max(3, Steps(0.5 * Pi * round, r));
    for (int i = 1; i <= steps; ++i)
      AddLoop([&](const Column& column) { return Place{column.handle, height_ - straight * i / steps}; }, ProbeMesh::Handle);
    height_ -= straight;
    for (int i = 1; i <= bends; ++i) {
      const double angle = 0.5 * Pi * i / bends;
      AddLoop(
          [&](const Column& column) {
            return Place{column.handle - round * (1.0 - std::cos(angle)), height_ - round * std::sin(angle)};
          },
          ProbeMesh::Handle);
    }
    const std::uint32_t middle = Add({0.0, 0.0, height_ - round});
    for (std::size_t i = 0; i < loop_.size(); ++i)
      Add(middle, loop_[(i + 1) % loop_.size()], loop_[i], ProbeMesh::Handle);
  }

  const ProbeHousing& housing_;
  ProbeMesh mesh_;
  std::vector<Column> columns_;
  std::vector<std::uint32_t> loop_; ///< the last loop, counter-clockwise as seen from above
  double height_ = 0.0;             ///< z of the last loop
};

} // namespace

ParameterList Describe(ProbeHousing& p)
{
  return {
      Parameter("RimMm", p.rimMm, {0.1, 50}, "mm", "Radius of the edge between face and wall.").Advanced(),
      Parameter("SkirtMm", p.skirtMm, {0.1, 200}, "mm", "Straight wall below the lowest point of that edge.").Advanced(),
      Parameter("NeckMm", p.neckMm, {1, 500}, "mm", "From the wall to the handle.").Advanced(),
      Parameter("HandleMm", p.handleMm, {1, 1000}, "mm", "Length of the handle.").Advanced(),
      Parameter("HandleWidthMm", p.handleWidthMm, {1, 500}, "mm", "The handle along the fan.").Advanced(),
      Parameter("HandleThicknessMm", p.handleThicknessMm, {1, 500}, "mm", "The handle along the sweep.").Advanced(),
      Parameter("FaceWidthMm", p.faceWidthMm, {1, 300}, "mm",
                "The face of a phased array along the fan: its beams start in one point, which has no size.")
          .Advanced(),
      Parameter("FaceThicknessMm", p.faceThicknessMm, {1, 300}, "mm",
                "The face of a single plane, or of a sweep about a line in the face, along the sweep.")
          .Advanced(),
      Parameter("ResolutionMm", p.resolutionMm, {0.1, 50}, "mm", "Edge of the triangles, about."),
  };
}

double ProbeMesh::Volume() const
{
  double sixfold = 0.0;
  for (const auto& [a, b, c] : triangles)
    sixfold += points[a].dot(points[b].cross(points[c]));
  return sixfold / 6.0;
}

ProbeMesh MakeProbeMesh(const ProbeGeometry& geometry, const ProbeHousing& housing)
{
  geometry.Check();
  CheckRanges(housing);
  return Builder(geometry, housing).Build();
}

std::vector<Pose> ElementPoses(const ProbeGeometry& geometry, int elements, int sweepSteps)
{
  geometry.Check();
  CheckRanges({Parameter("Elements", elements, {1, 65536}, "", ""), Parameter("SweepSteps", sweepSteps, {1, 65536}, "", "")});
  if (static_cast<std::int64_t>(elements) * sweepSteps > (1 << 24))
    throw Error(Error::Kind::TooLarge, "elements times sweepSteps must not be more than 16777216");
  std::vector<Pose> poses;
  poses.reserve(static_cast<std::size_t>(elements) * static_cast<std::size_t>(sweepSteps));
  for (int j = 0; j < sweepSteps; ++j)
    for (int i = 0; i < elements; ++i) {
      const BeamPoint beam{0.0, PositionOf(i, elements), PositionOf(j, sweepSteps)};
      const double phi = geometry.fanAngle * (beam.fan + geometry.fanOffset), psi = geometry.sweepAngle * beam.sweep;
      Pose pose = Pose::Identity();
      pose.linear().col(0) = Vector3d(std::cos(phi), -std::sin(phi) * std::sin(psi), -std::sin(phi) * std::cos(psi));
      pose.linear().col(1) = Vector3d(0.0, std::cos(psi), -std::sin(psi));
      pose.linear().col(2) = DirectionOf(geometry, beam);
      pose.translation() = PointOf(geometry, beam);
      poses.push_back(pose);
    }
  return poses;
}

} // namespace echorama
