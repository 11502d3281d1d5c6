// SPDX-License-Identifier: BSD-3-Clause
#include "Samples.h"
#include "AlgorithmRun.h"
#include "Core/Base/Error.h"
#include "Core/Geometry/PoseFile.h"
#include "Filters/Phantoms/PhantomViews.h"
#include "Readers/OutputFiles.h"
#include <algorithm>
#include <QCoreApplication>
#include <QDir>
#include <QFileInfo>
#include <QStandardPaths>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkUltrasoundPhantomSource.h>
#include <vtkUltrasoundVolume.h>
#include <vtkUltrasoundWriter.h>

namespace echorama {

namespace {

constexpr double KnockMm = 8.0, KnockDegrees = 6.0; // near enough for Refine
constexpr std::uint64_t Seed = 7;

/// What a sample is made of: a body, the places from which it is scanned, and how the volumes that come of it lie wrong.
struct Recipe {
  PhantomScene scene;
  std::vector<PhantomView> views;
  double knockMm = KnockMm, knockDegrees = KnockDegrees;
  std::size_t firstWrong = 1;
  bool areTogether = false; ///< those that lie wrong lie wrong by the same, and right among each other
};

Inclusion Round(const char* name, const Eigen::Vector3d& centre, double radius, double db, double attenuationDbPerMm)
{
  return {name, Ellipsoid{centre, Eigen::Vector3d::Constant(radius)}, db, 0.0, 0.0, attenuationDbPerMm};
}

Inclusion Clip(const Eigen::Vector3d& place)
{
  return Round("clip", place, 1.8, 40.0, 0.0);
}

// So that clips are all that is small and bright, and one stone at most casts a shadow.
PhantomScene WithoutGrains()
{
  PhantomScene scene = DefaultScene();
  auto& bodies = scene.inclusions;
  const auto isSmall = [](const Inclusion& body) { return body.name == "stone" || body.name == "grain"; };
  bodies.erase(std::remove_if(bodies.begin(), bodies.end(), isSmall), bodies.end());
  return scene;
}

// Slices show the middle of the first volume at first, so what is to be seen there lies in its plane.
Recipe WithAShadow(const ProbeGeometry& probe)
{
  constexpr double aside = 28.0; // mm that each probe is from the middle
  Recipe recipe{WithoutGrains(), {}};
  auto& bodies = recipe.scene.inclusions;
  const Eigen::Vector3d toFirst(-aside, 0.0, 0.0), clip = toFirst + PointOf(probe, {70.0, -0.25, 0.0});
  bodies.push_back(Round("stone", toFirst + PointOf(probe, {30.0, 0.12, 0.0}), 4.5, 22.0, 7.0)); // beside the second one's fan
  bodies.push_back(Clip(clip));                                                                  // each volume shows one
  bodies.push_back(Clip({-clip.x(), clip.y(), clip.z()}));
  recipe.views = {{Pose(Eigen::Translation3d(toFirst)), 0.0}, {Pose(Eigen::Translation3d(-toFirst)), 2.5}};
  return recipe;
}

Recipe FarApart(const ProbeGeometry& probe)
{
  Recipe recipe{WithoutGrains(), PhantomViews(probe, 2, 0.6), 70.0, 9.0};
  const double middle = BoxAround(probe).center().z();
  for (const auto& [x, y] : {std::pair(-16.0, -14.0), std::pair(20.0, -6.0), std::pair(-2.0, 24.0)})
    recipe.scene.inclusions.push_back(Clip({x, y, middle}));
  return recipe;
}

// The last three as somebody placed them who went wrong at one joint.
Recipe InARow(const ProbeGeometry& probe)
{
  return {DefaultScene(), PhantomViews(probe, 6, 0.42), 3.5, 0.0, 3, true};
}

Recipe RecipeOf(const Sample& sample, vtkUltrasoundPhantomSource* source)
{
  const QString name = sample.name;
  if (name == "phantom-6") { // narrow ones, so that six stay in the body and only neighbours overlap
    source->SetFanAngle(24.0);
    source->SetFanRadius(70.0);
    source->SetSweepAngle(34.0);
    source->SetDepthMax(80.0);
    source->SetSpacingMm(1.5);
  }
  const ProbeGeometry probe = source->Phantom().probe;
  if (name == "phantom-far")
    return FarApart(probe);
  if (name == "phantom-6")
    return InARow(probe);
  if (name == "phantom-shadow")
    return WithAShadow(probe);
  return {DefaultScene(), PhantomViews(probe, sample.volumes, 0.6)};
}

QString SampleText(const char* text)
{
  return QCoreApplication::translate("Samples", text);
}

} // namespace

QVector<Sample> Samples()
{
  return {
      {"phantom-2", 2, SampleText(QT_TRANSLATE_NOOP("Samples", "&Two volumes")),
       SampleText(QT_TRANSLATE_NOOP("Samples", "Two overlapping volumes of an invented body, of which one lies wrong"))},
      {"phantom-4", 4, SampleText(QT_TRANSLATE_NOOP("Samples", "&Four volumes")),
       SampleText(QT_TRANSLATE_NOOP("Samples", "Four overlapping volumes in a row, of which three lie wrong"))},
      {"phantom-far", 2, SampleText(QT_TRANSLATE_NOOP("Samples", "Two far &apart")),
       SampleText(QT_TRANSLATE_NOOP("Samples", "Two volumes of one body with three metal clips, 70 mm apart"))},
      {"phantom-6", 6, SampleText(QT_TRANSLATE_NOOP("Samples", "Five pairs, one &wrong")),
       SampleText(QT_TRANSLATE_NOOP("Samples", "Six volumes in a row that were aligned, but for one joint"))},
      {"phantom-shadow", 2, SampleText(QT_TRANSLATE_NOOP("Samples", "Stone with a &shadow")),
       SampleText(QT_TRANSLATE_NOOP("Samples", "Two volumes with a metal clip each; a stone casts a shadow in the first one"))}};
}

QString FolderOf(const Sample& sample)
{
  return QStandardPaths::writableLocation(QStandardPaths::GenericDataLocation) + "/echorama/samples/" + sample.name;
}

QStringList VolumesOf(const Sample& sample)
{
  QStringList files;
  for (int i = 1; i <= sample.volumes; i++)
    files.append(QString("%1/volume_%2.mha").arg(FolderOf(sample)).arg(i));
  return files;
}

QString TruthOf(const Sample& sample)
{
  return FolderOf(sample) + "/truth.json";
}

bool IsThere(const Sample& sample)
{
  bool isThere = QFileInfo::exists(TruthOf(sample));
  for (const QString& file : VolumesOf(sample))
    isThere = isThere && QFileInfo::exists(file);
  return isThere;
}

void Make(const Sample& sample, const Progress& progress)
{
  const QDir above = QFileInfo(FolderOf(sample)).dir();
  if (!above.mkpath("."))
    throw Error(Error::Kind::FileSystem, above.path().toStdString() + ": the folder for samples cannot be made");
  OutputFolder folder(FolderOf(sample).toStdString(), {});
  vtkNew<vtkUltrasoundPhantomSource> source;
  source->SetSeed(static_cast<vtkTypeInt64>(Seed));
  const Recipe recipe = RecipeOf(sample, source);
  const ProbeGeometry probe = source->Phantom().probe;
  source->SetScene(PhantomToJson(recipe.scene).c_str());
  const Pose toOrigin(Eigen::Translation3d(-BoxAround(probe).center())); // where slices are at first
  std::vector<VolumePose> truth;
  for (std::size_t i = 0; i < recipe.views.size(); i++) {
    const double count = sample.volumes, begin = static_cast<double>(i) / count;
    source->SetView(recipe.views[i].probeToWorld, recipe.views[i].gainDb);
    Update(source, progress.Part(begin, begin + 0.9 / count));
    vtkNew<vtkImageData> image;
    image->ShallowCopy(source->GetOutput());
    vtkUltrasoundVolume::Move(image, toOrigin);
    const Eigen::Vector3d centre = vtkUltrasoundVolume::GeometryOf(image).Centre();
    const std::uint64_t item = recipe.areTogether ? recipe.firstWrong : i;
    const Pose knock =
        i < recipe.firstWrong ? Pose::Identity() : KnockedPose(Seed, item, recipe.knockMm, recipe.knockDegrees, centre);
    vtkUltrasoundVolume::Move(image, knock);
    const std::string file = folder.Stage(QFileInfo(VolumesOf(sample)[static_cast<int>(i)]).fileName().toStdString());
    vtkNew<vtkUltrasoundWriter> writer;
    writer->SetInputDataObject(image);
    writer->SetFileName(file.c_str());
    Run(writer, progress.Part(begin + 0.9 / count, begin + 1.0 / count), [&] { writer->Write(); });
    truth.push_back({file, vtkUltrasoundVolume::GeometryOf(image), knock.inverse()});
  }
  WritePoses(folder.Stage("truth.json"), truth); // names are relative to it: right also where it goes
  folder.Commit();
}

} // namespace echorama
