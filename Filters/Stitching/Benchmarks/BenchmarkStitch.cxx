// SPDX-License-Identifier: BSD-3-Clause
// Stitching, all methods in one table: time, also over that of a plain average in turn, processor time, the largest memory per
// voxel of the output, and what became of the image (MeasureStitch): seams, texture, and the error against the truth inside and
// outside overlaps. The truth of a synthetic case is the anatomy without speckle, so that its error favours averages; that of the
// liver is its full reconstruction, which is itself an average. The peer does the plain average with filters of VTK: each volume
// and its mask, as the two components of one image, are resliced onto the part of the grid that the volume covers, and summed up
// over that part by vtkSMPTools. Ours and the peer are timed in turn, equally often.
//
// Arguments: [word of a case's name]... [--methods word...] [--runs N]; without words all cases, all methods, three runs.
#include "Core/Base/Parallel.h"
#include "Core/Base/Random.h"
#include "Core/Imaging/Sampling.h"
#include "Filters/Stitching/Benchmarks/StitchContestants.h"
#include "Filters/Stitching/StitchGrid.h"
#include "Filters/Stitching/StitchQuality.h"
#include "Testing/Benchmark.h"
#include <cmath>
#include <cstring>
#include <filesystem>
#include <functional>
#include <sys/resource.h>
#include <tbb/info.h>

#ifdef ECHORAMA_WITH_VTK
#include <vtkImageData.h>
#include <vtkImageReslice.h>
#include <vtkMatrix4x4.h>
#include <vtkMatrixToLinearTransform.h>
#include <vtkMetaImageReader.h>
#include <vtkMultiThreader.h>
#include <vtkNew.h>
#include <vtkSmartPointer.h>
#include <vtkSMPTools.h>
#endif

using namespace echorama;

namespace {

using Byte = unsigned char;

struct Case {
  std::string name;
  std::vector<Volume<Byte>> values, masks;
  std::vector<ImageGeometry> geometries;
  ImageGeometry grid;
  Volume<float> truth; ///< NaN where it is not known

  std::vector<StitchInput> Inputs() const
  {
    std::vector<StitchInput> inputs;
    for (std::size_t v = 0; v < values.size(); ++v)
      inputs.push_back({PosedVolume<Byte>{values[v].View(), masks[v].View(), geometries[v]}, "volume " + std::to_string(v + 1)});
    return inputs;
  }
};

struct Result {
  Volume<Byte> intensity, valid, coverage;
};

// Echo level of the anatomy, dB: slow changes, and bright and dark balls with sharp edges.
double Level(const Eigen::Vector3d& p)
{
  double level = 33.0 + 4.0 * std::sin(0.05 * p[0]) * std::sin(0.06 * p[1] + 0.5) + 3.0 * std::sin(0.04 * (p[0] + p[1] + p[2]));
  constexpr double cell = 26.0;
  const Eigen::Vector3d at = (p / cell).array().floor();
  Random random(11, static_cast<std::uint64_t>((std::lround(at[0]) + 500) * 1000000 + (std::lround(at[1]) + 500) * 1000 +
                                               std::lround(at[2]) + 500));
  const double radius = random.Uniform(3.0, 7.0), change = random.Uniform() < 0.5 ? -11.0 : 6.0;
  const Eigen::Vector3d centre =
      at * cell + Eigen::Vector3d(random.Uniform(8.0, 18.0), random.Uniform(8.0, 18.0), random.Uniform(8.0, 18.0));
  if ((p - centre).norm() < radius)
    level += change;
  return level;
}

constexpr double greyPerDb = 255.0 / 60.0;
constexpr double meanOfSpeckleDb = -2.5068; // of 20 log10 of a Rayleigh amplitude of mean square 1

// Fully developed speckle in dB: 20 log10 of the amplitude of complex Gaussian noise whose grain is 2 to 3 voxels wide.
Volume<float> SpeckleDb(const std::array<int, 3>& n, std::uint64_t seed)
{
  const auto noise = [&](std::uint64_t part) {
    Volume<float> field(n);
    ParallelFor(static_cast<std::ptrdiff_t>(n[1]) * n[2], [&](std::ptrdiff_t row) {
      Random random(100 + 2 * seed + part, static_cast<std::uint64_t>(row));
      float* values = field.View().Data() + row * n[0];
      for (int i = 0; i < n[0]; ++i)
        values[i] = static_cast<float>(random.Normal());
    });
    constexpr int radius = 3;
    const double sigmas[3] = {1.1, 1.1, 0.9};
    for (int axis = 0; axis < 3; ++axis) {
      float taps[2 * radius + 1];
      double squares = 0.0;
      for (int t = -radius; t <= radius; ++t) {
        const double tap = std::exp(-0.5 * t * t / (sigmas[axis] * sigmas[axis]));
        taps[t + radius] = static_cast<float>(tap);
        squares += tap * tap;
      }
      const std::ptrdiff_t stride = axis == 0 ? 1 : axis == 1 ? n[0] : static_cast<std::ptrdiff_t>(n[0]) * n[1];
      Volume<float> smooth(n);
      ParallelFor(static_cast<std::ptrdiff_t>(n[1]) * n[2], [&](std::ptrdiff_t row) {
        const int place[3] = {0, static_cast<int>(row % n[1]), static_cast<int>(row / n[1])};
        for (int t = -radius; t <= radius; ++t)
          for (int i = 0; i < n[0]; ++i) {
            // Noise goes on round the corner.
            const int at = axis == 0 ? i : place[axis], wrapped = (at + t + n[axis]) % n[axis];
            const std::ptrdiff_t here = row * n[0] + i;
            smooth.View()[here] += taps[t + radius] * field.View()[here + (wrapped - at) * stride];
          }
      });
      const float scale = static_cast<float>(1.0 / std::sqrt(squares));
      for (float& value : smooth.View())
        value *= scale;
      field = std::move(smooth);
    }
    return field;
  };
  Volume<float> speckle = noise(0);
  const Volume<float> imaginary = noise(1);
  ParallelFor(n[2], [&](std::ptrdiff_t k) {
    float* re = speckle.View().Row(0, static_cast<int>(k));
    const float* im = imaginary.View().Row(0, static_cast<int>(k));
    for (std::ptrdiff_t i = 0; i < speckle.View().SliceStride(); ++i)
      re[i] = 10.0f * std::log10(0.5f * (re[i] * re[i] + im[i] * im[i]) + 1e-6f);
  });
  return speckle;
}

// A row of views of the anatomy, each turned a little, with speckle of its own, and with brightness and contrast of its own.
// \param inside whether a voxel, counted from the middle of the volume, is real
Case Synthetic(const std::string& name, int count, int size, double step, double turn,
               const std::function<bool(double, double, double)>& inside)
{
  Case result;
  result.name = name;
  for (int v = 0; v < count; ++v) {
    Random random(7, static_cast<std::uint64_t>(v));
    ImageGeometry geometry;
    geometry.dimensions = {size, size, size};
    geometry.spacing.setConstant(0.5);
    const Eigen::Vector3d shift(step * size * 0.5 * v + 0.17 * v, 0.11 * v, -0.14 * v);
    geometry = geometry.Moved(MotionAbout(geometry.Centre(), turn * random.Direction(), shift));
    const double gain = v % 2 ? 1.05 : 0.96, offset = v % 2 ? 5.0 : -4.0;
    Volume<Byte> values(geometry.dimensions), mask(geometry.dimensions);
    const Volume<float> speckle = SpeckleDb(geometry.dimensions, static_cast<std::uint64_t>(v));
    const Eigen::Affine3d map = geometry.IndexToWorld();
    ParallelFor(size, [&](std::ptrdiff_t slice) {
      const int k = static_cast<int>(slice);
      for (int j = 0; j < size; ++j)
        for (int i = 0; i < size; ++i) {
          const double half = 0.5 * (size - 1);
          mask.View()(i, j, k) = inside(i - half, j - half, k - half);
          const double value = gain * greyPerDb * (Level(map * Eigen::Vector3d(i, j, k)) + speckle.View()(i, j, k)) + offset;
          values.View()(i, j, k) = static_cast<Byte>(std::lround(std::clamp(value, 0.0, 255.0)));
        }
    });
    result.values.push_back(std::move(values));
    result.masks.push_back(std::move(mask));
    result.geometries.push_back(geometry);
  }
  result.grid = StitchGrid(result.geometries);
  result.truth = Volume<float>(result.grid.dimensions);
  const Eigen::Affine3d map = result.grid.IndexToWorld();
  ParallelFor(result.grid.dimensions[2], [&](std::ptrdiff_t k) {
    for (int j = 0; j < result.grid.dimensions[1]; ++j)
      for (int i = 0; i < result.grid.dimensions[0]; ++i)
        result.truth.View()(i, j, static_cast<int>(k)) =
            static_cast<float>(greyPerDb * (Level(map * Eigen::Vector3d(i, j, static_cast<double>(k))) + meanOfSpeckleDb));
  });
  return result;
}

Case Chain(int size)
{
  return Synthetic("chain of 3, " + std::to_string(size) + "^3", 3, size, 0.6, 0.03, [](double, double, double) { return true; });
}

Case Fans(int count, int size, double step)
{
  return Synthetic(std::to_string(count) + " fans, " + std::to_string(size) + "^3", count, size, step, 0.15,
                   [size](double x, double y, double z) {
                     z += 0.8 * size;
                     return std::hypot(x, y, z) < 1.28 * size && std::abs(x) < 0.4 * z && std::abs(y) < 0.4 * z;
                   });
}

struct Time {
  double wall = 0.0, processor = 0.0;
};

double ProcessorSeconds()
{
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& time) {
    return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

Time TimeOf(const std::function<void()>& function)
{
  const double before = ProcessorSeconds();
  Time time;
  time.wall = benchmark::Seconds(function);
  time.processor = ProcessorSeconds() - before;
  return time;
}

double Median(std::vector<double> values)
{
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
  return values[values.size() / 2];
}

Result Stitched(const Case& scene, const StitchParameters& parameters)
{
  const auto& n = scene.grid.dimensions;
  Result result{Volume<Byte>(n), Volume<Byte>(n), Volume<Byte>(n)};
  Stitch<Byte>(parameters, scene.Inputs(), scene.grid,
               {result.intensity.View(), result.valid.View(), result.coverage.View(), {}});
  return result;
}

Result Bytes(ContestantStitch stitch)
{
  const auto& n = stitch.values.Dimensions();
  Result result{Volume<Byte>(n), Volume<Byte>(n), std::move(stitch.coverage)};
  for (std::ptrdiff_t at = 0; at < result.valid.View().Size(); ++at) {
    result.intensity.View()[at] = static_cast<Byte>(std::clamp(stitch.values.View()[at] + 0.5f, 0.0f, 255.0f));
    result.valid.View()[at] = result.coverage.View()[at] > 0;
  }
  return result;
}

// One line: a stitching, timed in turn with the plain average.
void Contest(const Case& scene, const std::string& method, const std::function<Result()>& stitch,
             const std::function<Result()>& average, int runs, int threads)
{
  Result result;
  double peak = 0.0;
  try {
    const benchmark::MemoryPeak memory;
    result = stitch();
    peak = memory.Beyond();
  } catch (const Error& error) {
    std::cerr << scene.name << ", " << method << ": " << error.what() << "\n";
    return;
  }
  std::vector<double> wall, processor, ratio, processorRatio;
  for (int run = 0; run < runs; ++run) {
    const Time ours = TimeOf([&] { stitch(); }), plain = TimeOf([&] { average(); });
    wall.push_back(ours.wall);
    processor.push_back(ours.processor);
    ratio.push_back(ours.wall / plain.wall);
    processorRatio.push_back(ours.processor / plain.processor);
  }
  const AnyPosedVolume truth = PosedVolume<float>{scene.truth.View(), {}, scene.grid};
  const StitchQualityReport quality = MeasureStitch<Byte>(scene.Inputs(), scene.grid, std::as_const(result.intensity).View(),
                                                          std::as_const(result.valid).View(), &truth);
  const auto voxels = static_cast<double>(result.valid.View().Size());
  benchmark::Report("stitch", scene.name, method, Median(wall), quality.errorOverlap, "grey",
                    {{"cpu_seconds", Median(processor)},
                     {"over_average", Median(ratio)},
                     {"cpu_over_average", Median(processorRatio)},
                     {"bytes_per_voxel", peak / voxels},
                     {"seam_mean", quality.seamMean},
                     {"seam_gradient", quality.seamGradient},
                     {"border_mean", quality.borders.mean},
                     {"border_gradient", quality.borders.gradient},
                     {"cut_mean", quality.cuts.mean},
                     {"cut_gradient", quality.cuts.gradient},
                     {"texture_kept", quality.textureKept},
                     {"snr", quality.snr},
                     {"snr_sources", quality.snrSources},
                     {"error_overlap", quality.errorOverlap},
                     {"error_outside", quality.errorOutside},
                     {"overlap_voxels", quality.overlapVoxels},
                     {"voxels", result.valid.View().Size()},
                     {"runs", runs},
                     {"threads", threads}});
}

#ifdef ECHORAMA_WITH_VTK

// Values, and 255 where they are real. Those that are not real are 0, so that the quotient of the two interpolated components is
// that of the real ones alone.
vtkSmartPointer<vtkImageData> VtkImageOf(const Volume<Byte>& values, const Volume<Byte>& mask, const ImageGeometry& geometry)
{
  auto image = vtkSmartPointer<vtkImageData>::New();
  image->SetDimensions(geometry.dimensions.data());
  image->SetSpacing(geometry.spacing.data());
  image->AllocateScalars(VTK_UNSIGNED_CHAR, 2);
  auto* pairs = static_cast<Byte*>(image->GetScalarPointer());
  for (std::ptrdiff_t at = 0; at < values.View().Size(); ++at) {
    pairs[2 * at] = mask.View()[at] ? values.View()[at] : Byte(0);
    pairs[2 * at + 1] = mask.View()[at] ? Byte(255) : Byte(0);
  }
  return image;
}

Result VtkAverage(const Case& scene, const std::vector<vtkSmartPointer<vtkImageData>>& images)
{
  const auto& n = scene.grid.dimensions;
  Result result{Volume<Byte>(n), Volume<Byte>(n), Volume<Byte>(n)};
  Volume<float> sum(n);
  for (std::size_t v = 0; v < images.size(); ++v) {
    // From the grid to the volume's own axes and origin: the reslicer knows of no directions.
    const ImageGeometry& geometry = scene.geometries[v];
    const Eigen::Affine3d toIndex = geometry.WorldToIndex() * scene.grid.IndexToWorld();
    const Eigen::Affine3d map(geometry.spacing.asDiagonal() * toIndex * scene.grid.spacing.cwiseInverse().asDiagonal());
    const Eigen::Matrix<double, 4, 4, Eigen::RowMajor> rows = map.matrix();
    vtkNew<vtkMatrix4x4> matrix;
    matrix->DeepCopy(rows.data());
    vtkNew<vtkMatrixToLinearTransform> transform;
    transform->SetInput(matrix);
    const Eigen::Vector3d size(geometry.dimensions[0], geometry.dimensions[1], geometry.dimensions[2]);
    Eigen::AlignedBox3d box; // voxels reach half a step beyond their centres
    for (int corner = 0; corner < 8; ++corner)
      box.extend(toIndex.inverse() *
                 (Eigen::Vector3d(corner & 1, corner >> 1 & 1, corner >> 2).cwiseProduct(size).array() - 0.5).matrix());
    int extent[6];
    for (int axis = 0; axis < 3; ++axis) {
      extent[2 * axis] = std::clamp(static_cast<int>(std::floor(box.min()[axis])), 0, n[axis] - 1);
      extent[2 * axis + 1] = std::clamp(static_cast<int>(std::ceil(box.max()[axis])), 0, n[axis] - 1);
    }
    vtkNew<vtkImageReslice> filter;
    filter->SetInputData(images[v]);
    filter->SetResliceTransform(transform);
    filter->SetOutputOrigin(0.0, 0.0, 0.0);
    filter->SetOutputSpacing(scene.grid.spacing.data());
    filter->SetOutputExtent(extent);
    filter->SetInterpolationModeToLinear();
    filter->SetOutputScalarType(VTK_FLOAT);
    filter->Update();
    vtkImageData* part = filter->GetOutput();
    vtkSMPTools::For(extent[4], extent[5] + 1, [&](int begin, int end) {
      for (int k = begin; k < end; ++k)
        for (int j = extent[2]; j <= extent[3]; ++j) {
          const auto* pair = static_cast<const float*>(part->GetScalarPointer(extent[0], j, k));
          float* row = sum.View().Row(j, k);
          Byte* coverage = result.coverage.View().Row(j, k);
          for (int i = extent[0]; i <= extent[1]; ++i, pair += 2)
            if (pair[1] > 127.5f) {
              row[i] += 255.0f * pair[0] / pair[1];
              ++coverage[i];
            }
        }
    });
  }
  vtkSMPTools::For(0, result.valid.View().Size(), [&](vtkIdType begin, vtkIdType end) {
    for (vtkIdType at = begin; at < end; ++at)
      if (const Byte count = result.coverage.View()[at]; count > 0) {
        result.intensity.View()[at] = static_cast<Byte>(sum.View()[at] / static_cast<float>(count) + 0.5f);
        result.valid.View()[at] = 1;
      }
  });
  return result;
}

// A MetaImage of bytes, axes along the world. Not real: the zeros that are connected to the border.
void ReadBytes(const std::string& path, Volume<Byte>& values, Volume<Byte>& mask, ImageGeometry& geometry)
{
  vtkNew<vtkMetaImageReader> reader;
  reader->SetFileName(path.c_str());
  reader->Update();
  vtkImageData* image = reader->GetOutput();
  image->GetDimensions(geometry.dimensions.data());
  image->GetSpacing(geometry.spacing.data());
  image->GetOrigin(geometry.origin.data());
  values = Volume<Byte>(geometry.dimensions);
  std::memcpy(values.View().Data(), image->GetScalarPointer(), geometry.VoxelCount());
  mask = Volume<Byte>(geometry.dimensions, 1);
  const auto& n = geometry.dimensions;
  std::vector<std::array<int, 3>> open;
  const auto visit = [&](int i, int j, int k) {
    if (i >= 0 && j >= 0 && k >= 0 && i < n[0] && j < n[1] && k < n[2] && mask.View()(i, j, k) && values.View()(i, j, k) == 0) {
      mask.View()(i, j, k) = 0;
      open.push_back({i, j, k});
    }
  };
  for (int k = 0; k < n[2]; ++k)
    for (int j = 0; j < n[1]; ++j)
      for (int i = 0; i < n[0]; ++i)
        if (i == 0 || j == 0 || k == 0 || i + 1 == n[0] || j + 1 == n[1] || k + 1 == n[2])
          visit(i, j, k);
  while (!open.empty()) {
    const auto [i, j, k] = open.back();
    open.pop_back();
    visit(i - 1, j, k);
    visit(i + 1, j, k);
    visit(i, j - 1, k);
    visit(i, j + 1, k);
    visit(i, j, k - 1);
    visit(i, j, k + 1);
  }
}

bool Liver(Case& scene)
{
  const std::filesystem::path folder = std::filesystem::path(ECHORAMA_SOURCE_DIR) / "../shared/data/liver";
  if (!std::filesystem::exists(folder / "liver_volume_full.mha"))
    return false;
  scene.name = "liver A + B";
  scene.values.resize(2);
  scene.masks.resize(2);
  scene.geometries.resize(2);
  ReadBytes(folder / "liver_volume_A.mha", scene.values[0], scene.masks[0], scene.geometries[0]);
  ReadBytes(folder / "liver_volume_B.mha", scene.values[1], scene.masks[1], scene.geometries[1]);
  scene.grid = StitchGrid(scene.geometries);
  Volume<Byte> values, mask;
  ImageGeometry geometry;
  ReadBytes(folder / "liver_volume_full.mha", values, mask, geometry);
  const Sampler<Byte> full(values.View(), mask.View());
  scene.truth = Volume<float>(scene.grid.dimensions, std::numeric_limits<float>::quiet_NaN());
  const Eigen::Affine3d map = geometry.WorldToIndex() * scene.grid.IndexToWorld();
  ParallelFor(scene.grid.dimensions[2], [&](std::ptrdiff_t k) {
    for (int j = 0; j < scene.grid.dimensions[1]; ++j)
      for (int i = 0; i < scene.grid.dimensions[0]; ++i) {
        const Eigen::Vector3d at = map * Eigen::Vector3d(i, j, static_cast<double>(k));
        double value = 0.0;
        if (full.Linear(at[0], at[1], at[2], value))
          scene.truth.View()(i, j, static_cast<int>(k)) = static_cast<float>(value);
      }
  });
  return true;
}

#endif

struct Wanted {
  std::vector<std::string> cases, methods; // words, one of which a name must contain; none: all
  int runs = benchmark::Trials(3);

  static bool Has(const std::vector<std::string>& words, const std::string& name)
  {
    return words.empty() ||
           std::any_of(words.begin(), words.end(), [&](const std::string& word) { return name.find(word) != std::string::npos; });
  }
};

void Measure(const Case& scene, const Wanted& wanted)
{
  struct Contender {
    const char* name;
    StitchMethod method;
    StitchTexture texture;
    double detailSharpness;
    int planStep;
  };
  // Details that change over as widely as the smooth part are the mean of all, amplified: "restore".
  const double narrow = StitchParameters().detailSharpness, wide = StitchParameters().sharpness;
  const Contender contenders[] = {
      {"average", StitchMethod::Average, StitchTexture::Mix, narrow, 0},
      {"feather", StitchMethod::Feather, StitchTexture::Mix, narrow, 0},
      {"maximum", StitchMethod::Maximum, StitchTexture::Mix, narrow, 0},
      {"distance", StitchMethod::Distance, StitchTexture::Mix, narrow, 0},
      {"membrane", StitchMethod::Membrane, StitchTexture::Mix, narrow, 0},
      {"distance restore", StitchMethod::Distance, StitchTexture::Split, wide, 0},
      {"distance split", StitchMethod::Distance, StitchTexture::Split, narrow, 0},
      {"membrane restore", StitchMethod::Membrane, StitchTexture::Split, wide, 0},
      {"membrane split", StitchMethod::Membrane, StitchTexture::Split, narrow, 0},
      {"membrane split, PlanStep 1", StitchMethod::Membrane, StitchTexture::Split, narrow, 1},
  };
  const auto with = [&scene](const Contender& contender) {
    StitchParameters parameters;
    parameters.method = contender.method;
    parameters.texture = contender.texture;
    parameters.detailSharpness = contender.detailSharpness;
    parameters.planStep = contender.planStep;
    return [&scene, parameters] { return Stitched(scene, parameters); };
  };
  const std::function<Result()> average = with(contenders[0]);
  for (const Contender& contender : contenders)
    if (Wanted::Has(wanted.methods, contender.name))
      Contest(scene, contender.name, with(contender), average, wanted.runs, tbb::info::default_concurrency());
  for (const auto& [name, stitch] :
       {std::pair("multiband", StitchByMultiband), std::pair("offset", StitchByOffsets), std::pair("seam", StitchBySeams)})
    if (Wanted::Has(wanted.methods, name))
      Contest(
          scene, name, [&scene, stitch = stitch] { return Bytes(stitch(scene.Inputs(), scene.grid)); }, average, wanted.runs,
          tbb::info::default_concurrency());
#ifdef ECHORAMA_WITH_VTK
  const char* peer = "vtk reslice and average";
  if (!Wanted::Has(wanted.methods, peer))
    return;
  std::vector<vtkSmartPointer<vtkImageData>> images;
  for (std::size_t v = 0; v < scene.values.size(); ++v)
    images.push_back(VtkImageOf(scene.values[v], scene.masks[v], scene.geometries[v]));
  Contest(
      scene, peer, [&] { return VtkAverage(scene, images); }, average, wanted.runs,
      vtkMultiThreader::GetGlobalDefaultNumberOfThreads());
#endif
}

} // namespace

int main(int argc, char** argv)
{
  Wanted wanted;
  std::vector<std::string>* words = &wanted.cases;
  for (int i = 1; i < argc; ++i) {
    const std::string argument = argv[i];
    if (argument == "--methods")
      words = &wanted.methods;
    else if (argument == "--runs" && i + 1 < argc)
      wanted.runs = std::max(1, std::atoi(argv[++i]));
    else
      words->push_back(argument);
  }
  const std::pair<const char*, std::function<Case()>> synthetic[] = {
      {"chain of 3, 96^3", [] { return Chain(96); }},
      {"5 fans, 96^3", [] { return Fans(5, 96, 0.3); }},
      {"chain of 3, 256^3", [] { return Chain(256); }},
  };
  for (const auto& [name, make] : synthetic)
    if (Wanted::Has(wanted.cases, name))
      Measure(make(), wanted);
#ifdef ECHORAMA_WITH_VTK
  if (Wanted::Has(wanted.cases, "liver A + B")) {
    Case liver;
    if (Liver(liver))
      Measure(liver, wanted);
    else
      std::cerr << "no liver volumes beside the project: that case is left out\n";
  }
#endif
  return 0;
}
