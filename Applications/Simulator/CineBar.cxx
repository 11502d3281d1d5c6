// SPDX-License-Identifier: BSD-3-Clause
#include "CineBar.h"
#include "Controls.h"
#include "Scan.h"
#include <algorithm>
#include <cmath>
#include <QHBoxLayout>
#include <QLabel>
#include <QSlider>
#include <QTimer>
#include <QToolButton>

namespace echorama {

CineBar::CineBar(Scan* scan, QWidget* parent) : QWidget(parent), scan_(scan)
{
  setObjectName("cineBar");
  play_ = SmallButton(this, "cinePlay", tr("Play"), tr("Plays what was seen before the freeze, over and over"));
  play_->setCheckable(true);
  slider_ = new QSlider(Qt::Horizontal, this);
  slider_->setObjectName("cineSlider");
  slider_->setToolTip(tr("Goes through what was seen in the 30 seconds before the freeze"));
  time_ = new QLabel(this);
  time_->setObjectName("cineTime");
  auto* row = new QHBoxLayout(this);
  row->setContentsMargins(4, 0, 4, 0);
  row->addWidget(play_);
  row->addWidget(slider_, 1);
  row->addWidget(time_);
  timer_ = new QTimer(this);
  timer_->setSingleShot(true);
  timer_->setTimerType(Qt::PreciseTimer);
  connect(timer_, &QTimer::timeout, this, &CineBar::PlayOn);
  connect(play_, &QToolButton::toggled, this, &CineBar::SetPlaying);
  connect(slider_, &QSlider::valueChanged, scan, &Scan::ShowCine);
  connect(scan, &Scan::FrozenChanged, this, &CineBar::ShowFrozen);
  connect(scan, &Scan::FrameMade, this, &CineBar::ShowIndex);
  ShowFrozen(false);
}

void CineBar::ShowFrozen(bool frozen)
{
  setEnabled(frozen);
  SetPlaying(false);
  const QSignalBlocker quiet(slider_);
  slider_->setRange(0, std::max(0, scan_->Cine().Count() - 1));
  slider_->setValue(slider_->maximum());
  ShowIndex();
}

void CineBar::ShowIndex()
{
  if (!scan_->IsFrozen() || scan_->Cine().Count() == 0) {
    time_->clear();
    return;
  }
  const QSignalBlocker quiet(slider_);
  slider_->setValue(scan_->CineIndex());
  const double newest = scan_->Cine().At(scan_->Cine().Count() - 1).seconds;
  time_->setText(tr("%1 s").arg(scan_->Frame().seconds - newest, 0, 'f', 2));
}

void CineBar::Step(int frames)
{
  if (scan_->IsFrozen())
    slider_->setValue(slider_->value() + frames);
}

void CineBar::SetPlaying(bool playing)
{
  play_->setChecked(playing);
  if (playing && scan_->IsFrozen() && scan_->Cine().Count() > 1)
    timer_->start(0);
  else
    timer_->stop();
}

// As fast as it was seen; pauses in which nothing changed are cut to half a second.
void CineBar::PlayOn()
{
  const CineLoop& cine = scan_->Cine();
  const int now = scan_->CineIndex(), next = now + 1 < cine.Count() ? now + 1 : 0;
  scan_->ShowCine(next);
  const double wait = next + 1 < cine.Count() ? cine.At(next + 1).seconds - cine.At(next).seconds : 0.5;
  timer_->start(static_cast<int>(std::lround(1e3 * std::clamp(wait, 0.001, 0.5))));
}

} // namespace echorama
