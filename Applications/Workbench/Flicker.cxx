// SPDX-License-Identifier: BSD-3-Clause
#include "Flicker.h"
#include "Workbench.h"
#include <algorithm>
#include <cmath>

namespace echorama {

Flicker::Flicker(Workbench* bench) : QObject(bench), bench_(bench)
{
  timer_.setTimerType(Qt::PreciseTimer);
  SetRate(2.0);
  connect(&timer_, &QTimer::timeout, this, &Flicker::Switch);
  connect(bench, &Workbench::InteractingChanged, this, [this](bool on) {
    if (on)
      Stop();
  });
  connect(bench, &Workbench::ToolChanged, this, &Flicker::Stop);
}

void Flicker::SetSides(const QString& one, const QString& other)
{
  sides_[0] = one;
  sides_[1] = other;
}

void Flicker::SetRate(double changesPerSecond)
{
  timer_.setInterval(static_cast<int>(std::lround(1000.0 / std::clamp(changesPerSecond, SlowestHz, FastestHz))));
}

QVector<int> Flicker::VolumesOf(const QString& side) const
{
  QVector<int> ids;
  for (int id : bench_->Volumes()) {
    const bool visible = bench_->Session()->GetVisible(id), selected = bench_->Session()->IsSelected(id);
    if (side == QString::number(id) || (visible && side == "selected" && selected) || (visible && side == "others" && !selected))
      ids.append(id);
  }
  return ids;
}

void Flicker::Start()
{
  const QVector<int> one = VolumesOf(sides_[0]), other = VolumesOf(sides_[1]);
  if (one.isEmpty() || other.isEmpty() || one == other)
    return bench_->Note(tr("Flicker: select one of the volumes, and leave another; or choose two in the panel Check."));
  if (IsOn())
    return;
  now_ = 1;
  timer_.start();
  Switch();
  emit Changed();
}

void Flicker::Stop()
{
  if (!IsOn())
    return;
  timer_.stop();
  bench_->SetOnlyInSlices(bench_->Only());
  emit Changed();
}

void Flicker::Switch()
{
  now_ = 1 - now_;
  const QVector<int> ids = VolumesOf(sides_[now_]);
  if (ids.isEmpty())
    return Stop();
  bench_->SetOnlyInSlices(ids);
}

} // namespace echorama
