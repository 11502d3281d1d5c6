// SPDX-License-Identifier: BSD-3-Clause
// echorama stitch: many volumes become one.
#include "Commands.h"
#include "Outputs.h"
#include "Readers/ImageHeader.h"
#include "Volumes.h"
#include <CLI/Validators.hpp>
#include <memory>
#include <vtkDataArray.h>
#include <vtkFieldData.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkUltrasoundReliabilityMap.h>
#include <vtkUltrasoundStitcher.h>
#include <vtkUltrasoundVolume.h>

namespace echorama {
namespace {

struct StitchOptions {
  std::vector<std::string> files;
  std::string output, poses, method = vtkUltrasoundStitcher::GetMethodName(vtkUltrasoundStitcher::DISTANCE);
  double sharpness = StitchParameters().sharpness, spacingMm = 0.0, memoryGb = StitchParameters().maximumMemoryGb;
  bool allowDisjoint = StitchParameters().allowDisjoint, reliability = false;
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

std::vector<std::string> MethodNames()
{
  std::vector<std::string> names;
  while (const char* name = vtkUltrasoundStitcher::GetMethodName(static_cast<int>(names.size())))
    names.emplace_back(name);
  return names;
}

void Stitch(Session& session, StitchOptions options)
{
  options.files = WithoutCompanions(session, options.files);
  std::vector<std::string> inputs = options.files;
  if (!options.poses.empty())
    inputs.push_back(options.poses);
  CheckVolumeOutput(options.output, inputs);
  std::vector<LoadedVolume> volumes = LoadVolumes(session, options.files);
  ApplyPoses(volumes, options.poses);
  if (options.reliability)
    AddReliability(session, volumes);

  vtkNew<vtkUltrasoundStitcher> stitcher;
  stitcher->SetInputDataObject(BlocksOf(volumes));
  stitcher->SetMethod(vtkUltrasoundStitcher::GetMethodFromName(options.method.c_str()));
  stitcher->SetSharpness(options.sharpness);
  stitcher->SetSpacingMm(options.spacingMm);
  stitcher->SetAllowDisjoint(options.allowDisjoint);
  stitcher->SetMaximumMemoryGb(options.memoryGb);
  session.Update(stitcher, "stitch");
  vtkImageData* stitched = stitcher->GetOutput();

  std::ptrdiff_t valid = 0, shared = 0;
  vtkDataArray* coverage = stitched->GetPointData()->GetArray(vtkUltrasoundStitcher::CoverageName());
  for (const unsigned char count : vtkUltrasoundVolume::ViewOf<const unsigned char>(coverage, stitched)) {
    valid += count > 0;
    shared += count > 1;
  }
  // Formats that hold one array would only complain about what was not asked for.
  if (FormatOfName(options.output) != FileFormat::VtkXmlImage) {
    stitched->GetPointData()->RemoveArray(vtkUltrasoundStitcher::CoverageName());
    stitched->GetFieldData()->RemoveArray(vtkUltrasoundStitcher::StitchedVolumesName());
  }
  SaveVolume(session, stitched, options.output);

  const ImageGeometry geometry = vtkUltrasoundVolume::GeometryOf(stitched);
  session.result["files"] = options.files;
  session.result["output"] = options.output;
  session.result["method"] = options.method;
  session.result["sharpness"] = options.sharpness;
  session.result["dimensions"] = geometry.dimensions;
  session.result["spacing"] = JsonOf(geometry.spacing);
  session.result["origin"] = JsonOf(geometry.origin);
  session.result["valid_voxels"] = valid;
  session.result["overlap_fraction"] = valid ? static_cast<double>(shared) / static_cast<double>(valid) : 0.0;
  session.Say("wrote " + options.output + ": " + std::to_string(options.files.size()) + " volumes, " +
              std::to_string(geometry.dimensions[0]) + " x " + std::to_string(geometry.dimensions[1]) + " x " +
              std::to_string(geometry.dimensions[2]) + " voxels of " + Triple(geometry.spacing, " x ", 3) + " mm");
  session.Say("  " + Fixed(valid ? 100.0 * static_cast<double>(shared) / static_cast<double>(valid) : 0.0, 1) +
              "% of the real voxels are seen by two volumes or more");
}

} // namespace

Command StitchCommand(CLI::App& program)
{
  auto values = std::make_shared<StitchOptions>();
  CLI::App* options = program.add_subcommand("stitch", "Blend overlapping volumes into one");
  options->add_option("volume", values->files, "Two or more volumes")->required();
  options->add_option("-o,--output", values->output, "File to write; its extension names the format")->required();
  options->add_option("--poses", values->poses, "Pose file that says where the volumes belong (default: where they say)");
  options->add_option("--method", values->method, "How overlaps are blended")
      ->check(CLI::IsMember(MethodNames()))
      ->capture_default_str();
  options->add_option("--sharpness", values->sharpness, "Exponent b of the weights (method distance): 0 is the plain average")
      ->check(CLI::Range(0.0, 1000.0))
      ->capture_default_str();
  options->add_option("--spacing", values->spacingMm, "Edge of the voxels in mm (0: the smallest of the volumes)")
      ->check(CLI::Range(0.0, 1000.0))
      ->capture_default_str();
  options->add_flag("--reliability", values->reliability,
                    "Find shadows and saturated areas first, and weigh voxels by how far they can be trusted");
  options->add_flag("--allow-disjoint", values->allowDisjoint, "Accept volumes that overlap no other");
  options
      ->add_option("--memory", values->memoryGb,
                   "Refuse what needs more memory than this, GB (0: three quarters of the machine's)")
      ->check(CLI::Range(0.0, 1e6))
      ->capture_default_str();
  return {options, [values](Session& session) { Stitch(session, *values); }};
}

} // namespace echorama
