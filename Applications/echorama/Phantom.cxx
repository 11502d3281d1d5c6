// SPDX-License-Identifier: BSD-3-Clause
// echorama phantom: volumes of an invented body, knocked out of place by a known amount.
//
// The first volume stays where it is, so that poses found with it held fixed lie in the frame of the truth.
#include "Commands.h"
#include "Core/Geometry/PoseFile.h"
#include "Filters/Registration/ValidPoints.h"
#include "Filters/Synthesis/PhantomViews.h"
#include "Outputs.h"
#include "Volumes.h"
#include <CLI/Validators.hpp>
#include <filesystem>
#include <memory>
#include <vtkNew.h>
#include <vtkUltrasoundAcquisition.h>
#include <vtkUltrasoundPhantomSource.h>
#include <vtkUltrasoundVolume.h>

namespace echorama {
namespace {

struct PhantomOptions {
  std::string folder, format = "mha";
  int count = 3;
  std::uint64_t seed = 1;
  double spacingMm = 1.0, overlap = 0.55, knockMm = 8.0, knockDegrees = 6.0;
};

Eigen::Vector3d CentroidOf(vtkImageData* image)
{
  std::ptrdiff_t count = 0;
  Eigen::Vector3d index = Eigen::Vector3d::Zero();
  vtkDataArray* intensity = vtkUltrasoundVolume::GetIntensity(image);
  vtkUltrasoundVolume::Dispatch(intensity, [&](auto type) {
    using T = decltype(type);
    index = ValidCentroid<T>(vtkUltrasoundVolume::ViewOf<const T>(intensity, image),
                             vtkUltrasoundVolume::ViewOf<const unsigned char>(vtkUltrasoundVolume::GetValidRegion(image), image),
                             count);
  });
  return vtkUltrasoundVolume::GeometryOf(image).IndexToWorld() * index;
}

void Phantom(Session& session, const PhantomOptions& options)
{
  vtkNew<vtkUltrasoundPhantomSource> source;
  source->SetSeed(static_cast<vtkTypeInt64>(options.seed));
  source->SetSpacingMm(options.spacingMm);
  const std::vector<PhantomView> views = PhantomViews(source->Parameters().probe, options.count, options.overlap);

  OutputFolder folder(session, options.folder, {});
  const std::string truthName = "truth.json", truthFile = folder.Stage(truthName);
  std::vector<VolumePose> truth;
  session.result["folder"] = options.folder;
  session.result["knock"] = {{"mm", options.knockMm}, {"degrees", options.knockDegrees}};
  session.result["truth"] = folder.Final(truthName);
  session.result["volumes"] = nlohmann::ordered_json::array();
  for (std::size_t i = 0; i < views.size(); ++i) {
    const std::string name = "volume_" + std::to_string(i + 1) + "." + options.format;
    source->SetView(views[i].probeToWorld, views[i].gainDb);
    session.Update(source, "make", name);
    vtkNew<vtkImageData> image;
    image->ShallowCopy(source->GetOutput());
    const Pose knock =
        i == 0 ? Pose::Identity() : KnockedPose(options.seed, i, options.knockMm, options.knockDegrees, CentroidOf(image));
    vtkUltrasoundVolume::Move(image, knock);
    const std::string file = folder.Stage(name);
    SaveVolume(session, image, file);
    truth.push_back({file, vtkUltrasoundVolume::GeometryOf(image), knock.inverse()});
    session.result["volumes"].push_back(
        {{"file", folder.Final(name)}, {"gain_db", views[i].gainDb}, {"VolumeToWorld", JsonOf(knock.inverse())}});
    session.Say("wrote " + folder.Final(name));
  }
  WritePoses(truthFile, truth); // relative to the folder, so they stay right when it gets its place
  folder.Commit();
  session.Say("wrote " + folder.Final(truthName) + ": the poses that put the volumes back, all but the first by " +
              Fixed(options.knockMm, 1) + " mm and " + Fixed(options.knockDegrees, 1) + " degrees");
}

} // namespace

Command PhantomCommand(CLI::App& program)
{
  auto values = std::make_shared<PhantomOptions>();
  CLI::App* options =
      program.add_subcommand("phantom", "Make overlapping volumes of an invented body, out of place by a known amount");
  options->add_option("-o,--output", values->folder, "Folder for the volumes and truth.json, the poses that put them back")
      ->required();
  options->add_option("--count", values->count, "How many volumes")->check(CLI::Range(1, 50))->capture_default_str();
  options->add_option("--seed", values->seed, "Seed of tissue and displacements")
      ->check(CLI::Range(std::uint64_t{0}, std::uint64_t{1} << 62))
      ->capture_default_str();
  options->add_option("--spacing", values->spacingMm, "Edge of the voxels, mm")
      ->check(CLI::Range(0.05, 20.0))
      ->capture_default_str();
  options->add_option("--overlap", values->overlap, "Part that neighbours share")
      ->check(CLI::Range(0.05, 0.95))
      ->capture_default_str();
  options->add_option("--knock-mm", values->knockMm, "How far each volume but the first is moved, mm")
      ->check(CLI::Range(0.0, 1000.0))
      ->capture_default_str();
  options
      ->add_option("--knock-degrees", values->knockDegrees, "How far it is turned about the centre of its valid region, degrees")
      ->check(CLI::Range(0.0, 180.0))
      ->capture_default_str();
  options->add_option("--format", values->format, "File format")
      ->check(CLI::IsMember({"mha", "mhd", "nrrd", "nhdr", "vti"}))
      ->capture_default_str();
  return {options, [values](Session& session) { Phantom(session, *values); }};
}

} // namespace echorama
