// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <array>
#include <QMainWindow>

class QDockWidget;
class QMenu;

namespace echorama {

class EditActions;
class FileActions;
class JobBar;
class MessageBar;
class StatusReadout;
class ViewActions;
class ViewGrid;
class Workbench;
struct Workspace;

/// The window: it makes the parts and puts them together. What parts share is the Workbench.
class MainWindow : public QMainWindow {
  Q_OBJECT

public:
  enum class Place { File, Edit, View, Tools, Align, Stitch, Help };

  /// \a workspace outlives the window.
  explicit MainWindow(Workspace& workspace, QWidget* parent = nullptr);
  ~MainWindow() override;

  Workbench* Bench() const { return bench_; }
  JobBar* Jobs() const { return jobs_; }
  ViewGrid* Views() const { return views_; }
  FileActions* Files() const { return files_; }
  MessageBar* Said() const { return messages_; }

  ///@{ Where parts add themselves: a menu, and a panel among the tabs at the right.
  QMenu* Menu(Place place) const { return menus_[static_cast<std::size_t>(place)]; }
  void AddPanel(QWidget* panel, const QString& title);
  ///@}

  /// Looks for sessions that ended without being saved, opens what is named, and keeps backups from now on.
  void Start(const QString& project, const QStringList& volumes);

protected:
  void closeEvent(QCloseEvent* event) override;
  void dragEnterEvent(QDragEnterEvent* event) override;
  void dropEvent(QDropEvent* event) override;

private:
  void MakeMenus();
  void MakePanels();
  QDockWidget* AddDock(Qt::DockWidgetArea area, QWidget* panel, const QString& title, QWidget* content);
  void AddLeft(QWidget* panel, const QString& title);
  void ShowTitle();
  bool AsksBeforeClosing();
  void CloseWhenDone(int running);
  void RestoreLayout();

  Workbench* bench_;
  JobBar* jobs_;
  MessageBar* messages_;
  ViewGrid* views_;
  StatusReadout* readout_;
  FileActions* files_;
  EditActions* edits_;
  ViewActions* looks_;
  std::array<QMenu*, 7> menus_{};
  QDockWidget* lastPanel_ = nullptr;
  bool mayClose_ = false;
};

} // namespace echorama
