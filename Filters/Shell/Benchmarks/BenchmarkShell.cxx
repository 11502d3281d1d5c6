// SPDX-License-Identifier: BSD-3-Clause
// The printed skin of an abdomen of 200,000 triangles: how long it takes, and how thick its wall is, measured from the triangles
// of its inner surface to those of its outer one, at 10^4 places that are spread by area. The peers are what VTK offers: each
// point moved inwards along its normal (vtkWarpVector), whose faces may cross, and vtkImplicitModeller, which samples distances
// and contours them.
#include "Core/Base/NumberText.h"
#include "Core/Base/Random.h"
#include "Filters/Shell/Benchmarks/InventedAbdomen.h"
#include "Filters/Shell/Shell.h"
#include "Filters/Shell/ShellMarks.h"
#include "Testing/Benchmark.h"
#include <algorithm>
#include <cmath>
#include <ctime>
#include <numeric>
#ifdef ECHORAMA_WITH_VTK
#include <vtkCellArray.h>
#include <vtkFloatArray.h>
#include <vtkFlyingEdges3D.h>
#include <vtkImageData.h>
#include <vtkImplicitModeller.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkPolyDataNormals.h>
#include <vtkWarpVector.h>
#endif

using namespace echorama;
using Eigen::Vector3d;

namespace {

TriangleTree TreeOf(const TriangleSurface& surface, const std::vector<std::uint32_t>& members)
{
  return TriangleTree(surface.points, surface.triangles, members);
}

struct Wall {
  double least = 1e9, most = 0.0, within = 0.0; // within 0.05 mm of 2: a share
  int places = 0;
};

// From places of some triangles to the nearest of others, where the place is above the plane.
Wall WallBetween(const TriangleSurface& innerMesh, const std::vector<std::uint32_t>& inner, const TriangleSurface& outerMesh,
                 const std::vector<std::uint32_t>& outer, double level)
{
  std::vector<double> areas{0.0};
  for (const std::uint32_t t : inner) {
    const auto& [a, b, c] = innerMesh.triangles[t];
    const Vector3d p = innerMesh.points[a].cast<double>();
    areas.push_back(areas.back() + (innerMesh.points[b].cast<double>() - p).cross(innerMesh.points[c].cast<double>() - p).norm());
  }
  const TriangleTree tree = TreeOf(outerMesh, outer);
  Wall wall;
  int within = 0;
  for (std::uint64_t i = 0; wall.places < 10000 && i < 100000; ++i) {
    Random random(5, i);
    const auto at = static_cast<std::size_t>(
        std::upper_bound(areas.begin() + 1, areas.end() - 1, random.Uniform() * areas.back()) - areas.begin() - 1);
    const auto& [a, b, c] = innerMesh.triangles[inner[at]];
    double u = random.Uniform(), v = random.Uniform();
    if (u + v > 1.0) {
      u = 1.0 - u;
      v = 1.0 - v;
    }
    const Vector3d place = (1.0 - u - v) * innerMesh.points[a].cast<double>() + u * innerMesh.points[b].cast<double>() +
                           v * innerMesh.points[c].cast<double>();
    if (place.z() < level)
      continue;
    const double distance = tree.NearestTo(outerMesh.points, outerMesh.triangles, place)->distanceMm;
    wall.least = std::min(wall.least, distance);
    wall.most = std::max(wall.most, distance);
    within += std::abs(distance - 2.0) <= 0.05;
    ++wall.places;
  }
  wall.within = static_cast<double>(within) / std::max(wall.places, 1);
  return wall;
}

nlohmann::ordered_json More(const Wall& wall)
{
  return {{"least_mm", wall.least}, {"most_mm", wall.most}, {"share_within", wall.within}, {"places", wall.places}};
}

// Of one call: seconds that passed, and those of all processors.
struct Spent {
  double seconds, cpu;
};

template <class Function>
Spent Timed(const Function& function)
{
  const std::clock_t before = std::clock();
  const double seconds = benchmark::Seconds(function);
  return {seconds, static_cast<double>(std::clock() - before) / CLOCKS_PER_SEC};
}

double WorstOf(const Wall& wall)
{
  return std::max(2.0 - wall.least, wall.most - 2.0);
}

std::vector<std::uint32_t> AllOf(const TriangleSurface& surface)
{
  std::vector<std::uint32_t> numbers(surface.triangles.size());
  std::iota(numbers.begin(), numbers.end(), 0u);
  return numbers;
}

#ifdef ECHORAMA_WITH_VTK
vtkNew<vtkPolyData> DataOf(const TriangleSurface& surface)
{
  vtkNew<vtkPolyData> data;
  vtkNew<vtkPoints> points;
  for (const Eigen::Vector3f& point : surface.points)
    points->InsertNextPoint(point.x(), point.y(), point.z());
  vtkNew<vtkCellArray> cells;
  for (const auto& triangle : surface.triangles) {
    const vtkIdType ids[3] = {triangle[0], triangle[1], triangle[2]};
    cells->InsertNextCell(3, ids);
  }
  data->SetPoints(points);
  data->SetPolys(cells);
  return data;
}

TriangleSurface SurfaceOf(vtkPolyData* data)
{
  TriangleSurface surface;
  for (vtkIdType i = 0; i < data->GetNumberOfPoints(); ++i)
    surface.points.push_back(Eigen::Map<const Vector3d>(data->GetPoint(i)).cast<float>());
  vtkIdType count;
  const vtkIdType* ids;
  for (vtkIdType i = 0; i < data->GetPolys()->GetNumberOfCells(); ++i) {
    data->GetPolys()->GetCellAtId(i, count, ids);
    surface.triangles.push_back(
        {static_cast<std::uint32_t>(ids[0]), static_cast<std::uint32_t>(ids[1]), static_cast<std::uint32_t>(ids[2])});
  }
  return surface;
}

TriangleSurface Warped(vtkPolyData* body)
{
  vtkNew<vtkPolyDataNormals> normals;
  normals->SetInputData(body);
  normals->SplittingOff();
  normals->Update();
  vtkNew<vtkWarpVector> warp;
  warp->SetInputConnection(normals->GetOutputPort());
  warp->SetInputArrayToProcess(0, 0, 0, vtkDataObject::FIELD_ASSOCIATION_POINTS, "Normals");
  warp->SetScaleFactor(-2.0);
  warp->Update();
  return SurfaceOf(warp->GetPolyDataOutput());
}

// Both surfaces at 2 mm, in- and outside, at 1 mm: at 0.5 it takes eight times as much.
TriangleSurface Modelled(vtkPolyData* body)
{
  const double* bounds = body->GetBounds();
  vtkNew<vtkImplicitModeller> model;
  model->SetInputData(body);
  double box[6];
  int size[3];
  double longest = 0.0;
  for (int axis = 0; axis < 3; ++axis) {
    box[2 * axis] = bounds[2 * axis] - 5.0;
    box[2 * axis + 1] = bounds[2 * axis + 1] + 5.0;
    size[axis] = static_cast<int>(box[2 * axis + 1] - box[2 * axis]) + 1;
    longest = std::max(longest, box[2 * axis + 1] - box[2 * axis]);
  }
  model->SetModelBounds(box);
  model->SetSampleDimensions(size);
  model->SetMaximumDistance(5.0 / longest);
  model->SetProcessModeToPerVoxel();
  model->AdjustBoundsOff();
  vtkNew<vtkFlyingEdges3D> contour;
  contour->SetInputConnection(model->GetOutputPort());
  contour->SetValue(0, 2.0);
  contour->Update();
  return SurfaceOf(contour->GetOutput());
}
#endif

void Compare(const std::string& name, const TriangleSurface& abdomen, const std::vector<double>& resolutions)
{
  ShellParameters p;
  p.openingMm = 70.0; // as high as the back
  p.printerMm = Vector3d(400.0, 400.0, 400.0);
  for (const double resolution : resolutions) {
    p.resolutionMm = resolution;
    Shell shell;
    const Spent spent = Timed([&] { shell = MakeShell(BodySurface(abdomen), p); });
    const BodySurface body(abdomen);
    const TriangleSurface& skin = shell.skin.surface;
    std::vector<double> depth;
    for (const Eigen::Vector3f& point : skin.points)
      depth.push_back(-body.Distance(point.cast<double>()));
    std::vector<std::uint32_t> inner, outer;
    for (std::uint32_t t = 0; t < skin.triangles.size(); ++t) {
      const auto& [a, b, c] = skin.triangles[t];
      if (std::min({depth[a], depth[b], depth[c]}) > 1.0)
        inner.push_back(t);
      else if (std::max({depth[a], depth[b], depth[c]}) < 1.0)
        outer.push_back(t);
    }
    const double level = body.Bounds().min().z() + p.openingMm + p.flangeThicknessMm + 3.0;
    const Wall wall = WallBetween(skin, inner, skin, outer, level);
    nlohmann::ordered_json more = More(wall);
    more["cpu_seconds"] = spent.cpu;
    more["triangles_in"] = abdomen.triangles.size();
    more["triangles_skin"] = skin.triangles.size();
    more["triangles_base"] = shell.base.surface.triangles.size();
    more["closed"] = shell.skin.check.IsClosed() && shell.base.check.IsClosed();
    more["self_intersections"] = shell.skin.check.selfIntersections.count + shell.base.check.selfIntersections.count;
    benchmark::Report("shell", name, "level set, " + NumberText(resolution) + " mm", spent.seconds, WorstOf(wall),
                      "largest error of the wall, mm", more);
  }
#ifdef ECHORAMA_WITH_VTK
  const double level = p.openingMm + p.flangeThicknessMm + 3.0 + BodySurface(abdomen).Bounds().min().z();
  const auto data = DataOf(abdomen);
  TriangleSurface offset;
  Spent spent = Timed([&] { offset = Warped(data); });
  Wall wall = WallBetween(offset, AllOf(offset), abdomen, AllOf(abdomen), level);
  nlohmann::ordered_json more = More(wall);
  more["cpu_seconds"] = spent.cpu;
  more["triangles_inner"] = offset.triangles.size();
  more["self_intersections"] = CheckSurface(offset).selfIntersections.count;
  benchmark::Report("shell", name, "vtkPolyDataNormals, vtkWarpVector", spent.seconds, WorstOf(wall),
                    "largest error of the wall, mm", more);
  spent = Timed([&] { offset = Modelled(data); });
  wall = WallBetween(offset, AllOf(offset), abdomen, AllOf(abdomen), level); // the outer half is as far
  more = More(wall);
  more["cpu_seconds"] = spent.cpu;
  benchmark::Report("shell", name, "vtkImplicitModeller, 1 mm, and contour", spent.seconds, WorstOf(wall),
                    "largest error of the wall, mm", more);
#endif
}

// A printer that is too small: what the cut costs, and whether the parts make the whole. At random places near the surface of the
// whole: how many that lie deeper in it than edges are broken (half a cell) lie in no part, and how many lie in two.
void Cut(const std::string& name, const TriangleSurface& abdomen, double resolution)
{
  ShellParameters p;
  p.openingMm = 70.0;
  p.resolutionMm = resolution;
  p.printerMm = Vector3d(250.0, 210.0, 210.0);
  const BodySurface body(abdomen);
  p.cutToFit = false;
  const Spent whole = Timed([&] { MakeShell(body, p); });
  p.cutToFit = true;
  Shell shell;
  const Spent cut = Timed([&] { shell = MakeShell(body, p); });
  std::size_t within = 0, lost = 0, doubled = 0, parts = 0;
  double volume = 0.0, largest = 0.0;
  std::vector<BodySurface> skins;
  bool isSound = true;
  for (const PrintedPart& printed : shell.cut) {
    isSound = isSound && printed.part.check.IsSound() && printed.part.fits;
    ++parts;
    largest = std::max(largest, printed.part.sizeMm.maxCoeff());
    if (printed.name[0] == 's') {
      skins.emplace_back(printed.part.surface);
      volume += printed.part.check.volumeMm3;
    }
  }
  const BodySurface skin(shell.skin.surface);
  for (std::uint64_t i = 0; i < 100000; ++i) {
    Random random(6, i);
    const auto& corners = shell.skin.surface.points;
    const Vector3d place =
        corners[static_cast<std::size_t>(random.Uniform() * static_cast<double>(corners.size()))].cast<double>() +
        4.0 * Vector3d(random.Uniform() - 0.5, random.Uniform() - 0.5, random.Uniform() - 0.5);
    int in = 0;
    for (const BodySurface& part : skins)
      in += part.Bounds().contains(place) && part.Distance(place) < -0.01;
    const bool isWithin = skin.Distance(place) < -0.5 * resolution;
    within += isWithin;
    lost += isWithin && in == 0;
    doubled += in > 1;
  }
  nlohmann::ordered_json more;
  more["cpu_seconds"] = cut.cpu;
  more["cpu_seconds_whole"] = whole.cpu;
  more["parts"] = parts;
  more["sound"] = isSound;
  more["largest_mm"] = largest;
  more["doubled"] = doubled;
  more["laps_share"] = volume / shell.skin.check.volumeMm3 - 1.0;
  benchmark::Report("shell", name, "cut for a printer of 250 x 210 x 210 mm", cut.seconds,
                    static_cast<double>(lost) / static_cast<double>(within), "share of the skin that is in no part", more);
}

} // namespace

int main()
{
  const int divisions = benchmark::Smoke() ? 30 : 129;
  const bool isQuick = benchmark::Smoke();
  Compare("abdomen, 2 mm", InventedAbdomen(divisions), isQuick ? std::vector<double>{1.0} : std::vector<double>{0.5, 0.8, 1.0});
  Compare("abdomen with a fold, 2 mm", InventedAbdomen(divisions, 6.0),
          isQuick ? std::vector<double>{1.0} : std::vector<double>{0.5});
  Cut("abdomen, cut", InventedAbdomen(divisions), isQuick ? 1.0 : 0.5);
  return 0;
}
