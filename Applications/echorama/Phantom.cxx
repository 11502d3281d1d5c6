// SPDX-License-Identifier: BSD-3-Clause
// echorama phantom: volumes of an invented body, knocked out of place by a known amount.
#include "Commands.h"
#include "Filters/Phantoms/PhantomViews.h"
#include "SyntheticSet.h"
#include <CLI/Validators.hpp>
#include <memory>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkUltrasoundPhantomSource.h>

namespace echorama {
namespace {

struct PhantomOptions {
  std::string folder, format = "mha";
  int count = 3, landmarks = 0;
  std::uint64_t seed = 1;
  double spacingMm = 1.0, overlap = 0.55, knockMm = 8.0, knockDegrees = 6.0;
  double decorrelation = 0.0, deformationMm = 0.0, noiseDb = PhantomParameters::noNoiseDb, ribShare = 0.0;
  bool jets = false;
};

void Phantom(Session& session, const PhantomOptions& options)
{
  vtkNew<vtkUltrasoundPhantomSource> source;
  source->SetSeed(static_cast<vtkTypeInt64>(options.seed));
  source->SetSpacingMm(options.spacingMm);
  const ProbeGeometry probe = source->Parameters().probe;
  const std::vector<PhantomView> views = PhantomViews(probe, options.count, options.overlap);
  std::vector<Pose> poses;
  for (const PhantomView& view : views)
    poses.push_back(view.probeToWorld);
  const std::vector<Landmark> places = SharedPlaces(options.seed, options.landmarks, probe, poses);
  source->SetDecorrelation(options.decorrelation);
  source->SetNoiseDb(options.noiseDb);

  OutputFolder folder(options.folder, {});
  session.ShowAs(folder.StageFolder(), options.folder);
  session.result["folder"] = options.folder;
  SyntheticSet set(session, folder, options.format, {options.knockMm, options.knockDegrees, options.seed});
  for (std::size_t i = 0; i < views.size(); ++i) {
    source->SetView(views[i].probeToWorld, views[i].gainDb);
    source->SetChangeSeed(static_cast<vtkTypeInt64>(i + 1));
    source->SetDeformationMm(i == 0 ? 0.0 : options.deformationMm);
    source->SetRibShare(i == 0 ? 0.0 : options.ribShare);
    source->SetJets(i > 0 && options.jets);
    session.Update(source, "make", "volume_" + std::to_string(i + 1));
    vtkNew<vtkImageData> image;
    image->ShallowCopy(source->GetOutput());
    const PhantomParameters parameters = source->Parameters();
    set.Add(image, {{"gain_db", views[i].gainDb}}, places, [&](const Eigen::Vector3d& place) -> std::optional<Eigen::Vector3d> {
      const Eigen::Vector3d seen = parameters.press.Seen(parameters.probeToWorld.inverse() * place);
      if (!BeamPointAt(parameters.probe, seen))
        return {};
      return parameters.probeToWorld * seen;
    });
  }
  set.WriteTruth();
  folder.Commit();
  session.Say("wrote " + folder.Final("truth.json") + ": the poses that put the volumes back, all but the first by " +
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
  options
      ->add_option("--decorrelation", values->decorrelation, "How far the speckle of each volume has changed by itself, 0 to 1")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  options
      ->add_option("--deformation", values->deformationMm,
                   "How far the probe presses the tissue below its face, mm, in each volume but the first")
      ->check(CLI::Range(0.0, ProbePress::maxMm))
      ->capture_default_str();
  options->add_option("--noise", values->noiseDb, "Power of the receiver's noise beside that of the background, dB; -120: none")
      ->check(CLI::Range(-120.0, 60.0))
      ->capture_default_str();
  options
      ->add_option("--rib", values->ribShare, "Share of the fan in the shadow of a rib, in each volume but the first; 0: no rib")
      ->check(CLI::Range(0.0, 0.6))
      ->capture_default_str();
  options->add_flag("--jets", values->jets, "Bodies that come and go are there in each volume but the first");
  options
      ->add_option("--landmarks", values->landmarks,
                   "How many places that two volumes see are listed for each volume, as landmarks_N.csv")
      ->check(CLI::Range(0, 10000))
      ->capture_default_str();
  options->add_option("--format", values->format, "File format")
      ->check(CLI::IsMember({"mha", "mhd", "nrrd", "nhdr", "vti"}))
      ->capture_default_str();
  return {options, [values](Session& session) { Phantom(session, *values); }};
}

} // namespace echorama
