// SPDX-License-Identifier: BSD-3-Clause
// Embedding, end to end: a fan is put around a stitched volume, noise is made in it, and the data are laid over it. Time of each
// step, and what became of the border (MeasureEmbedding), for
//   naive         the data on noise as it is, with a hard edge
//   feather       the same with a soft edge
//   dissertation  noise with the local mean of the data (I' = T D), and a soft edge of plain means
//   full          noise with the grain of the data and their local mean and contrast, and an edge that keeps texture
// Cases: three views of a phantom, a liver, and a tank: three views of a linear probe in water, with walls and a block of
// speckle. The error is the seam's jump (95 % of the border jump no more), to be held against the limit beside it. The first
// three share noise of one machine's defaults. Ends with status 1 when any voxel of the data beyond the feather is not that of
// the input. Arguments: [word of a case's name]...; without words all cases.
#include "Core/Base/Angles.h"
#include "Core/Base/Error.h"
#include "Core/Base/Parallel.h"
#include "Core/Geometry/EnclosingFan.h"
#include "Core/Imaging/ScanConversion.h"
#include "Filters/Embedding/BackgroundNoise.h"
#include "Filters/Embedding/BeamNoise.h"
#include "Filters/Embedding/Embed.h"
#include "Filters/Embedding/EmbedGrid.h"
#include "Filters/Embedding/EmbedQuality.h"
#include "Filters/Phantoms/Phantom.h"
#include "Filters/Phantoms/PhantomViews.h"
#include "Filters/Stitching/Stitch.h"
#include "Filters/Stitching/StitchGrid.h"
#include "Readers/BorderZeros.h"
#include "Readers/ImageHeader.h"
#include "Readers/VolumeFile.h"
#include "Testing/Benchmark.h"
#include <cmath>
#include <filesystem>
#include <functional>
#include <limits>

using namespace echorama;

namespace {

using Byte = unsigned char;

struct Seen {
  ImageGeometry geometry;
  Volume<Byte> voxels, valid;

  PosedVolume<Byte> Posed() const { return {voxels.View(), valid.View(), geometry}; }
};

Seen Stitched(const std::vector<Seen>& volumes)
{
  std::vector<StitchInput> inputs;
  std::vector<ImageGeometry> geometries;
  for (const Seen& volume : volumes) {
    inputs.push_back({volume.Posed(), "volume " + std::to_string(inputs.size() + 1)});
    geometries.push_back(volume.geometry);
  }
  const ImageGeometry grid = StitchGrid(geometries);
  Seen result{grid, Volume<Byte>(grid.dimensions), Volume<Byte>(grid.dimensions)};
  Volume<Byte> coverage(grid.dimensions);
  Stitch<Byte>({}, inputs, grid, {result.voxels.View(), result.valid.View(), coverage.View(), {}});
  return result;
}

Seen Liver(const std::filesystem::path& folder)
{
  std::vector<Seen> volumes;
  for (const char* name : {"liver_volume_A.mha", "liver_volume_B.mha"}) {
    const ImageHeader header = ReadImageHeader((folder / name).string());
    CheckVolume(header);
    Seen seen{header.geometry, Volume<Byte>(header.geometry.dimensions), Volume<Byte>(header.geometry.dimensions)};
    ReadVoxels(header, seen.voxels.View().Data());
    ValidFromBorderZeros<Byte>(seen.voxels.View(), seen.valid.View());
    volumes.push_back(std::move(seen));
  }
  return Stitched(volumes);
}

Seen Phantom()
{
  PhantomParameters parameters;
  std::vector<Seen> volumes;
  for (const PhantomView& view : PhantomViews(parameters.probe, 3)) {
    parameters.probeToWorld = view.probeToWorld;
    const ImageGeometry geometry = PhantomGeometry(parameters);
    volumes.push_back({geometry, Volume<Byte>(geometry.dimensions), Volume<Byte>(geometry.dimensions)});
    MakePhantom(parameters, volumes.back().voxels.View(), volumes.back().valid.View());
  }
  return Stitched(volumes);
}

// Three views of a linear probe in water, each with speckle of its own: two walls that run out of the data, and a block that is
// cut by them.
Seen Tank()
{
  const ProbeGeometry probe = ProbeGeometry::Linear(38.0, 24.0, 0.0, 40.0);
  BeamNoiseParameters parameters;
  parameters.intensity = NoiseIntensity::Rayleigh;
  parameters.mean = 50.0;
  parameters.depthCorrelationMm = 0.35;
  parameters.fanCorrelation = 0.5 / 38.0;
  parameters.sweepCorrelation = 0.6 / 24.0;
  parameters = ResolvingCounts(parameters, probe);
  const Eigen::Vector3d places[] = {{-6.0, 0.0, 0.0}, {0.0, 4.0, 0.0}, {6.0, -3.0, 0.0}},
                        turns[] = {{0, 2, 0}, {0, 0, 0}, {1, -2, 0}};
  std::vector<Seen> volumes;
  for (std::size_t view = 0; view < 3; ++view) {
    Pose pose = Pose::Identity();
    pose.linear() = ExpRotation(RadiansPerDegree * turns[view]);
    pose.translation() = places[view];
    parameters.seed = view + 1;
    const Volume<float> noise = MakeBeamNoise(parameters, probe);
    const auto& n = noise.Dimensions();
    Volume<Byte> beams(n);
    ParallelFor(n[2], [&](std::ptrdiff_t k) {
      for (int j = 0; j < n[1]; ++j)
        for (int i = 0; i < n[0]; ++i) {
          const Eigen::Vector3d at = pose * PointOf(probe, {40.0 * i / (n[0] - 1), static_cast<double>(j) / (n[1] - 1) - 0.5,
                                                            static_cast<double>(k) / (n[2] - 1) - 0.5});
          const bool wall = std::abs(at.z() - 35.0) < 0.4 || (std::abs(at.z() - 10.5 - 0.1 * at.y()) < 0.4 && at.x() < -10.0);
          const bool block = at.x() > 6.0 && at.y() > -4.0 && std::abs(at.z() - 22.0) < 7.0;
          const double echo = static_cast<double>(noise.View()(i, j, static_cast<int>(k))) * (wall ? 3.0 : block ? 1.0 : 0.03);
          beams.View()(i, j, static_cast<int>(k)) = static_cast<Byte>(std::min(echo + 0.5, 255.0));
        }
    });
    const ImageGeometry grid = ScanConversionGrid(probe, pose, 0.2, std::size_t{1} << 28);
    volumes.push_back({grid, Volume<Byte>(grid.dimensions), Volume<Byte>(grid.dimensions)});
    ScanConvert<Byte>(std::as_const(beams).View(), probe, pose, grid, volumes.back().voxels.View(), volumes.back().valid.View());
  }
  return Stitched(volumes);
}

// The steps of one embedding and their seconds.
class Embedding {
public:
  explicit Embedding(const Seen& data) : data_(data)
  {
    Time("fan", [&] {
      EnclosingFanParameters parameters;
      parameters.marginMm = -1.0; // as wide as the data ask
      form_ = EncloseRegion(data_.valid.View(), data_.geometry, parameters);
    });
    Time("grid", [&] {
      grid_ = EmbedGridOf(data_.geometry, data_.valid.View(), form_);
      values_ = Volume<Byte>(grid_.geometry.dimensions);
      region_ = Volume<Byte>(grid_.geometry.dimensions);
      labels_ = Volume<Byte>(grid_.geometry.dimensions);
      CopyToGrid(grid_, data_.geometry.dimensions, 1, data_.voxels.View().Data(), values_.View().Data());
      CopyToGrid(grid_, data_.geometry.dimensions, 1, data_.valid.View().Data(), region_.View().Data());
    });
  }

  void MakeNoise(bool match)
  {
    BeamNoiseParameters parameters;
    if (match)
      Time("match", [&] {
        const BackgroundNoise found = NoiseBehind(data_.Posed(), form_);
        parameters = found.parameters;
        grainMm_ = found.grainMm;
        grains_ = found.grains;
      });
    Volume<float> beams;
    Time("noise", [&] { beams = MakeBeamNoise(parameters, form_.geometry); });
    Time("scan", [&] {
      noise_ = Volume<float>(grid_.geometry.dimensions);
      fan_ = Volume<Byte>(grid_.geometry.dimensions);
      ScanConvert<float>(beams.View(), form_.geometry, form_.probeToWorld, grid_.geometry, noise_.View(), fan_.View());
    });
  }

  // How deep the border of data with the grain that was measured is.
  double FeatherMm() const { return FeatherDepth(grainMm_, data_.geometry.spacing); }

  // The data on the noise as it is.
  void Overlay(double featherMm)
  {
    const FeatherParameters parameters{featherMm, false, 3.0};
    Time("feather", [&] {
      Volume<float> weights(grid_.geometry.dimensions);
      FeatherWeights(parameters, region_.View(), fan_.View(), grid_.geometry.spacing, weights.View());
      Feather<Byte>(parameters, weights.View(), region_.View(), noise_.View(), fan_.View(), grid_.geometry.spacing,
                    values_.View(), labels_.View());
    });
  }

  void Embed(const EmbedParameters& parameters)
  {
    Time("embed", [&] {
      echorama::Embed<Byte>(parameters, region_.View(), grid_.geometry.spacing, noise_.View(), fan_.View(), values_.View(),
                            labels_.View());
    });
  }

  // \returns whether the data are untouched
  bool Report(const std::string& testCase, const std::string& method, double featherMm) const
  {
    EmbedQualityParameters parameters;
    parameters.featherMm = featherMm;
    const PosedVolume<Byte> original = data_.Posed();
    const EmbedQualityReport q =
        MeasureEmbedding<Byte>(values_.View(), labels_.View(), grid_.geometry, &original, &form_, parameters);
    double seconds = 0.0;
    for (const auto& step : steps_.items())
      seconds += step.value().get<double>();
    const auto& n = grid_.geometry.dimensions;
    benchmark::Report(
        "embed", testCase, method, seconds, q.border.percentile95, "grey",
        {{"limit", q.jumpLimit},
         {"jump_passes", q.jumpPasses},
         {"mean_jump", q.border.mean},
         {"bias", q.border.bias},
         {"reference_mean_jump", q.reference.mean},
         {"deviation_ratio", q.border.deviationRatio},
         {"deviation_ratio_5", q.border.deviationRatio5},
         {"deviation_ratio_95", q.border.deviationRatio95},
         {"deviation_passes", q.deviationPasses},
         {"reference_ratio_5", q.reference.deviationRatio5},
         {"reference_ratio_95", q.reference.deviationRatio95},
         {"altered", q.altered},
         {"pretended", q.pretended},
         {"lost", q.lost},
         {"data", q.data},
         {"blend", q.blend},
         {"invented", q.invented},
         {"border_patches", q.border.patches},
         {"border_measured", q.borderMeasured},
         {"mixed_percent", 100.0 * static_cast<double>(q.blend) / static_cast<double>(q.data + q.blend)},
         {"invented_percent", 100.0 * static_cast<double>(q.invented) / static_cast<double>(q.data + q.blend + q.invented)},
         {"grain_mm", grainMm_},
         {"grains", grains_},
         {"grain_ratio", GrainRatio()},
         {"crop_share", q.crop.share},
         {"steps", steps_},
         {"grid", {n[0], n[1], n[2]}}});
    const bool untouched = q.altered == 0 && q.pretended == 0 && q.lost == 0;
    if (!untouched)
      std::cerr << testCase << ", " << method << ": " << q.altered << " voxels of the data are altered, " << q.pretended
                << " pretended, " << q.lost << " lost\n";
    return untouched;
  }

private:
  // The grain of the background over that of the data, where both have speckle.
  double GrainRatio() const
  {
    Volume<Byte> invented(labels_.Dimensions()), seen(labels_.Dimensions());
    for (std::ptrdiff_t at = 0; at < invented.View().Size(); ++at) {
      invented.View()[at] = labels_.View()[at] == static_cast<Byte>(EmbeddedVoxel::Invented);
      seen.View()[at] = labels_.View()[at] == static_cast<Byte>(EmbeddedVoxel::Data);
    }
    const auto grain = [this](const Volume<Byte>& where) {
      const NoiseMatch match =
          MatchNoise<Byte>({values_.View(), where.View(), grid_.geometry}, form_.geometry, form_.probeToWorld);
      return GrainOf(match, form_.geometry);
    };
    try {
      return grain(invented) / grain(seen);
    } catch (const Error&) { // neither speckle nor a ratio
      return std::numeric_limits<double>::quiet_NaN();
    }
  }

  void Time(const char* step, const std::function<void()>& function) { steps_[step] = benchmark::Seconds(function); }

  const Seen& data_;
  PlacedProbe form_;
  EmbedGrid grid_;
  Volume<Byte> values_, region_, labels_, fan_;
  Volume<float> noise_;
  double grainMm_ = 0.0, grains_ = 0.0;
  nlohmann::ordered_json steps_;
};

bool Measure(const std::string& name, const Seen& data)
{
  const auto& n = data.geometry.dimensions;
  const std::string testCase = name + ", " + std::to_string(n[0]) + " x " + std::to_string(n[1]) + " x " + std::to_string(n[2]);
  bool untouched = true;
  for (const double featherMm : {0.0, 3.0}) {
    Embedding embedding(data);
    embedding.MakeNoise(false);
    embedding.Overlay(featherMm);
    untouched = embedding.Report(testCase, featherMm == 0.0 ? "naive" : "feather", featherMm) && untouched;
  }
  for (const bool full : {false, true}) {
    Embedding embedding(data);
    embedding.MakeNoise(full);
    EmbedParameters parameters;
    parameters.matchContrast = parameters.keepTexture = full;
    parameters.featherMm = full ? embedding.FeatherMm() : 3.0;
    embedding.Embed(parameters);
    untouched = embedding.Report(testCase, full ? "full" : "dissertation", parameters.featherMm) && untouched;
  }
  return untouched;
}

} // namespace

int main(int argc, char** argv)
{
  const std::vector<std::string> words(argv + 1, argv + argc);
  const auto wanted = [&words](const std::string& name) {
    return words.empty() || std::any_of(words.begin(), words.end(),
                                        [&name](const std::string& word) { return name.find(word) != std::string::npos; });
  };
  bool untouched = true;
  if (wanted("phantom, 3 views"))
    untouched = Measure("phantom, 3 views", Phantom()) && untouched;
  if (wanted("linear, 3 views in water"))
    untouched = Measure("linear, 3 views in water", Tank()) && untouched;
  if (wanted("liver A + B")) {
    const std::filesystem::path folder = std::filesystem::path(ECHORAMA_SOURCE_DIR) / "../shared/data/liver";
    if (std::filesystem::exists(folder / "liver_volume_A.mha"))
      untouched = Measure("liver A + B", Liver(folder)) && untouched;
    else
      std::cerr << "no liver volumes beside the project: that case is left out\n";
  }
  return untouched ? 0 : 1;
}
