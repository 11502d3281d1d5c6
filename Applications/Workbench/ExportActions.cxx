// SPDX-License-Identifier: BSD-3-Clause
#include "ExportActions.h"
#include "AlgorithmRun.h"
#include "Controls.h"
#include "Core/Base/FileReplacement.h"
#include "Filters/Calibration/ItkTransform.h"
#include "Messages.h"
#include "Readers/OutputFiles.h"
#include <filesystem>
#include <QAction>
#include <QFileDialog>
#include <QMenu>
#include <system_error>
#include <vector>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkUltrasoundWriter.h>

namespace echorama {

namespace {

// A file for each volume that is shown, by its name. Throws Error(FileSystem) when one is there, or would be written beside it,
// or belongs to two volumes.
std::vector<std::pair<int, std::string>> FilesFor(vtkUltrasoundAlignmentSession* session, const QString& folder,
                                                  const std::string& extension)
{
  std::vector<std::pair<int, std::string>> files;
  for (int i = 0; i < session->GetNumberOfVolumes(); ++i) {
    const int id = session->GetVolumeId(i);
    if (!session->GetVisible(id))
      continue;
    std::string name = session->GetName(id);
    for (char& character : name)
      if (character == '/' || character == '\\' || character == '\0')
        character = '_';
    const std::string path = (std::filesystem::path(folder.toStdString()) / (name + "." + extension)).string();
    std::vector<std::string> written = CompanionPaths(path);
    written.push_back(path);
    std::error_code unknown; // of a name that no file can have: writing it says so
    for (const std::string& each : written)
      if (std::filesystem::exists(each, unknown))
        throw Error(Error::Kind::FileSystem, each + ": it is there already; choose another folder");
    for (const auto& file : files)
      if (file.second == path)
        throw Error(Error::Kind::FileSystem, path + ": two volumes would be this file; rename one of them");
    files.emplace_back(id, path);
  }
  if (files.empty())
    throw Error(Error::Kind::NotPossible, "no volume is shown; tick one in the list of volumes");
  return files;
}

} // namespace

ExportActions::ExportActions(Workspace& workspace, QObject* parent) : QObject(parent), workspace_(workspace) {}

void ExportActions::AddTo(QMenu* menu, QWidget* window)
{
  const auto folder = [window](const QString& title) { return QFileDialog::getExistingDirectory(window, title); };
  menu->addSeparator();
  menu->addAction(MakeAction(
      this, "exportPoses", tr("Export &poses..."), "", tr("For echorama stitch, and all that reads pose files"), [this, window] {
        const QString path = QFileDialog::getSaveFileName(window, tr("Export poses"), "poses.json", tr("Poses (*.json)"));
        if (!path.isEmpty())
          ExportPoses(path);
      }));
  menu->addAction(MakeAction(this, "exportVolumes", tr("Export &volumes..."), "",
                             tr("The volumes that are shown, with their new geometry and what was painted"), [this, folder] {
                               const QString path = folder(tr("Export volumes to"));
                               if (!path.isEmpty())
                                 ExportVolumes(path);
                             }));
  menu->addAction(MakeAction(this, "exportTransforms", tr("Export &transforms..."), "",
                             tr("One transform of ITK (.tfm) per volume that is shown, for 3D Slicer"), [this, folder] {
                               const QString path = folder(tr("Export transforms to"));
                               if (!path.isEmpty())
                                 ExportTransforms(path);
                             }));
}

void ExportActions::ExportVolumes(const QString& folder, const QString& extension)
{
  std::vector<std::pair<vtkSmartPointer<vtkImageData>, std::string>> items;
  try {
    for (const auto& [id, path] : FilesFor(workspace_.session, folder, extension.toStdString())) {
      items.emplace_back(vtkSmartPointer<vtkImageData>::New(), path);
      workspace_.session->GetSnapshot(id, items.back().first); // it stays as it is, whatever the session does
    }
  } catch (const Error& error) {
    Refuse("exportVolumes", tr("Export volumes: %1").arg(error.what()));
    return;
  }
  const int count = static_cast<int>(items.size());
  const auto write = [items = std::move(items)](const Progress& progress) {
    for (std::size_t i = 0; i < items.size(); ++i) {
      const vtkNew<vtkUltrasoundWriter> writer;
      writer->SetInputDataObject(items[i].first);
      writer->SetFileName(items[i].second.c_str());
      const double of = static_cast<double>(items.size());
      Run(writer, progress.Part(static_cast<double>(i) / of, static_cast<double>(i + 1) / of), [&] { writer->Write(); });
    }
  };
  const auto tell = [this, folder, count] {
    workspace_.show({Message::Note, tr("Exported %1 volumes to %2").arg(count).arg(folder), {}, "exportVolumes"});
  };
  workspace_.Run(this, tr("Export volumes"), write, tell, Elsewhere("exportVolumes"), "exportVolumes");
}

void ExportActions::ExportTransforms(const QString& folder)
{
  try {
    const auto files = FilesFor(workspace_.session, folder, "tfm");
    for (const auto& [id, path] : files)
      WriteItkTransform(path, workspace_.session->GetKernel().State().Find(id)->volumeToWorld);
    workspace_.show({Message::Note, tr("Exported %1 transforms to %2").arg(files.size()).arg(folder), {}, "exportTransforms"});
  } catch (const Error& error) {
    Refuse("exportTransforms", tr("Export transforms: %1").arg(error.what()));
  }
}

void ExportActions::ExportPoses(const QString& path)
{
  const Messages::OfThread messages;
  if (workspace_.session->WritePoses(path.toUtf8()))
    workspace_.show({Message::Note, tr("Exported poses to %1").arg(path), {}, "exportPoses"});
  else
    Refuse("exportPoses", QString::fromUtf8(messages.Error().c_str()));
}

// \a action: that was not done, and can be done with another folder or name.
void ExportActions::Refuse(const char* action, const QString& why)
{
  workspace_.show({Message::Warning, why, Elsewhere(action), action});
}

Message::Answers ExportActions::Elsewhere(const char* action)
{
  auto* again = findChild<QAction*>(action);
  return {{tr("Choose another place..."), [again] { again->trigger(); }}};
}

} // namespace echorama
