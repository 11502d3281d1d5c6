// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Workspace.h"
#include <QObject>

class QMenu;
class QWidget;

namespace echorama {

/// What leaves the session as files of others: volumes with their new geometry, poses, and transforms of ITK (3D Slicer).
class ExportActions : public QObject {
  Q_OBJECT

public:
  explicit ExportActions(Workspace& workspace, QObject* parent = nullptr);

  /// Adds its entries to a menu; dialogs belong to \a window.
  void AddTo(QMenu* menu, QWidget* window);

  /// The volumes that are shown, each under its name, into \a folder, in the background. \a extension names the format
  /// ("mha"). Files that are there are not replaced: then nothing is written.
  void ExportVolumes(const QString& folder, const QString& extension = "mha");
  /// One .tfm per volume that is shown.
  void ExportTransforms(const QString& folder);
  void ExportPoses(const QString& path);

private:
  void Refuse(const char* action, const QString& why);
  Message::Answers Elsewhere(const char* action);

  Workspace& workspace_;
};

} // namespace echorama
