// SPDX-License-Identifier: BSD-3-Clause
// What a person at the workbench waits for: a slice of three blended volumes of 256^3 at 800 x 800 pixels, whole and at each
// level of detail (error: grey levels from every pixel read by definition, where all three volumes are), a dab of the brush on
// 300^3 (error: voxels that differ from painting by definition), the live score of three volumes, and opening five of them. With
// a screen also the slice view with its rendering. Peers: vtkImageReslice and vtkImageBlend; painting that looks at every voxel.
// Arguments: parts to run, of slices, painting, score, opening, view (default: all).
#include "Core/Base/Parallel.h"
#include "Core/Base/Random.h"
#include "Core/Imaging/Sampling.h"
#include "Core/Imaging/ValidPoints.h"
#include "Testing/Benchmark.h"
#include "Widgets/Painting/VoxelEdits.h"
#include "Widgets/Pictures/SlicePicture.h"
#include "Widgets/Session/LiveScore.h"
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <set>
#ifdef ECHORAMA_WITH_VTK
#include <vtkImageBlend.h>
#include <vtkImageData.h>
#include <vtkImageReslice.h>
#include <vtkMatrix4x4.h>
#include <vtkMatrixToLinearTransform.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkRenderer.h>
#include <vtkRenderWindow.h>
#include <vtkSmartPointer.h>
#include <vtkUltrasoundAlignmentSession.h>
#include <vtkUltrasoundSliceView.h>
#include <vtkUltrasoundVolume.h>
#include <vtkUnsignedCharArray.h>
#endif

using namespace echorama;
using Byte = unsigned char;

namespace {

constexpr int Side = 256, Pixels = 800;
constexpr const char* Bench = "workbench";

struct Seen {
  Volume<Byte> intensity, valid;
  ImageGeometry geometry;
  PosedVolume<Byte> Posed() const { return {intensity.View(), valid.View(), geometry}; }
};

// A fan of speckle under slow changes of brightness, 0.5 mm voxels, turned and moved a little from one volume to the next.
Seen Fan(int number)
{
  const std::array<int, 3> dimensions{Side, Side, Side};
  Seen seen{Volume<Byte>(dimensions), Volume<Byte>(dimensions), {}};
  ParallelFor(Side, [&](std::ptrdiff_t k) {
    Random random(17, static_cast<std::uint64_t>(number * Side + k));
    for (int j = 0; j < Side; ++j)
      for (int i = 0; i < Side; ++i) {
        const double x = i - 0.5 * Side, depth = j + 40.0, z = static_cast<double>(k) - 0.5 * Side;
        const double tissue = 90.0 + 40.0 * std::sin(0.05 * x) * std::cos(0.04 * depth) + 20.0 * std::sin(0.11 * z);
        const double speckle = std::sqrt(-2.0 * std::log1p(-random.Uniform())) / 1.25;
        const bool inside = std::fabs(x) < 0.6 * depth && std::hypot(x, depth) < Side + 30.0;
        seen.valid.View()(i, j, static_cast<int>(k)) = inside;
        seen.intensity.View()(i, j, static_cast<int>(k)) =
            inside ? static_cast<Byte>(std::min(255.0, tissue * (0.5 + 0.5 * speckle))) : Byte(0);
      }
  });
  seen.geometry.dimensions = dimensions;
  seen.geometry.spacing.setConstant(0.5);
  seen.geometry.direction = ExpRotation(Eigen::Vector3d(0.1 * number, 0.15, 0.05 * number));
  seen.geometry.origin.setZero();
  seen.geometry.origin = Eigen::Vector3d(6.0 * number, 0.0, 2.0 * number) - seen.geometry.Centre();
  return seen;
}

SlicePlane Plane()
{
  SlicePlane plane;
  const Eigen::Matrix3d axes = ExpRotation(Eigen::Vector3d(0.3, 0.2, 0.1));
  plane.right = 0.16 * axes.col(0);
  plane.up = 0.16 * axes.col(1);
  plane.width = plane.height = Pixels;
  plane.origin = -0.5 * (Pixels - 1) * (plane.right + plane.up);
  return plane;
}

std::vector<SliceLayer> Layers(const std::vector<Seen>& volumes)
{
  std::vector<SliceLayer> layers;
  for (const Seen& volume : volumes) {
    SliceLayer layer;
    layer.volume = volume.Posed();
    layers.push_back(layer);
  }
  return layers;
}

// Every pixel read by definition: the mean grey level where all volumes are real, -1 elsewhere.
std::vector<double> Exact(const std::vector<Seen>& volumes, const SlicePlane& plane)
{
  std::vector<double> exact(static_cast<std::size_t>(plane.width) * static_cast<std::size_t>(plane.height), 0.0);
  for (const Seen& volume : volumes) {
    const Sampler<Byte> sampler(volume.intensity.View(), volume.valid.View());
    const Eigen::Affine3d toIndex = volume.geometry.WorldToIndex();
    ParallelFor(plane.height, [&](std::ptrdiff_t j) {
      for (int i = 0; i < plane.width; ++i) {
        const Eigen::Vector3d at = toIndex * (plane.origin + i * plane.right + static_cast<double>(j) * plane.up);
        double value = 0.0;
        double& pixel = exact[static_cast<std::size_t>(j * plane.width + i)];
        if (sampler.Linear(at[0], at[1], at[2], value) && pixel >= 0.0)
          pixel += value / static_cast<double>(volumes.size());
        else
          pixel = -1.0;
      }
    });
  }
  return exact;
}

// Median processor seconds, of all threads, of one call: what a machine that is shared does not change much.
template <class Function>
double ProcessorSeconds(const Function& function, int runs)
{
  std::vector<double> seconds;
  for (int run = 0; run < runs; ++run) {
    const std::clock_t start = std::clock();
    function();
    seconds.push_back(static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC);
  }
  std::nth_element(seconds.begin(), seconds.begin() + runs / 2, seconds.end());
  return seconds[static_cast<std::size_t>(runs / 2)];
}

struct PictureError {
  double rms = 0.0, p99 = 0.0;
};

// Of the bytes value[stride p].
PictureError ErrorOf(const std::uint8_t* value, std::size_t stride, const std::vector<double>& exact)
{
  std::vector<double> errors;
  double squares = 0.0;
  for (std::size_t p = 0; p < exact.size(); ++p)
    if (exact[p] >= 0.0) {
      errors.push_back(std::fabs(value[stride * p] - exact[p]));
      squares += errors.back() * errors.back();
    }
  std::nth_element(errors.begin(), errors.begin() + static_cast<std::ptrdiff_t>(errors.size() * 99 / 100), errors.end());
  return {std::sqrt(squares / static_cast<double>(errors.size())), errors[errors.size() * 99 / 100]};
}

#ifdef ECHORAMA_WITH_VTK
vtkSmartPointer<vtkImageData> ImageOf(const Seen& seen, bool placed)
{
  auto image = vtkSmartPointer<vtkImageData>::New();
  if (placed)
    vtkUltrasoundVolume::SetGeometry(image, seen.geometry);
  else { // in its own axes, from zero: the reslicer is told the rest
    image->SetDimensions(seen.geometry.dimensions.data());
    image->SetSpacing(seen.geometry.spacing.data());
  }
  for (const auto& [voxels, name] : {std::pair(&seen.intensity, vtkUltrasoundVolume::IntensityName()),
                                     std::pair(&seen.valid, vtkUltrasoundVolume::ValidRegionName())}) {
    vtkNew<vtkUnsignedCharArray> array;
    array->SetName(name);
    array->SetArray(const_cast<Byte*>(voxels->View().Data()), voxels->View().Size(), 1);
    image->GetPointData()->AddArray(array);
  }
  image->GetPointData()->SetActiveScalars(vtkUltrasoundVolume::IntensityName());
  return image;
}

// Three reslicers on the plane, and their mean.
struct VtkSlices {
  std::vector<vtkSmartPointer<vtkImageReslice>> reslicers;
  vtkNew<vtkImageBlend> blend;

  VtkSlices(const std::vector<Seen>& volumes, const SlicePlane& plane)
  {
    for (std::size_t v = 0; v < volumes.size(); ++v) {
      const ImageGeometry& geometry = volumes[v].geometry;
      Eigen::Affine3d map = geometry.spacing.asDiagonal() * geometry.WorldToIndex();
      Eigen::Affine3d pixels = Eigen::Affine3d::Identity();
      pixels.linear() << plane.right, plane.up, plane.right.cross(plane.up).normalized();
      pixels.translation() = plane.origin;
      const Eigen::Matrix<double, 4, 4, Eigen::RowMajor> rows = (map * pixels).matrix();
      vtkNew<vtkMatrix4x4> matrix;
      matrix->DeepCopy(rows.data());
      vtkNew<vtkMatrixToLinearTransform> transform;
      transform->SetInput(matrix);
      auto reslicer = vtkSmartPointer<vtkImageReslice>::New();
      reslicer->SetInputData(ImageOf(volumes[v], false));
      reslicer->SetResliceTransform(transform);
      reslicer->SetOutputOrigin(0.0, 0.0, 0.0);
      reslicer->SetOutputSpacing(1.0, 1.0, 1.0);
      reslicer->SetOutputExtent(0, plane.width - 1, 0, plane.height - 1, 0, 0);
      reslicer->SetInterpolationModeToLinear();
      blend->AddInputConnection(reslicer->GetOutputPort());
      blend->SetOpacity(static_cast<int>(v), 1.0 / static_cast<double>(v + 1));
      reslicers.push_back(reslicer);
    }
  }
  const std::uint8_t* Draw()
  {
    for (const auto& reslicer : reslicers)
      reslicer->Modified();
    blend->Update();
    return static_cast<const std::uint8_t*>(blend->GetOutput()->GetScalarPointer());
  }
};
#endif

void MeasureSlices(const std::vector<Seen>& volumes)
{
  const SlicePlane plane = Plane();
  const std::vector<SliceLayer> layers = Layers(volumes);
  const std::vector<double> exact = Exact(volumes, plane);
  std::vector<std::uint8_t> rgba(4 * exact.size());
  const std::string name = "slice of three 256^3, 800 x 800";
  const auto measure = [&](const std::string& method, const SliceParameters& parameters) {
    const auto draw = [&] { DrawSlice(layers, plane, parameters, rgba.data()); };
    const double seconds = benchmark::MedianSeconds(draw, 9), processor = ProcessorSeconds(draw, 9);
    const PictureError error = ErrorOf(rgba.data(), 4, exact);
    benchmark::Report(Bench, name, method, seconds, error.rms, "grey levels rms",
                      {{"p99", error.p99}, {"processor_seconds", processor}});
  };
  for (const int step : {1, 2, 3, 4}) {
    SliceParameters parameters;
    parameters.step = step;
    measure(step == 1 ? "echorama" : "echorama, every " + std::to_string(step) + " pixels", parameters);
  }
  SliceParameters nearest;
  nearest.linear = false;
  measure("echorama, nearest voxels", nearest);
#ifdef ECHORAMA_WITH_VTK
  VtkSlices peer(volumes, plane);
  const SliceParameters full;
  const auto [ours, theirs] = benchmark::Duel([&] { DrawSlice(layers, plane, full, rgba.data()); }, [&] { peer.Draw(); }, 9);
  const std::uint8_t* drawn = peer.Draw();
  const PictureError error =
      ErrorOf(drawn, static_cast<std::size_t>(peer.blend->GetOutput()->GetNumberOfScalarComponents()), exact);
  benchmark::Report(Bench, name, "vtkImageReslice and vtkImageBlend", theirs, error.rms, "grey levels rms",
                    {{"p99", error.p99}, {"processor_seconds", ProcessorSeconds([&] { peer.Draw(); }, 9)}});
  benchmark::ReportTime(Bench, name, "echorama beside vtk", ours, {{"times_faster", theirs / ours}});
#endif
}

// Every voxel of the volume looked at for one dab.
void DabByDefinition(VolumeView<Byte> intensity, VolumeView<const Byte> valid, const ImageGeometry& geometry, const Brush& brush,
                     const Eigen::Vector3d& at)
{
  const Eigen::Affine3d toWorld = geometry.IndexToWorld();
  ParallelFor(intensity.Slices(), [&](std::ptrdiff_t k) {
    std::ptrdiff_t v = k * intensity.SliceStride();
    for (int j = 0; j < geometry.dimensions[1]; ++j)
      for (int i = 0; i < geometry.dimensions[0]; ++i, ++v) {
        const double d = (toWorld * Eigen::Vector3d(i, j, static_cast<double>(k)) - at).norm();
        if (d > brush.radiusMm || !valid[v])
          continue;
        const double s = std::max(0.0, (d / brush.radiusMm - brush.hardness) / (1.0 - brush.hardness));
        const double weight = brush.opacity * (1.0 - s * s * (3.0 - 2.0 * s));
        intensity[v] = static_cast<Byte>(std::lround(intensity[v] + weight * (brush.intensity - intensity[v])));
      }
  });
}

void MeasurePainting()
{
  constexpr int n = 300, dabs = 60;
  ImageGeometry geometry;
  geometry.dimensions = {n, n, n};
  geometry.spacing = Eigen::Vector3d(0.4, 0.4, 0.6);
  geometry.direction = ExpRotation(Eigen::Vector3d(0.2, 0.3, -0.1));
  Volume<Byte> ours(geometry.dimensions, 50), peer(geometry.dimensions, 50), valid(geometry.dimensions, 1);
  const Eigen::Vector3d middle = geometry.Centre();
  for (const double radius : {3.0, 8.0, 20.0}) {
    Brush brush;
    brush.radiusMm = radius;
    brush.intensity = 200.0;
    brush.opacity = 0.8;
    VoxelEdits<Byte> edits(ours.View(), valid.View(), geometry);
    const std::string name = "brush of " + std::to_string(static_cast<int>(radius)) + " mm on 300^3 (0.4 x 0.4 x 0.6 mm)";

    // One dab, ours and by definition in turn; each on what it was before.
    const StrokeChain dab = Append(nullptr, {brush, {middle}});
    std::vector<double> dabSeconds, peerSeconds;
    for (int run = 0; run < 5; ++run) {
      edits.GoTo(nullptr);
      dabSeconds.push_back(benchmark::Seconds([&] { edits.GoTo(dab); }));
      std::fill(peer.View().begin(), peer.View().end(), Byte(50));
      peerSeconds.push_back(benchmark::Seconds([&] { DabByDefinition(peer.View(), valid.View(), geometry, brush, middle); }));
    }
    std::ptrdiff_t different = 0, painted = 0;
    for (std::ptrdiff_t v = 0; v < ours.View().Size(); ++v) {
      different += ours.View()[v] != peer.View()[v];
      painted += ours.View()[v] != 50;
    }
    std::sort(dabSeconds.begin(), dabSeconds.end());
    std::sort(peerSeconds.begin(), peerSeconds.end());
    benchmark::Report(Bench, name, "echorama, a dab", dabSeconds[2], static_cast<double>(different), "voxels",
                      {{"voxels", painted}});
    benchmark::ReportTime(Bench, name, "every voxel, a dab", peerSeconds[2], {{"times_slower", peerSeconds[2] / dabSeconds[2]}});

    // A stroke of a second's mouse events, undone and done again.
    edits.GoTo(nullptr);
    Stroke stroke{brush, {}};
    std::vector<double> seconds;
    edits.Begin(brush);
    for (int step = 0; step < dabs; ++step) {
      const double t = 6.283 * step / dabs;
      stroke.pathMm.push_back(middle + Eigen::Vector3d(30.0 * std::cos(t), 30.0 * std::sin(2.0 * t), 5.0 * std::sin(t)));
      seconds.push_back(benchmark::Seconds([&] { edits.Extend(stroke.pathMm.back()); }));
    }
    const StrokeChain chain = Append(nullptr, stroke);
    edits.End(chain);
    const std::size_t bytes = edits.MemoryBytes();
    const double undo = benchmark::Seconds([&] { edits.GoTo(nullptr); });
    const double redo = benchmark::Seconds([&] { edits.GoTo(chain); });
    edits.GoTo(nullptr);
    std::ptrdiff_t left = 0;
    for (const Byte voxel : ours.View())
      left += voxel != 50;
    std::sort(seconds.begin(), seconds.end());
    benchmark::Report(Bench, name, "echorama, each of 60 points of a stroke", seconds[dabs / 2], static_cast<double>(left),
                      "voxels after undo",
                      {{"slowest_seconds", seconds.back()},
                       {"undo_seconds", undo},
                       {"redo_seconds", redo},
                       {"undo_mb", static_cast<double>(bytes) / 1e6}});
  }
}

void MeasureScore(const std::vector<Seen>& volumes)
{
  constexpr int points = 2000, manyPoints = 400000;
  LiveScore score, fine;
  std::map<int, ImageGeometry> aligned;
  for (std::size_t v = 0; v < volumes.size(); ++v) {
    const Seen& volume = volumes[v];
    const int id = static_cast<int>(v) + 1;
    for (const auto& [which, count] : {std::pair(&score, points), std::pair(&fine, manyPoints)})
      which->Set(id, std::to_string(id), volume.geometry,
                 ValidPoints<Byte>(volume.intensity.View(), volume.valid.View(), count, 1));
    aligned[id] = volume.geometry.Moved(
        MotionAbout(volume.geometry.Centre(), Eigen::Vector3d(0.01, 0.02 * id, 0.0), Eigen::Vector3d(1.0 * id, 0.0, 0.0)));
  }
  double value = 0.0;
  const double seconds = benchmark::MedianSeconds([&] { value = score.Update(aligned, 1).mean; }, 101);
  benchmark::Report(Bench, "live score of three 256^3", "echorama", seconds, std::fabs(value - fine.Update(aligned, 1).mean),
                    "mm from the score of 400000 points a volume", {{"points", points}, {"score_mm", value}});
}

#ifdef ECHORAMA_WITH_VTK
void MeasureOpening(const std::vector<Seen>& volumes)
{
  const std::filesystem::path folder = std::filesystem::temp_directory_path() / "echorama_benchmark_workbench";
  std::filesystem::create_directories(folder);
  std::vector<std::string> files;
  for (int v = 0; v < 5; ++v) {
    files.push_back((folder / ("volume" + std::to_string(v) + ".mha")).string());
    std::ofstream file(files.back(), std::ios::binary);
    file << "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\nCompressedData = False\n"
            "DimSize = 256 256 256\nElementSpacing = 0.5 0.5 0.5\nElementType = MET_UCHAR\nElementDataFile = LOCAL\n";
    const auto view = volumes[static_cast<std::size_t>(v) % volumes.size()].intensity.View();
    file.write(reinterpret_cast<const char*>(view.Data()), view.Size());
  }
  int opened = 0;
  std::vector<char> bytes(static_cast<std::size_t>(Side) * Side * Side);
  const auto [seconds, plain] = benchmark::Duel(
      [&] {
        vtkNew<vtkUltrasoundAlignmentSession> session;
        for (const std::string& file : files)
          session->OpenVolume(file.c_str());
        opened = session->GetNumberOfVolumes();
      },
      [&] {
        for (const std::string& file : files)
          std::ifstream(file, std::ios::binary).read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
      },
      3);
  benchmark::Report(Bench, "opening five 256^3", "echorama", seconds, 5.0 - opened, "volumes missing");
  benchmark::ReportTime(Bench, "opening five 256^3", "reading the bytes", plain);
  std::filesystem::remove_all(folder);
}

void MeasureView(const std::vector<Seen>& volumes)
{
  if (!std::getenv("DISPLAY")) {
    std::cerr << "no screen: the slice view is left out\n";
    return;
  }
  vtkNew<vtkUltrasoundAlignmentSession> session;
  for (const Seen& volume : volumes)
    session->AddVolume(ImageOf(volume, true), nullptr);
  vtkNew<vtkUltrasoundSliceView> view;
  view->SetSession(session);
  view->SetPixelSize(Pixels, Pixels);
  view->SetNormalAndUp(0.3, 0.2, 1.0, 0.0, 1.0, 0.0);
  view->SetFocus(0.0, 0.0, 0.0);
  view->SetMillimetresPerPixel(0.16);
  vtkNew<vtkRenderWindow> window;
  window->SetMultiSamples(0);
  window->SetSize(Pixels, Pixels);
  window->AddRenderer(view->GetRenderer());
  session->SelectAll();
  double mm = 0.0;
  for (const int step : {1, 2, 4}) {
    view->SetInteractive(step > 1);
    view->SetInteractiveStep(step);
    std::vector<double> pictures;
    const auto redraw = [&] {
      mm = mm > 0.0 ? -0.1 : 0.1;
      session->TranslateSelection(mm, 0.0, 0.0);
      view->Update();
      pictures.push_back(view->GetPictureSeconds());
      window->Render();
    };
    const double seconds = benchmark::MedianSeconds(redraw, 15), processor = ProcessorSeconds(redraw, 15);
    std::sort(pictures.begin(), pictures.end());
    benchmark::ReportTime(Bench, "slice view of three 256^3, 800 x 800, to the screen",
                          "every " + std::to_string(step) + " pixels", seconds,
                          {{"picture_seconds", pictures[pictures.size() / 2]}, {"processor_seconds", processor}});
  }
}
#endif

} // namespace

int main(int argc, char** argv)
{
  const std::set<std::string> wanted(argv + 1, argv + argc);
  const auto wants = [&](const char* part) { return wanted.empty() || wanted.count(part) != 0; };
  std::vector<Seen> volumes;
  if (wants("slices") || wants("score") || wants("opening") || wants("view"))
    for (int v = 0; v < 3; ++v)
      volumes.push_back(Fan(v));
  if (wants("slices"))
    MeasureSlices(volumes);
  if (wants("painting"))
    MeasurePainting();
  if (wants("score"))
    MeasureScore(volumes);
#ifdef ECHORAMA_WITH_VTK
  if (wants("opening"))
    MeasureOpening(volumes);
  if (wants("view"))
    MeasureView(volumes);
#endif
  return 0;
}
