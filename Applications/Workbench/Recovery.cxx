// SPDX-License-Identifier: BSD-3-Clause
#include "Recovery.h"
#include "FileActions.h"
#include "Workbench.h"
#include <QDateTime>
#include <string>
#include <vtkDoubleArray.h>
#include <vtkNew.h>
#include <vtkStringArray.h>

namespace echorama {

namespace {

// Asks about the newest backup of a folder that can be read; false when there is none.
bool Offer(Workbench* bench, FileActions* files, const std::string& folder)
{
  vtkNew<vtkStringArray> paths, labels;
  vtkNew<vtkDoubleArray> times;
  const int count = vtkUltrasoundAlignmentSession::GetBackupsIn(folder.c_str(), paths, labels, times);
  for (int i = 0; i < count; i++) {
    const QString path = QString::fromStdString(paths->GetValue(i)), label = QString::fromStdString(labels->GetValue(i));
    if (label == "damaged")
      continue;
    const QDateTime time = QDateTime::fromMSecsSinceEpoch(static_cast<qint64>(1000.0 * times->GetValue(i)));
    bench->Ask(
        QObject::tr("A session ended at %1 without being saved%2.")
            .arg(time.toString("yyyy-MM-dd hh:mm:ss"), label.isEmpty() ? QString() : QObject::tr(" (last: %1)").arg(label)),
        {{QObject::tr("Open it"), [files, path] { files->OpenAbandoned(path); }},
         {QObject::tr("Later"), {}},
         {QObject::tr("Delete it"), [bench, folder] { bench->Session()->DiscardBackups(folder.c_str()); }}});
    return true;
  }
  return false;
}

} // namespace

void OfferAbandoned(Workbench* bench, FileActions* files)
{
  vtkNew<vtkStringArray> folders;
  const int count = vtkUltrasoundAlignmentSession::GetAbandonedSessions(folders);
  for (int i = 0; i < count; i++)
    if (Offer(bench, files, folders->GetValue(i)))
      return;
}

} // namespace echorama
