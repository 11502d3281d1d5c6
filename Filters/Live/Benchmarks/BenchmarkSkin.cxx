// SPDX-License-Identifier: BSD-3-Clause
// A probe on a body of a million triangles: a ball of 150 mm, so that the truth is known. The error of walks is how far great
// circles are from closing, that of nearest places their distance from those of the ball; the peer is vtkStaticCellLocator, as it
// comes. Times are of one thread; "processor_seconds" is what a busy machine does not blur. Then a needle in the plane of 192
// beams of 512 samples; last, the skin of volumes in which a ball is valid, by the filter.
#include "Core/Base/Random.h"
#include "Filters/Live/LiveProbe.h"
#include "Filters/Live/Needle.h"
#include "Filters/Live/SkinWalk.h"
#include "Testing/Benchmark.h"
#include <cmath>
#include <ctime>

#ifdef ECHORAMA_WITH_VTK
#include "Filters/Live/vtkUltrasoundSkin.h"
#include <vtkCellArray.h>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkStaticCellLocator.h>
#include <vtkUnsignedCharArray.h>
#endif

namespace {

using namespace echorama;
using Eigen::Vector3d;

constexpr double radius = 150.0, pi = 3.14159265358979323846;

struct Ball {
  std::vector<Eigen::Vector3f> points;
  std::vector<SkinMesh::Triangle> triangles;
};

// Rings of equal heights apart in angle, each of as many points; the poles are one point.
Ball MakeBall(std::uint32_t rings, std::uint32_t around)
{
  Ball ball;
  for (std::uint32_t j = 1; j < rings; ++j)
    for (std::uint32_t i = 0; i < around; ++i) {
      const double polar = pi * j / rings, azimuth = 2.0 * pi * i / around;
      ball.points.push_back(
          (radius * Vector3d(std::sin(polar) * std::cos(azimuth), std::sin(polar) * std::sin(azimuth), std::cos(polar)))
              .cast<float>());
    }
  const auto at = [around](std::uint32_t ring, std::uint32_t i) { return (ring - 1) * around + i % around; };
  const auto north = static_cast<std::uint32_t>(ball.points.size()), south = north + 1;
  ball.points.emplace_back(0.0f, 0.0f, static_cast<float>(radius));
  ball.points.emplace_back(0.0f, 0.0f, static_cast<float>(-radius));
  for (std::uint32_t i = 0; i < around; ++i) {
    ball.triangles.push_back({north, at(1, i), at(1, i + 1)});
    for (std::uint32_t j = 1; j + 1 < rings; ++j) {
      ball.triangles.push_back({at(j, i), at(j + 1, i), at(j + 1, i + 1)});
      ball.triangles.push_back({at(j, i), at(j + 1, i + 1), at(j, i + 1)});
    }
    ball.triangles.push_back({south, at(rings - 1, i + 1), at(rings - 1, i)});
  }
  return ball;
}

// Seconds and processor seconds of one of \a count.
template <class F>
std::pair<double, double> Each(int count, const F& f)
{
  const std::clock_t start = std::clock();
  const double seconds = benchmark::Seconds([&] {
    for (int n = 0; n < count; ++n)
      f(n);
  });
  return {seconds / count, static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC / count};
}

#ifdef ECHORAMA_WITH_VTK
// A ball of 0.4 sides within a cube of voxels of 0.5 mm.
vtkSmartPointer<vtkImageData> BallVolume(int side)
{
  auto image = vtkSmartPointer<vtkImageData>::New();
  image->SetDimensions(side, side, side);
  image->SetSpacing(0.5, 0.5, 0.5);
  image->SetOrigin(-0.25 * (side - 1), -0.25 * (side - 1), -0.25 * (side - 1));
  vtkNew<vtkUnsignedCharArray> valid;
  valid->SetName("ValidRegion");
  valid->SetNumberOfTuples(image->GetNumberOfPoints());
  unsigned char* to = valid->GetPointer(0);
  for (int k = 0; k < side; ++k)
    for (int j = 0; j < side; ++j)
      for (int i = 0; i < side; ++i)
        *to++ = (0.5 * Vector3d(i, j, k) + Vector3d(image->GetOrigin())).norm() < 0.2 * side;
  image->GetPointData()->AddArray(valid);
  return image;
}
#endif

void Line(const std::string& name, const std::string& method, const std::pair<double, double>& times, double error = -1.0)
{
  const nlohmann::ordered_json more{{"processor_seconds", times.second}};
  if (error < 0.0)
    benchmark::ReportTime("skin", name, method, times.first, more);
  else
    benchmark::Report("skin", name, method, times.first, error, "mm", more);
}

} // namespace

int main()
{
  const Ball ball = MakeBall(500, 1000);
  std::shared_ptr<const SkinMesh> mesh;
  Line("made ready", "echorama", Each(1, [&](int) { mesh = std::make_shared<const SkinMesh>(ball.points, ball.triangles); }));
  SkinWalk walk(mesh);
  Random random(1);

  const int steps = benchmark::Trials(50000);
  double sum = 0.0; // so that nothing is left out
  Line("step of 2 mm, and the pose", "echorama", Each(steps, [&](int) {
         walk.Step(1.6, 1.2);
         walk.Turn(0.05);
         sum += walk.PoseOf().translation().x();
       }));
  const int circles = benchmark::Trials(100);
  double squared = 0.0;
  const auto round = Each(circles, [&](int) {
    walk.PutNearest(radius * random.Direction());
    const Vector3d from = walk.Point();
    walk.Step(2.0 * pi * radius, 0.0);
    squared += (walk.Point() - from).squaredNorm();
  });
  Line("great circle", "echorama", round, std::sqrt(squared / circles));

  const int questions = benchmark::Trials(50000);
  std::vector<Vector3d> places;
  for (int n = 0; n < questions; ++n)
    places.push_back((radius + random.Uniform(-10.0, 10.0)) * random.Direction());
  double worst = 0.0;
  const auto ours = Each(questions, [&](int n) {
    const auto nearest = mesh->NearestTo(places[static_cast<std::size_t>(n)]);
    worst = std::max(worst, std::abs(nearest->distanceMm - std::abs(places[static_cast<std::size_t>(n)].norm() - radius)));
  });
  Line("nearest place, within 10 mm", "echorama", ours, worst);
#ifdef ECHORAMA_WITH_VTK
  vtkNew<vtkPoints> points;
  for (const auto& p : ball.points)
    points->InsertNextPoint(p[0], p[1], p[2]);
  vtkNew<vtkCellArray> cells;
  for (const auto& t : ball.triangles) {
    const vtkIdType corners[]{t[0], t[1], t[2]};
    cells->InsertNextCell(3, corners);
  }
  vtkNew<vtkPolyData> surface;
  surface->SetPoints(points);
  surface->SetPolys(cells);
  vtkNew<vtkStaticCellLocator> locator;
  locator->SetDataSet(surface);
  Line("made ready", "vtkStaticCellLocator", Each(1, [&](int) { locator->BuildLocator(); }));
  worst = 0.0;
  const auto theirs = Each(questions, [&](int n) {
    double found[3], distance2 = 0.0;
    vtkIdType cell = 0;
    int part = 0;
    const Vector3d& place = places[static_cast<std::size_t>(n)];
    locator->FindClosestPoint(place.data(), found, cell, part, distance2);
    worst = std::max(worst, std::abs(std::sqrt(distance2) - std::abs(place.norm() - radius)));
  });
  Line("nearest place, within 10 mm", "vtkStaticCellLocator", theirs, worst);
#endif
  Line("click", "echorama", Each(questions, [&](int n) {
         const Vector3d& place = places[static_cast<std::size_t>(n)];
         sum += mesh->FirstHit(3.0 * place, -place)->distanceMm;
       }));

  LiveProbeSettings settings;
  settings.depthMm = 120.0;
  const PlacedProbe probe{GeometryOf(settings, 192), Pose::Identity()};
  Volume<float> value({512, 192, 1}, 80.0f);
  for (const double degrees : {20.0, 50.0, 85.0}) {
    const double angle = degrees * pi / 180.0;
    const Needle needle{{10, 0, 60}, {std::cos(angle), 0, std::sin(angle)}};
    Line("needle at " + std::to_string(static_cast<int>(degrees)) + " degrees to the face", "echorama",
         Each(benchmark::Trials(500), [&](int) { sum += DrawNeedle({}, needle, probe, {}, {}, value.View()).seenMm; }));
  }
#ifdef ECHORAMA_WITH_VTK
  for (const int side : benchmark::Smoke() ? std::vector<int>{64} : std::vector<int>{128, 256, 512}) {
    vtkNew<vtkUltrasoundSkin> skin;
    skin->SetInputData(BallVolume(side));
    const auto times = Each(1, [&](int) { skin->Update(); });
    double squares = 0.0;
    for (vtkIdType i = 0; i < skin->GetOutput()->GetNumberOfPoints(); ++i)
      squares += std::pow(Vector3d(skin->GetOutput()->GetPoint(i)).norm() - 0.2 * side, 2);
    Line("skin of " + std::to_string(side) + "^3 voxels", "echorama", times,
         std::sqrt(squares / static_cast<double>(skin->GetOutput()->GetNumberOfPoints())));
  }
#endif
  return std::isfinite(sum) ? 0 : 1;
}
