// SPDX-License-Identifier: BSD-3-Clause
#include "Recovery.h"
#include "FileActions.h"
#include "Workbench.h"
#include <QDateTime>
#include <QStringList>
#include <vtkDoubleArray.h>
#include <vtkNew.h>
#include <vtkStringArray.h>

namespace echorama {

namespace {

QString TimeOf(double seconds)
{
  return QDateTime::fromMSecsSinceEpoch(static_cast<qint64>(1000.0 * seconds)).toString("yyyy-MM-dd hh:mm:ss");
}

// Asks about the first of some sessions that has a backup which can be read; the others come after it.
void Offer(Workbench* bench, FileActions* files, QStringList folders)
{
  vtkNew<vtkStringArray> paths, labels;
  vtkNew<vtkDoubleArray> times;
  while (!folders.isEmpty()) {
    const QString folder = folders.takeFirst();
    const int count = vtkUltrasoundAlignmentSession::GetBackupsIn(folder.toUtf8().constData(), paths, labels, times);
    int newest = 0;
    while (newest < count && labels->GetValue(newest) == "damaged")
      newest++;
    if (newest == count)
      continue;
    const QString path = QString::fromStdString(paths->GetValue(newest)),
                  label = QString::fromStdString(labels->GetValue(newest));
    QString text = QObject::tr("A session ended at %1 without being saved%2.")
                       .arg(TimeOf(times->GetValue(newest)), label.isEmpty() ? QString() : QObject::tr(" (last: %1)").arg(label));
    const auto next = [bench, files, folders] { Offer(bench, files, folders); };
    QVector<Message::Answer> answers{{QObject::tr("Open it"), [files, path] { files->OpenAbandoned(path); }},
                                     {QObject::tr("Later"), {}},
                                     {QObject::tr("Delete it"), [bench, folder, next] {
                                        bench->Session()->DiscardBackups(folder.toUtf8().constData());
                                        next();
                                      }}};
    if (!folders.isEmpty()) {
      text += QObject::tr(" Earlier ones: %1.").arg(folders.size());
      answers.insert(1, {QObject::tr("Show the one before"), next});
    }
    bench->Ask(text, answers, "recovery");
    return;
  }
}

} // namespace

void OfferAbandoned(Workbench* bench, FileActions* files)
{
  vtkNew<vtkStringArray> found;
  const int count = vtkUltrasoundAlignmentSession::GetAbandonedSessions(found);
  QStringList folders;
  for (int i = 0; i < count; i++)
    folders.append(QString::fromStdString(found->GetValue(i)));
  Offer(bench, files, folders);
}

} // namespace echorama
