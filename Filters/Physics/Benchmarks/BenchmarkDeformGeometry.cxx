// SPDX-License-Identifier: BSD-3-Clause
// What follows a lattice of 64 x 64 x 40 points that is bent by up to 10 mm: an image of 256^3 voxels, and a million points there
// and back, beside vtkGridTransform on the same lattice (with vtkImageReslice, and for points by itself), whose inverse is
// iterated: once to its default tolerance, once to one that is comparable. Both interpolate the lattice in their own way, so the
// error of an inverse is how far its result is carried from where it should be, by the contestant's own map; from_smooth is the
// same by the function that the lattice samples.
#include "Core/Base/Random.h"
#include "Filters/Physics/DeformedSources.h"
#include "Filters/Physics/DeformGeometry.h"
#include "Testing/Benchmark.h"
#include <cmath>
#include <ctime>
#include <tbb/info.h>

#ifdef ECHORAMA_WITH_VTK
#include <vtkDoubleArray.h>
#include <vtkFloatArray.h>
#include <vtkGridTransform.h>
#include <vtkImageData.h>
#include <vtkImageReslice.h>
#include <vtkNew.h>
#include <vtkObject.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#endif

namespace {

using namespace echorama;
using Eigen::Vector3d;

// Tissue under a probe: pressed down, bulging sideways.
Vector3d Smooth(const Vector3d& x)
{
  const Vector3d d = x - Vector3d(80.0, 80.0, 0.0);
  const double g = std::exp(-d[2] / 60.0 - (d[0] * d[0] + d[1] * d[1]) / (2.0 * 45.0 * 45.0));
  return 10.0 * g * Vector3d(0.4 * d[0] / 45.0, 0.4 * d[1] / 45.0, 1.0);
}

ImageGeometry Lattice()
{
  ImageGeometry lattice;
  lattice.dimensions = {64, 64, 40};
  lattice.spacing = {160.0 / 63.0, 160.0 / 63.0, 120.0 / 39.0};
  return lattice;
}

ImageGeometry Grid()
{
  ImageGeometry grid;
  grid.dimensions = {256, 256, 256};
  grid.spacing = {160.0 / 255.0, 160.0 / 255.0, 120.0 / 255.0};
  return grid;
}

std::vector<Vector3d> Displacements(const ImageGeometry& lattice)
{
  std::vector<Vector3d> u;
  for (int k = 0; k < lattice.dimensions[2]; ++k)
    for (int j = 0; j < lattice.dimensions[1]; ++j)
      for (int i = 0; i < lattice.dimensions[0]; ++i)
        u.push_back(Smooth(lattice.IndexToWorld() * Vector3d(i, j, k)));
  return u;
}

template <class Function>
double CpuSeconds(const Function& function)
{
  const std::clock_t start = std::clock();
  function();
  return static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
}

// Well inside of the lattice, before and after.
std::vector<Vector3d> Points(int count)
{
  Random random(1);
  std::vector<Vector3d> points;
  for (int n = 0; n < count; ++n)
    points.emplace_back(random.Uniform(10.0, 150.0), random.Uniform(10.0, 150.0), random.Uniform(2.0, 105.0));
  return points;
}

struct Largest {
  double error = 0.0, fromSmooth = 0.0;

  // \a read: where a contestant says that lay what is at \a now; \a carried: where its own map takes that.
  void Add(const Vector3d& now, const Vector3d& read, const Vector3d& carried)
  {
    error = std::max(error, (carried - now).norm());
    fromSmooth = std::max(fromSmooth, (read + Smooth(read) - now).norm());
  }
};

constexpr const char* imageCase = "image 256^3, forward";
constexpr const char* forwardCase = "10^6 points, forward";
constexpr const char* backwardCase = "10^6 points, backward";

// Points forward are the map itself, which has no error of its own.
void ReportMap(const std::string& method, double seconds, double cpuSeconds, const Largest& largest)
{
  benchmark::ReportTime(
      "deform_geometry", forwardCase, method, seconds,
      {{"cpu_seconds", cpuSeconds}, {"from_smooth", largest.fromSmooth}, {"threads", tbb::info::default_concurrency()}});
}

void Report(const char* testCase, const std::string& method, double seconds, double cpuSeconds, const Largest& largest)
{
  benchmark::Report(
      "deform_geometry", testCase, method, seconds, largest.error, "mm",
      {{"cpu_seconds", cpuSeconds}, {"from_smooth", largest.fromSmooth}, {"threads", tbb::info::default_concurrency()}});
}

#ifdef ECHORAMA_WITH_VTK
vtkSmartPointer<vtkImageData> ImageOf(const ImageGeometry& geometry)
{
  auto image = vtkSmartPointer<vtkImageData>::New();
  image->SetDimensions(geometry.dimensions.data());
  image->SetSpacing(geometry.spacing.data());
  return image;
}

vtkSmartPointer<vtkGridTransform> GridTransform(const ImageGeometry& lattice, const std::vector<Vector3d>& u)
{
  const auto image = ImageOf(lattice);
  vtkNew<vtkDoubleArray> array;
  array->SetNumberOfComponents(3);
  array->SetNumberOfTuples(static_cast<vtkIdType>(u.size()));
  for (std::size_t i = 0; i < u.size(); ++i)
    array->SetTuple(static_cast<vtkIdType>(i), u[i].data());
  image->GetPointData()->SetScalars(array);
  auto transform = vtkSmartPointer<vtkGridTransform>::New();
  transform->SetDisplacementGridData(image);
  transform->SetInterpolationModeToLinear();
  transform->Update();
  return transform;
}

Vector3d Through(vtkAbstractTransform* transform, const Vector3d& point)
{
  Vector3d result;
  transform->TransformPoint(point.data(), result.data());
  return result;
}

vtkSmartPointer<vtkPoints> PointsOf(const std::vector<Vector3d>& points)
{
  auto made = vtkSmartPointer<vtkPoints>::New();
  made->SetDataTypeToDouble();
  for (const Vector3d& point : points)
    made->InsertNextPoint(point.data());
  return made;
}

void Peer(const std::string& name, double tolerance, const std::vector<float>& voxels, const std::vector<Vector3d>& u)
{
  const ImageGeometry lattice = Lattice(), grid = Grid();
  const auto transform = GridTransform(lattice, u);
  transform->SetInverseTolerance(tolerance);
  vtkAbstractTransform* inverse = transform->GetInverse();
  inverse->Update();

  const auto image = ImageOf(grid);
  vtkNew<vtkFloatArray> array;
  array->SetArray(const_cast<float*>(voxels.data()), static_cast<vtkIdType>(voxels.size()), 1);
  image->GetPointData()->SetScalars(array);
  vtkNew<vtkImageReslice> reslice;
  reslice->SetInputData(image);
  reslice->SetResliceTransform(inverse);
  reslice->SetInterpolationModeToLinear();
  const auto run = [&reslice] {
    reslice->Modified();
    reslice->Update();
  };
  double seconds = 0.0;
  const double cpu = CpuSeconds([&] { seconds = benchmark::Seconds(run); });
  Largest largest;
  Random random(2);
  for (int n = 0; n < 50000; ++n) {
    const Vector3d now(random.Uniform(10.0, 150.0), random.Uniform(10.0, 150.0), random.Uniform(12.0, 110.0));
    const Vector3d read = Through(inverse, now);
    largest.Add(now, read, Through(transform, read));
  }
  Report(imageCase, name, seconds, cpu, largest);

  const auto start = Points(1000000);
  const auto points = PointsOf(start);
  vtkNew<vtkPoints> there, back;
  there->SetDataTypeToDouble();
  back->SetDataTypeToDouble();
  const double cpuThere = CpuSeconds([&] { seconds = benchmark::Seconds([&] { transform->TransformPoints(points, there); }); });
  Largest forward;
  for (std::size_t i = 0; i < start.size(); ++i) {
    const Vector3d now(there->GetPoint(static_cast<vtkIdType>(i)));
    forward.fromSmooth = std::max(forward.fromSmooth, (start[i] + Smooth(start[i]) - now).norm());
  }
  ReportMap(name, seconds, cpuThere, forward);
  const double cpuBack = CpuSeconds([&] { seconds = benchmark::Seconds([&] { inverse->TransformPoints(there, back); }); });
  Largest backward;
  for (vtkIdType i = 0; i < back->GetNumberOfPoints(); i += 7) {
    const Vector3d now(there->GetPoint(i)), read(back->GetPoint(i));
    backward.Add(now, read, Through(transform, read));
  }
  Report(backwardCase, name, seconds, cpuBack, backward);
}
#endif

} // namespace

int main()
{
  const ImageGeometry lattice = Lattice(), grid = Grid();
  const std::vector<Vector3d> u = Displacements(lattice);
  const LatticeMap map(lattice, u);
  std::vector<float> voxels(grid.VoxelCount());
  for (std::size_t i = 0; i < voxels.size(); ++i)
    voxels[i] = static_cast<float>(i * 2654435761u % 256);

  std::vector<float> deformed(voxels.size());
  std::vector<unsigned char> valid(voxels.size());
  DeformedImage image;
  image.geometry = image.grid = grid;
  image.valid = {valid.data(), grid.dimensions};
  image.writers = {MixedArray<float>(voxels.data(), deformed.data(), 1)};
  DeformGeometryParameters parameters;
  parameters.outside = DeformGeometryParameters::Outside::Mask;
  const auto ours = [&] { DeformImage(parameters, map, image); };
  const double seconds = benchmark::MedianSeconds(ours, 3), cpu = CpuSeconds(ours);
  // One error per slab, as slabs come from several threads.
  std::vector<Largest> slices(static_cast<std::size_t>(grid.dimensions[2]));
  VisitRestPlaces(map, false, grid, [&](const SourceSlab& slab) {
    Largest& largest = slices[static_cast<std::size_t>(slab.firstSlice)];
    std::size_t at = 0;
    for (int k = slab.firstSlice; k < slab.firstSlice + slab.slices; ++k)
      for (int j = 0; j < grid.dimensions[1]; ++j)
        for (int i = 0; i < grid.dimensions[0]; ++i, ++at)
          if (slab.kinds[at] == SourceKind::Found) {
            const Vector3d read = lattice.IndexToWorld() * slab.sources[at];
            if (const auto place = map.Find(slab.sources[at], true))
              largest.Add(grid.IndexToWorld() * Vector3d(i, j, k), read, read + map.DisplacementAt(*place));
          }
  });
  Largest largest;
  for (const Largest& one : slices) {
    largest.error = std::max(largest.error, one.error);
    largest.fromSmooth = std::max(largest.fromSmooth, one.fromSmooth);
  }
  Report(imageCase, "echorama", seconds, cpu, largest);

  const auto start = Points(1000000);
  auto points = start;
  std::vector<unsigned char> states;
  double once = 0.0;
  const double cpuThere = CpuSeconds([&] { once = benchmark::Seconds([&] { DeformPoints(parameters, map, points, states); }); });
  const auto there = points;
  Largest forward;
  for (std::size_t i = 0; i < start.size(); ++i)
    forward.fromSmooth = std::max(forward.fromSmooth, (start[i] + Smooth(start[i]) - there[i]).norm());
  ReportMap("echorama", once, cpuThere, forward);
  parameters.direction = DeformGeometryParameters::Direction::Backward;
  const double cpuBack = CpuSeconds([&] { once = benchmark::Seconds([&] { DeformPoints(parameters, map, points, states); }); });
  Largest backward;
  for (std::size_t i = 0; i < start.size(); ++i)
    backward.Add(there[i], points[i], points[i] + map.DisplacementAt(*map.Find(map.WorldToIndex() * points[i], true)));
  Report(backwardCase, "echorama", once, cpuBack, backward);

#ifdef ECHORAMA_WITH_VTK
  vtkObject::GlobalWarningDisplayOff();       // it warns of every point whose iteration stops early
  Peer("vtkGridTransform", 0.001, voxels, u); // its default
  Peer("tight vtkGridTransform, tolerance 1e-5 mm", 1e-5, voxels, u);
#endif
  return 0;
}
