// SPDX-License-Identifier: BSD-3-Clause
// The 3D view with three volumes of 256^3: what an update of the score costs, what particles cost, and frames at rest and while
// dragging with the error of the level of detail against the full picture (RMS, grey levels). Frames need a screen (xvfb-run).
#include "Core/Base/Random.h"
#include "Core/Imaging/ValidPoints.h"
#include "Testing/Benchmark.h"
#include "Widgets/Pictures/Particles.h"
#include "Widgets/Session/LiveScore.h"
#include <array>
#include <cmath>
#include <cstdlib>
#include <ctime>

#ifdef ECHORAMA_WITH_VTK
#include "vtkImageData.h"
#include "vtkMatrix4x4.h"
#include "vtkNew.h"
#include "vtkPointData.h"
#include "vtkRenderer.h"
#include "vtkRenderWindow.h"
#include "vtkUnsignedCharArray.h"
#include "Widgets/vtkUltrasoundAlignmentSession.h"
#include "Widgets/vtkUltrasoundVolumeView.h"
#endif

using namespace echorama;

namespace {

constexpr int Size = 256;

// A fan of speckle with dark vessels, as a mechanical probe sweeps it.
struct Scene {
  Volume<unsigned char> intensity{{Size, Size, Size}, 0}, valid{{Size, Size, Size}, 0};
  ImageGeometry geometry;

  explicit Scene(std::uint64_t seed)
  {
    geometry.dimensions = {Size, Size, Size};
    geometry.spacing.setConstant(0.5);
    Random random(seed);
    for (int k = 0; k < Size; ++k)
      for (int j = 0; j < Size; ++j)
        for (int i = 0; i < Size; ++i) {
          const double x = i - 127.5, y = j + 40.0, z = k - 127.5; // the probe is above the first rows
          const double depth = std::sqrt(x * x + y * y + z * z);
          const bool inside = depth > 60.0 && depth < 290.0 && std::abs(x) < 0.7 * y && std::abs(z) < 0.6 * y;
          valid.View()(i, j, k) = inside;
          const double vessel = std::sin(0.05 * x + 0.02 * z) * std::sin(0.06 * y) * std::sin(0.05 * z);
          const double mean = vessel > 0.45 ? 8.0 : 70.0 + 40.0 * vessel;
          const double speckle = std::sqrt(-2.0 * std::log(1.0 - random.Uniform())) / 1.2533;
          if (inside)
            intensity.View()(i, j, k) = static_cast<unsigned char>(std::min(255.0, mean * speckle));
        }
  }
  PosedVolume<unsigned char> Posed() const { return {intensity.View(), valid.View(), geometry}; }
};

Pose Placed(int number)
{
  return MotionAbout({64.0, 64.0, 64.0}, {0.0, 0.1 * number, 0.25 * number}, {30.0 * number, 4.0 * number, 6.0});
}

void BenchScore(const std::vector<Scene>& scenes)
{
  LiveScore live;
  std::map<int, ImageGeometry> aligned;
  for (int v = 0; v < 3; ++v) {
    const Scene& scene = scenes[static_cast<std::size_t>(v)];
    live.Set(v + 1, "volume", scene.geometry.Moved(Placed(v)),
             ValidPoints<unsigned char>(scene.intensity.View(), scene.valid.View(), 2000, 1));
    aligned[v + 1] = scene.geometry.Moved(Placed(v));
  }
  Pose slip = Pose::Identity();
  slip.translation() = Eigen::Vector3d(2.0, -1.0, 2.0);
  aligned[2] = aligned[2].Moved(slip);
  LiveScoreResult score;
  const double seconds = benchmark::MedianSeconds([&] { score = live.Update(aligned, 1); }, 101);
  benchmark::Report("volume_view", "score update, three volumes", "LiveScore", seconds, std::abs(score.mean - 1.5), "mm");
}

void BenchParticles(const std::vector<Scene>& scenes)
{
  for (const int downsampling : {1, 2, 4}) {
    ParticleParameters parameters;
    parameters.downsampling = downsampling;
    parameters.budget = 100000000;
    Particles particles;
    const double seconds = benchmark::MedianSeconds([&] { particles = MakeParticles(scenes[0].Posed(), parameters); });
    const double sort = benchmark::MedianSeconds([&] { BackToFront({{&particles.positions, {0.5, 0.7, 0.1}, 0.0}}); });
    benchmark::ReportTime("volume_view", "particles of one volume, downsampling " + std::to_string(downsampling), "MakeParticles",
                          seconds, {{"particles", particles.Count()}, {"sort_seconds", sort}});
  }
}

#ifdef ECHORAMA_WITH_VTK
std::vector<unsigned char> PictureOf(vtkRenderWindow* window)
{
  window->Render();
  vtkNew<vtkUnsignedCharArray> pixels;
  const int* size = window->GetSize();
  window->GetPixelData(0, 0, size[0] - 1, size[1] - 1, 0, pixels);
  return {pixels->GetPointer(0), pixels->GetPointer(0) + pixels->GetNumberOfValues()};
}

double Rms(const std::vector<unsigned char>& a, const std::vector<unsigned char>& b)
{
  double sum = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i)
    sum += (a[i] - b[i]) * (a[i] - b[i]);
  return std::sqrt(sum / static_cast<double>(a.size()));
}

void BenchFrames(const std::vector<Scene>& scenes)
{
  vtkNew<vtkUltrasoundAlignmentSession> session;
  std::vector<int> ids;
  for (int v = 0; v < 3; ++v) {
    vtkNew<vtkImageData> image;
    image->SetDimensions(Size, Size, Size);
    image->SetSpacing(0.5, 0.5, 0.5);
    const Scene& scene = scenes[static_cast<std::size_t>(v)];
    for (const auto& [name, values] : {std::pair{"Intensity", &scene.intensity}, {"ValidRegion", &scene.valid}}) {
      vtkNew<vtkUnsignedCharArray> array;
      array->SetName(name);
      array->SetNumberOfValues(values->View().Size());
      std::copy(values->View().begin(), values->View().end(), array->GetPointer(0));
      image->GetPointData()->AddArray(array);
    }
    ids.push_back(session->AddVolume(image, nullptr, "volume"));
  }
  const auto place = [&](int v, double along) {
    Pose pose = Placed(v);
    pose.translation().x() += along;
    const Eigen::Matrix<double, 4, 4, Eigen::RowMajor> rows = pose.matrix();
    vtkNew<vtkMatrix4x4> matrix;
    matrix->DeepCopy(rows.data());
    session->SetVolumeToWorld(ids[static_cast<std::size_t>(v)], matrix);
  };
  for (int v = 0; v < 3; ++v)
    place(v, 0.0);
  session->SetGreyWindow(0.0, 200.0);

  vtkNew<vtkUltrasoundVolumeView> view;
  view->SetSession(session);
  vtkNew<vtkRenderWindow> window;
  window->SetMultiSamples(0);
  window->SetOffScreenRendering(1);
  window->SetSize(800, 600);
  window->AddRenderer(view->GetRenderer());
  std::vector<unsigned char> first;
  for (const auto& [name, style, who] : {std::array{"points", "points", "automatic"},
                                         {"points by OpenGL", "points", "graphics"},
                                         {"volume", "volume", "automatic"},
                                         {"volume by OpenGL", "volume", "graphics"},
                                         {"outline", "outline", "automatic"}}) {
    view->SetStyle(style);
    view->SetDrawnBy(who);
    window->Render();
    std::vector<double> full, drag, processor; // the last: of all cores, which other programs do not lengthen
    const auto processorSeconds = [] { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; };
    for (int frame = 0; frame < 5; ++frame) {
      place(1, 0.2 * frame);
      const double before = processorSeconds();
      full.push_back(benchmark::Seconds([&] { window->Render(); }));
      processor.push_back(processorSeconds() - before);
    }
    place(1, 0.0);
    const auto picture = PictureOf(window);
    const int particles = view->GetNumberOfParticles();
    const auto report = [&](const std::string& how, std::vector<double> seconds, nlohmann::ordered_json more) {
      std::sort(seconds.begin(), seconds.end());
      std::sort(processor.begin(), processor.end());
      more.update({{"percentile95_seconds", seconds[seconds.size() * 95 / 100]},
                   {"slowest_seconds", seconds.back()},
                   {"processor_seconds", processor[processor.size() / 2]},
                   {"level", view->GetDetailLevel()}});
      benchmark::ReportTime("volume_view", name, how, seconds[seconds.size() / 2], more);
    };
    if (first.empty())
      first = picture;
    report("full", full,
           {{"particles", particles},
            {"error", std::string(style) == "points" ? Rms(picture, first) : 0.0},
            {"error_unit", "grey levels RMS"}});
    processor.clear();
    view->SetInteractive(true);
    for (int frame = 0; frame < 60; ++frame) {
      place(1, 0.2 * frame);
      const double before = processorSeconds();
      drag.push_back(benchmark::Seconds([&] { window->Render(); }));
      processor.push_back(processorSeconds() - before);
    }
    place(1, 0.0);
    const auto coarse = PictureOf(window);
    report("dragging", drag,
           {{"particles", view->GetNumberOfParticles()}, {"error", Rms(coarse, picture)}, {"error_unit", "grey levels RMS"}});
    view->SetInteractive(false);
  }
}
#endif

} // namespace

int main()
{
  const std::vector<Scene> scenes{Scene(1), Scene(2), Scene(3)};
  BenchScore(scenes);
  BenchParticles(scenes);
#ifdef ECHORAMA_WITH_VTK
  if (std::getenv("DISPLAY"))
    BenchFrames(scenes);
  else
    std::cerr << "no screen: frames are left out\n";
#endif
}
