// SPDX-License-Identifier: BSD-3-Clause
#include "ViewActions.h"
#include "Controls.h"
#include "Flicker.h"
#include "SlicePane.h"
#include "ViewGrid.h"
#include "Workbench.h"
#include <algorithm>
#include <QAction>
#include <QActionGroup>
#include <QMenu>
#include <QToolBar>

namespace echorama {

ViewActions::ViewActions(Workbench* bench, ViewGrid* views, QObject* parent)
  : QObject(parent), bench_(bench), views_(views), tools_(new QActionGroup(this)), shown_(new QActionGroup(this)),
    modes_(new QActionGroup(this))
{
  const auto addTo = [this](QActionGroup* group, const char* name, const QString& label, const char* key, const QString& help,
                            const QVariant& value, const std::function<void()>& triggered) {
    QAction* action = MakeAction(this, name, label, key, help, triggered);
    action->setCheckable(true);
    action->setData(value);
    group->addAction(action);
  };
  const auto addTool = [&](const char* name, const QString& label, const char* key, const QString& help, Tool tool) {
    addTo(tools_, name, label, key, help, static_cast<int>(tool), [this, tool] { bench_->SetTool(tool); });
  };
  addTool("toolLook", tr("&Look"), "1", tr("Point with the left button: the other slices go there"), Tool::Look);
  addTool("toolAlign", tr("&Align"), "2", tr("Drag selected volumes; with Shift they turn; keys x y z keep to an axis"),
          Tool::Align);
  addTool("toolPaint", tr("&Paint"), "3", tr("Paint in the selected volume"), Tool::Paint);
  addTool("toolCarve", tr("&Carve"), "4", tr("Take away parts of the selected volume"), Tool::Carve);
  addTool("toolRestore", tr("&Restore"), "5", tr("Bring back what was painted over or carved away"), Tool::Restore);
  addTool("toolMark", tr("&Mark"), "6",
          tr("Mark landmarks in the selected volume: the same places in two volumes help to align them; drag one to move it"),
          Tool::Mark);
  addTool("toolMeasure", tr("M&easure"), "7", tr("Measure a distance: click on both ends, or drag; the panel Check lists it"),
          Tool::Measure);
  addTool("toolAngle", tr("A&ngle"), "8", tr("Measure an angle: click on its three points, the second where its arms meet"),
          Tool::Angle);

  const auto addShown = [&](const char* name, const QString& label, const char* key, const QString& help, const QString& word) {
    addTo(shown_, name, label, key, help, word, [this, word] { bench_->Set(&SliceLook::shown, word); });
  };
  addShown("showAll", tr("&All"), "A", tr("Slices show all volumes"), "all");
  addShown("showSelected", tr("&Selected"), "S", tr("Slices show the selected volumes alone"), "selected");
  addShown("showOthers", tr("&Others"), "O", tr("Slices show the volumes that are not selected"), "others");
  switch_ = MakeAction(this, "showSwitch", tr("S&witch selected and others"), "Space",
                       tr("Flicker: back and forth between the selected volumes and the others"),
                       [this] { bench_->Set(&SliceLook::shown, bench_->Slices().shown == "selected" ? "others" : "selected"); });

  flicker_ = MakeAction(this, "flicker", tr("&Flicker"), "Shift+Space",
                        tr("Back and forth by itself between two sides (panel Check: which, and how fast); ends when something "
                           "is dragged"),
                        [this] { bench_->Flickering()->Toggle(); });
  flicker_->setCheckable(true);
  connect(bench->Flickering(), &Flicker::Changed, this, &ViewActions::ShowLook);

  const auto addMode = [&](const char* name, const QString& label, const char* key, const QString& help, const QString& word) {
    addTo(modes_, name, label, key, help, word, [this, word] { bench_->Set(&SliceLook::mode, word); });
  };
  addMode("modeBlend", tr("&Blend"), "B", tr("Volumes are mixed; tints add up to grey where they agree"), "blend");
  addMode("modeDifference", tr("&Difference"), "D",
          tr("Difference between the selected volumes and the others: dark where they agree"), "difference");
  addMode("modeCheckerboard", tr("&Checkerboard"), "K", tr("Squares of the selected volumes and of the others in turn"),
          "checkerboard");

  linear_ = MakeAction(this, "linear", tr("&Trilinear interpolation"), "N", tr("Smooth between voxels, or the nearest voxel"),
                       [this] { bench_->Set(&SliceLook::linear, !bench_->Slices().linear); });
  linear_->setCheckable(true);
  linked_ = MakeAction(this, "linked", tr("&Link slices"), "L", tr("Slices share the point in focus and the zoom"),
                       [this] { views_->SetLinked(!views_->Linked()); });
  linked_->setCheckable(true);
  linked_->setChecked(views->Linked());
  more_ = {MakeAction(this, "nextAxis", tr("Ne&xt axis"), "V", tr("Axial, coronal, sagittal: of the view under the mouse"),
                      [this] { views_->CurrentSlice()->NextAxis(); }),
           MakeAction(this, "fit", tr("&Fit"), "F", tr("Show everything in all views"), [this] { views_->Fit(); }),
           MakeAction(this, "resetGreys", tr("Reset &grey levels"), "G",
                      tr("Brightness and contrast as they were at first, before a right drag changed them"),
                      [this] { bench_->Session()->ResetGreyWindow(); }),
           MakeAction(this, "large", tr("&Make view large"), "M", tr("Make the view under the mouse large, and back"),
                      [this] { views_->ToggleLarge(views_->CurrentView()); })};
  brush_ = {MakeAction(this, "brushSmaller", tr("Smaller brush"), "[", tr("Smaller brush"), [this] { ChangeBrush(1.0 / 1.25); }),
            MakeAction(this, "brushLarger", tr("Larger brush"), "]", tr("Larger brush"), [this] { ChangeBrush(1.25); })};
  connect(bench, &Workbench::LookChanged, this, &ViewActions::ShowLook);
  connect(bench, &Workbench::ToolChanged, this, &ViewActions::ShowLook);
  ShowLook();
}

void ViewActions::AddTools(QMenu* menu, QToolBar* bar)
{
  menu->addActions(tools_->actions());
  menu->addSeparator();
  for (QAction* action : brush_)
    menu->addAction(action);
  bar->addActions(tools_->actions());
}

void ViewActions::AddTo(QMenu* menu, QToolBar* bar)
{
  menu->addActions(shown_->actions());
  menu->addActions({switch_, flicker_});
  menu->addSeparator();
  menu->addActions(modes_->actions());
  menu->addSeparator();
  menu->addActions({linear_, linked_});
  for (QAction* action : more_)
    menu->addAction(action);
  bar->addActions(shown_->actions());
  bar->addSeparator();
  bar->addActions(modes_->actions());
}

void ViewActions::ShowLook()
{
  const auto check = [](const QActionGroup* group, const QVariant& value) {
    for (QAction* action : group->actions())
      action->setChecked(action->data() == value);
  };
  check(tools_, static_cast<int>(bench_->CurrentTool()));
  check(shown_, bench_->Slices().shown);
  check(modes_, bench_->Slices().mode);
  linear_->setChecked(bench_->Slices().linear);
  flicker_->setChecked(bench_->Flickering()->IsOn());
}

void ViewActions::ChangeBrush(double factor)
{
  bench_->Set(&BrushSettings::radiusMm, std::clamp(bench_->Brush().radiusMm * factor, 0.1, 100.0));
}

} // namespace echorama
