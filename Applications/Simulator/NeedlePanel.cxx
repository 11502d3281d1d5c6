// SPDX-License-Identifier: BSD-3-Clause
#include "NeedlePanel.h"
#include "Controls.h"
#include "NeedleTool.h"
#include "ParameterPanel.h"
#include "Scan.h"
#include <QAction>
#include <QCheckBox>
#include <QComboBox>
#include <QFormLayout>
#include <QLabel>
#include <QMenu>
#include <QVBoxLayout>

namespace echorama {

namespace {

constexpr double AdvanceMm = 1.0, LongAdvanceMm = 5.0, SteerDegrees = 2.0;

const std::pair<NeedleGuide, const char*> Guides[] = {
    {NeedleGuide::None, "hand"}, {NeedleGuide::InPlane, "inPlane"}, {NeedleGuide::OutOfPlane, "outOfPlane"}};

} // namespace

NeedlePanel::NeedlePanel(Scan* scan, NeedleTool* needle, QWidget* parent) : QWidget(parent), needle_(needle)
{
  setObjectName("needlePanel");
  shown_ = CheckField(this, "needleShown", tr("A needle"), tr("Whether there is a needle (N)"),
                      [this](bool on) { needle_->SetShown(on); });
  guide_ = ChoiceField(this, "needleGuide",
                       tr("What holds it: a hand, or a guide on the probe that aims into the image or across it (G)"),
                       {{"hand", tr("a hand")}, {"inPlane", tr("guide, in the plane")}, {"outOfPlane", tr("guide, across it")}},
                       [this](const QString& word) {
                         for (const auto& [guide, name] : Guides)
                           if (word == name)
                             needle_->SetGuide(guide);
                         ShowState(); // it may have been refused
                       });
  state_ = TextField(this, "needleState");
  const auto source = [scan] { return scan->Scanner().Parameters(); };
  const auto set = [scan](const char* name, const std::string& text) { scan->SetControl(name, text); };
  auto* tip = new ParameterPanel(source, {{"NeedleShowTip", tr("Mark the tip")}}, set, this);
  auto* look = new ParameterPanel(source,
                                  {{"NeedleStops", tr("Bone stops it")},
                                   {"NeedleStopLevel", tr("Bone is above")},
                                   {"NeedleLengthMm", tr("Length"), 50, 250},
                                   {"NeedleEchoDb", tr("Echo"), -20, 20},
                                   {"NeedleShadowDb", tr("Shadow"), 0, 30}},
                                  set, this);
  auto* form = new QFormLayout;
  form->addRow(shown_);
  form->addRow(tr("Held by"), guide_);
  form->addRow(tr("State"), state_);
  auto* column = new QVBoxLayout(this);
  column->addLayout(form);
  column->addWidget(tip);
  column->addWidget(look);
  column->addStretch(1);
  for (ParameterPanel* panel : {tip, look}) {
    connect(scan, &Scan::ControlsChanged, panel, &ParameterPanel::ShowValues);
    connect(scan, &Scan::FrozenChanged, panel, &QWidget::setDisabled);
  }
  connect(scan, &Scan::FrameMade, this, [this, tip, look, was = false]() mutable {
    if (was != needle_->IsShown()) { // what only counts with a needle
      tip->ShowValues();
      look->ShowValues();
      was = !was;
    }
    ShowState();
  });
  connect(needle, &NeedleTool::BlindChanged, tip, [tip](bool blind) { tip->setVisible(!blind); });
  connect(needle, &NeedleTool::Changed, this, &NeedlePanel::ShowState);
  ShowState();
}

void NeedlePanel::ShowState()
{
  Show(shown_, needle_->IsShown());
  for (const auto& [guide, name] : Guides)
    if (guide == needle_->Guide())
      Show(guide_, name);
  guide_->setEnabled(needle_->IsShown() && !needle_->IsFollowing());
  const QString state = needle_->IsShown() ? needle_->State() : tr("there is none");
  if (state_->text() != state)
    state_->setText(state);
}

void AddNeedleActions(QMenu* menu, NeedleTool* needle, const Scan* scan)
{
  const auto add = [&](const char* name, const QString& label, const char* key, const QString& help,
                       const std::function<void()>& done) {
    QAction* action = MakeAction(menu->parent(), name, label, key, help, done);
    menu->addAction(action);
    return action;
  };
  using Text = QObject;
  QAction* shown = add("needle", Text::tr("A &needle"), "N", Text::tr("Take a needle, or put it away"), [] {});
  shown->setCheckable(true);
  Text::connect(shown, &QAction::triggered, needle, &NeedleTool::SetShown);
  Text::connect(needle, &NeedleTool::Changed, shown, [shown, needle] { shown->setChecked(needle->IsShown()); });
  add("needleGuide", Text::tr("Held by: next"), "G",
      Text::tr("A hand holds the needle, a guide that aims into the image, or one that aims across it"), [needle] {
        needle->SetGuide(needle->Guide() == NeedleGuide::None      ? NeedleGuide::InPlane
                         : needle->Guide() == NeedleGuide::InPlane ? NeedleGuide::OutOfPlane
                                                                   : NeedleGuide::None);
      });
  menu->addSeparator();
  add("advance", Text::tr("Advance"), "W", Text::tr("Advance the needle by 1 mm"), [needle] { needle->Advance(AdvanceMm); });
  add("advanceFar", Text::tr("Advance far"), "Shift+W", Text::tr("Advance the needle by 5 mm"),
      [needle] { needle->Advance(LongAdvanceMm); });
  add("withdraw", Text::tr("Withdraw"), "X", Text::tr("Withdraw the needle by 1 mm"), [needle] { needle->Advance(-AdvanceMm); });
  add("withdrawFar", Text::tr("Withdraw far"), "Shift+X", Text::tr("Withdraw the needle by 5 mm"),
      [needle] { needle->Advance(-LongAdvanceMm); });
  const auto steer = [needle, scan](double right, double across) {
    needle->Steer(SteerDegrees * (scan->IsFlipped() ? -right : right), SteerDegrees * across);
  };
  add("steerRight", Text::tr("Steer to the right"), "D", Text::tr("Steer the needle 2 degrees to the right in the image"),
      [steer] { steer(1.0, 0.0); });
  add("steerLeft", Text::tr("Steer to the left"), "A", Text::tr("Steer the needle 2 degrees to the left in the image"),
      [steer] { steer(-1.0, 0.0); });
  add("steerAway", Text::tr("Steer away"), "Shift+D", Text::tr("Steer the needle 2 degrees away from you, across the image"),
      [steer] { steer(0.0, -1.0); });
  add("steerTowards", Text::tr("Steer towards you"), "Shift+A",
      Text::tr("Steer the needle 2 degrees towards you, across the image"), [steer] { steer(0.0, 1.0); });
}

} // namespace echorama
