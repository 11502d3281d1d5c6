// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Filters/Scenes/SceneRun.h"
#include "Scan.h"
#include "SkinSurface.h"
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

template <class Points, class Triangles>
vtkSmartPointer<vtkPolyData> SkinOf(const Points& points, const Triangles& triangles)
{
  vtkNew<vtkPoints> places;
  for (const auto& point : points)
    places->InsertNextPoint(point[0], point[1], point[2]);
  vtkNew<vtkCellArray> cells;
  for (const auto& triangle : triangles)
    cells->InsertNextCell({triangle[0], triangle[1], triangle[2]});
  vtkNew<vtkPolyData> surface;
  surface->SetPoints(places);
  surface->SetPolys(cells);
  return WithNormals(surface);
}

// The tissue of a scene, and the body that holds all others as its skin. It is scanned from where its first view is.
Subject SubjectOfScene(const QString& file, const Progress& progress)
{
  SceneRun run(ReadScene(file.toStdString()), 0, ReadMesh, vtkUltrasoundGel::SurfaceOf, progress);
  const TissueSurface tissue = run.Tissue();
  int outermost = -1;
  double largest = 0.0;
  for (int body = 0; body < static_cast<int>(tissue.bodies.size()); body++) {
    Eigen::AlignedBox3f box;
    for (std::size_t i = 0; i < tissue.triangles.size(); i++)
      if (tissue.bodyOfTriangle[i] == body)
        for (std::uint32_t corner : tissue.triangles[i])
          box.extend(tissue.points[corner]);
    if (!box.isEmpty() && box.diagonal().norm() > largest) {
      outermost = body;
      largest = box.diagonal().norm();
    }
  }
  Subject subject;
  subject.files.append(file);
  subject.tissue = vtkSmartPointer<vtkPolyData>::New();
  vtkUltrasoundTissue::Set(subject.tissue, tissue);
  if (!run.Views().empty())
    subject.start = run.Views().front().probeToWorld;
  if (outermost < 0) {
    subject.whyNoSkin = QObject::tr("the scene has no body");
    return subject;
  }
  const TissueSurface outer = tissue.Only(outermost);
  subject.skin = SkinOf(outer.points, outer.triangles);
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
  try {
    subject.skin = SkinOfVolume(subject.volumes.front());
  } catch (const Error& error) {
    subject.whyNoSkin = QString::fromUtf8(error.what());
  }
  return subject;
}

} // namespace

Subject ReadSubject(const QStringList& files, const QString& skin, const Progress& progress)
{
  const auto isScene = [](const QString& file) { return file.endsWith(".json", Qt::CaseInsensitive); };
  if (files.size() > 1 && std::any_of(files.begin(), files.end(), isScene))
    throw Error(Error::Kind::BadInput, "one scene, or volumes, can be scanned at a time");
  Subject subject = isScene(files.first()) ? SubjectOfScene(files.first(), progress.Part(0.0, 0.8))
                                           : SubjectOfVolumes(files, progress.Part(0.0, 0.8));
  if (!skin.isEmpty()) {
    const TriangleSurface mesh = ReadMesh(skin.toStdString());
    subject.skin = SkinOf(mesh.points, mesh.triangles);
  }
  if (subject.skin)
    subject.mesh = MeshOf(subject.skin, skin.isEmpty() ? "the skin of " + files.first().toStdString() : skin.toStdString());
  return subject;
}

} // namespace echorama
