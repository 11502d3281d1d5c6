// SPDX-License-Identifier: BSD-3-Clause
// Scan conversion of a 512 x 128 x 128 beam volume of a convex probe to 256^3 voxels, beside vtkImageReslice with the same
// inverse map as a vtkAbstractTransform. Both are compared, on the same beams, with trilinear interpolation in double
// precision at the exact inverse. The error is taken before rounding (on beams and voxels of type float, same code); that of
// the bytes, with half a grey level of rounding, is given as well.
#include "Core/Base/Parallel.h"
#include "Core/Base/Random.h"
#include "Core/Imaging/ScanConversion.h"
#include "Testing/Benchmark.h"
#include <cmath>
#include <ctime>
#include <tbb/info.h>

#ifdef ECHORAMA_WITH_VTK
#include <vtkAbstractTransform.h>
#include <vtkFloatArray.h>
#include <vtkImageData.h>
#include <vtkImageReslice.h>
#include <vtkMultiThreader.h>
#include <vtkNew.h>
#include <vtkObjectFactory.h>
#include <vtkPointData.h>
#include <vtkUnsignedCharArray.h>
#endif

namespace {

using namespace echorama;

constexpr double fanRadius = 40.0, sweepRadius = 25.0;
constexpr std::array<int, 3> beamDimensions{512, 128, 128};

ProbeGeometry TheProbe()
{
  return ProbeGeometry::Convex(1.2, fanRadius, 1.1, sweepRadius, 2.0, 150.0);
}

// Smooth shapes under speckle of a few samples' grain, 0 to 255.
template <class T>
Volume<T> Beams()
{
  Volume<T> beams(beamDimensions);
  ParallelFor(beamDimensions[2], [&beams](std::ptrdiff_t k) {
    Random random(7, static_cast<std::uint64_t>(k));
    for (int j = 0; j < beamDimensions[1]; ++j)
      for (int i = 0; i < beamDimensions[0]; ++i) {
        const double shape = 90.0 + 60.0 * std::sin(0.05 * i + 0.1 * j) * std::cos(0.07 * static_cast<double>(k));
        beams.View()(i, j, static_cast<int>(k)) = static_cast<T>(static_cast<int>(shape + random.Uniform(0.0, 100.0)));
      }
  });
  return beams;
}

// Trilinear interpolation at the exact inverse, all in double precision; -1 outside.
std::vector<double> Reference(VolumeView<const unsigned char> beams, const ProbeGeometry& probe, const ImageGeometry& grid)
{
  std::vector<double> values(grid.VoxelCount(), -1.0);
  const Eigen::Affine3d toWorld = grid.IndexToWorld();
  const auto& n = grid.dimensions;
  ParallelFor(n[2], [&](std::ptrdiff_t k) {
    std::size_t at = static_cast<std::size_t>(n[0]) * n[1] * k;
    for (int j = 0; j < n[1]; ++j)
      for (int i = 0; i < n[0]; ++i, ++at) {
        const auto beam = BeamPointAt(probe, toWorld * Eigen::Vector3d(i, j, static_cast<double>(k)));
        if (!beam)
          continue;
        const double index[3] = {(beam->depth - probe.depthMin) / (probe.depthMax - probe.depthMin) * (beamDimensions[0] - 1),
                                 (beam->fan + 0.5) * (beamDimensions[1] - 1), (beam->sweep + 0.5) * (beamDimensions[2] - 1)};
        int before[3];
        double t[3];
        for (int axis = 0; axis < 3; ++axis) {
          before[axis] = std::min(static_cast<int>(index[axis]), beamDimensions[axis] - 2);
          t[axis] = index[axis] - before[axis];
        }
        double sum = 0.0;
        for (int corner = 0; corner < 8; ++corner) {
          const int dx = corner & 1, dy = corner >> 1 & 1, dz = corner >> 2;
          sum += (dx ? t[0] : 1.0 - t[0]) * (dy ? t[1] : 1.0 - t[1]) * (dz ? t[2] : 1.0 - t[2]) *
                 beams(before[0] + dx, before[1] + dy, before[2] + dz);
        }
        values[at] = sum;
      }
  });
  return values;
}

// Seconds of processor time that one more call takes, over all threads: what machines that others use, too, can tell best.
template <class Function>
double CpuSeconds(const Function& function)
{
  const std::clock_t start = std::clock();
  function();
  return static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
}

struct Difference {
  double largest = 0.0;
  std::size_t compared = 0, onlyOne = 0;
};

// Where both have a value; \a real tells where ours has one.
template <class T, class RealVoxel>
Difference Compare(const T* values, const std::vector<double>& reference, const RealVoxel& real)
{
  Difference difference;
  for (std::size_t i = 0; i < reference.size(); ++i) {
    const bool here = real(i), there = reference[i] >= 0.0;
    difference.onlyOne += here != there;
    if (here && there) {
      difference.largest = std::max(difference.largest, std::abs(static_cast<double>(values[i]) - reference[i]));
      ++difference.compared;
    }
  }
  return difference;
}

#ifdef ECHORAMA_WITH_VTK
// From a point in the probe frame to continuous sample indices, as a user of VTK would write it.
class ConvexInverse : public vtkAbstractTransform {
public:
  static ConvexInverse* New();
  vtkTypeMacro(ConvexInverse, vtkAbstractTransform);

  void InternalTransformPoint(const float in[3], float out[3]) override { Map(in, out); }
  void InternalTransformPoint(const double in[3], double out[3]) override { Map(in, out); }
  void InternalTransformDerivative(const float in[3], float out[3], float[3][3]) override { Map(in, out); }
  void InternalTransformDerivative(const double in[3], double out[3], double[3][3]) override { Map(in, out); }
  vtkAbstractTransform* MakeTransform() override { return New(); }
  void Inverse() override {}

private:
  template <class R>
  void Map(const R in[3], R out[3]) const
  {
    const double psi = std::atan2(in[1], in[2] + sweepRadius);
    const double rho = std::sqrt(in[1] * in[1] + (in[2] + sweepRadius) * (in[2] + sweepRadius)) - sweepRadius;
    const double phi = std::atan2(static_cast<double>(in[0]), rho + fanRadius);
    const double depth = std::sqrt(in[0] * in[0] + (rho + fanRadius) * (rho + fanRadius)) - fanRadius;
    out[0] = static_cast<R>((depth - probe_.depthMin) * depthScale_);
    out[1] = static_cast<R>(phi * fanScale_ + 0.5 * (beamDimensions[1] - 1));
    out[2] = static_cast<R>(psi * sweepScale_ + 0.5 * (beamDimensions[2] - 1));
  }

  const ProbeGeometry probe_ = TheProbe();
  const double depthScale_ = (beamDimensions[0] - 1) / (probe_.depthMax - probe_.depthMin);
  const double fanScale_ = (beamDimensions[1] - 1) / probe_.fanAngle, sweepScale_ = (beamDimensions[2] - 1) / probe_.sweepAngle;
};
vtkStandardNewMacro(ConvexInverse);

template <class T, class Array>
vtkSmartPointer<vtkImageReslice> Reslice(Volume<T>& beams, const ImageGeometry& grid)
{
  vtkNew<Array> array;
  array->SetArray(beams.View().Data(), beams.View().Size(), 1);
  vtkNew<vtkImageData> image;
  image->SetDimensions(beamDimensions.data());
  image->GetPointData()->SetScalars(array);
  vtkNew<ConvexInverse> transform;
  auto reslice = vtkSmartPointer<vtkImageReslice>::New();
  reslice->SetInputData(image);
  reslice->SetResliceTransform(transform);
  reslice->SetInterpolationModeToLinear();
  reslice->SetOutputOrigin(grid.origin.data());
  reslice->SetOutputSpacing(grid.spacing.data());
  reslice->SetOutputExtent(0, grid.dimensions[0] - 1, 0, grid.dimensions[1] - 1, 0, grid.dimensions[2] - 1);
  return reslice;
}
#endif

} // namespace

int main()
{
  const ProbeGeometry probe = TheProbe();
  Volume<unsigned char> beams = Beams<unsigned char>();
  Volume<float> floatBeams = Beams<float>();
  // The box around the fan, in 256 voxels along each axis.
  ImageGeometry grid = ScanConversionGrid(probe, Pose::Identity(), 1.0, 1u << 30);
  for (int axis = 0; axis < 3; ++axis) {
    grid.spacing[axis] = (grid.dimensions[axis] - 1) / 255.0;
    grid.dimensions[axis] = 256;
  }
  const std::vector<double> reference = Reference(beams.View(), probe, grid);
  const double megavoxels = static_cast<double>(grid.VoxelCount()) * 1e-6;

  Volume<unsigned char> voxels(grid.dimensions), valid(grid.dimensions);
  Volume<float> floats(grid.dimensions);
  const auto real = [&valid](std::size_t i) { return valid.View()[static_cast<std::ptrdiff_t>(i)] != 0; };
  const auto ours = [&] { ScanConvert<unsigned char>(beams.View(), probe, Pose::Identity(), grid, voxels.View(), valid.View()); };
  double seconds = 0.0;
#ifdef ECHORAMA_WITH_VTK
  const auto reslice = Reslice<unsigned char, vtkUnsignedCharArray>(beams, grid);
  double peerSeconds = 0.0;
  const auto peer = [&reslice] {
    reslice->Modified();
    reslice->Update();
  };
  std::tie(seconds, peerSeconds) = benchmark::Duel(ours, peer);
#else
  seconds = benchmark::MedianSeconds(ours);
#endif

  const Difference bytes = Compare(voxels.View().Data(), reference, real);
  ScanConvert<float>(floatBeams.View(), probe, Pose::Identity(), grid, floats.View(), valid.View());
  const Difference exact = Compare(floats.View().Data(), reference, real);
  const double inside = static_cast<double>(exact.compared) / static_cast<double>(reference.size());
  benchmark::Report("scan_conversion", "convex 512x128x128 to 256^3", "echorama", seconds, exact.largest, "grey",
                    {{"error_of_bytes", bytes.largest},
                     {"cpu_seconds", CpuSeconds(ours)},
                     {"mvoxels_per_second", megavoxels / seconds},
                     {"threads", tbb::info::default_concurrency()},
                     {"inside_fraction", inside},
                     {"voxels_inside_in_one_only", exact.onlyOne}});

#ifdef ECHORAMA_WITH_VTK
  // vtkImageReslice marks nothing; its voxels are compared where ours are real.
  const Difference peerBytes = Compare(static_cast<unsigned char*>(reslice->GetOutput()->GetScalarPointer()), reference, real);
  const auto floatReslice = Reslice<float, vtkFloatArray>(floatBeams, grid);
  floatReslice->Update();
  const Difference peerExact = Compare(static_cast<float*>(floatReslice->GetOutput()->GetScalarPointer()), reference, real);
  benchmark::Report("scan_conversion", "convex 512x128x128 to 256^3", "vtkImageReslice with vtkAbstractTransform", peerSeconds,
                    peerExact.largest, "grey",
                    {{"error_of_bytes", peerBytes.largest},
                     {"cpu_seconds", CpuSeconds(peer)},
                     {"mvoxels_per_second", megavoxels / peerSeconds},
                     {"threads", reslice->GetEnableSMP() ? tbb::info::default_concurrency() : reslice->GetNumberOfThreads()},
                     {"ratio", peerSeconds / seconds}});
#endif

  // Any other orientation of the grid takes the general way.
  const Pose turned = MotionAbout({0, 0, 60}, {0.3, -0.2, 0.4}, {5, 3, -4});
  const double oblique = benchmark::MedianSeconds(
      [&] { ScanConvert<unsigned char>(beams.View(), probe, turned, grid, voxels.View(), valid.View()); }, 3);
  const std::vector<double> turnedReference = Reference(beams.View(), probe, grid.Moved(turned.inverse()));
  ScanConvert<float>(floatBeams.View(), probe, turned, grid, floats.View(), valid.View());
  const Difference turnedExact = Compare(floats.View().Data(), turnedReference, real);
  benchmark::Report("scan_conversion", "convex 512x128x128 to 256^3, oblique grid", "echorama", oblique, turnedExact.largest,
                    "grey", {{"mvoxels_per_second", megavoxels / oblique}, {"voxels_inside_in_one_only", turnedExact.onlyOne}});
  return 0;
}
