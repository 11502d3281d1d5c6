// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Widgets/Session/ProjectFile.h"
#include <QObject>

class QAction;
class QMenu;
class QWidget;

namespace echorama {

class Workbench;

/// What is done with whole projects: a copy with all its files in one folder, and a comparison with another session's poses.
class ProjectActions : public QObject {
  Q_OBJECT

public:
  /// \a window: where dialogs belong.
  ProjectActions(Workbench* bench, QWidget* window);
  void AddTo(QMenu* menu);

  /// Copies project and volumes into a new folder, in the background; there also what is in no file here.
  void CopyTo(const QString& folder);
  /// Shows in a table how differently a project, a backup or a pose file places the volumes.
  void CompareWith(const QString& path);

signals:
  void OpenAsked(const QString& copy, const Project& project); ///< the copy that was made, and what is in it

private:
  void ShowVolumes();

  Workbench* bench_;
  QWidget* window_;
  QAction *copy_, *compare_;
};

} // namespace echorama
