// SPDX-License-Identifier: BSD-3-Clause
// Embedding, end to end: a fan is put around a stitched volume, noise is made in it, and the data are laid over it. Time of each
// step, and what became of the border (MeasureEmbedding), for
//   naive         the data on noise as it is, with a hard edge
//   feather       the same with a soft edge
//   dissertation  noise with the local mean of the data (I' = T D), and a soft edge of plain means
//   full          noise with the grain of the data and their local mean and contrast, and an edge that keeps texture
// The error is the seam's jump (95 % of the border jump no more), to be held against the limit beside it. The first three share
// noise of one machine's defaults. Ends with status 1 when any voxel of the data beyond the feather is not that of the input.
// Arguments: [word of a case's name]...; without words all cases.
#include "Core/Base/Parallel.h"
#include "Core/Geometry/EnclosingFan.h"
#include "Core/Imaging/BorderZeros.h"
#include "Core/Imaging/ScanConversion.h"
#include "Filters/Embedding/BeamNoise.h"
#include "Filters/Embedding/Embed.h"
#include "Filters/Embedding/EmbedGrid.h"
#include "Filters/Embedding/EmbedQuality.h"
#include "Filters/Embedding/NoiseMatch.h"
#include "Filters/Phantoms/Phantom.h"
#include "Filters/Phantoms/PhantomViews.h"
#include "Filters/Stitching/Stitch.h"
#include "Filters/Stitching/StitchGrid.h"
#include "Readers/ImageHeader.h"
#include "Readers/VolumeFile.h"
#include "Testing/Benchmark.h"
#include <cmath>
#include <filesystem>
#include <functional>

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

// The steps of one embedding and their seconds.
class Embedding {
public:
  explicit Embedding(const Seen& data) : data_(data)
  {
    Time("fan", [&] {
      EnclosingFanParameters parameters;
      parameters.marginMm = 5.0;
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
        const NoiseMatch found = MatchNoise(data_.Posed(), form_.geometry, form_.probeToWorld);
        parameters = NoiseLike(found, form_.geometry, form_.geometry);
      });
    Volume<float> beams;
    Time("noise", [&] { beams = MakeBeamNoise(parameters, form_.geometry); });
    Time("scan", [&] {
      noise_ = Volume<float>(grid_.geometry.dimensions);
      fan_ = Volume<Byte>(grid_.geometry.dimensions);
      ScanConvert<float>(beams.View(), form_.geometry, form_.probeToWorld, grid_.geometry, noise_.View(), fan_.View());
    });
  }

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
    benchmark::Report("embed", testCase, method, seconds, q.border.percentile95, "grey",
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
  void Time(const char* step, const std::function<void()>& function) { steps_[step] = benchmark::Seconds(function); }

  const Seen& data_;
  PlacedProbe form_;
  EmbedGrid grid_;
  Volume<Byte> values_, region_, labels_, fan_;
  Volume<float> noise_;
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
  if (wanted("liver A + B")) {
    const std::filesystem::path folder = std::filesystem::path(ECHORAMA_SOURCE_DIR) / "../shared/data/liver";
    if (std::filesystem::exists(folder / "liver_volume_A.mha"))
      untouched = Measure("liver A + B", Liver(folder)) && untouched;
    else
      std::cerr << "no liver volumes beside the project: that case is left out\n";
  }
  return untouched ? 0 : 1;
}
