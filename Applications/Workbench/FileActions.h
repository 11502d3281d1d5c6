// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "VolumeReading.h"
#include "Widgets/Session/ProjectFile.h"
#include <functional>
#include <QObject>
#include <QStringList>
#include <vector>

class QAction;
class QMenu;
class QWidget;

namespace echorama {

class Workbench;

/// Opening and saving: volumes, projects, poses. Volumes are read in the background; what cannot be read is named in the message
/// bar, and the rest is opened.
class FileActions : public QObject {
  Q_OBJECT

public:
  /// \a window: where dialogs belong.
  FileActions(Workbench* bench, QWidget* window);
  void AddTo(QMenu* menu);
  QAction* OpenAction() const { return open_; }
  QAction* OpenProjectAction() const { return openProject_; }
  QAction* SaveAsAction() const { return saveAs_; }
  QAction* SaveAction() const { return save_; }

  /// Volumes, folders of slices, a project or poses, in any mixture: by drop, dialog or command line.
  void Open(const QStringList& paths);
  /// \a then: when those that could be read are open.
  void OpenVolumes(const QStringList& files, const std::function<void()>& then = {});
  /// Asks first when there is unsaved work, and again when there is new work once its files are read.
  /// \a then: when it is open; not when it is not.
  void OpenProject(const QString& path, const std::function<void()>& then = {});
  /// The copy of \a project, which was this one: asks only when something has been done since.
  void OpenCopy(const QString& path, const Project& project);
  /// A project that a session left that ended without being saved.
  void OpenAbandoned(const QString& backup);
  /// Returns false when it did not work, or a name has to be asked for first.
  bool Save();
  bool SaveTo(const QString& path, bool withoutUnsavedResults = false);

  /// Whether anything would be lost that a person did: moved, painted, grouped, renamed, taken out. Volumes that were only opened
  /// are not work.
  bool HasUnsavedWork() const;
  /// Calls \a then at once, or after the user said what to do with unsaved work.
  void WhenSaved(const QString& question, const std::function<void()>& then);

signals:
  void Opened(); ///< a project took the place of what was there

private:
  enum class Kind { Volume, Project, Poses };
  static Kind KindOf(const QString& path);
  static QString QuestionBefore(const QString& path);
  void WarnOfUnread(const std::vector<ReadVolume>& volumes);
  void ReadProject(const QString& path, const QString& saveAs, const std::function<void()>& then);
  void TakeProject(const QString& path, const QString& saveAs, const std::vector<ReadVolume>& volumes,
                   const std::function<void()>& then);
  void OfferLaterBackup();
  void AskForResults(const QString& path, const QVector<int>& unsaved);
  void AskOpen(const QString& title, const QString& filter, bool several);
  void AskSave();
  void ShowHistory();

  Workbench* bench_;
  QWidget* window_;
  QAction *open_, *openProject_, *save_, *saveAs_, *readPoses_;
  SessionState opened_; ///< as files had it, of a session that was never saved: what is different is work
  int edits_ = 0;
  std::function<void()> afterSave_; ///< what waits for a name to be given
};

} // namespace echorama
