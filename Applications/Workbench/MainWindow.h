// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <array>
#include <QMainWindow>

class QDockWidget;
class QMenu;
class QToolBar;

namespace echorama {

class EditActions;
class EmptyPage;
class FileActions;
class Focus;
class GuideBar;
class JobBar;
class MessageBar;
class StatusReadout;
class TrainingPanel;
class ViewActions;
class ViewGrid;
class Workbench;
struct Message;
struct Sample;
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
  void resizeEvent(QResizeEvent* event) override;
  void changeEvent(QEvent* event) override;

private:
  void MakeMenus();
  void MakePanels();
  QDockWidget* AddDock(Qt::DockWidgetArea area, QWidget* panel, const QString& title, QWidget* content);
  void FocusFirstOf(QWidget* panel);
  void AddLeft(QWidget* panel, const QString& title);
  void ShowTitle();
  void Say(const Message& message);
  void ShowPanel(QWidget* panel);
  void ShowEmpty();
  void OpenSample(const Sample& sample);
  bool AsksBeforeClosing();
  void RestoreLayout();
  void FitToolBars();

  Workbench* bench_;
  JobBar* jobs_;
  MessageBar* messages_;
  ViewGrid* views_;
  StatusReadout* readout_;
  FileActions* files_;
  EditActions* edits_;
  ViewActions* looks_;
  std::array<QMenu*, 7> menus_{};
  QToolBar* lookBar_ = nullptr;
  QMenu *panels_ = nullptr, *shownPanels_ = nullptr;
  TrainingPanel* training_;
  GuideBar* guide_;
  EmptyPage* empty_ = nullptr;
  Focus* focus_ = nullptr;
  QDockWidget* lastPanel_ = nullptr;
  int volumes_ = 0;
  bool mayClose_ = false;
};

} // namespace echorama
