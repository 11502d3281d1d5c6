// SPDX-License-Identifier: BSD-3-Clause
#include "ResultFile.h"
#include "AlgorithmRun.h"
#include "Job.h"
#include "Readers/OutputFiles.h"
#include <QDir>
#include <QFileInfo>
#include <vtkImageData.h>
#include <vtkUltrasoundWriter.h>

namespace echorama {

namespace {

QString Tr(const char* text)
{
  return QObject::tr(text);
}

} // namespace

QVector<int> UnsavedResults(vtkUltrasoundAlignmentSession* session)
{
  QVector<int> ids;
  for (int i = 0; i < session->GetNumberOfVolumes(); ++i)
    if (const int id = session->GetVolumeId(i); session->IsResult(id) && session->GetFile(id).empty())
      ids.append(id);
  return ids;
}

QString FreeFileFor(vtkUltrasoundAlignmentSession* session, int id, const QString& folder)
{
  QString name = QString::fromStdString(session->GetName(id));
  for (QChar& character : name)
    if (character == '/' || character == '\\' || character.isNull())
      character = '_';
  const auto isFree = [](const QString& path) {
    bool isThere = QFileInfo::exists(path);
    for (const std::string& companion : CompanionPaths(path.toStdString()))
      isThere = isThere || QFileInfo::exists(QString::fromStdString(companion));
    return !isThere;
  };
  QString path = QDir(folder).filePath(name + ".mha");
  for (int number = 2; !isFree(path); ++number)
    path = QDir(folder).filePath(QString("%1-%2.mha").arg(name).arg(number));
  return path;
}

void SaveResult(Workspace& workspace, QObject* owner, int id, const QString& path, const std::function<void()>& then)
{
  vtkUltrasoundAlignmentSession* session = workspace.session;
  const SessionVolume* volume = session->GetKernel().State().Find(id);
  if (!volume)
    return;
  const QString label = Tr("Save %1").arg(QString::fromStdString(volume->name));
  for (const SessionVolume& other : session->GetKernel().State().volumes)
    if (!other.file.empty() && other.id != id && QFileInfo(QString::fromStdString(other.file)) == QFileInfo(path)) {
      workspace.say(Tr("%1: %2 is the file of %3, and stays").arg(label, path, QString::fromStdString(other.name)), true);
      return;
    }
  const auto image = vtkSmartPointer<vtkImageData>::New();
  if (!session->GetUnpainted(id, image))
    return; // it has said why
  const auto writer = vtkSmartPointer<vtkUltrasoundWriter>::New();
  writer->SetInputDataObject(image);
  writer->SetFileName(path.toUtf8());
  const auto isDone = std::make_shared<bool>(false);
  const auto done = [&workspace, id, path, writer, isDone, edition = volume->edition] {
    const SessionVolume* now = workspace.session->GetKernel().State().Find(id);
    if (!now || now->edition != edition) {
      workspace.say(Tr("Saved %1, which is another volume than the one that is here now").arg(path), true);
      return;
    }
    if (!workspace.session->SetFile(id, path.toUtf8()))
      return;
    *isDone = true;
    QString text = Tr("Saved %1").arg(path);
    if (now->strokes)
      text += Tr(", as it was made. What was painted on it is part of the project; Export volumes writes both into one file");
    const QString notes = QString::fromStdString(writer->GetNotes());
    workspace.say(notes.isEmpty() ? text : text + ". " + notes, false);
  };
  Job* job = workspace.Run(
      owner, label, [writer](const Progress& progress) { Run(writer, progress, [&] { writer->Write(); }); }, done);
  if (then)
    QObject::connect(job, &QObject::destroyed, owner, [isDone, then] {
      if (*isDone)
        then();
    });
}

} // namespace echorama
