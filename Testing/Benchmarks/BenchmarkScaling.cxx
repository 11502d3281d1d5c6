// SPDX-License-Identifier: BSD-3-Clause
// How the cost of the main kernels grows: nanoseconds of one thread per voxel, pair, ray and so on at four sizes of which each is
// ten times (pairs: five times) the one before, what a second thread makes of it, and memory. Each size of each kernel is
// measured by a process of its own, one thread and two in turn, the best of several; input is made beforehand. "over_median" is
// the cost of a unit over the median of the four sizes, "speedup" that of two threads over one, "beyond_bytes" the largest memory
// per unit beyond what was there before the kernel was called (input, and output where the caller makes it), "peak_mb" that of
// the whole process.
//
// Arguments: [word of a kernel's name]...; without words all.
#include "Core/Base/Parallel.h"
#include "Core/Base/Random.h"
#include "Core/Imaging/DistanceMap.h"
#include "Core/Imaging/ScanConversion.h"
#include "Filters/Acoustics/Synthesize.h"
#include "Filters/Embedding/BeamNoise.h"
#include "Filters/Embedding/Embed.h"
#include "Filters/Reconstruction/VolumeReconstruction.h"
#include "Filters/Registration/AlignVolumes.h"
#include "Filters/Stitching/Membrane.h"
#include "Filters/Stitching/Stitch.h"
#include "Filters/Stitching/StitchGrid.h"
#include "Filters/Tissue/PackedTissue.h"
#include "Readers/VolumeFile.h"
#include "Readers/VolumeWriter.h"
#include "Testing/Benchmark.h"
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <unistd.h>

using namespace echorama;

namespace {

using Byte = unsigned char;

// What one run cost, and of how many what.
struct Cost {
  std::string kernel, unit;
  double units = 0.0, seconds = 0.0;
};
using Run = std::function<std::vector<Cost>()>;

template <class Function>
Run Whole(const std::string& kernel, const std::string& unit, double units, const Function& function)
{
  return [=] { return std::vector<Cost>{{kernel, unit, units, benchmark::Seconds(function)}}; };
}

std::array<int, 3> Cube(double voxels)
{
  const int n = static_cast<int>(std::lround(std::cbrt(voxels)));
  return {n, n, n};
}

template <class T, class Function>
std::shared_ptr<Volume<T>> Filled(const std::array<int, 3>& n, const Function& value)
{
  auto volume = std::make_shared<Volume<T>>(n);
  ParallelFor(n[2], [&](std::ptrdiff_t slice) {
    const int k = static_cast<int>(slice);
    Random random(5, static_cast<std::uint64_t>(slice));
    for (int j = 0; j < n[1]; ++j)
      for (int i = 0; i < n[0]; ++i)
        volume->View()(i, j, k) = static_cast<T>(value(i, j, k, random));
  });
  return volume;
}

// Tissue, in grey levels: shapes of all sizes from some voxels of 1 mm on.
double Tissue(const Eigen::Vector3d& p)
{
  double grey = 110.0;
  for (const double mm : {7.0, 19.0, 53.0})
    grey += 22.0 * std::sin(6.2832 / mm * (p[0] + 0.3 * p[1])) * std::sin(6.2832 / mm * (p[1] - 0.2 * p[2]) + 1.0) *
            std::sin(6.2832 / mm * (p[2] + 0.1 * p[0]) + 2.0);
  return grey;
}

// What a volume of it shows, with noise.
std::shared_ptr<Volume<Byte>> Seen(const ImageGeometry& geometry)
{
  const Eigen::Affine3d map = geometry.IndexToWorld();
  return Filled<Byte>(geometry.dimensions, [&map](int i, int j, int k, Random& random) {
    return Tissue(map * Eigen::Vector3d(i, j, k)) + random.Uniform(0.0, 60.0);
  });
}

Run ScanConversion(double voxels)
{
  const ProbeGeometry probe = ProbeGeometry::Convex(1.2, 40.0, 1.1, 25.0, 2.0, 150.0);
  const double atOneMm = static_cast<double>(ScanConversionGrid(probe, Pose::Identity(), 1.0, std::size_t{1} << 28).VoxelCount());
  const ImageGeometry grid = ScanConversionGrid(probe, Pose::Identity(), std::cbrt(atOneMm / voxels), std::size_t{1} << 28);
  const int beams = Cube(voxels / 8.0)[0]; // half as many samples as voxels
  const auto samples = Filled<Byte>({4 * beams, beams, beams}, [](int, int, int, Random& random) { return random.Bits() >> 24; });
  const auto out = std::make_shared<Volume<Byte>>(grid.dimensions), valid = std::make_shared<Volume<Byte>>(grid.dimensions);
  return Whole("scan conversion", "voxel", static_cast<double>(grid.VoxelCount()), [=] {
    ScanConvert<Byte>(std::as_const(*samples).View(), probe, Pose::Identity(), grid, out->View(), valid->View());
  });
}

Run Distances(double voxels)
{
  const auto n = Cube(voxels);
  const ProbeGeometry probe = ProbeGeometry::Convex(1.2, 40.0, 1.1, 25.0, 5.0, 120.0);
  const double spacing = 154.0 / n[0], middle = 0.5 * (n[0] - 1);
  const auto mask = Filled<Byte>(n, [&](int i, int j, int k, Random&) {
    return BeamPointAt(probe, Eigen::Vector3d(i - middle, j - middle, k) * spacing).has_value() ? 1 : 0;
  });
  const auto map = std::make_shared<Volume<float>>(n);
  return Whole("distance map", "voxel", static_cast<double>(map->View().Size()),
               [=] { SquaredDistanceMap(std::as_const(*mask).View(), Eigen::Vector3d::Ones(), map->View()); });
}

// Three boxes in a row, each turned a little, of which neighbours share two fifths.
Run Stitching(double voxels)
{
  const auto n = Cube(voxels / 2.3);
  std::vector<std::shared_ptr<Volume<Byte>>> seen;
  std::vector<StitchInput> inputs;
  std::vector<ImageGeometry> geometries;
  for (int v = 0; v < 3; ++v) {
    ImageGeometry geometry;
    geometry.dimensions = n;
    geometry.spacing.setConstant(0.5);
    geometry = geometry.Moved(MotionAbout(geometry.Centre(), 0.03 * Random(7, static_cast<std::uint64_t>(v)).Direction(),
                                          {0.3 * n[0] * v, 0.1 * v, -0.1 * v}));
    seen.push_back(Seen(geometry));
    geometries.push_back(geometry);
    inputs.push_back({PosedVolume<Byte>{std::as_const(*seen.back()).View(), {}, geometry}, "volume " + std::to_string(v)});
  }
  const ImageGeometry grid = StitchGrid(geometries);
  const auto out = std::make_shared<std::array<Volume<Byte>, 3>>();
  for (Volume<Byte>& volume : *out)
    volume = Volume<Byte>(grid.dimensions);
  return Whole("stitching", "output voxel", static_cast<double>(grid.VoxelCount()), [=, keep = seen] {
    Stitch<Byte>({}, inputs, grid, {(*out)[0].View(), (*out)[1].View(), (*out)[2].View(), {}});
  });
}

// Unknown between two walls, one of them with a pattern of 0 and 1, and around a ball that is not there.
Run Membranes(double nodes)
{
  const auto n = Cube(nodes);
  const auto spans =
      std::make_shared<const RowSpans>(GridBox{{0, 0, 0}, n}, std::vector<int>(static_cast<std::size_t>(n[1]) * n[2], 0),
                                       std::vector<int>(static_cast<std::size_t>(n[1]) * n[2], n[0]));
  const auto kinds = std::make_shared<RowField<Byte>>(spans);
  const auto known = std::make_shared<RowField<float>>(spans), values = std::make_shared<RowField<float>>(spans);
  double unknowns = 0.0;
  for (int k = 0; k < n[2]; ++k)
    for (int j = 0; j < n[1]; ++j)
      for (int i = 0; i < n[0]; ++i) {
        const bool wall = i == 0 || i == n[0] - 1;
        const bool ball = (Eigen::Vector3d(i, j, k) / n[0] - Eigen::Vector3d::Constant(0.5)).norm() < 0.2;
        kinds->Row(j, k)[i] = static_cast<Byte>(wall   ? MembraneVoxel::Known
                                                : ball ? MembraneVoxel::Void
                                                       : MembraneVoxel::Unknown);
        known->Row(j, k)[i] = i == 0 ? static_cast<float>((4 * j / n[1] + 4 * k / n[2]) % 2) : 0.5f;
        unknowns += !wall && !ball;
      }
  return [=] {
    values->values = known->values;
    return std::vector<Cost>{{"membrane", "unknown", unknowns,
                              benchmark::Seconds([&] { SolveMembrane(*kinds, Eigen::Vector3d::Ones(), *values, 0.5f); })}};
  };
}

ImageGeometry Millimetres(const std::array<int, 3>& n)
{
  ImageGeometry geometry;
  geometry.dimensions = n;
  return geometry;
}

Run Resolutions(double voxels)
{
  const ImageGeometry geometry = Millimetres(Cube(voxels));
  const auto seen = Seen(geometry);
  return Whole("alignment: resolutions", "voxel", static_cast<double>(geometry.VoxelCount()), [=] {
    BuildPyramid<Byte>({std::as_const(*seen).View(), {}, geometry});
  });
}

// Of both volumes of a pair, as the aligner holds them.
Run Features(double voxels)
{
  const ImageGeometry geometry = Millimetres(Cube(voxels / 2.0));
  const auto pyramid = std::make_shared<const std::vector<PyramidLevel>>(
      BuildPyramid<Byte>({std::as_const(*Seen(geometry)).View(), {}, geometry}));
  return Whole("alignment: features", "voxel", 2.0 * static_cast<double>(geometry.VoxelCount()), [=] {
    const PlacedVolume volume{pyramid.get(), Pose::Identity(), "volume"};
    const auto first = BuildMetricPyramid(volume, "local-ncc"), second = BuildMetricPyramid(volume, "local-ncc");
  });
}

// Small volumes of one place, each a little off: every pair of them.
Run Pairs(double pairs)
{
  const int count = static_cast<int>(std::lround(0.5 + std::sqrt(0.25 + 2.0 * pairs)));
  const auto pyramids = std::make_shared<std::vector<std::vector<PyramidLevel>>>();
  std::vector<PlacedVolume> volumes;
  for (int v = 0; v < count; ++v) {
    Random random(3, static_cast<std::uint64_t>(v));
    ImageGeometry geometry = Millimetres({24, 24, 24});
    geometry = geometry.Moved(MotionAbout(geometry.Centre(), 0.1 * random.Direction(), 4.0 * random.Direction()));
    pyramids->push_back(BuildPyramid<Byte>({std::as_const(*Seen(geometry)).View(), {}, geometry}));
  }
  for (int v = 0; v < count; ++v) {
    Random random(4, static_cast<std::uint64_t>(v));
    const Pose start = MotionAbout(Eigen::Vector3d::Constant(12.0), 0.03 * random.Direction(), 2.0 * random.Direction());
    volumes.push_back({&(*pyramids)[static_cast<std::size_t>(v)], start, "volume " + std::to_string(v)});
  }
  AlignVolumesParameters p;
  p.pair.start = AlignStart::Tracked;
  p.pairsPerVolume = count;
  return [=, keep = pyramids] {
    std::size_t tried = 0;
    const double seconds = benchmark::Seconds([&] { tried = AlignVolumes(volumes, 0, p).pairs.size(); });
    return std::vector<Cost>{{"alignment: pairs", "pair", static_cast<double>(tried), seconds}};
  };
}

// A sweep in steps of a pixel; voxels of two pixels.
Run Reconstructing(double pixels)
{
  constexpr int size = 256;
  const int frames = std::max(2, static_cast<int>(std::lround(pixels / size / size)));
  const auto frame = Filled<Byte>({size, size, 1}, [](int, int, int, Random& random) { return random.Bits() >> 24; });
  ImageGeometry grid = Millimetres({size / 2 + 2, size / 2 + 2, frames / 2 + 2});
  const auto out = std::make_shared<std::array<Volume<Byte>, 2>>();
  for (Volume<Byte>& volume : *out)
    volume = Volume<Byte>(grid.dimensions);
  const auto coverage = std::make_shared<Volume<unsigned short>>(grid.dimensions);
  return Whole("reconstruction", "pixel", static_cast<double>(frames) * size * size, [=] {
    VolumeReconstruction<Byte> reconstruction({}, grid, {(*out)[0].View(), (*out)[1].View(), coverage->View()});
    for (int f = 0; f < frames; ++f) {
      Eigen::Affine3d pose =
          MotionAbout(Eigen::Vector3d::Constant(64.0), {0.01 * std::sin(0.1 * f), 0.0, 0.0}, {0.0, 0.0, 0.5 * f}) *
          Eigen::Affine3d(Eigen::Scaling(0.5));
      reconstruction.Add({std::as_const(*frame).View(), {}, pose});
    }
  });
}

// Beams into packed spheres, always over the same fan and sweep.
Run Synthesis(double beams)
{
  PackedTissueParameters tissue;
  tissue.packing.boxMin = Eigen::Vector3d(-120, -100, 3);
  tissue.packing.boxMax = Eigen::Vector3d(120, 100, 160);
  tissue.packing.radiusMin = 2.0;
  tissue.packing.radiusMax = 8.0;
  tissue.cell.mm = 1.0;
  const auto scene = std::make_shared<const AcousticScene>(MakePackedTissue(tissue).surface);
  SynthesisParameters p;
  p.elements = std::max(2, static_cast<int>(std::lround(std::sqrt(beams))));
  p.steps = std::max(2, static_cast<int>(std::lround(beams / p.elements)));
  return [=] {
    SynthesisCost cost;
    SynthesizeBeams(*scene, p, {}, &cost);
    const double samples = static_cast<double>(p.samples) * p.elements * p.steps;
    return std::vector<Cost>{{"synthesis: rays", "ray", static_cast<double>(cost.rays), cost.raysSeconds},
                             {"synthesis: scatterers", "scatterer", static_cast<double>(cost.scatterers), cost.scatterersSeconds},
                             {"synthesis: echoes", "sample", samples, cost.echoesSeconds}};
  };
}

// A ball of data in a cube of noise.
Run Embedding(double voxels)
{
  const auto n = Cube(voxels);
  const auto region = Filled<Byte>(n, [&n](int i, int j, int k, Random&) {
    return (Eigen::Vector3d(i, j, k) / n[0] - Eigen::Vector3d::Constant(0.5)).norm() < 0.35 ? 1 : 0;
  });
  const auto data = Filled<Byte>(
      n, [](int i, int j, int k, Random& random) { return Tissue(0.5 * Eigen::Vector3d(i, j, k)) + random.Uniform(0.0, 60.0); });
  const auto noise = Filled<float>(n, [](int, int, int, Random& random) { return random.Uniform(0.0, 80.0); });
  const auto values = std::make_shared<Volume<Byte>>(n), labels = std::make_shared<Volume<Byte>>(n);
  const auto background = std::make_shared<Volume<float>>(n);
  return [=] {
    *values = *data;
    *background = *noise;
    return std::vector<Cost>{{"embedding", "voxel", static_cast<double>(values->View().Size()), benchmark::Seconds([&] {
                                Embed<Byte>({}, std::as_const(*region).View(), Eigen::Vector3d::Constant(0.5), background->View(),
                                            {}, values->View(), labels->View());
                              })}};
  };
}

// Grain of three samples along each axis.
Run Noise(double samples)
{
  const ProbeGeometry probe = ProbeGeometry::Convex(1.15, 40.0, 0.85, 40.0, 0.0, 100.0);
  const double scale = std::cbrt(samples / (400.0 * 240.0 * 120.0));
  BeamNoiseParameters p;
  p.samples = static_cast<int>(std::lround(400 * scale));
  p.elements = static_cast<int>(std::lround(240 * scale));
  p.steps = static_cast<int>(std::lround(120 * scale));
  p.depthCorrelationMm = 3.0 * 100.0 / p.samples;
  p.fanCorrelation = 3.0 / p.elements;
  p.sweepCorrelation = 3.0 / p.steps;
  return Whole("noise along beams", "sample", static_cast<double>(p.samples) * p.elements * p.steps,
               [=] { MakeBeamNoise(p, probe); });
}

// From files that the system holds in memory.
Run Reading(double bytes, bool compressed)
{
  const ImageGeometry geometry = Millimetres(Cube(bytes));
  const std::string path =
      (std::filesystem::temp_directory_path() / ("echorama-scaling-" + std::to_string(getpid()) + ".mha")).string();
  ImageHeader header;
  header.geometry = geometry;
  FileReplacement files;
  WriteVolume(path, header, Seen(geometry)->View().Data(), compressed, files);
  files.Commit();
  const std::shared_ptr<void> remove(nullptr, [path](void*) { std::filesystem::remove(path); });
  const auto voxels = std::make_shared<std::vector<Byte>>(geometry.VoxelCount());
  return Whole(compressed ? "reading, compressed" : "reading", "byte", static_cast<double>(voxels->size()), [=] {
    static_cast<void>(remove);
    const ImageHeader found = ReadImageHeader(path);
    CheckVolume(found);
    ReadVoxels(found, voxels->data());
  });
}

struct Kernel {
  const char* name;
  double units; // of the smallest size
  Run (*prepare)(double units);
  double step = 10.0; // from size to size
};
const Kernel Kernels[] = {
    {"scan conversion", 1e5, ScanConversion},
    {"distance map", 1e5, Distances},
    {"stitching", 2e4, Stitching},
    {"membrane", 1e4, Membranes},
    {"alignment: resolutions", 134217.728, Resolutions}, // up to 512^3
    {"alignment: features", 2 * 134217.728, Features},
    {"alignment: pairs", 1, Pairs, 5.0}, // a thousand take minutes
    {"reconstruction", 131072, Reconstructing},
    {"synthesis", 4, Synthesis},
    {"embedding", 3e4, Embedding},
    {"noise along beams", 3e4, Noise},
    {"reading", 1e5, [](double bytes) { return Reading(bytes, false); }},
    {"reading, compressed", 1e5, [](double bytes) { return Reading(bytes, true); }},
};

// A child: measures one size of one kernel and prints a line for each of what it reports.
void Measure(const Kernel& kernel, double units)
{
  const Run run = kernel.prepare(units);
  std::vector<Cost> best[2];
  double beyond[2] = {0.0, 0.0}, peak[2] = {0.0, 0.0};
  double spent = 0.0;
  // A run of several seconds tells as much as many short ones.
  for (int round = 0; round == 0 || (!benchmark::Smoke() && (round < 2 ? spent < 5.0 : round < 50 && spent < 1.0)); ++round)
    for (const int threads : {1, 2}) {
      const ThreadLimit limit(threads);
      const std::size_t t = static_cast<std::size_t>(threads) - 1;
      const benchmark::MemoryPeak memory;
      std::vector<Cost> costs;
      spent += benchmark::Seconds([&] { costs = run(); });
      beyond[t] = std::max(beyond[t], memory.Beyond());
      peak[t] = std::max(peak[t], benchmark::PeakMb());
      if (round == 0)
        best[t] = costs;
      for (std::size_t c = 0; c < costs.size(); ++c)
        best[t][c].seconds = std::min(best[t][c].seconds, costs[c].seconds);
    }
  for (const std::size_t t : {0, 1})
    for (const Cost& cost : best[t])
      std::cout << nlohmann::ordered_json{{"bench", "scaling"},
                                          {"case", cost.kernel},
                                          {"method", t ? "2 threads" : "1 thread"},
                                          {"seconds", cost.seconds},
                                          {"unit", cost.unit},
                                          {"units", cost.units},
                                          {"ns_per_unit", 1e9 * cost.seconds / cost.units},
                                          {"speedup",
                                           best[0][static_cast<std::size_t>(&cost - best[t].data())].seconds / cost.seconds},
                                          {"beyond_bytes", beyond[t] / cost.units},
                                          {"peak_mb", peak[t]}}
                       .dump()
                << "\n";
}

// What a child prints about one size.
std::vector<nlohmann::ordered_json> Measured(const std::string& program, std::size_t kernel, double units)
{
  const std::string command = "'" + program + "' --measure " + std::to_string(kernel) + " " + std::to_string(units);
  FILE* pipe = popen(command.c_str(), "r");
  if (!pipe)
    throw std::runtime_error("cannot start " + command);
  std::string text;
  for (int c = std::fgetc(pipe); c != EOF; c = std::fgetc(pipe))
    text += static_cast<char>(c);
  if (pclose(pipe) != 0)
    throw std::runtime_error(command + " failed");
  std::vector<nlohmann::ordered_json> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);)
    lines.push_back(nlohmann::ordered_json::parse(line));
  return lines;
}

} // namespace

int main(int argc, char** argv)
{
  if (argc == 4 && std::string(argv[1]) == "--measure") {
    Measure(Kernels[std::stoul(argv[2])], std::stod(argv[3]));
    return 0;
  }
  const std::string program = std::filesystem::read_symlink("/proc/self/exe").string();
  for (std::size_t k = 0; k < std::size(Kernels); ++k) {
    const std::string name = Kernels[k].name;
    if (argc > 1 &&
        std::none_of(argv + 1, argv + argc, [&name](const char* word) { return name.find(word) != std::string::npos; }))
      continue;
    std::vector<nlohmann::ordered_json> lines;
    for (const int power : {0, 1, 2, 3}) {
      const auto more = Measured(program, k, std::pow(Kernels[k].step, power) * Kernels[k].units);
      lines.insert(lines.end(), more.begin(), more.end());
      if (benchmark::Smoke())
        break;
    }
    for (nlohmann::ordered_json& line : lines) {
      std::vector<double> costs;
      for (const nlohmann::ordered_json& other : lines)
        if (other["case"] == line["case"] && other["method"] == line["method"])
          costs.push_back(other["ns_per_unit"]);
      std::sort(costs.begin(), costs.end());
      line["over_median"] = line["ns_per_unit"].get<double>() / (0.5 * (costs[(costs.size() - 1) / 2] + costs[costs.size() / 2]));
      std::cout << line.dump() << std::endl;
    }
  }
  return 0;
}
