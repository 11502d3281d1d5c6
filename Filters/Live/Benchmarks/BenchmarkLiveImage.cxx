// SPDX-License-Identifier: BSD-3-Clause
// A live image of 640 x 480 pixels, 192 beams of 512 samples, of a volume of 512 x 512 x 400 bytes, as the probe moves. The error
// is that of the pixels, rounded to bytes, beside a dense reference: at the exact place of each pixel on its beam, 65 planes of
// the thickness, in double precision. That of the samples on the beams is given as well: it has all but what lies between the
// beams, which deep down are further apart than the voxels. The peer is vtkImageReslice with as many planes as ours, averaged
// with our weights; as it knows no planes that diverge, it gets a case in which they do not. Two volumes are overlapping parts of
// the same one, so that it is the reference for both ways to take them. Of pressed tissue it is a layer that is squeezed evenly.
#include "Core/Base/Parallel.h"
#include "Filters/Live/LiveImage.h"
#include "Testing/Benchmark.h"
#include <cmath>
#include <ctime>
#include <tbb/info.h>

#ifdef ECHORAMA_WITH_VTK
#include "Filters/Live/vtkUltrasoundLiveImage.h"
#include <vtkImageData.h>
#include <vtkImageReslice.h>
#include <vtkMatrix4x4.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkUnsignedCharArray.h>
#endif

namespace {

using namespace echorama;

constexpr std::array<int, 3> dimensions{512, 512, 400};

// Smooth shapes under a texture of two voxels' grain.
Volume<unsigned char> Body()
{
  const auto hash = [](int i, int j, int k) {
    std::uint32_t h = static_cast<std::uint32_t>(i) * 0x9E3779B1u ^ static_cast<std::uint32_t>(j) * 0x85EBCA77u ^
                      static_cast<std::uint32_t>(k) * 0xC2B2AE3Du;
    h = (h ^ h >> 15) * 0x2C1B3C6Du;
    h = (h ^ h >> 12) * 0x297A2D39u;
    return static_cast<float>((h ^ h >> 15) & 255u);
  };
  Volume<unsigned char> body(dimensions);
  ParallelFor(dimensions[2], [&](std::ptrdiff_t slice) {
    const int k = static_cast<int>(slice);
    for (int j = 0; j < dimensions[1]; ++j)
      for (int i = 0; i < dimensions[0]; ++i) {
        float texture = 0.0f;
        for (int corner = 0; corner < 8; ++corner)
          texture += hash(i + (corner & 1), j + (corner >> 1 & 1), k + (corner >> 2));
        const float shape = 40.0f * std::sin(0.04f * static_cast<float>(i)) * std::cos(0.05f * static_cast<float>(k)) *
                            std::cos(0.03f * static_cast<float>(j));
        body.View()(i, j, k) = static_cast<unsigned char>(std::min(255.0f, std::max(0.0f, shape + texture * 0.125f)));
      }
  });
  return body;
}

ImageGeometry BodyGrid()
{
  ImageGeometry grid;
  grid.dimensions = dimensions;
  grid.spacing.setConstant(0.5);
  grid.origin = {-128, -128, -15};
  return grid;
}

// Somewhere along a slow movement.
Pose PoseAt(int step)
{
  const double t = 0.01 * step;
  return MotionAbout({0, 0, 40}, {0.2 * std::sin(t), 0.15 * std::cos(1.3 * t), 0.4 + 0.3 * t}, {5.0 * std::sin(t), 4.0 * t, 0.0});
}

// A layer of tissue under a probe that is pressed in, in the probe's frame: what is at z lay at z / (1 - press / thick) - press.
constexpr double pressMm = 8.0, thickMm = 120.0;

double RestOf(double z)
{
  return z / (1.0 - pressMm / thickMm) - pressMm;
}

// The dense reference at points of the probe's plane; -1 where not all planes lie in the volume.
class Dense {
public:
  Dense(const VolumeView<const unsigned char>& body, BeamThickness thickness, const Pose& pose, bool isPressed = false)
    : body_(body), thickness_(thickness), toIndex_(BodyGrid().WorldToIndex() * pose), isPressed_(isPressed)
  {
    thickness_.planes = thickness.planes == 1 ? 1 : 65;
    planes_ = PlanesOf(thickness_);
  }

  double operator()(const Eigen::Vector3d& point, double depth) const
  {
    double sum = 0.0;
    for (const ThicknessPlane& plane : planes_) {
      const double z = isPressed_ ? RestOf(point.z()) : point.z();
      const Eigen::Vector3d at = toIndex_ * Eigen::Vector3d(point.x(), plane.offset * thickness_.SigmaMm(depth), z);
      const Eigen::Vector3i below = at.array().floor().cast<int>();
      if (below.minCoeff() < 0 || (Eigen::Vector3i(dimensions[0], dimensions[1], dimensions[2]) - below).minCoeff() < 2)
        return -1.0;
      const Eigen::Vector3d t = at - below.cast<double>();
      for (int c = 0; c < 8; ++c)
        sum += plane.weight * (c & 1 ? t[0] : 1 - t[0]) * (c & 2 ? t[1] : 1 - t[1]) * (c & 4 ? t[2] : 1 - t[2]) *
               body_(below[0] + (c & 1), below[1] + (c >> 1 & 1), below[2] + (c >> 2));
    }
    return sum;
  }

private:
  VolumeView<const unsigned char> body_;
  BeamThickness thickness_;
  Eigen::Affine3d toIndex_;
  bool isPressed_;
  std::vector<ThicknessPlane> planes_;
};

// At the pixels.
std::vector<double> Reference(const Dense& dense, const ProbeGeometry& probe, const Pose& pose, const ImageGeometry& grid)
{
  const Eigen::Affine3d toProbe = pose.inverse() * grid.IndexToWorld();
  std::vector<double> values(grid.VoxelCount(), -1.0);
  ParallelFor(grid.dimensions[1], [&](std::ptrdiff_t j) {
    for (int i = 0; i < grid.dimensions[0]; ++i) {
      Eigen::Vector3d point = toProbe * Eigen::Vector3d(i, static_cast<double>(j), 0);
      point.y() = 0.0;
      if (const auto beam = BeamPointAt(probe, point))
        values[static_cast<std::size_t>(i) + static_cast<std::size_t>(grid.dimensions[0]) * static_cast<std::size_t>(j)] =
            dense(point, beam->depth);
    }
  });
  return values;
}

// At the samples of the beams.
std::vector<double> BeamReference(const Dense& dense, const ProbeGeometry& probe, int samples, int beams)
{
  std::vector<double> values;
  for (int beam = 0; beam < beams; ++beam)
    for (int sample = 0; sample < samples; ++sample) {
      const double depth = probe.depthMin + (probe.depthMax - probe.depthMin) * sample / (samples - 1);
      values.push_back(dense(PointOf(probe, {depth, static_cast<double>(beam) / (beams - 1) - 0.5, 0.0}), depth));
    }
  return values;
}

struct Difference {
  double squares = 0.0, largest = 0.0;
  std::size_t compared = 0;
  double Rms() const { return std::sqrt(squares / static_cast<double>(compared)); }
};

template <class T>
Difference Compare(const T* pixels, const std::vector<double>& reference)
{
  Difference d;
  for (std::size_t i = 0; i < reference.size(); ++i)
    if (reference[i] >= 0.0) {
      const double difference = std::abs(static_cast<double>(pixels[i]) - reference[i]);
      d.squares += difference * difference;
      d.largest = std::max(d.largest, difference);
      ++d.compared;
    }
  return d;
}

// Seconds of processor time of one call, over all threads: what machines that others use, too, can tell best.
template <class Function>
double CpuSeconds(const Function& function, int runs = 5)
{
  const std::clock_t start = std::clock();
  for (int run = 0; run < runs; ++run)
    function();
  return static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC / runs;
}

struct Images {
  explicit Images(const LiveImage& live)
    : intensity(live.Grid(Pose::Identity()).dimensions), valid(live.Grid(Pose::Identity()).dimensions)
  {
  }
  Volume<unsigned char> intensity, valid;
};

#ifdef ECHORAMA_WITH_VTK
vtkSmartPointer<vtkImageData> ImageOf(Volume<unsigned char>& body)
{
  vtkNew<vtkUnsignedCharArray> array;
  array->SetName("Intensity");
  array->SetArray(body.View().Data(), body.View().Size(), 1);
  auto image = vtkSmartPointer<vtkImageData>::New();
  const ImageGeometry grid = BodyGrid();
  image->SetDimensions(dimensions.data());
  image->SetSpacing(grid.spacing.data());
  image->SetOrigin(grid.origin.data());
  image->GetPointData()->SetScalars(array);
  return image;
}

// The planes one behind the other, as one output, and their average.
struct Reslice {
  Reslice(vtkImageData* body, const ImageGeometry& pixels, const std::vector<ThicknessPlane>& thePlanes, double sigma)
    : planes(thePlanes), average(pixels.VoxelCount())
  {
    const double apart = planes.size() > 1 ? sigma * (planes[1].offset - planes[0].offset) : 1.0;
    filter->SetInputData(body);
    filter->SetInterpolationModeToLinear();
    filter->SetOutputDimensionality(3);
    filter->SetOutputSpacing(pixels.spacing[0], pixels.spacing[1], apart);
    filter->SetOutputOrigin(0, 0, sigma * planes[0].offset);
    filter->SetOutputExtent(0, pixels.dimensions[0] - 1, 0, pixels.dimensions[1] - 1, 0, static_cast<int>(planes.size()) - 1);
  }

  void Run(const ImageGeometry& pixels)
  {
    vtkNew<vtkMatrix4x4> axes;
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column)
        axes->SetElement(row, column, pixels.direction(row, column));
      axes->SetElement(row, 3, pixels.origin[row]);
    }
    filter->SetResliceAxes(axes);
    filter->Update();
    const auto* slices = static_cast<unsigned char*>(filter->GetOutput()->GetScalarPointer());
    const std::size_t count = average.size();
    for (std::size_t i = 0; i < count; ++i) {
      float sum = 0.0f;
      for (std::size_t p = 0; p < planes.size(); ++p)
        sum += planes[p].weight * static_cast<float>(slices[p * count + i]);
      average[i] = static_cast<unsigned char>(sum + 0.5f);
    }
  }

  std::vector<ThicknessPlane> planes;
  std::vector<unsigned char> average;
  vtkNew<vtkImageReslice> filter;
};
#endif

} // namespace

int main()
{
  Volume<unsigned char> body = Body();
  const int threads = tbb::info::default_concurrency();
  BeamVolumes volumes;
  volumes.Add<unsigned char>({body.View(), {}, BodyGrid()});
  const Pose still = PoseAt(7);

  int step = 0;
  const auto measure = [&](const std::string& testCase, const LiveImageParameters& p, const BeamVolumes& read,
                           const BeamBend* bend = nullptr) {
    LiveImage live;
    live.Set(p);
    Images images(live);
    const auto frame = [&](const Pose& pose) {
      live.MakeBeams(read, pose, 0, bend);
      live.MakePixels(images.intensity.View(), images.valid.View(), {});
    };
    const auto moving = [&] { frame(PoseAt(++step)); };
    const double seconds = benchmark::MedianSeconds(moving, 21), cpu = CpuSeconds(moving, benchmark::Trials(21));
    const double pixelSeconds =
        benchmark::MedianSeconds([&] { live.MakePixels(images.intensity.View(), images.valid.View(), {}); }, 21);
    frame(still);
    const Dense dense(body.View(), ThicknessOf(p), still, bend);
    const Difference d = Compare(images.intensity.View().Data(), Reference(dense, live.Probe(), still, live.Grid(still)));
    const Difference ofBeams = Compare(live.BeamValue().Data(), BeamReference(dense, live.Probe(), p.samples, p.beams));
    benchmark::Report("live_image", testCase, "echorama", seconds, d.Rms(), "grey (rms)",
                      {{"error_on_beams", ofBeams.Rms()},
                       {"largest_error", d.largest},
                       {"cpu_seconds", cpu},
                       {"pixel_seconds", pixelSeconds},
                       {"frames_per_second", 1.0 / seconds},
                       {"threads", threads}});
    return live.Grid(still);
  };

  LiveImageParameters parallel;
  parallel.thickness.planes = 5;
  parallel.thickness.divergence = 0.0;
  [[maybe_unused]] const ImageGeometry pixels = measure("convex, 5 parallel planes", parallel, volumes);

#ifdef ECHORAMA_WITH_VTK
  {
    const auto image = ImageOf(body);
    LiveImage live;
    live.Set(parallel);
    Reslice reslice(image, pixels, PlanesOf(ThicknessOf(parallel)), ThicknessOf(parallel).SigmaMm(0.0));
    const auto moving = [&] { reslice.Run(live.Grid(PoseAt(++step))); };
    const double seconds = benchmark::MedianSeconds(moving), cpu = CpuSeconds(moving, benchmark::Trials(5));
    reslice.Run(pixels);
    const Difference d =
        Compare(reslice.average.data(), Reference(Dense(body.View(), ThicknessOf(parallel), still), live.Probe(), still, pixels));
    benchmark::Report("live_image", "convex, 5 parallel planes", "vtkImageReslice", seconds, d.Rms(), "grey (rms)",
                      {{"largest_error", d.largest}, {"cpu_seconds", cpu}, {"threads", threads}});
  }
#endif

  LiveImageParameters usual;
  usual.thickness.planes = 5;
  measure("convex, 5 planes", usual, volumes);
#ifdef ECHORAMA_WITH_VTK
  {
    vtkNew<vtkUltrasoundLiveImage> live;
    live->AddInputData(ImageOf(body));
    live->SetThicknessPlanes(5);
    vtkNew<vtkMatrix4x4> matrix;
    const auto moving = [&] {
      const Pose pose = PoseAt(++step);
      for (int row = 0; row < 4; ++row)
        for (int column = 0; column < 4; ++column)
          matrix->SetElement(row, column, pose(row, column));
      live->SetProbeToWorld(matrix);
      live->Update();
    };
    const double seconds = benchmark::MedianSeconds(moving, 21), cpu = CpuSeconds(moving, benchmark::Trials(21));
    benchmark::ReportTime("live_image", "convex, 5 planes, one Update() of the filter", "echorama", seconds,
                          {{"cpu_seconds", cpu}, {"frames_per_second", 1.0 / seconds}, {"threads", threads}});
    // A needle in a guide, 40 degrees to the face, that moves with the probe.
    live->NeedleOn();
    const auto withNeedle = [&] {
      const Pose pose = PoseAt(step + 1);
      const Eigen::Vector3d tip = pose * Eigen::Vector3d(10, 0, 60), way = pose.linear() * Eigen::Vector3d(0.766, 0, 0.643);
      live->SetNeedleTip(tip[0], tip[1], tip[2]);
      live->SetNeedleDirection(way[0], way[1], way[2]);
      moving();
    };
    const double needleSeconds = benchmark::MedianSeconds(withNeedle, 21),
                 needleCpu = CpuSeconds(withNeedle, benchmark::Trials(21));
    benchmark::ReportTime("live_image", "convex, 5 planes, one Update() of the filter, with a needle", "echorama", needleSeconds,
                          {{"cpu_seconds", needleCpu}, {"frames_per_second", 1.0 / needleSeconds}, {"threads", threads}});
  }
#endif
  LiveImageParameters dense = usual;
  dense.beams = 384;
  measure("convex, 5 planes, 384 beams", dense, volumes);
  for (const int planes : {1, 9, 17}) {
    LiveImageParameters other;
    other.thickness.planes = planes;
    if (planes == 1)
      other.thickness.thicknessMm = 0.0;
    measure("convex, " + std::to_string(planes) + (planes == 1 ? " plane" : " planes"), other, volumes);
  }
  LiveImageParameters all = usual;
  all.controls.noiseDb = -50.0;
  all.controls.shadowDbPerCm = 10.0;
  all.controls.enhancementDbPerCm = 1.0;
  LiveImage live;
  live.Set(all);
  Images images(live);
  const double seconds = benchmark::MedianSeconds(
      [&] {
        live.MakeBeams(volumes, PoseAt(++step));
        live.MakePixels(images.intensity.View(), images.valid.View(), {});
      },
      21);
  benchmark::ReportTime("live_image", "convex, 5 planes, with noise, shadow and enhancement", "echorama", seconds,
                        {{"frames_per_second", 1.0 / seconds}, {"threads", threads}});

  BeamBend bend(GeometryOf(usual.probe, usual.beams), 97, 33, 10.0);
  for (std::size_t node = 0; node < bend.Count(); ++node)
    bend.SetMove(node, Eigen::Vector3d(0, 0, RestOf(bend.NodePoint(node).z()) - bend.NodePoint(node).z()));
  measure("convex, 5 planes, pressed tissue", usual, volumes, &bend);

  // The first 240 slices and the last 240.
  BeamVolumes two;
  for (const int first : {0, dimensions[2] - 240}) {
    ImageGeometry grid = BodyGrid();
    grid.dimensions[2] = 240;
    grid.origin.z() += first * grid.spacing.z();
    two.Add<unsigned char>({{body.View().Row(0, first), grid.dimensions}, {}, grid});
  }
  LiveImageParameters overlap = usual;
  measure("convex, 5 planes, two volumes, the first counts", overlap, two);
  overlap.mix.overlap = VolumeMix::Overlap::Mean;
  const double prepareCpu = CpuSeconds([&] { two.PrepareMean(); }, 1);
  benchmark::ReportTime("live_image", "set-up of the mean of two volumes", "echorama",
                        benchmark::Seconds([&] { two.PrepareMean(); }), {{"cpu_seconds", prepareCpu}, {"threads", threads}});
  measure("convex, 5 planes, two volumes, mean", overlap, two);

  // A valid region that is all real, and labels: what bricks cost.
  const Volume<unsigned char> ones(dimensions, 1);
  const double setUp = benchmark::Seconds([&] {
    volumes = BeamVolumes();
    volumes.Add<unsigned char>({body.View(), ones.View(), BodyGrid()}, ones.View());
  });
  benchmark::ReportTime("live_image", "set-up of a volume with valid region and labels", "echorama", setUp,
                        {{"threads", threads}});
  measure("convex, 5 planes, valid region and labels", usual, volumes);
  return 0;
}
