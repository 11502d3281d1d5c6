// SPDX-License-Identifier: BSD-3-Clause
// echorama stitch: many volumes become one. What fits into the allowed memory is made whole; larger results are made and written
// slab by slab.
#include "Commands.h"
#include "Readers/ImageHeader.h"
#include "Readers/OutputFiles.h"
#include "Volumes.h"
#include <CLI/Validators.hpp>
#include <memory>
#include <vtkCallbackCommand.h>
#include <vtkCommand.h>
#include <vtkDataArray.h>
#include <vtkFieldData.h>
#include <vtkInformation.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkUltrasoundReliabilityMap.h>
#include <vtkUltrasoundStitcher.h>
#include <vtkUltrasoundStitchQuality.h>
#include <vtkUltrasoundVolume.h>
#include <vtkUltrasoundWriter.h>

namespace echorama {
namespace {

struct StitchOptions {
  std::vector<std::string> files;
  std::string output, poses;
  std::string method = vtkUltrasoundStitcher::GetMethodName(static_cast<int>(StitchParameters().method)),
              texture = vtkUltrasoundStitcher::GetTextureName(static_cast<int>(StitchParameters().texture));
  double sharpness = StitchParameters().sharpness, detailSharpness = StitchParameters().detailSharpness,
         detailScale = StitchParameters().detailScale, spacingMm = 0.0, memoryGb = StitchParameters().maximumMemoryGb;
  bool gain = StitchParameters().equalizeGain, allowDisjoint = StitchParameters().allowDisjoint, reliability = false,
       uncertainty = false, quality = false, dryRun = false;
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

std::vector<std::string> NamesFrom(const char* (*nameOf)(int))
{
  std::vector<std::string> names;
  while (const char* name = nameOf(static_cast<int>(names.size())))
    names.emplace_back(name);
  return names;
}

std::string Gigabytes(double bytes)
{
  return Fixed(bytes * 1e-9, bytes < 1e9 ? 3 : 1) + " GB";
}

bool IsWrittenBySlabs(const std::string& path)
{
  const FileFormat format = FormatOfName(path);
  return format == FileFormat::MetaImage || format == FileFormat::Nrrd || format == FileFormat::Nifti;
}

std::string VoxelsText(const std::array<int, 3>& size, const Eigen::Vector3d& spacing)
{
  return std::to_string(size[0]) + " x " + std::to_string(size[1]) + " x " + std::to_string(size[2]) + " voxels of " +
         Triple(spacing, " x ", 3) + " mm";
}

// What the stitching costs; also among the results.
nlohmann::ordered_json Cost(Session& session, vtkUltrasoundStitcher* stitcher)
{
  std::string report;
  session.Watch(stitcher, "plan", {}, [&] { report = stitcher->EstimateCost(); });
  nlohmann::ordered_json cost = nlohmann::ordered_json::parse(report);
  for (const char* key : {"plan_factor", "plan_bytes", "output_bytes", "allowed_bytes", "slabs"})
    session.result[key] = cost[key];
  return cost;
}

void TellCost(Session& session, const nlohmann::ordered_json& cost, const std::string& output)
{
  const double plan = cost["plan_bytes"], whole = cost["output_bytes"], allowed = cost["allowed_bytes"];
  const int factor = cost["plan_factor"], slabs = cost["slabs"];
  const std::array<double, 3> spacing = cost["spacing"];
  session.result["dimensions"] = cost["dimensions"];
  session.result["spacing"] = spacing;
  session.Say(VoxelsText(cost["dimensions"], Eigen::Vector3d(spacing.data())));
  session.Say("  the result needs " + Gigabytes(whole) + ", what is known of the overlaps " + Gigabytes(plan) +
              (factor > 1 ? " (on a grid that is " + std::to_string(factor) + " times coarser)" : "") + "; allowed are " +
              Gigabytes(allowed) + " beside the volumes");
  session.Say(slabs == 0   ? "  that does not fit"
              : slabs == 1 ? "  that fits as a whole"
              : IsWrittenBySlabs(output)
                  ? "  it will be made and written in " + std::to_string(slabs) + " slabs"
                  : "  it fits in " + std::to_string(slabs) + " slabs, but " + output + " would have to be written whole");
}

// What is counted in the result, and what of it is written.
class Pieces {
public:
  Pieces(const StitchOptions& options) : options_(options) {}

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
    if (FormatOfName(options_.output) == FileFormat::VtkXmlImage)
      return; // it holds all
    // Other formats would only complain about what was not asked for.
    if (!options_.uncertainty)
      piece->GetPointData()->RemoveArray(vtkUltrasoundStitcher::CoverageName());
    piece->GetFieldData()->RemoveArray(vtkUltrasoundStitcher::StitchedVolumesName());
  }
  std::ptrdiff_t Valid() const { return valid_; }
  double OverlapFraction() const { return valid_ ? static_cast<double>(shared_) / static_cast<double>(valid_) : 0.0; }

private:
  const StitchOptions& options_;
  std::ptrdiff_t valid_ = 0, shared_ = 0;
};

void WriteBySlabs(Session& session, vtkUltrasoundStitcher* stitcher, int slabs, const std::string& path, Pieces& pieces)
{
  vtkNew<vtkCallbackCommand> made;
  const std::function<void()> take = [&] { pieces.Take(stitcher->GetOutput()); };
  made->SetClientData(const_cast<void*>(static_cast<const void*>(&take)));
  made->SetCallback(
      [](vtkObject*, unsigned long, void* function, void*) { (*static_cast<const std::function<void()>*>(function))(); });
  const unsigned long tag = stitcher->AddObserver(vtkCommand::EndEvent, made);
  vtkNew<vtkUltrasoundWriter> writer;
  writer->SetFileName(path.c_str());
  writer->SetInputConnection(stitcher->GetOutputPort());
  writer->SetNumberOfSlabs(slabs);
  bool written = false;
  session.Watch(writer, "stitch", {}, [&] { written = writer->Write() != 0; });
  stitcher->RemoveObserver(tag);
  if (!written)
    throw Error(Error::Kind::FileSystem, path + ": it cannot be written");
}

// How visible the seams are, and how much texture was kept.
void TellQuality(Session& session, vtkImageData* stitched, const std::vector<LoadedVolume>& volumes)
{
  vtkNew<vtkUltrasoundStitchQuality> quality;
  quality->SetInputData(stitched);
  quality->AddSourceData(BlocksOf(volumes));
  session.Update(quality, "quality");
  const nlohmann::ordered_json report = nlohmann::ordered_json::parse(quality->GetReport());
  session.result["quality"] = report;
  const auto number = [&report](const char* key) {
    return report[key].is_number() ? Fixed(report[key], 2) : std::string("not measurable");
  };
  session.Say("  seams: " + number("seam_mean") + " in the mean, " + number("seam_gradient") +
              " in the gradient (1: as within single volumes); texture kept in overlaps: " + number("texture_kept"));
}

void Stitch(Session& session, StitchOptions options)
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

  vtkNew<vtkUltrasoundStitcher> stitcher;
  stitcher->SetInputDataObject(BlocksOf(volumes));
  stitcher->SetMethod(vtkUltrasoundStitcher::GetMethodFromName(options.method.c_str()));
  stitcher->SetTexture(vtkUltrasoundStitcher::GetTextureFromName(options.texture.c_str()));
  stitcher->SetSharpness(options.sharpness);
  stitcher->SetDetailSharpness(options.detailSharpness);
  stitcher->SetDetailScale(options.detailScale);
  stitcher->SetEqualizeGain(options.gain);
  stitcher->SetSpacingMm(options.spacingMm);
  stitcher->SetAllowDisjoint(options.allowDisjoint);
  stitcher->SetOutputSpread(options.uncertainty);
  stitcher->SetMaximumMemoryGb(options.memoryGb);
  session.result["files"] = options.files;
  session.result["output"] = options.output;
  session.result["method"] = options.method;
  session.result["texture"] = options.texture;
  session.result["sharpness"] = options.sharpness;
  const nlohmann::ordered_json cost = Cost(session, stitcher);
  if (options.dryRun) {
    TellCost(session, cost, options.output);
    return;
  }

  Pieces pieces(options);
  const int slabs = cost["slabs"];
  if (slabs > 1 && IsWrittenBySlabs(options.output)) {
    session.Note("the result is larger than the memory that is allowed: it is made and written in " + std::to_string(slabs) +
                 " slabs");
    WriteBySlabs(session, stitcher, slabs, options.output, pieces);
    if (options.quality)
      session.Note("--quality: it needs the whole result in memory, and is left out");
  } else {
    if (slabs > 1)
      throw Error(Error::Kind::TooLarge, options.output + ": the result needs " + Gigabytes(cost["output_bytes"]) +
                                             " beside what is known of the overlaps, and " + Gigabytes(cost["allowed_bytes"]) +
                                             " are allowed (--memory). Its format is written whole; as .mha, .nrrd or .nii it "
                                             "would be made in " +
                                             std::to_string(slabs) + " slabs");
    session.Update(stitcher, "stitch"); // or be told why it does not fit
    vtkImageData* stitched = stitcher->GetOutput();
    pieces.Take(stitched);
    SaveVolume(session, stitched, options.output);
  }

  Eigen::Vector3d origin, spacing;
  stitcher->GetOutputInformation(0)->Get(vtkDataObject::ORIGIN(), origin.data());
  stitcher->GetOutputInformation(0)->Get(vtkDataObject::SPACING(), spacing.data());
  session.result["dimensions"] = cost["dimensions"];
  session.result["spacing"] = JsonOf(spacing);
  session.result["origin"] = JsonOf(origin);
  session.result["valid_voxels"] = pieces.Valid();
  session.result["overlap_fraction"] = pieces.OverlapFraction();
  for (int volume = 0; options.gain && volume < static_cast<int>(volumes.size()); ++volume)
    session.result["gains"].push_back({{"gain", stitcher->GetGain(volume)}, {"offset", stitcher->GetOffset(volume)}});
  session.Say("wrote " + options.output + ": " + std::to_string(options.files.size()) + " volumes, " +
              VoxelsText(cost["dimensions"], spacing));
  session.Say("  " + Fixed(100.0 * pieces.OverlapFraction(), 1) + "% of the real voxels are seen by two volumes or more");
  for (int volume = 0; options.gain && volume < static_cast<int>(volumes.size()); ++volume)
    session.Say("  " + options.files[static_cast<std::size_t>(volume)] + ": values times " + Fixed(stitcher->GetGain(volume), 3) +
                ", plus " + Fixed(stitcher->GetOffset(volume), 2));
  if (options.quality && slabs <= 1)
    TellQuality(session, stitcher->GetOutput(), volumes);
}

} // namespace

Command StitchCommand(CLI::App& program)
{
  auto values = std::make_shared<StitchOptions>();
  CLI::App* options = program.add_subcommand("stitch", "Blend overlapping volumes into one");
  options->add_option("volume", values->files, "Two or more volumes")->required();
  options->add_option("-o,--output", values->output, "File to write; its extension names the format")->required();
  options->add_option("--poses", values->poses, "Pose file that says where the volumes belong (default: where they say)");
  options->add_option("--method", values->method, "What decides how much each volume counts in overlaps")
      ->check(CLI::IsMember(NamesFrom(vtkUltrasoundStitcher::GetMethodName)))
      ->capture_default_str();
  options
      ->add_option("--texture", values->texture, "What becomes of speckle and edges there (distance, feather and membrane only)")
      ->check(CLI::IsMember(NamesFrom(vtkUltrasoundStitcher::GetTextureName)))
      ->capture_default_str();
  options
      ->add_option("--sharpness", values->sharpness,
                   "Exponent b of the weights (methods distance and membrane): 0 is the plain average")
      ->check(CLI::Range(0.0, 1000.0))
      ->capture_default_str();
  options->add_option("--detail-sharpness", values->detailSharpness, "The same for details (texture split)")
      ->check(CLI::Range(0.0, 1000.0))
      ->capture_default_str();
  options->add_option("--detail-scale", values->detailScale, "What is smaller than this is detail, voxels of the output")
      ->check(CLI::Range(1.0, 100.0))
      ->capture_default_str();
  options->add_flag("--gain", values->gain, "Find a gain and an offset for each volume on the overlaps, and apply them");
  options->add_option("--spacing", values->spacingMm, "Edge of the voxels in mm (0: the smallest of the volumes)")
      ->check(CLI::Range(0.0, 1000.0))
      ->capture_default_str();
  options->add_flag("--reliability", values->reliability,
                    "Find shadows and saturated areas first, and weigh voxels by how far they can be trusted");
  options->add_flag("--uncertainty", values->uncertainty,
                    "Also write how many volumes see each voxel, and how far they disagree (NAME.Coverage, NAME.Spread)");
  options->add_flag("--quality", values->quality, "Measure how visible the seams are, and how much texture was kept");
  options->add_flag("--allow-disjoint", values->allowDisjoint, "Accept volumes that overlap no other");
  options
      ->add_option("--memory", values->memoryGb,
                   "Memory beside the volumes, GB (0: three quarters of the machine's); a larger result is made slab by slab")
      ->check(CLI::Range(0.0, 1e6))
      ->capture_default_str();
  options->add_flag("--dry-run", values->dryRun, "Tell the size of the result and the memory that it needs, and write nothing");
  return {options, [values](Session& session) { Stitch(session, *values); }};
}

} // namespace echorama
