// SPDX-License-Identifier: BSD-3-Clause
#include "GuideBar.h"
#include "Controls.h"
#include "Workbench.h"
#include <algorithm>
#include <QAction>
#include <QEvent>
#include <QHBoxLayout>
#include <QLabel>
#include <QPushButton>
#include <QToolButton>

namespace echorama {

namespace {

struct StepText {
  const char *name, *title, *what, *button;
};
constexpr StepText Texts[GuideBar::Steps] = {
    {"guideOpen", QT_TRANSLATE_NOOP("echorama::GuideBar", "Open"),
     QT_TRANSLATE_NOOP("echorama::GuideBar", "Open two or more volumes that overlap; their files can be dropped here."),
     QT_TRANSLATE_NOOP("echorama::GuideBar", "Open...")},
    {"guideAlign", QT_TRANSLATE_NOOP("echorama::GuideBar", "Align"),
     QT_TRANSLATE_NOOP("echorama::GuideBar", "Drag the selected volume until it nearly fits; Refine finds the exact place."),
     QT_TRANSLATE_NOOP("echorama::GuideBar", "Refine")},
    {"guideCheck", QT_TRANSLATE_NOOP("echorama::GuideBar", "Check"),
     QT_TRANSLATE_NOOP("echorama::GuideBar", "Look whether it is right: where volumes agree, their difference is dark."),
     QT_TRANSLATE_NOOP("echorama::GuideBar", "Difference")},
    {"guideStitch", QT_TRANSLATE_NOOP("echorama::GuideBar", "Stitch"),
     QT_TRANSLATE_NOOP("echorama::GuideBar", "Make one volume of all that are shown; it joins the others."),
     QT_TRANSLATE_NOOP("echorama::GuideBar", "Stitch")},
    {"guideEmbed", QT_TRANSLATE_NOOP("echorama::GuideBar", "Embed"),
     QT_TRANSLATE_NOOP("echorama::GuideBar", "Put the stitched volume into the fan that holds it, among noise of its own grain."),
     QT_TRANSLATE_NOOP("echorama::GuideBar", "Embed")},
    {"guideSave", QT_TRANSLATE_NOOP("echorama::GuideBar", "Save"),
     QT_TRANSLATE_NOOP("echorama::GuideBar", "Keep the work as a project; the stitched volume is saved beside it."),
     QT_TRANSLATE_NOOP("echorama::GuideBar", "Save...")},
};

// What aligning depends on: where volumes are, but for those that were made of others.
SessionState Essence(const SessionState& state)
{
  SessionState essence;
  for (const SessionVolume& volume : state.volumes)
    if (!volume.madeOf) {
      SessionVolume kept;
      kept.id = volume.id;
      kept.volumeToWorld = volume.volumeToWorld;
      essence.volumes.push_back(kept);
    }
  return essence;
}

} // namespace

GuideBar::GuideBar(Workbench* bench, Actions actions, QWidget* parent)
  : QToolBar(tr("Guide"), parent), bench_(bench), actions_(std::move(actions))
{
  setObjectName("guideBar");
  setMovable(false);
  auto* inside = new QWidget(this);
  auto* row = new QHBoxLayout(inside);
  row->setContentsMargins(4, 0, 4, 0);
  row->setSpacing(3);
  for (int i = 0; i < Steps; i++) {
    steps_[i] = SmallButton(inside, Texts[i].name, {}, tr(Texts[i].what));
    steps_[i]->setCheckable(true);
    connect(steps_[i], &QToolButton::clicked, this, [this, i] { ShowStep(i); });
    row->addWidget(steps_[i]);
  }
  text_ = TextField(inside, "guideText");
  text_->setSizePolicy(QSizePolicy::Ignored, QSizePolicy::Preferred); // it breaks rather than widen the window
  FitText();
  row->addWidget(text_, 1);
  do_ = Button(inside, "guideDo", {}, tr("Does this step, or opens what does"), [this] { actions_[shown_](); });
  do_->setAutoDefault(true);
  row->addWidget(do_);
  auto* close = SmallButton(inside, "guideClose", QString(QChar(0x00d7)), tr("Close the guide; the menu Help brings it back"));
  connect(close, &QToolButton::clicked, this, [this] { toggleViewAction()->trigger(); });
  row->addWidget(close);
  addWidget(inside);

  for (auto changed : {&Workbench::VolumesChanged, &Workbench::PosesChanged, &Workbench::HistoryChanged})
    connect(bench, changed, this, &GuideBar::Follow);
  connect(bench, &Workbench::LookChanged, this, &GuideBar::NoteLook);
  connect(bench, &Workbench::InteractingChanged, this, &GuideBar::Follow);
  Follow();
  ShowStep(Open);
}

void GuideBar::FitText()
{
  text_->setFixedHeight(2 * text_->fontMetrics().lineSpacing() + 4); // else it asks for the height of its text in one column
}

void GuideBar::changeEvent(QEvent* event)
{
  QToolBar::changeEvent(event);
  if (event->type() == QEvent::FontChange && text_)
    FitText();
}

// Seen in another way than one blended into the other.
void GuideBar::NoteLook()
{
  const SliceLook& look = bench_->Slices();
  if (look.mode != "blend" || look.shown != "all")
    checked_ = Essence(bench_->Session()->GetKernel().State());
  Follow();
}

void GuideBar::Follow()
{
  if (bench_->Interacting())
    return; // at the end of the drag
  auto* session = bench_->Session();
  const SessionState& state = session->GetKernel().State();
  const SessionState sources = Essence(state);
  const auto isMoved = [](const SessionVolume& volume) { return volume.volumeToWorld.matrix() != Pose::Identity().matrix(); };
  const std::array<bool, Steps> before = done_;
  const auto isResult = [&](const SessionVolume& volume, const char* option, bool on) {
    return volume.madeOf && ChangesSince(state, volume).empty() && (OptionOf(*volume.madeOf, option) == "on") == on;
  };
  const auto& volumes = state.volumes;
  done_[Open] = sources.volumes.size() > 1;
  done_[Align] = done_[Open] && std::any_of(sources.volumes.begin(), sources.volumes.end(), isMoved);
  done_[Check] = done_[Align] && sources == checked_;
  done_[Stitch] =
      std::any_of(volumes.begin(), volumes.end(), [&](const auto& volume) { return isResult(volume, "Preview", false); });
  done_[Embed] = done_[Stitch] &&
                 std::any_of(volumes.begin(), volumes.end(), [&](const auto& volume) { return isResult(volume, "Embed", true); });
  done_[Save] = !state.volumes.empty() && !session->GetProjectPath().empty() && !session->GetModifiedSinceSave();
  for (int i = 0; i < Steps; i++) {
    const QString title = tr(Texts[i].title);
    steps_[i]->setText(QString("%1 %2").arg(done_[i] ? QString(QChar(0x2713)) : QString::number(i + 1), title));
    steps_[i]->setAccessibleName(done_[i] ? tr("%1: done").arg(title) : title);
  }
  if (done_ != before)
    ShowStep(static_cast<int>(std::find(done_.begin(), done_.end(), false) - done_.begin()));
}

void GuideBar::ShowStep(int step)
{
  shown_ = std::min<int>(step, Save);
  for (int i = 0; i < Steps; i++)
    steps_[i]->setChecked(i == shown_);
  text_->setText(step == Steps ? tr("All is done and saved.") : tr(Texts[shown_].what));
  do_->setText(tr(Texts[shown_].button));
  do_->setAccessibleName(do_->text());
}

} // namespace echorama
