// SPDX-License-Identifier: BSD-3-Clause
#include "SimulatorWindow.h"
#include "BodyView.h"
#include "CineBar.h"
#include "Controls.h"
#include "Core/Base/Angles.h"
#include "Core/Base/Error.h"
#include "Core/Base/NumberText.h"
#include "DroppedFiles.h"
#include "Focus.h"
#include "ImageView.h"
#include "Job.h"
#include "JobBar.h"
#include "KeysPage.h"
#include "MessageBar.h"
#include "Messages.h"
#include "NeedlePanel.h"
#include "NeedleTool.h"
#include "OutputPanel.h"
#include "ParameterPanel.h"
#include "PressedStates.h"
#include "ProbeTracker.h"
#include "Scan.h"
#include "Snapshot.h"
#include "TaskPanel.h"
#include <cmath>
#include <QAction>
#include <QCloseEvent>
#include <QDockWidget>
#include <QFileDialog>
#include <QFileInfo>
#include <QLabel>
#include <QMenuBar>
#include <QPointer>
#include <QScrollArea>
#include <QSettings>
#include <QSplitter>
#include <QStandardPaths>
#include <QStatusBar>
#include <QTimer>
#include <QVBoxLayout>
#include <QVTKOpenGLNativeWidget.h>

namespace echorama {

namespace {

constexpr double StepMm = 2.0, LongStepMm = 10.0, StepDegrees = 2.0, RotateDegrees = 5.0, PressMm = 1.0, DepthStepMm = 10.0,
                 GainStepDb = 2.0;
constexpr int LayoutVersion = 1;

QVector<KeysOf> SimulatorKeys()
{
  using Text = QObject;
  return {{Text::tr("Mouse on the body"),
           {{Text::tr("Left drag"), Text::tr("slide the probe over the skin")},
            {Text::tr("Shift + left drag"), Text::tr("tilt (up and down) and rock (sideways)")},
            {Text::tr("Ctrl + left drag"), Text::tr("rotate the probe about its axis")},
            {Text::tr("Double click"), Text::tr("put the probe there")},
            {Text::tr("Left drag on the needle"),
             Text::tr("put it elsewhere on the skin; with Shift steer it, with Ctrl in and out")},
            {Text::tr("Ctrl + Shift + left drag"), Text::tr("bring the needle there")},
            {Text::tr("Wheel on the needle"), Text::tr("advance and withdraw it")},
            {Text::tr("Right drag, middle drag, wheel"), Text::tr("turn, move and zoom the view")}}},
          {Text::tr("Mouse on the image"),
           {{Text::tr("Wheel"), Text::tr("rotate the probe; while frozen: go through what was seen")},
            {Text::tr("Shift + wheel"), Text::tr("tilt")},
            {Text::tr("Alt + wheel"), Text::tr("rock")},
            {Text::tr("Ctrl + wheel"), Text::tr("depth")},
            {Text::tr("Left (callipers)"), Text::tr("set the ends of a line, or drag one")}}}};
}

} // namespace

SimulatorWindow::SimulatorWindow(QWidget* parent)
  : QMainWindow(parent), scan_(new Scan(this)), needle_(new NeedleTool(scan_)), messages_(new MessageBar(this)),
    jobs_(new JobBar(this)), body_(new BodyView(scan_, needle_, this)), image_(new ImageView(this)),
    solution_(new ImageView(this)), cine_(new CineBar(scan_, this)), views_(new QSplitter(this)), readout_(new QLabel(this))
{
  setObjectName("simulator");
  setWindowTitle("Echorama simulator");
  setAcceptDrops(true);
  setTabPosition(Qt::RightDockWidgetArea, QTabWidget::East);
  auto* right = new QWidget(views_);
  auto* rightLayout = new QVBoxLayout(right);
  rightLayout->setContentsMargins(0, 0, 0, 0);
  rightLayout->setSpacing(1);
  images_ = new QBoxLayout(QBoxLayout::TopToBottom);
  images_->setSpacing(1);
  images_->addWidget(image_, 1);
  images_->addWidget(solution_, 1);
  solution_->setObjectName("solutionView");
  solution_->setAccessibleName(tr("Solution"));
  solution_->SetCorner(tr("SOLUTION"));
  solution_->hide();
  rightLayout->addLayout(images_, 1);
  rightLayout->addWidget(cine_);
  views_->addWidget(body_);
  views_->addWidget(right);
  views_->setStretchFactor(0, 4);
  views_->setStretchFactor(1, 5);
  views_->setSizes({450, 500});
  auto* middle = new QWidget(this);
  auto* layout = new QVBoxLayout(middle);
  layout->setContentsMargins(2, 2, 2, 2);
  layout->setSpacing(2);
  layout->addWidget(messages_);
  layout->addWidget(views_, 1);
  setCentralWidget(middle);
  readout_->setObjectName("readout");
  statusBar()->addWidget(readout_, 1);
  statusBar()->addPermanentWidget(jobs_);

  connect(scan_, &Scan::Said, messages_, &MessageBar::Show);
  Messages::Install([bar = QPointer<MessageBar>(messages_)](const std::string& text, bool isError) {
    const QString message = QString::fromUtf8(text.c_str());
    QMetaObject::invokeMethod(bar, [bar, message, isError] {
      if (bar)
        bar->Show({isError ? Message::Warning : Message::Note, message, {}});
    });
  });
  connect(scan_, &Scan::FrameMade, this, &SimulatorWindow::ShowFrame);
  connect(scan_, &Scan::StateChanged, this, &SimulatorWindow::ShowState);
  connect(scan_, &Scan::FrozenChanged, this, &SimulatorWindow::ShowState);
  connect(image_, &ImageView::WheelTurned, this, &SimulatorWindow::Turn);
  auto* timer = new QTimer(this); // what changes with time alone
  connect(timer, &QTimer::timeout, this, &SimulatorWindow::ShowState);
  timer->start(200);

  MakeMenus();
  const auto source = [this] { return scan_->Scanner().Parameters(); };
  const auto set = [this](const char* name, const std::string& text) { scan_->SetControl(name, text); };
  auto* controls = new QWidget(this);
  controls->setObjectName("imagePanel");
  auto* column = new QVBoxLayout(controls);
  column->setContentsMargins(0, 0, 0, 0);
  for (const auto& [title, list] : std::vector<std::pair<QString, std::vector<ParameterPanel::Control>>>{
           {tr("Image"),
            {{"Probe", tr("Probe")},
             {"DepthMm", tr("Depth"), 20, 250, tr("as usual")},
             {"GainDb", tr("Gain"), -40, 40},
             {"DynamicRangeDb", tr("Dynamic range"), 20, 120},
             {"FrequencyMHz", tr("Frequency"), 1, 60, tr("the usual")},
             {"FocusMm", tr("Focus"), 0, 200, tr("the probe's")},
             {"ThicknessMm", tr("Thickness"), 0, 10, tr("the probe's")},
             {"Overlap", tr("Overlap")},
             {"ShowInvented", tr("Invented")}}},
           {tr("Time-gain curve, from the face down"),
            {{"Tgc1Db", "1"},
             {"Tgc2Db", "2"},
             {"Tgc3Db", "3"},
             {"Tgc4Db", "4"},
             {"Tgc5Db", "5"},
             {"Tgc6Db", "6"},
             {"Tgc7Db", "7"},
             {"Tgc8Db", "8"}}},
           {tr("For the eye"),
            {{"NoiseDb", tr("Noise"), -80, 0, tr("none")},
             {"NoiseMoves", tr("Noise moves")},
             {"ShadowDbPerCm", tr("Shadow"), 0, 60},
             {"EnhancementDbPerCm", tr("Enhancement")}}},
           {tr("Scene"),
            {{"Source", tr("Made from")},
             {"Speckle", tr("Speckle")},
             {"DarkeningDb", tr("Shadow a surface"), 0, 12},
             {"PressMm", tr("Pressed"), 0, 20, {}, "scene"}}}, // volumes give way by pressed states alone, and to the keys that
                                                               // press
           {tr("Custom probe"), {{"FanAngle", tr("Fan angle"), 0, 180}, {"FanWidth", tr("Fan width"), 0, 100}}}}) {
    auto* label = new QLabel("<b>" + title + "</b>", controls);
    auto* panel = new ParameterPanel(source, list, set, controls);
    connect(scan_, &Scan::ControlsChanged, panel, &ParameterPanel::ShowValues);
    column->addWidget(label);
    column->addWidget(panel);
  }
  column->addStretch(1);
  connect(scan_, &Scan::FrozenChanged, controls, &QWidget::setDisabled);
  AddPanel(controls, tr("Image"));
  AddPanel(new NeedlePanel(scan_, needle_, this), tr("Needle"));
  auto* tracker = new ProbeTracker(scan_, needle_, this);
  AddPanel(tracker, tr("Tracker"));
  outputs_ = new OutputPanel(scan_, this);
  connect(outputs_, &OutputPanel::JobStarted, jobs_, &JobBar::Watch);
  connect(tracker, &ProbeTracker::JobStarted, jobs_, &JobBar::Watch);
  AddPanel(outputs_, tr("Record"));
  tasks_ = new TaskPanel(scan_, needle_, image_, this);
  connect(tasks_, &TaskPanel::RunningChanged, outputs_, &OutputPanel::ForbidReplay);
  connect(tasks_, &TaskPanel::RunningChanged, tracker, &QWidget::setDisabled); // a tool that comes later may be anywhere
  connect(tasks_, &TaskPanel::MarksChanged, body_, &BodyView::ShowMarks);
  connect(tasks_, &TaskPanel::SolutionChanged, this, &SimulatorWindow::ShowSolution);
  AddPanel(tasks_, tr("Tasks"));
  ShowState();
  resize(1280, 800);
  QSettings settings;
  restoreGeometry(settings.value("window/geometry").toByteArray());
  restoreState(settings.value("window/state").toByteArray(), LayoutVersion);
  new Focus(this, image_);
}

SimulatorWindow::~SimulatorWindow()
{
  delete outputs_; // before the scan that it records
  Messages::Install({});
}

void SimulatorWindow::AddPanel(QWidget* panel, const QString& title)
{
  auto* scroll = new QScrollArea(this);
  scroll->setWidgetResizable(true);
  scroll->setFocusPolicy(Qt::NoFocus); // keys are for the views
  scroll->setFrameShape(QFrame::NoFrame);
  scroll->setHorizontalScrollBarPolicy(Qt::ScrollBarAlwaysOff);
  scroll->setWidget(panel);
  scroll->setMinimumWidth(270);
  auto* dock = new QDockWidget(title, this);
  dock->setObjectName(panel->objectName() + "Dock");
  dock->setWidget(scroll);
  addDockWidget(Qt::RightDockWidgetArea, dock);
  viewMenu_->addAction(dock->toggleViewAction());
  if (lastPanel_) {
    tabifyDockWidget(qobject_cast<QDockWidget*>(lastPanel_), dock);
    qobject_cast<QDockWidget*>(lastPanel_)->raise();
  } else {
    lastPanel_ = dock;
  }
}

void SimulatorWindow::MakeMenus()
{
  QMenu* file = menuBar()->addMenu(tr("&File"));
  file->addAction(MakeAction(this, "open", tr("&Open volumes..."), "Ctrl+O", tr("Scan other volumes"), [this] {
    const QStringList files = QFileDialog::getOpenFileNames(this, tr("Volumes to scan"));
    if (!files.isEmpty())
      Open(files);
  }));
  file->addAction(MakeAction(this, "snapshot", tr("&Save the image and its pose"), "S",
                             tr("Write the image (PNG) and what it was made from (JSON) into the folder for pictures"),
                             [this] { TakePicture(); }));
  file->addAction(MakeAction(this, "quit", tr("&Quit"), "Ctrl+Q", tr("Close the window"), [this] { close(); }));
  MakeProbeMenu(menuBar()->addMenu(tr("&Probe")));
  MakeImageMenu(menuBar()->addMenu(tr("&Image")));
  AddNeedleActions(menuBar()->addMenu(tr("&Needle")), needle_, scan_);
  viewMenu_ = menuBar()->addMenu(tr("&View"));
  viewMenu_->addAction(MakeAction(this, "fullScreen", tr("&Full screen"), "F11", tr("Fill the screen, and back"),
                                  [this] { isFullScreen() ? showNormal() : showFullScreen(); }));
  viewMenu_->addAction(MakeAction(this, "fit", tr("Fit the &body"), "B", tr("Show all of the body, from the side of the probe"),
                                  [this] { body_->Fit(); }));
  QMenu* help = menuBar()->addMenu(tr("&Help"));
  help->addAction(MakeAction(this, "keys", tr("&Keys and mouse"), "F1", tr("What keys and mouse buttons do"),
                             [this] { ShowKeysPage(this, SimulatorKeys()); }));
}

double SimulatorWindow::Across(double toTheRight) const
{
  return scan_->IsFlipped() ? -toTheRight : toTheRight;
}

void SimulatorWindow::MakeProbeMenu(QMenu* menu)
{
  const auto add = [&](const char* name, const QString& label, const char* key, const QString& help,
                       const std::function<void()>& move) { menu->addAction(MakeAction(this, name, label, key, help, move)); };
  struct Way {
    const char* name;
    const char* key;
    QString where;
    double along, across;
  };
  // On the screen: right is along the array towards its mark, up is across it, away from who
  // looks at the image.
  for (const Way& way :
       {Way{"Right", "Right", tr("right in the image"), 1, 0}, Way{"Left", "Left", tr("left in the image"), -1, 0},
        Way{"Up", "Up", tr("away from you, across the image"), 0, -1},
        Way{"Down", "Down", tr("towards you, across the image"), 0, 1}}) {
    const QString key(way.key);
    const auto slide = [this, way](double mm) { scan_->Slide(Across(mm) * way.along, mm * way.across); };
    add(QString("slide%1").arg(way.name).toLatin1(), tr("Slide: %1").arg(way.where), way.key,
        tr("Slide the probe 2 mm, %1").arg(way.where), [slide] { slide(StepMm); });
    add(QString("slideFar%1").arg(way.name).toLatin1(), tr("Slide far: %1").arg(way.where), ("Shift+" + key).toLatin1(),
        tr("Slide the probe 10 mm, %1").arg(way.where), [slide] { slide(LongStepMm); });
  }
  menu->addSeparator();
  add("tiltUp", tr("Tilt away"), "Ctrl+Up", tr("Tilt the probe by 2 degrees: the image looks away from you"),
      [this] { scan_->Hold(StepDegrees, 0.0); });
  add("tiltDown", tr("Tilt towards you"), "Ctrl+Down", tr("Tilt the probe by 2 degrees: the image looks towards you"),
      [this] { scan_->Hold(-StepDegrees, 0.0); });
  add("rockRight", tr("Rock to the right"), "Ctrl+Right", tr("Rock the probe by 2 degrees: it looks more to the right"),
      [this] { scan_->Hold(0.0, Across(StepDegrees)); });
  add("rockLeft", tr("Rock to the left"), "Ctrl+Left", tr("Rock the probe by 2 degrees: it looks more to the left"),
      [this] { scan_->Hold(0.0, Across(-StepDegrees)); });
  add("rotateRight", tr("Rotate one way"), "E", tr("Rotate the probe about its axis by 5 degrees"),
      [this] { scan_->Rotate(RotateDegrees); });
  add("rotateLeft", tr("Rotate the other way"), "Q", tr("Rotate the probe about its axis by 5 degrees, the other way"),
      [this] { scan_->Rotate(-RotateDegrees); });
  add("press", tr("Press"), "PgDown", tr("Press the probe 1 mm deeper"), [this] { scan_->Press(PressMm); });
  add("lift", tr("Lift"), "PgUp", tr("Lift the probe by 1 mm: off the skin there is no image"),
      [this] { scan_->Press(-PressMm); });
  menu->addSeparator();
  add("straighten", tr("Upright"), "Home", tr("Hold the probe upright, without pressure"), [this] { scan_->Straighten(); });
  add("toTop", tr("Back to the top"), "Shift+Home", tr("Put the probe where it was at first"), [this] { scan_->PlaceAtTop(); });
}

void SimulatorWindow::MakeImageMenu(QMenu* menu)
{
  const auto add = [&](const char* name, const QString& label, const char* key, const QString& help,
                       const std::function<void()>& done) {
    QAction* action = MakeAction(this, name, label, key, help, done);
    menu->addAction(action);
    return action;
  };
  QAction* freeze =
      add("freeze", tr("&Freeze"), "Space", tr("Stop the image, or go on"), [this] { scan_->SetFrozen(!scan_->IsFrozen()); });
  freeze->setCheckable(true);
  connect(scan_, &Scan::FrozenChanged, freeze, &QAction::setChecked);
  add("cineBack", tr("Cine: back"), "Alt+Left", tr("Frozen: the frame before"), [this] { cine_->Step(-1); });
  add("cineOn", tr("Cine: on"), "Alt+Right", tr("Frozen: the next frame"), [this] { cine_->Step(1); });
  menu->addSeparator();
  add("deeper", tr("Deeper"), "]", tr("See 10 mm deeper"), [this] { ChangeDepth(DepthStepMm); });
  add("shallower", tr("Shallower"), "[", tr("See 10 mm less deep"), [this] { ChangeDepth(-DepthStepMm); });
  add("moreGain", tr("More gain"), "+", tr("Make the image 2 dB brighter"), [this] { ChangeGain(GainStepDb); });
  add("lessGain", tr("Less gain"), "-", tr("Make the image 2 dB darker"), [this] { ChangeGain(-GainStepDb); });
  QAction* flip = add("flip", tr("Left and &right exchanged"), "F", tr("Exchange left and right in the image"), [] {});
  flip->setCheckable(true);
  connect(flip, &QAction::toggled, scan_, &Scan::SetFlipped);
  QAction* invented = add("invented", tr("Show what is &invented"), "I",
                          tr("What embedding invented, in colour; else nothing is seen there"), [] {});
  invented->setCheckable(true);
  invented->setChecked(true);
  connect(invented, &QAction::toggled, scan_, [this](bool on) { scan_->SetControl("ShowInvented", on ? "on" : "off"); });
  connect(scan_, &Scan::ControlsChanged, invented, [this, invented] {
    ParameterList parameters = scan_->Scanner().Parameters();
    const QSignalBlocker same(invented);
    invented->setChecked(Named(parameters, "ShowInvented").Number() != 0.0);
  });
  connect(scan_, &Scan::FrozenChanged, invented, &QAction::setDisabled);
  menu->addSeparator();
  QAction* measure = add("callipers", tr("&Callipers"), "C", tr("Measure in the image: click on both ends"), [] {});
  measure->setCheckable(true);
  connect(measure, &QAction::toggled, image_, &ImageView::SetMeasuring);
  add("clearCallipers", tr("Remove all callipers"), "Shift+C", tr("Remove what was measured"),
      [this] { image_->ClearCallipers(); });
}

void SimulatorWindow::Open(const QStringList& files, const QString& skin, const Eigen::Vector3d& up)
{
  const auto subject = std::make_shared<Subject>(scan_->Body()); // which states are held against, if nothing else is opened
  const auto isBody = std::make_shared<bool>(false);
  Job* job = Job::Start(
      this, tr("Reading"),
      [=](const Progress& progress) {
        const QStringList states = PressedStatesAmong(files);
        QStringList body = files;
        for (const QString& state : states)
          body.removeAll(state);
        *isBody = !body.isEmpty();
        if (*isBody)
          *subject = ReadSubject(body, skin, progress.Part(0.0, states.isEmpty() ? 1.0 : 0.8));
        if (!states.isEmpty())
          subject->pressed = ReadPressedStates(states, *subject, progress.Part(*isBody ? 0.8 : 0.0, 1.0));
      },
      [this, subject, isBody, up] {
        if (!*isBody && (scan_->Body().volumes != subject->volumes || scan_->Body().tissue != subject->tissue)) {
          messages_->Show({Message::Warning,
                           tr("Another body was opened while pressed states were read; open them again if they are of it"),
                           {}});
          return;
        }
        const QString pressed = subject->pressed.empty()
                                    ? QString()
                                    : tr("The body gives way to a probe that is pressed in (Page Down), by up to %1 mm")
                                          .arg(PressMmOf(subject->pressed.back()));
        if (!pressed.isEmpty())
          messages_->Show({Message::Note, pressed, {}});
        if (!*isBody) {
          scan_->SetPressed(std::move(subject->pressed));
          return;
        }
        subject->up = up;
        scan_->SetSubject(std::move(*subject));
        QStringList names;
        for (const QString& file : scan_->Body().files)
          names.append(QFileInfo(file).fileName());
        setWindowTitle(QString("%1 \u2014 Echorama simulator").arg(names.join(", ")));
      },
      [this](const QString& error) {
        messages_->Show({Message::Warning, error, {}});
      });
  jobs_->Watch(job);
}

QString SimulatorWindow::TakePicture()
{
  if (scan_->Picture().image.isNull()) {
    messages_->Show({Message::Note, tr("There is no image to save"), {}});
    return {};
  }
  try {
    const QDir folder(QStandardPaths::writableLocation(QStandardPaths::PicturesLocation) + "/Echorama");
    const QString path = WriteSnapshot(folder, scan_->Body().files, scan_->Picture(), scan_->Frame(), image_->Callipers());
    messages_->Show({Message::Note, tr("Saved as %1, and what it was made from beside it").arg(path), {}});
    return path;
  } catch (const Error& error) {
    messages_->Show({Message::Warning, QString::fromUtf8(error.what()), {}});
    return {};
  }
}

// At once, not when the events that wait are done: this is what a hand waits for.
void SimulatorWindow::ShowFrame()
{
  image_->SetPicture(scan_->Picture());
  image_->SetTip(scan_->Scanner().MarkedTip());
  ShowState();
  image_->repaint();
}

void SimulatorWindow::ShowState()
{
  image_->SetState(scan_->State(), scan_->IsStale());
  image_->SetCorner(scan_->IsFrozen() ? tr("FROZEN") : needle_->State());
  image_->SetFocusDepth(scan_->Scanner().FocusMm());
  if (scan_->Body().IsEmpty())
    return;
  const Eigen::Vector3d at = scan_->ProbeToWorld().translation();
  const ProbeHold& held = scan_->Held();
  QString text = tr("%1  %2  %3 mm   tilt %4\u00b0  rock %5\u00b0  press %6 mm   depth %7 mm   %8 frames/s")
                     .arg(at[0], 0, 'f', 1)
                     .arg(at[1], 0, 'f', 1)
                     .arg(at[2], 0, 'f', 1)
                     .arg(held.tilt / RadiansPerDegree, 0, 'f', 0)
                     .arg(held.rock / RadiansPerDegree, 0, 'f', 0)
                     .arg(held.pressMm, 0, 'f', 0)
                     .arg(scan_->Scanner().Probe().depthMax, 0, 'f', 0)
                     .arg(scan_->FramesPerSecond(), 0, 'f', 0);
  if (std::isfinite(scan_->LatencyMs()))
    text += tr("   %1 ms").arg(scan_->LatencyMs(), 0, 'f', 0);
  readout_->setText(text);
}

void SimulatorWindow::Turn(double notches, Qt::KeyboardModifiers keys)
{
  if (keys & Qt::ControlModifier)
    ChangeDepth(-DepthStepMm * notches);
  else if (scan_->IsFrozen())
    cine_->Step(static_cast<int>(std::lround(-notches)));
  else if (keys & Qt::ShiftModifier)
    scan_->Hold(StepDegrees * notches, 0.0);
  else if (keys & Qt::AltModifier)
    scan_->Hold(0.0, Across(StepDegrees * notches));
  else
    scan_->Rotate(RotateDegrees * notches);
}

void SimulatorWindow::ChangeDepth(double byMm)
{
  const double depth = scan_->Scanner().Probe().depthMax + byMm;
  if (depth >= DepthStepMm)
    scan_->SetControl("DepthMm", NumberText(depth));
}

void SimulatorWindow::ChangeGain(double byDb)
{
  ParameterList parameters = scan_->Scanner().Parameters();
  scan_->SetControl("GainDb", NumberText(Named(parameters, "GainDb").Number() + byDb));
}

void SimulatorWindow::dragEnterEvent(QDragEnterEvent* event)
{
  LetDrop(event);
}

void SimulatorWindow::dropEvent(QDropEvent* event)
{
  const QStringList paths = DroppedFiles(event);
  if (paths.isEmpty())
    return;
  activateWindow();
  Open(paths);
}

void SimulatorWindow::ShowSolution(const PlanePicture* picture)
{
  const QRect room = images_->geometry();
  images_->setDirection(room.width() > 1.4 * room.height() ? QBoxLayout::LeftToRight : QBoxLayout::TopToBottom);
  solution_->setVisible(picture != nullptr);
  solution_->SetPicture(picture ? *picture : PlanePicture());
}

bool SimulatorWindow::AsksBeforeClosing()
{
  QStringList running;
  if (tasks_->IsRunning())
    running.append(tr("An attempt is running, and has no answer yet."));
  if (outputs_->IsRecording())
    running.append(tr("A recording is running."));
  if (running.isEmpty())
    return false;
  const QString text = running.join(" ");
  if (!messages_->Texts().contains(text)) // it is asked already
    messages_->Show({Message::Question, text, {{tr("Stay"), {}}, {tr("End it and close"), [this] {
                                                                    tasks_->GiveUp();
                                                                    outputs_->EndReplay();
                                                                    if (outputs_->Finish())
                                                                      jobs_->WhenDone([this] { close(); });
                                                                  }}}});
  return true;
}

void SimulatorWindow::closeEvent(QCloseEvent* event)
{
  if (AsksBeforeClosing()) {
    event->ignore();
    return;
  }
  QSettings settings;
  settings.setValue("window/geometry", saveGeometry());
  settings.setValue("window/state", saveState(LayoutVersion));
  event->accept();
}

} // namespace echorama
