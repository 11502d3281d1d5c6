// SPDX-License-Identifier: BSD-3-Clause
#include "Samples.h"
#include "AlgorithmRun.h"
#include "Core/Base/Error.h"
#include "Core/Geometry/PoseFile.h"
#include "Filters/Phantoms/PhantomViews.h"
#include "Readers/OutputFiles.h"
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

constexpr double Overlap = 0.6, KnockMm = 8.0, KnockDegrees = 6.0; // near enough for Refine
constexpr std::uint64_t Seed = 7;

QString SampleText(const char* text)
{
  return QCoreApplication::translate("Samples", text);
}

} // namespace

QVector<Sample> Samples()
{
  return {{"phantom-2", 2, SampleText(QT_TRANSLATE_NOOP("Samples", "&Two volumes")),
           SampleText(QT_TRANSLATE_NOOP("Samples", "Two overlapping volumes of an invented body, of which one lies wrong"))},
          {"phantom-4", 4, SampleText(QT_TRANSLATE_NOOP("Samples", "&Four volumes")),
           SampleText(QT_TRANSLATE_NOOP("Samples", "Four overlapping volumes in a row, of which three lie wrong"))}};
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
  const ProbeGeometry probe = source->Phantom().probe;
  const std::vector<PhantomView> views = PhantomViews(probe, sample.volumes, Overlap);
  const Pose toOrigin(Eigen::Translation3d(-BoxAround(probe).center())); // where slices are at first
  std::vector<VolumePose> truth;
  for (std::size_t i = 0; i < views.size(); i++) {
    const double count = sample.volumes, begin = static_cast<double>(i) / count;
    source->SetView(views[i].probeToWorld, views[i].gainDb);
    Update(source, progress.Part(begin, begin + 0.9 / count));
    vtkNew<vtkImageData> image;
    image->ShallowCopy(source->GetOutput());
    vtkUltrasoundVolume::Move(image, toOrigin);
    const Eigen::Vector3d centre = vtkUltrasoundVolume::GeometryOf(image).Centre();
    const Pose knock = i == 0 ? Pose::Identity() : KnockedPose(Seed, i, KnockMm, KnockDegrees, centre);
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
