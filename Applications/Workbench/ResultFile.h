// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Workspace.h"
#include <functional>
#include <QString>
#include <QVector>

namespace echorama {

/// Results of a session that are in no file.
QVector<int> UnsavedResults(vtkUltrasoundAlignmentSession* session);

/// A name for the file of a volume that nothing has in \a folder.
QString FreeFileFor(vtkUltrasoundAlignmentSession* session, int id, const QString& folder);

/// Writes a result as it was made, in the background; from then on that is its file. What was painted on it stays in the session
/// and its project. \a then: when that is done, and no job is running for it any more; not when it is not.
void SaveResult(Workspace& workspace, QObject* owner, int id, const QString& path, const std::function<void()>& then = {});

} // namespace echorama
