// SPDX-License-Identifier: BSD-3-Clause
// echorama phantom: volumes of an invented body, knocked out of place by a known amount.
#include "Commands.h"
#include "Filters/Phantoms/PhantomViews.h"
#include "ParameterOptions.h"
#include "SyntheticSet.h"
#include <CLI/Validators.hpp>
#include <memory>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkSmartPointer.h>
#include <vtkUltrasoundPhantomSource.h>
#include <vtkUltrasoundSceneSource.h>

namespace echorama {
namespace {

struct PhantomOptions {
  std::string folder, format = "mha";
  int count = 3, landmarks = 0;
  double overlap = 0.55, knockMm = 8.0, knockDegrees = 6.0;
};

void Phantom(Session& session, const PhantomOptions& options, vtkUltrasoundPhantomSource* source)
{
  const PhantomParameters wanted = source->Phantom();
  const ProbeGeometry& probe = wanted.probe;
  const std::vector<PhantomView> views = PhantomViews(probe, options.count, options.overlap);
  std::vector<Pose> poses;
  for (const PhantomView& view : views)
    poses.push_back(view.probeToWorld);
  const std::vector<Landmark> places = SharedPlaces(wanted.seed, options.landmarks, probe, poses);

  OutputFolder folder(options.folder, {});
  session.ShowAs(folder.StageFolder(), options.folder);
  session.result["folder"] = options.folder;
  SyntheticSet set(session, folder, options.format, options.knockMm, options.knockDegrees);
  for (std::size_t i = 0; i < views.size(); ++i) {
    source->SetView(views[i].probeToWorld, views[i].gainDb);
    source->SetChangeSeed(static_cast<vtkTypeInt64>(i + 1));
    source->SetDeformationMm(i == 0 ? 0.0 : wanted.press.mm);
    source->SetRibShare(i == 0 ? 0.0 : wanted.ribShare);
    source->SetJets(i > 0 && wanted.jets);
    session.Update(source, "make", "volume_" + std::to_string(i + 1));
    vtkNew<vtkImageData> image;
    image->ShallowCopy(source->GetOutput());
    const PhantomParameters parameters = source->Phantom();
    const Pose knock = vtkUltrasoundSceneSource::Knock(image, i, wanted.seed, options.knockMm, options.knockDegrees);
    std::vector<Landmark> seen;
    for (const Landmark& place : places) {
      const Eigen::Vector3d inProbe = parameters.press.Seen(parameters.probeToWorld.inverse() * place.position);
      if (BeamPointAt(parameters.probe, inProbe))
        seen.push_back({place.label, knock * parameters.probeToWorld * inProbe});
    }
    set.Add(image, knock, {{"gain_db", views[i].gainDb}}, seen);
  }
  set.Finish();
}

} // namespace

void EchoramaCommand(CLI::App* options, Action& action)
{
  auto values = std::make_shared<PhantomOptions>();
  const auto source = vtkSmartPointer<vtkUltrasoundPhantomSource>::New();
  options->add_option("-o,--output", values->folder, "Folder for the volumes and truth.json, the poses that put them back")
      ->type_name("FOLDER")
      ->required();
  options->add_option("--count", values->count, "How many volumes")->check(CLI::Range(1, 50))->capture_default_str();
  AddParameter(options, source, "Seed")->description("Seed of tissue and displacements");
  AddParameter(options, source, "SpacingMm", "--spacing");
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
  AddParameter(options, source, "Decorrelation");
  AddParameter(options, source, "NoiseDb", "--noise");
  // These change each volume but the first.
  const auto butTheFirst = [options, &source](const char* name, const char* flag) {
    CLI::Option* option = AddParameter(options, source, name, flag);
    option->description(option->get_description() + ", in each volume but the first");
  };
  butTheFirst("DeformationMm", "--deformation");
  butTheFirst("RibShare", "--rib");
  butTheFirst("Jets", "--jets");
  AddSetOptions(*options, values->landmarks, values->format);
  action = [values, source](Session& session) { Phantom(session, *values, source); };
}

} // namespace echorama
