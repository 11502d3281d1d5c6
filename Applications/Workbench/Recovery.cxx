// SPDX-License-Identifier: BSD-3-Clause
#include "Recovery.h"
#include "FileActions.h"
#include "Widgets/Session/Backups.h"
#include "Workbench.h"
#include <exception>
#include <QDateTime>

namespace echorama {

namespace {

// The newest backup of a folder that can be read; its path is empty when there is none.
Backup NewestOf(const std::string& folder)
{
  for (const Backup& backup : Backups::List(folder))
    if (backup.readable)
      return backup;
  return {};
}

void Offer(Workbench* bench, FileActions* files, const std::string& folder, const Backup& backup)
{
  const QString path = QString::fromStdString(backup.path), time = QDateTime::fromSecsSinceEpoch(backup.time).toString("yyyy-MM-dd hh:mm:ss");
  bench->Ask(QObject::tr("A session ended at %1 without being saved (last: %2).").arg(time, QString::fromStdString(backup.label)),
             {{QObject::tr("Open it"), [files, path] { files->OpenAbandoned(path); }},
              {QObject::tr("Later"), {}},
              {QObject::tr("Delete it"), [folder] { Backups::Discard(folder); }}});
}

} // namespace

void OfferAbandoned(Workbench* bench, FileActions* files)
{
  try {
    for (const std::string& folder : Backups::Abandoned())
      if (const Backup newest = NewestOf(folder); !newest.path.empty()) {
        Offer(bench, files, folder, newest);
        return;
      }
  } catch (const std::exception& error) {
    bench->Warn(QString::fromUtf8(error.what()));
  }
}

} // namespace echorama
