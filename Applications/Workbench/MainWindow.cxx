// SPDX-License-Identifier: BSD-3-Clause
#include "MainWindow.h"
#include "AlignmentHandles.h"
#include "BrushPanel.h"
#include "CheckPanel.h"
#include "Controls.h"
#include "DroppedFiles.h"
#include "EditActions.h"
#include "ExportActions.h"
#include "FileActions.h"
#include "Focus.h"
#include "HistoryPanel.h"
#include "JobBar.h"
#include "LandmarkBox.h"
#include "MessageBar.h"
#include "Messages.h"
#include "PanelScroll.h"
#include "PosePanel.h"
#include "Recovery.h"
#include "RegistrationPanel.h"
#include "ResultPanel.h"
#include "SliceCanvas.h"
#include "SlicePane.h"
#include "StatusReadout.h"
#include "TrackerPanel.h"
#include "TrainingPanel.h"
#include "ViewActions.h"
#include "ViewGrid.h"
#include "ViewPanel.h"
#include "VolumePane.h"
#include "VolumePanel.h"
#include "vtkUltrasoundAlignmentWidget.h"
#include "Workbench.h"
#include "WorkbenchKeys.h"
#include <QCloseEvent>
#include <QDockWidget>
#include <QFileInfo>
#include <QLabel>
#include <QMenuBar>
#include <QPointer>
#include <QSettings>
#include <QStatusBar>
#include <QTimer>
#include <QToolBar>
#include <QVBoxLayout>

namespace echorama {

namespace {
constexpr int LayoutVersion = 1; ///< of the panels: a layout of other panels is not restored
}

MainWindow::MainWindow(Workspace& workspace, QWidget* parent)
  : QMainWindow(parent), bench_(new Workbench(workspace, this)), jobs_(new JobBar(this)), messages_(new MessageBar(this)),
    views_(new ViewGrid(bench_, this)), readout_(new StatusReadout(bench_, this)), files_(new FileActions(bench_, this)),
    edits_(new EditActions(bench_, this)), looks_(new ViewActions(bench_, views_, this))
{
  setObjectName("workbench");
  setAcceptDrops(true);
  auto* middle = new QWidget(this);
  auto* layout = new QVBoxLayout(middle);
  layout->setContentsMargins(2, 2, 2, 2);
  layout->setSpacing(2);
  layout->addWidget(messages_);
  layout->addWidget(views_, 1);
  setCentralWidget(middle);
  workspace.jobs = jobs_;
  workspace.moveByTool = [this](vtkMatrix4x4* pose, bool grasping) {
    views_->Volume()->Handles()->Widget()->StepTool(pose, grasping);
  };
  connect(bench_, &Workbench::Said, messages_, &MessageBar::Show);
  // VTK classes report on whatever thread they run.
  Messages::Install([bench = QPointer<Workbench>(bench_)](const std::string& text, bool isError) {
    const QString message = QString::fromUtf8(text.c_str());
    QMetaObject::invokeMethod(bench, [bench, message, isError] {
      if (bench)
        isError ? bench->Warn(message) : bench->Note(message);
    });
  });

  MakeMenus();
  MakePanels();
  statusBar()->addWidget(readout_, 1);
  statusBar()->addPermanentWidget(jobs_);
  for (auto changed : {&Workbench::HistoryChanged, &Workbench::VolumesChanged})
    connect(bench_, changed, this, &MainWindow::ShowTitle);
  ShowTitle();
  RestoreLayout();
  new Focus(this, views_->Slices()[0]->Canvas());
}

MainWindow::~MainWindow()
{
  bench_->Shared().moveByTool = [](vtkMatrix4x4*, bool) {};
  Messages::Install({});
}

void MainWindow::MakeMenus()
{
  const char* const titles[] = {QT_TR_NOOP("&File"),  QT_TR_NOOP("&Edit"),   QT_TR_NOOP("&View"), QT_TR_NOOP("&Tools"),
                                QT_TR_NOOP("&Align"), QT_TR_NOOP("&Stitch"), QT_TR_NOOP("&Help")};
  for (std::size_t i = 0; i < menus_.size(); i++) {
    menus_[i] = menuBar()->addMenu(tr(titles[i]));
    menus_[i]->setToolTipsVisible(true);
  }
  auto* bar = addToolBar(tr("Tools"));
  bar->setObjectName("toolBar");
  bar->setMovable(false);
  bar->addAction(files_->OpenAction());
  bar->addAction(files_->SaveAction());
  bar->addSeparator();
  bar->addAction(edits_->UndoAction());
  bar->addAction(edits_->RedoAction());
  edits_->UndoAction()->setIconText(tr("Undo"));
  edits_->RedoAction()->setIconText(tr("Redo"));
  bar->addSeparator();
  looks_->AddTools(Menu(Place::Tools), bar);
  bar->addSeparator();
  looks_->AddTo(Menu(Place::View), bar);
  edits_->AddTo(Menu(Place::Edit));
  files_->AddTo(Menu(Place::File));
  (new ExportActions(bench_->Shared(), this))->AddTo(Menu(Place::File), this);
  Menu(Place::Help)
      ->addAction(MakeAction(this, "keys", tr("&Keys and mouse"), "F1", tr("What keys and mouse buttons do"),
                             [this] { ShowKeysPage(this, WorkbenchKeys()); }));
}

void MainWindow::MakePanels()
{
  setDockOptions(QMainWindow::AnimatedDocks | QMainWindow::AllowTabbedDocks);
  setTabPosition(Qt::RightDockWidgetArea, QTabWidget::East); // all of their names can be read
  auto* volumes = new VolumePanel(bench_, this);
  AddLeft(volumes, tr("Volumes"));
  AddLeft(new PosePanel(bench_, this), tr("Pose"));
  AddPanel(new ViewPanel(bench_, views_, this), tr("View"));
  AddPanel(new BrushPanel(bench_, this), tr("Brush"));
  AddPanel(new HistoryPanel(bench_, this), tr("History"));
  Workspace& workspace = bench_->Shared();
  auto* registration = new RegistrationPanel(bench_, this);
  AddPanel(registration, tr("Align"));
  for (auto changed : {&Workbench::VolumesChanged, &Workbench::PosesChanged})
    connect(bench_, changed, registration->Landmarks(), &LandmarkBox::ShowLandmarks);
  Menu(Place::Align)
      ->addAction(MakeAction(this, "refineAction", tr("&Refine from here"), "R",
                             tr("Align the selected volumes to the others from where they are; can be undone"),
                             [registration] { registration->Refine(); }));
  Menu(Place::Align)
      ->addAction(MakeAction(this, "alignAllAction", tr("Align &all"), "Shift+R",
                             tr("Align all volumes to the first; can be undone"), [registration] { registration->AlignAll(); }));
  AddPanel(new CheckPanel(bench_, this), tr("Check"));
  auto* result = new ResultPanel(workspace, this);
  AddPanel(result, tr("Stitch"));
  for (auto changed : {&Workbench::VolumesChanged, &Workbench::PosesChanged, &Workbench::VoxelsChanged,
                       &Workbench::HistoryChanged, &Workbench::SelectionChanged})
    connect(bench_, changed, result, &ResultPanel::ShowResults);
  connect(volumes, &VolumePanel::MakeAgain, result, &ResultPanel::MakeAgain);
  Menu(Place::Stitch)
      ->addAction(MakeAction(this, "stitchAction", tr("&Stitch and embed"), "",
                             tr("Make one volume of those that are shown: the panel Stitch"), [result] {
                               auto* dock = result->window()->findChild<QDockWidget*>(result->objectName() + "Dock");
                               dock->show();
                               dock->raise();
                             }));
  Menu(Place::Stitch)
      ->addAction(MakeAction(this, "compareAction", tr("&Compare with sources"), "T",
                             tr("Show the result alone, and then its sources instead, in all views"),
                             [result] { result->Compare(); }));
  auto* training = new TrainingPanel(bench_, this);
  AddPanel(training, tr("Train"));
  auto* score = new QLabel(this);
  score->setObjectName("scoreReadout");
  connect(training, &TrainingPanel::ScoreShown, score, &QLabel::setText);
  statusBar()->addPermanentWidget(score);
  AddPanel(new TrackerPanel(workspace, this), tr("Tracker"));
}

QDockWidget* MainWindow::AddDock(Qt::DockWidgetArea area, QWidget* panel, const QString& title, QWidget* content)
{
  auto* dock = new QDockWidget(title, this);
  dock->setObjectName(panel->objectName() + "Dock");
  dock->setWidget(content);
  addDockWidget(area, dock);
  Menu(Place::View)->addAction(dock->toggleViewAction());
  return dock;
}

void MainWindow::AddLeft(QWidget* panel, const QString& title)
{
  AddDock(Qt::LeftDockWidgetArea, panel, title, panel);
}

void MainWindow::AddPanel(QWidget* panel, const QString& title)
{
  auto* scroll = new PanelScroll(panel, this);
  QDockWidget* dock = AddDock(Qt::RightDockWidgetArea, panel, title, scroll);
  if (!lastPanel_) {
    lastPanel_ = dock;
    return;
  }
  tabifyDockWidget(lastPanel_, dock);
  lastPanel_->raise();
}

void MainWindow::RestoreLayout()
{
  resize(1280, 800);
  // The views get what the panels can spare.
  resizeDocks({findChild<QDockWidget*>("volumePanelDock"), findChild<QDockWidget*>("viewPanelDock")}, {250, 240}, Qt::Horizontal);
  QSettings settings;
  restoreGeometry(settings.value("window/geometry").toByteArray());
  restoreState(settings.value("window/state").toByteArray(), LayoutVersion);
  bench_->SetShown(Remembered());
}

void MainWindow::Start(const QString& project, const QStringList& volumes)
{
  bench_->Session()->SetAutomaticBackups(true);
  OfferAbandoned(bench_, files_);
  if (!project.isEmpty())
    files_->Open({project});
  if (!volumes.isEmpty())
    files_->Open(volumes);
}

void MainWindow::ShowTitle()
{
  const auto* session = bench_->Session();
  const QString path = QString::fromStdString(session->GetProjectPath());
  const QString name = !path.isEmpty()                     ? QFileInfo(path).fileName()
                       : session->GetNumberOfVolumes() > 0 ? tr("Not saved yet")
                                                           : QString();
  setWindowTitle(name.isEmpty() ? QString("Echorama") : QString("%1[*] \u2014 Echorama").arg(name));
  setWindowFilePath(path);
  setWindowModified(files_->HasUnsavedWork());
}

// What runs comes first: it may make what is to be saved. No question stops the window.
bool MainWindow::AsksBeforeClosing()
{
  if (jobs_->Count() > 0) {
    const auto closeThen = [this] {
      if (jobs_->Count() == 0)
        close();
      else
        connect(jobs_, &JobBar::CountChanged, this, &MainWindow::CloseWhenDone, Qt::UniqueConnection);
    };
    bench_->Ask(tr("%1 is still running.").arg(jobs_->Labels().join(", ")),
                {{tr("Stay"), {}}, {tr("Close when it is done"), closeThen}, {tr("Stop it and close"), [this, closeThen] {
                                                                                jobs_->StopAll();
                                                                                closeThen();
                                                                              }}});
    return true;
  }
  if (mayClose_ || !files_->HasUnsavedWork())
    return false;
  files_->WhenSaved(tr("Save what you did before the window closes?"), [this] {
    mayClose_ = true;
    close();
    mayClose_ = false; // it may have stayed
  });
  return true;
}

void MainWindow::CloseWhenDone(int running)
{
  if (running > 0)
    return;
  disconnect(jobs_, &JobBar::CountChanged, this, &MainWindow::CloseWhenDone);
  QTimer::singleShot(0, this, &QWidget::close); // the job that ended is not quite gone
}

void MainWindow::closeEvent(QCloseEvent* event)
{
  if (AsksBeforeClosing()) {
    event->ignore();
    return;
  }
  QSettings settings;
  settings.setValue("window/geometry", saveGeometry());
  settings.setValue("window/state", saveState(LayoutVersion));
  Remember(bench_->Shown());
  event->accept();
}

void MainWindow::dragEnterEvent(QDragEnterEvent* event)
{
  LetDrop(event);
}

void MainWindow::dropEvent(QDropEvent* event)
{
  const QStringList paths = DroppedFiles(event);
  if (paths.isEmpty())
    return;
  activateWindow();
  files_->Open(paths);
}

} // namespace echorama
