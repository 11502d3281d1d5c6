// SPDX-License-Identifier: BSD-3-Clause
// echorama phantom: volumes of an invented body, knocked out of place by a known amount.
//
// The first volume stays where it is, so that poses found with it held fixed lie in the frame of the truth.
#include "Commands.h"
#include "Core/Base/NumberText.h"
#include "Core/Base/Random.h"
#include "Core/Geometry/PoseFile.h"
#include "Filters/Registration/ValidPoints.h"
#include "Filters/Synthesis/PhantomViews.h"
#include "Outputs.h"
#include "Volumes.h"
#include <algorithm>
#include <CLI/Validators.hpp>
#include <filesystem>
#include <fstream>
#include <memory>
#include <vtkNew.h>
#include <vtkUltrasoundAcquisition.h>
#include <vtkUltrasoundPhantomSource.h>
#include <vtkUltrasoundVolume.h>

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

// Places in the tissue that two views at least see.
std::vector<Eigen::Vector3d> SharedPlaces(const PhantomOptions& options, const ProbeGeometry& probe,
                                          const std::vector<PhantomView>& views)
{
  std::vector<Eigen::Vector3d> places;
  Random random(options.seed, 0x1a4d);
  for (int attempt = 0; attempt < 1000 * options.landmarks && static_cast<int>(places.size()) < options.landmarks; ++attempt) {
    const PhantomView& view = views[random.Below(views.size())];
    const Eigen::AlignedBox3d box = BoxAround(probe);
    const Eigen::Vector3d share(random.Uniform(), random.Uniform(), random.Uniform());
    const Eigen::Vector3d place = view.probeToWorld * (box.min() + share.cwiseProduct(box.sizes()));
    const auto sees = [&](const PhantomView& other) {
      return BeamPointAt(probe, other.probeToWorld.inverse() * place).has_value();
    };
    if (sees(view) && std::count_if(views.begin(), views.end(), sees) > 1)
      places.push_back(place);
  }
  return places;
}

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

// Where each of the places is seen in a volume that was knocked out of place, if it is.
void WriteLandmarks(const std::string& file, const std::vector<Eigen::Vector3d>& places, const PhantomParameters& parameters,
                    const Pose& knock)
{
  std::ofstream stream(file);
  stream << "label,x,y,z\n";
  for (std::size_t i = 0; i < places.size(); ++i) {
    const Eigen::Vector3d seen = parameters.press.Seen(parameters.probeToWorld.inverse() * places[i]);
    if (!BeamPointAt(parameters.probe, seen))
      continue;
    const Eigen::Vector3d point = knock * (parameters.probeToWorld * seen);
    stream << "L" << i + 1 << ',' << NumberText(point.x()) << ',' << NumberText(point.y()) << ',' << NumberText(point.z())
           << '\n';
  }
  stream.close();
  if (!stream)
    throw Error(Error::Kind::FileSystem, file + ": it cannot be written (is the disk full?)");
}

void Phantom(Session& session, const PhantomOptions& options)
{
  vtkNew<vtkUltrasoundPhantomSource> source;
  source->SetSeed(static_cast<vtkTypeInt64>(options.seed));
  source->SetSpacingMm(options.spacingMm);
  const ProbeGeometry probe = source->Parameters().probe;
  const std::vector<PhantomView> views = PhantomViews(probe, options.count, options.overlap);
  const std::vector<Eigen::Vector3d> places = SharedPlaces(options, probe, views);
  source->SetDecorrelation(options.decorrelation);
  source->SetNoiseDb(options.noiseDb);

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
    source->SetChangeSeed(static_cast<vtkTypeInt64>(i + 1));
    source->SetDeformationMm(i == 0 ? 0.0 : options.deformationMm);
    source->SetRibShare(i == 0 ? 0.0 : options.ribShare);
    source->SetJets(i > 0 && options.jets);
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
    if (options.landmarks > 0) {
      const std::string list = "landmarks_" + std::to_string(i + 1) + ".csv";
      WriteLandmarks(folder.Stage(list), places, source->Parameters(), knock);
      session.result["volumes"].back()["landmarks"] = folder.Final(list);
    }
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
