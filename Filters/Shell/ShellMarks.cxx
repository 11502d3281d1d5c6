// SPDX-License-Identifier: BSD-3-Clause
// The map of marks is that of a compass: direction is kept, and distance from the middle is the way down along the body, as the
// angle from the top seen from below the middle. So marks on steep sides do not lie over one another, as they would when seen
// from above.
#include "ShellMarks.h"
#include "Core/Base/CheckRange.h"
#include "Core/Base/Error.h"
#include "Core/Base/FormatText.h"
#include "Core/Base/Parallel.h"
#include <algorithm>
#include <cmath>
#include <Eigen/Geometry>
#include <numeric>

namespace echorama {
namespace {

using Eigen::Vector3d;

constexpr double fullTurn = 6.283185307179586;

// A mark in the frame of Up: height, and direction around.
struct MarkPlace {
  double height = 0.0, angle = 0.0, polar = 0.0; // polar: from the top, as seen from the middle of the lowest plane
};

std::vector<MarkPlace> PlacesOf(const std::vector<Vector3d>& marks, const Vector3d& up)
{
  const Eigen::Quaterniond upright = Eigen::Quaterniond::FromTwoVectors(up, Vector3d::UnitZ());
  Eigen::AlignedBox3d box;
  for (const Vector3d& mark : marks)
    box.extend(upright * mark);
  std::vector<MarkPlace> places;
  for (const Vector3d& mark : marks) {
    const Vector3d from = upright * mark - Vector3d(box.center().x(), box.center().y(), box.min().z());
    places.push_back({from.z(), std::atan2(from.y(), from.x()), std::atan2(from.head<2>().norm(), from.z())});
  }
  return places;
}

} // namespace

std::vector<Vector3d> DomeMarks(int count, double radiusMm, double horizon, double lowestDegrees)
{
  CheckRange("the number of marks", count, 1, 100000);
  CheckRange("the radius of the dome", radiusMm, 1e-3, 1e5);
  CheckRange("the density at the horizon", horizon, 1e-3, 1e3);
  CheckRange("the lowest elevation of marks", lowestDegrees, 0.0, 80.0);
  // Per height z (area is uniform in z) the density is 1 + (horizon - 1) (1 - z); its share from the top down to z, solved for z.
  const double slope = horizon - 1.0, depth = 1.0 - std::sin(lowestDegrees * fullTurn / 360.0);
  const double all = depth + 0.5 * slope * depth * depth;
  std::vector<Vector3d> marks;
  for (int i = 0; i < count; ++i) {
    const double share = count > 1 ? all * i / (count - 1) : 0.0;
    const double down = 2.0 * share / (1.0 + std::sqrt(1.0 + 2.0 * slope * share));
    const double z = 1.0 - down, around = 2.399963229728653 * i,
                 aside = std::sqrt(std::max(1.0 - z * z, 0.0)); // the golden angle
    marks.emplace_back(radiusMm * Vector3d(aside * std::cos(around), aside * std::sin(around), z));
  }
  return marks;
}

std::vector<std::size_t> OrderMarks(const std::vector<Vector3d>& marks, const Vector3d& up)
{
  const std::vector<MarkPlace> places = PlacesOf(marks, up);
  std::vector<std::size_t> order(marks.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  if (marks.empty())
    return order;
  const auto lower = [&](std::size_t a, std::size_t b) {
    return std::make_pair(places[a].polar, a) < std::make_pair(places[b].polar, b);
  };
  std::sort(order.begin(), order.end(), lower);
  // As many rings as make gaps alike along a ring and between two: about 2/3 of the root of their number on a half sphere.
  const auto rings = static_cast<std::size_t>(std::max(1.0, std::round(0.63 * std::sqrt(static_cast<double>(marks.size())))));
  const double lowest = places[order.back()].polar;
  double start = -0.5 * fullTurn;
  for (std::size_t ring = 0, begin = 0; ring < rings; ++ring) {
    std::size_t end = begin;
    while (end < order.size() &&
           (ring + 1 == rings || places[order[end]].polar < lowest * static_cast<double>(ring + 1) / static_cast<double>(rings)))
      ++end;
    const auto around = [&](std::size_t mark) {
      const double angle = places[mark].angle - start;
      return angle - fullTurn * std::floor(angle / fullTurn);
    };
    std::sort(order.begin() + static_cast<std::ptrdiff_t>(begin), order.begin() + static_cast<std::ptrdiff_t>(end),
              [&](std::size_t a, std::size_t b) { return std::make_pair(around(a), a) < std::make_pair(around(b), b); });
    if (end > begin)
      start = places[order[end - 1]].angle;
    begin = end;
  }
  return order;
}

ProxyFit MeasureProxy(const TriangleSurface& body, const TriangleSurface& proxy, const std::vector<Vector3d>& marks,
                      const Vector3d& up, double level, const Progress& progress)
{
  if (proxy.triangles.empty() || marks.empty())
    throw Error(Error::Kind::BadInput, "the proxy has no triangles or no marks");
  const TriangleTree tree(proxy.points, proxy.triangles);
  std::vector<Eigen::Vector3f> places; // marks, as triangles without an extent
  std::vector<TriangleTree::Triangle> dots;
  for (const Vector3d& mark : marks) {
    const auto at = static_cast<std::uint32_t>(places.size());
    dots.push_back({at, at, at});
    places.push_back(mark.cast<float>());
  }
  const TriangleTree markTree(places, dots);
  struct Distances {
    double toProxy = -1.0, toMark = 0.0;
  };
  std::vector<Distances> distances(body.points.size());
  ParallelRanges(static_cast<std::ptrdiff_t>(distances.size()), 1024, progress, [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
    for (auto i = static_cast<std::size_t>(begin); i < static_cast<std::size_t>(end); ++i) {
      const Vector3d point = body.points[i].cast<double>();
      if (up.dot(point) < level)
        continue;
      const auto near = tree.NearestTo(proxy.points, proxy.triangles, point);
      const auto mark = markTree.NearestTo(places, dots, point);
      if (near && mark)
        distances[i] = {near->distanceMm, mark->distanceMm};
    }
  });
  ProxyFit fit;
  std::size_t count = 0;
  for (std::size_t i = 0; i < distances.size(); ++i) {
    if (distances[i].toProxy < 0.0)
      continue;
    ++count;
    fit.meanMm += distances[i].toProxy;
    fit.mostMm = std::max(fit.mostMm, distances[i].toProxy);
    if (distances[i].toMark > fit.farthestMarkMm) {
      fit.farthestMarkMm = distances[i].toMark;
      fit.farthest = body.points[i].cast<double>();
    }
  }
  fit.meanMm /= static_cast<double>(std::max<std::size_t>(count, 1));
  return fit;
}

std::string MarksGuide(const std::vector<Vector3d>& marks, const Vector3d& up)
{
  const std::vector<MarkPlace> places = PlacesOf(marks, up);
  double widest = 1e-9;
  for (const MarkPlace& place : places)
    widest = std::max(widest, place.polar);
  constexpr double half = 95.0; // mm on the page
  const auto onPage = [&](const MarkPlace& place) {
    const double radius = (half - 5.0) * place.polar / widest;
    return Eigen::Vector2d(half + radius * std::cos(place.angle), half - radius * std::sin(place.angle));
  };
  std::string html =
      "<!DOCTYPE html>\n<html><head><meta charset=\"utf-8\"><title>Calibration points</title>"
      "<style>body{font-family:sans-serif}table{font-size:8pt;columns:3}</style></head><body>\n"
      "<h1>Calibration points</h1>\n<p>" +
      std::to_string(marks.size()) +
      " points, seen from outside against Up. Go from 1 on; the line leads to the next. Distance from the middle is the "
      "angle down from the top.</p>\n" +
      Format("<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"%gmm\" height=\"%gmm\" viewBox=\"0 0 %g %g\">\n", 2.0 * half,
             2.0 * half, 2.0 * half, 2.0 * half) +
      "<polyline fill=\"none\" stroke=\"#9bc\" stroke-width=\"0.4\" points=\"";
  for (const MarkPlace& place : places)
    html += Format("%.2f,%.2f ", onPage(place).x(), onPage(place).y());
  html += "\"/>\n";
  for (std::size_t i = 0; i < places.size(); ++i) {
    const Eigen::Vector2d at = onPage(places[i]);
    html += Format(
        "<circle cx=\"%.2f\" cy=\"%.2f\" r=\"0.8\" fill=\"%s\"/><text x=\"%.2f\" y=\"%.2f\" font-size=\"2.6\">%zu</text>\n",
        at.x(), at.y(), i % 10 == 9 ? "#c00" : "#000", at.x() + 1.0, at.y() - 0.6, i + 1);
  }
  html += "</svg>\n<table><tr><th>point</th><th>x</th><th>y</th><th>z</th></tr>\n";
  for (std::size_t i = 0; i < marks.size(); ++i)
    html +=
        Format("<tr><td>%zu</td><td>%.2f</td><td>%.2f</td><td>%.2f</td></tr>\n", i + 1, marks[i].x(), marks[i].y(), marks[i].z());
  return html + "</table>\n</body></html>\n";
}

} // namespace echorama
