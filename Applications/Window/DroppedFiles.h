// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <QDragEnterEvent>
#include <QMimeData>
#include <QStringList>
#include <QUrl>

namespace echorama {

/// Lets files be dropped on a window.
inline void LetDrop(QDragEnterEvent* event)
{
  if (event->mimeData()->hasUrls())
    event->acceptProposedAction();
}

/// The files of this machine among what was dropped; where there are some the drop is accepted.
inline QStringList DroppedFiles(QDropEvent* event)
{
  QStringList paths;
  for (const QUrl& url : event->mimeData()->urls())
    if (url.isLocalFile())
      paths.append(url.toLocalFile());
  if (!paths.isEmpty())
    event->acceptProposedAction();
  return paths;
}

} // namespace echorama
