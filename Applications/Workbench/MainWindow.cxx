// SPDX-License-Identifier: BSD-3-Clause
#include "MainWindow.h"
#include "AlignmentHandles.h"
#include "BrushPanel.h"
#include "CheckPanel.h"
#include "Controls.h"
#include "DropAnywhere.h"
#include "EditActions.h"
#include "EmptyPage.h"
#include "ExportActions.h"
#include "FileActions.h"
#include "Focus.h"
#include "FocusRing.h"
#include "GuideBar.h"
#include "HistoryPanel.h"
#include "JobBar.h"
#include "LandmarkBox.h"
#include "MessageBar.h"
#include "Messages.h"
#include "Mnemonics.h"
#include "PanelScroll.h"
#include "PosePanel.h"
#include "Preferences.h"
#include "ProjectActions.h"
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
#include <QApplication>
#include <QCheckBox>
#include <QClipboard>
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
  auto* middle = new QWidget(this);
  auto* layout = new QVBoxLayout(middle);
  layout->setContentsMargins(2, 2, 2, 2);
  layout->setSpacing(2);
  auto* above = new QVBoxLayout; // without a gap, so that nothing takes no place
  above->setSpacing(0);
  above->addWidget(jobs_);
  above->addWidget(messages_);
  layout->addLayout(above);
  layout->addWidget(views_, 1);
  setCentralWidget(middle);
  workspace.jobs = jobs_;
  workspace.moveByTool = [this](vtkMatrix4x4* pose, bool grasping) {
    views_->Volume()->Handles()->Widget()->StepTool(pose, grasping);
  };
  connect(bench_, &Workbench::Said, this, &MainWindow::Say);
  connect(jobs_, &JobBar::CountChanged, this, [this](int count) {
    if (count == 0)
      bench_->Forget("running");
  });
  // VTK classes report on whatever thread they run.
  Messages::Install([bench = QPointer<Workbench>(bench_)](const std::string& text, bool isError) {
    const QString message = QString::fromUtf8(text.c_str());
    QMetaObject::invokeMethod(bench, [bench, message, isError] {
      if (!bench)
        return;
      if (!isError)
        return bench->Note(message);
      // Nobody here knows what was to be done, so the text is for somebody who may.
      bench->Warn(message, {{tr("Copy the text"), [message] { QApplication::clipboard()->setText(message); }}});
    });
  });

  MakeMenus();
  MakePanels();
  statusBar()->addWidget(readout_, 1);
  for (auto changed : {&Workbench::HistoryChanged, &Workbench::VolumesChanged})
    connect(bench_, changed, this, &MainWindow::ShowTitle);
  ShowTitle();
  RestoreLayout();
  focus_ = new Focus(this, views_->Slices()[0]->Canvas());
  new FocusRing(this);
  Apply(Preferences::Kept(), bench_);
  empty_ = new EmptyPage(views_, files_->OpenAction(), files_->OpenProjectAction(),
                         [this](const Sample& sample) { OpenSample(sample); });
  connect(bench_, &Workbench::VolumesChanged, this, &MainWindow::ShowEmpty);
  new DropAnywhere(this, [this](const QStringList& paths) { files_->Open(paths); });
}

MainWindow::~MainWindow()
{
  jobs_->disconnect(this); // jobs end with their panels, when the parts that would be told are gone
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
  lookBar_ = addToolBar(tr("Looks"));
  lookBar_->setObjectName("lookBar");
  lookBar_->setMovable(false);
  looks_->AddTo(Menu(Place::View), lookBar_);
  edits_->AddTo(Menu(Place::Edit));
  Menu(Place::Edit)->addSeparator();
  Menu(Place::Edit)
      ->addAction(MakeAction(this, "preferencesAction", tr("&Preferences..."), "Ctrl+,",
                             tr("Colours of volumes, light or dark, language"), [this] { ShowPreferences(this, bench_); }));
  files_->AddTo(Menu(Place::File));
  auto* projects = new ProjectActions(bench_, this);
  connect(projects, &ProjectActions::OpenAsked, files_, &FileActions::OpenCopy);
  projects->AddTo(Menu(Place::File));
  (new ExportActions(bench_->Shared(), this))->AddTo(Menu(Place::File), this);
  Menu(Place::File)->addSeparator();
  Menu(Place::File)
      ->addAction(MakeAction(this, "quit", tr("&Quit"), "Ctrl+Q", tr("Ends the program; asks first when something is not saved"),
                             [this] { close(); }));
  Menu(Place::Help)
      ->addAction(MakeAction(this, "keys", tr("&Keys and mouse"), "F1", tr("What keys and mouse buttons do"),
                             [this] { ShowKeysPage(this, WorkbenchKeys()); }));
}

void MainWindow::MakePanels()
{
  setDockOptions(QMainWindow::AnimatedDocks | QMainWindow::AllowTabbedDocks);
  setTabPosition(Qt::RightDockWidgetArea, QTabWidget::East); // all of their names can be read
  Menu(Place::View)->addSeparator();
  panels_ = Menu(Place::View)->addMenu(tr("&Go to panel"));
  shownPanels_ = Menu(Place::View)->addMenu(tr("Panels that are sho&wn"));
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
  connect(registration->Landmarks(), &LandmarkBox::PlaceAsked, this, [this](double x, double y, double z) {
    views_->CentreOn({x, y, z});
  });
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
                             tr("Make one volume of those that are shown: the panel Stitch"),
                             [this, result] { ShowPanel(result); }));
  Menu(Place::Stitch)
      ->addAction(MakeAction(this, "compareAction", tr("&Compare with sources"), "T",
                             tr("Show the result alone, and then its sources instead, in all views"),
                             [result] { result->Compare(); }));
  training_ = new TrainingPanel(bench_, jobs_, this);
  AddPanel(training_, tr("Train"));
  auto* score = new QLabel(this);
  score->setObjectName("scoreReadout");
  connect(training_, &TrainingPanel::ScoreShown, score, &QLabel::setText);
  statusBar()->addPermanentWidget(score);
  AddPanel(new TrackerPanel(workspace, this), tr("Tracker"));

  const auto make = [this, result](bool embedded) {
    result->findChild<QCheckBox*>("embed")->setChecked(embedded);
    ShowPanel(result);
    result->Make(false);
  };
  const auto refine = [this, registration] {
    ShowPanel(registration);
    registration->Refine();
  };
  guide_ = new GuideBar(bench_,
                        {[this] { files_->OpenAction()->trigger(); }, refine,
                         [this] { bench_->Set(&SliceLook::mode, QString("difference")); }, [make] { make(false); },
                         [make] { make(true); }, [this] { files_->Save(); }},
                        this);
  addToolBarBreak();
  addToolBar(guide_);
  QAction* shown = guide_->toggleViewAction();
  shown->setText(tr("&Guide"));
  shown->setStatusTip(tr("Six steps from volumes to one volume"));
  Menu(Place::Help)->addAction(shown);
  for (QMenu* menu : menus_)
    AddMnemonics(menu);
}

void MainWindow::ShowPanel(QWidget* panel)
{
  auto* dock = findChild<QDockWidget*>(panel->objectName() + "Dock");
  dock->show();
  dock->raise();
}

void MainWindow::ShowEmpty()
{
  const int count = bench_->Session()->GetNumberOfVolumes();
  if (count > 1 && volumes_ < 2)
    bench_->Forget("registrationPanel"); // that there were too few
  volumes_ = count;
  const bool isEmpty = count == 0;
  if (isEmpty == empty_->isVisibleTo(views_))
    return;
  const bool hadFocus = empty_->isAncestorOf(focusWidget());
  empty_->setVisible(isEmpty);
  if (hadFocus)
    focus_->GiveBack();
}

void MainWindow::OpenSample(const Sample& sample)
{
  bench_->Forget("sample");
  const auto open = [this, sample] {
    files_->OpenVolumes(VolumesOf(sample), [this, sample] { training_->LoadTruth(TruthOf(sample)); });
  };
  if (IsThere(sample))
    open();
  else
    bench_->Shared().Run(
        this, tr("Making a sample"), [sample](const Progress& progress) { Make(sample, progress); }, open,
        {{tr("Try again"), [this, sample] { OpenSample(sample); }}}, "sample");
}

QDockWidget* MainWindow::AddDock(Qt::DockWidgetArea area, QWidget* panel, const QString& title, QWidget* content)
{
  auto* dock = new QDockWidget(title, this);
  dock->setObjectName(panel->objectName() + "Dock");
  dock->setWidget(content);
  dock->setAcceptDrops(true); // it may float
  addDockWidget(area, dock);
  // The key brings it in front and goes into it; it is a mouse's work to close it, or the menu's.
  const int number = panels_->actions().size() + 1;
  panels_->addAction(MakeAction(this, ("goTo" + panel->objectName()).toLatin1(), title, QString("Ctrl+%1").arg(number % 10),
                                tr("Show the panel %1 and go into it").arg(title), [this, panel] {
                                  ShowPanel(panel);
                                  FocusFirstOf(panel);
                                }));
  shownPanels_->addAction(dock->toggleViewAction());
  return dock;
}

// What Tab would come to first in a panel.
void MainWindow::FocusFirstOf(QWidget* panel)
{
  for (QWidget* part = panel->nextInFocusChain(); part != panel; part = part->nextInFocusChain())
    if (panel->isAncestorOf(part) && (part->focusPolicy() & Qt::TabFocus) == Qt::TabFocus && part->isEnabled() &&
        part->isVisibleTo(panel)) {
      part->setFocus(Qt::TabFocusReason);
      return;
    }
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
  guide_->setVisible(settings.value("window/guide", true).toBool());
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
  if (!files_->HasUnsavedWork())
    bench_->Forget("unsaved");
}

// A panel that could not do what it was asked for is where it can be asked for something else.
void MainWindow::Say(const Message& message)
{
  Message said = message;
  auto* panel = said.topic.isEmpty() ? nullptr : findChild<QWidget*>(said.topic);
  auto* dock = findChild<QDockWidget*>(said.topic + "Dock");
  if (said.text.startsWith("there is no new backup"))
    said.answers = {{tr("Save as..."), [this] { files_->SaveAsAction()->trigger(); }}};
  else if (said.kind == Message::Warning && said.answers.isEmpty() && panel && dock)
    said.answers = {{tr("Show panel %1").arg(dock->windowTitle()), [this, panel] { ShowPanel(panel); }}};
  messages_->Show(said);
}

// What runs comes first: it may make what is to be saved. No question stops the window.
bool MainWindow::AsksBeforeClosing()
{
  if (jobs_->Count() > 0) {
    const auto closeThen = [this] { jobs_->WhenDone([this] { close(); }); };
    bench_->Ask(tr("%1 is still running.").arg(jobs_->Labels().join(", ")),
                {{tr("Stay"), {}},
                 {tr("Close when it is done"), closeThen},
                 {tr("Stop it and close"),
                  [this, closeThen] {
                    jobs_->StopAll();
                    closeThen();
                  }}},
                "running");
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

// All that is on the tool bar is seen, in a second row when texts are large or the window is narrow.
void MainWindow::FitToolBars()
{
  const auto* first = findChild<QToolBar*>("toolBar");
  const bool isWide = first->sizeHint().width() + lookBar_->sizeHint().width() <= width();
  if (isWide == !toolBarBreak(lookBar_))
    return;
  isWide ? removeToolBarBreak(lookBar_) : insertToolBarBreak(lookBar_);
}

void MainWindow::resizeEvent(QResizeEvent* event)
{
  QMainWindow::resizeEvent(event);
  FitToolBars();
}

void MainWindow::changeEvent(QEvent* event)
{
  QMainWindow::changeEvent(event);
  if (event->type() == QEvent::FontChange && lookBar_)
    FitToolBars();
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
  settings.setValue("window/guide", guide_->isVisible());
  Remember(bench_->Shown());
  event->accept();
}

} // namespace echorama
