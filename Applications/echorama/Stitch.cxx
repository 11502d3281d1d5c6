// SPDX-License-Identifier: BSD-3-Clause
// echorama stitch: many volumes become one. What fits into the allowed memory is made whole; larger results are made and written
// slab by slab.
#include "Commands.h"
#include "Core/Base/FormatText.h"
#include "Core/Base/Memory.h"
#include "Displacements.h"
#include "Filters/Stitching/StitchJson.h"
#include "ParameterOptions.h"
#include "Readers/ImageHeader.h"
#include "Readers/OutputFiles.h"
#include "Volumes.h"
#include <cmath>
#include <memory>
#include <optional>
#include <vtkDataArray.h>
#include <vtkFieldData.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkSmartPointer.h>
#include <vtkUltrasoundReliabilityMap.h>
#include <vtkUltrasoundStitcher.h>
#include <vtkUltrasoundStitchQuality.h>
#include <vtkUltrasoundVolume.h>

namespace echorama {
namespace {

struct StitchOptions {
  std::vector<std::string> files;
  std::string output, poses;
  bool reliability = false, quality = false, dryRun = false;
};

// Gives every volume its map of what can be trusted, and tells how much cannot.
void AddReliability(Session& session, std::vector<LoadedVolume>& volumes)
{
  for (LoadedVolume& volume : volumes) {
    vtkNew<vtkUltrasoundReliabilityMap> map;
    map->SetInputData(volume.image);
    session.Update(map, "reliability", volume.file);
    volume.image = map->GetOutput();
    const std::vector<std::string> notes = LinesOf(map->GetNote());
    for (std::size_t i = 1; i < notes.size(); ++i) // the first says where the beams are from
      session.Note(volume.file + ": " + notes[i]);
    session.result["reliability"].push_back({{"file", volume.file},
                                             {"shadow_fraction", map->GetShadowFraction()},
                                             {"saturated_fraction", map->GetSaturatedFraction()},
                                             {"note", notes.front()}});
    session.Say(volume.file + ": " + Fixed(100.0 * map->GetShadowFraction(), 1) + "% in shadow, " +
                Fixed(100.0 * map->GetSaturatedFraction(), 1) + "% saturated");
  }
}

std::string VoxelsText(const ImageGeometry& grid)
{
  return SizeText(grid.dimensions) + " voxels of " + Triple(grid.spacing, " x ", 3) + " mm";
}

void TellCost(Session& session, const StitchCost& cost, const std::string& output)
{
  session.Say(VoxelsText(cost.grid));
  session.Say("  the result needs " + GigabytesText(cost.outputBytes) + ", what is known of the overlaps " +
              GigabytesText(cost.planBytes) +
              (cost.planFactor > 1 ? " (on a grid that is " + std::to_string(cost.planFactor) + " times coarser)" : "") +
              "; allowed are " + GigabytesText(cost.allowedBytes) + " beside the volumes");
  session.Say(cost.slabs == 0   ? "  that does not fit"
              : cost.slabs == 1 ? "  that fits as a whole"
              : IsWrittenBySlabs(output)
                  ? "  it will be made and written in " + std::to_string(cost.slabs) + " slabs"
                  : "  it fits in " + std::to_string(cost.slabs) + " slabs, but " + output + " would have to be written whole");
}

// What is counted in the result, and what of it is written.
class Pieces {
public:
  Pieces(const std::string& output, bool keepsCoverage) : output_(output), keepsCoverage_(keepsCoverage) {}

  /// Takes a piece of the result as the stitcher made it.
  void Take(vtkImageData* piece)
  {
    vtkDataArray* coverage = piece->GetPointData()->GetArray(vtkUltrasoundStitcher::CoverageName());
    if (!coverage)
      return; // the stitcher failed, or this piece was seen before
    for (const unsigned char count : vtkUltrasoundVolume::ViewOf<const unsigned char>(coverage, piece)) {
      valid_ += count > 0;
      shared_ += count > 1;
    }
    if (FormatOfName(output_) == FileFormat::VtkXmlImage)
      return; // it holds all
    // Other formats would only complain about what was not asked for.
    if (!keepsCoverage_)
      piece->GetPointData()->RemoveArray(vtkUltrasoundStitcher::CoverageName());
    piece->GetFieldData()->RemoveArray(vtkUltrasoundStitcher::StitchedVolumesName());
  }
  std::ptrdiff_t Valid() const { return valid_; }
  double OverlapFraction() const { return valid_ ? static_cast<double>(shared_) / static_cast<double>(valid_) : 0.0; }

private:
  const std::string output_;
  const bool keepsCoverage_;
  std::ptrdiff_t valid_ = 0, shared_ = 0;
};

StitchQualityReport QualityOf(Session& session, vtkImageData* stitched, const std::vector<LoadedVolume>& volumes)
{
  vtkNew<vtkUltrasoundStitchQuality> quality;
  quality->SetInputData(stitched);
  quality->AddSourceData(BlocksOf(volumes));
  session.Update(quality, "quality");
  return quality->Measured();
}

// How visible the seams are, and how much texture was kept.
void TellQuality(Session& session, const StitchQualityReport& report)
{
  session.result["quality"] = ToJson(report);
  const auto text = [](double number) { return std::isfinite(number) ? Fixed(number, 2) : std::string("not measurable"); };
  session.Say("  seams: " + text(report.seamMean) + " in the mean, " + text(report.seamGradient) +
              " in the gradient (1: as within single volumes); texture kept in overlaps: " + text(report.textureKept));
}

void Stitch(Session& session, StitchOptions options, vtkUltrasoundStitcher* stitcher)
{
  options.files = WithoutCompanions(session, options.files);
  std::vector<std::string> inputs = options.files;
  if (!options.poses.empty())
    inputs.push_back(options.poses);
  CheckVolumeOutput(options.output, inputs);
  std::vector<LoadedVolume> volumes = LoadVolumes(session, options.files);
  ApplyPoses(session, volumes, options.poses);
  if (options.reliability)
    AddReliability(session, volumes);

  stitcher->SetInputDataObject(BlocksOf(volumes));
  if (const auto displacements = DisplacementsOf(session, volumes, options.poses)) {
    stitcher->AddDisplacementData(displacements);
    session.Note("volumes are read through the displacements that " + options.poses + " names");
  }
  session.result["files"] = options.files;
  session.result["output"] = options.output;
  session.result["method"] = stitcher->GetMethodAsString();
  session.result["texture"] = stitcher->GetTextureAsString();
  session.result["sharpness"] = stitcher->GetSharpness();
  std::optional<StitchCost> known;
  session.Watch(stitcher, "plan", {}, [&] { known = stitcher->Cost(); });
  const StitchCost cost = known.value();
  session.result.update(ToJson(cost));
  if (options.dryRun) {
    TellCost(session, cost, options.output);
    return;
  }

  Pieces pieces(options.output, stitcher->GetOutputSpread());
  std::optional<StitchQualityReport> quality;
  const int slabs = cost.slabs;
  if (slabs > 1 && IsWrittenBySlabs(options.output)) {
    session.Note("the result is larger than the memory that is allowed: it is made and written in " + std::to_string(slabs) +
                 " slabs");
    WriteBySlabs(session, stitcher, slabs, options.output, "stitch", [&](vtkImageData* piece) { pieces.Take(piece); });
    if (options.quality)
      session.Note("--quality: it needs the whole result in memory, and is left out");
  } else {
    if (slabs > 1)
      throw Error(Error::Kind::TooLarge, options.output + ": the result needs " + GigabytesText(cost.outputBytes) +
                                             " beside what is known of the overlaps, and " + GigabytesText(cost.allowedBytes) +
                                             " are allowed (--memory). Its format is written whole; as .mha, .nrrd or .nii it "
                                             "would be made in " +
                                             std::to_string(slabs) + " slabs");
    session.Update(stitcher, "stitch"); // or be told why it does not fit
    vtkImageData* stitched = stitcher->GetOutput();
    pieces.Take(stitched);
    if (options.quality) // before anything is written, so that who stops it keeps what was there
      quality = QualityOf(session, stitched, volumes);
    SaveVolume(session, stitched, options.output);
  }

  const bool equalized = stitcher->GetEqualizeGain();
  session.result["origin"] = JsonOf(cost.grid.origin);
  session.result["valid_voxels"] = pieces.Valid();
  session.result["overlap_fraction"] = pieces.OverlapFraction();
  for (int volume = 0; equalized && volume < static_cast<int>(volumes.size()); ++volume)
    session.result["gains"].push_back({{"gain", stitcher->GetGain(volume)}, {"offset", stitcher->GetOffset(volume)}});
  session.Say("wrote " + options.output + ": " + std::to_string(options.files.size()) + " volumes, " + VoxelsText(cost.grid));
  session.Say("  " + Fixed(100.0 * pieces.OverlapFraction(), 1) + "% of the real voxels are seen by two volumes or more");
  for (int volume = 0; equalized && volume < static_cast<int>(volumes.size()); ++volume)
    session.Say("  " + options.files[static_cast<std::size_t>(volume)] + ": values times " + Fixed(stitcher->GetGain(volume), 3) +
                ", plus " + Fixed(stitcher->GetOffset(volume), 2));
  if (quality)
    TellQuality(session, *quality);
}

} // namespace

void EchoramaCommand(CLI::App* options, Action& action)
{
  auto values = std::make_shared<StitchOptions>();
  const auto stitcher = vtkSmartPointer<vtkUltrasoundStitcher>::New();
  options->add_option("volume", values->files, "Two or more volumes")->type_name("VOLUME")->required();
  options->add_option("-o,--output", values->output, "File to write; its extension names the format")
      ->type_name("VOLUME")
      ->required();
  options
      ->add_option("--poses", values->poses,
                   "Pose file that says where the volumes belong, and how they are bent (default: where they say)")
      ->type_name("FILE");
  AddParameters(options, stitcher, {"Method", "Texture", "Sharpness", "DetailSharpness", "DetailScale"});
  AddParameter(options, stitcher, "EqualizeGain", "--gain");
  AddParameter(options, stitcher, "SpacingMm", "--spacing");
  options->add_flag("--reliability", values->reliability,
                    "Find shadows and saturated areas first, and weigh voxels by how far they can be trusted");
  AddParameter(options, stitcher, "OutputSpread", "--uncertainty")
      ->description("Also write how many volumes see each voxel, and how far they disagree (NAME.Coverage, NAME.Spread)");
  options->add_flag("--quality", values->quality, "Measure how visible the seams are, and how much texture was kept");
  AddParameter(options, stitcher, "AllowDisjoint");
  AddParameter(options, stitcher, "MaximumMemoryGb", "--memory")
      ->description("Memory beside the volumes, GB (0: three quarters of the machine's); a larger result is made slab by slab");
  options->add_flag("--dry-run", values->dryRun, "Tell the size of the result and the memory that it needs, and write nothing");
  action = [values, stitcher](Session& session) { Stitch(session, *values, stitcher); };
}

} // namespace echorama
