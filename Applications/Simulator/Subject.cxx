// SPDX-License-Identifier: BSD-3-Clause
#include "AlgorithmRun.h"
#include "Core/Base/Error.h"
#include "Filters/Scenes/SceneRun.h"
#include "Scan.h"
#include "ScanLog.h"
#include "VolumeReading.h"
#include <algorithm>
#include <vtkCellArray.h>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkUltrasoundAcquisition.h>
#include <vtkUltrasoundGel.h>
#include <vtkUltrasoundMeshFile.h>
#include <vtkUltrasoundSkin.h>
#include <vtkUltrasoundTissue.h>

namespace echorama {

namespace {

std::shared_ptr<const SkinMesh> MeshOf(vtkPolyData* skin, const std::string& name)
{
  std::vector<Eigen::Vector3f> points(static_cast<std::size_t>(skin->GetNumberOfPoints()));
  for (vtkIdType i = 0; i < skin->GetNumberOfPoints(); i++) {
    double at[3];
    skin->GetPoint(i, at);
    points[static_cast<std::size_t>(i)] = Eigen::Map<Eigen::Vector3d>(at).cast<float>();
  }
  std::vector<SkinMesh::Triangle> triangles;
  for (vtkIdType i = 0; i < skin->GetNumberOfCells(); i++) {
    vtkIdType count = 0;
    const vtkIdType* corners = nullptr;
    skin->GetCellPoints(i, count, corners);
    if (count == 3)
      triangles.push_back({static_cast<std::uint32_t>(corners[0]), static_cast<std::uint32_t>(corners[1]),
                           static_cast<std::uint32_t>(corners[2])});
  }
  return std::make_shared<const SkinMesh>(points, triangles, name);
}

vtkSmartPointer<vtkPolyData> SkinOf(vtkDataObject* body, const Progress& progress)
{
  vtkNew<vtkUltrasoundSkin> skin;
  skin->SetInputDataObject(body);
  Update(skin, progress);
  return skin->GetOutput();
}

// Of what is scanned. A body without a skin can be scanned by a tracker all the same.
void TakeSkin(Subject& subject, const Progress& progress)
{
  try {
    subject.skin = SkinOf(subject.tissue ? static_cast<vtkDataObject*>(subject.tissue) : subject.volumes.front(), progress);
  } catch (const Error& error) {
    if (error.GetKind() == Error::Kind::Cancelled)
      throw;
    subject.whyNoSkin = QString::fromUtf8(error.what());
  }
}

// The tissue of a scene. It is scanned from where its first view is.
Subject SubjectOfScene(const QString& file, const Progress& progress)
{
  SceneRun run(ReadScene(file.toStdString()), 0, ReadMesh, vtkUltrasoundGel::SurfaceOf, progress);
  Subject subject;
  subject.files.append(file);
  subject.tissue = vtkSmartPointer<vtkPolyData>::New();
  vtkUltrasoundTissue::Set(subject.tissue, run.Tissue());
  if (!run.Views().empty())
    subject.start = run.Views().front().probeToWorld;
  return subject;
}

Subject SubjectOfVolumes(const QStringList& files, const Progress& progress)
{
  Subject subject;
  for (const ReadVolume& read : ReadVolumes(WithoutCompanions(files), progress)) {
    if (!read.image)
      throw Error(Error::Kind::BadFile, read.error.toStdString());
    subject.files.append(read.file);
    subject.volumes.push_back(read.image);
  }
  subject.start = vtkUltrasoundAcquisition::ProbeToWorldOf(subject.volumes.front());
  return subject;
}

} // namespace

Subject ReadSubject(const QStringList& files, const QString& skin, const Progress& progress)
{
  const auto isScene = [](const QString& file) { return file.endsWith(".json", Qt::CaseInsensitive); };
  if (files.size() > 1 && std::any_of(files.begin(), files.end(), isScene))
    throw Error(Error::Kind::BadInput, "one scene, or volumes, can be scanned at a time");
  Subject subject = isScene(files.first()) ? SubjectOfScene(files.first(), progress.Part(0.0, 0.7))
                                           : SubjectOfVolumes(files, progress.Part(0.0, 0.7));
  if (skin.isEmpty()) {
    TakeSkin(subject, progress.Part(0.7, 1.0));
  } else {
    const TriangleSurface mesh = ReadMesh(skin.toStdString());
    vtkNew<vtkPoints> points;
    for (const auto& point : mesh.points)
      points->InsertNextPoint(point[0], point[1], point[2]);
    vtkNew<vtkCellArray> triangles;
    for (const auto& triangle : mesh.triangles)
      triangles->InsertNextCell({triangle[0], triangle[1], triangle[2]});
    vtkNew<vtkPolyData> surface;
    surface->SetPoints(points);
    surface->SetPolys(triangles);
    subject.skin = SkinOf(surface, progress.Part(0.7, 1.0));
  }
  if (subject.skin)
    subject.mesh = MeshOf(subject.skin, skin.isEmpty() ? "the skin of " + files.first().toStdString() : skin.toStdString());
  subject.sum = SumOf(subject);
  return subject;
}

} // namespace echorama
