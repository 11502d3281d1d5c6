// SPDX-License-Identifier: BSD-3-Clause
#include "StatusReadout.h"
#include "GreyLevels.h"
#include "Workbench.h"
#include <algorithm>
#include <QStringList>

namespace echorama {

StatusReadout::StatusReadout(Workbench* bench, QWidget* parent) : QLabel(parent), bench_(bench)
{
  setObjectName("readout");
  setTextFormat(Qt::RichText);
  setSizePolicy(QSizePolicy::Ignored, QSizePolicy::Preferred); // a long text must not widen the window
  setToolTip(tr("Position under the mouse in mm (left, posterior, superior), and the grey level of each volume there"));
  connect(bench, &Workbench::PointerChanged, this, &StatusReadout::Show);
}

void StatusReadout::Show()
{
  constexpr int most = 5;
  if (!bench_->Pointer() || bench_->Interacting())
    return; // what was read last can still be read
  const Eigen::Vector3d& at = *bench_->Pointer();
  QStringList parts{QString("%1&nbsp; %2&nbsp; %3 mm").arg(at.x(), 0, 'f', 1).arg(at.y(), 0, 'f', 1).arg(at.z(), 0, 'f', 1)};
  std::vector<GreyLevel> levels = GreyLevelsAt(*bench_, at);
  if (static_cast<int>(levels.size()) > most)
    std::stable_partition(levels.begin(), levels.end(), [](const GreyLevel& level) { return level.value.has_value(); });
  for (std::size_t i = 0; i < levels.size() && i < most; ++i)
    parts.append(QString("<span style='color:%1'>&#9632;</span>&nbsp;%2: %3")
                     .arg(levels[i].colour.name(), levels[i].name.toHtmlEscaped(), levels[i].Text()));
  if (static_cast<int>(levels.size()) > most)
    parts.append(tr("and %1 more").arg(static_cast<int>(levels.size()) - most));
  setText(parts.join("&nbsp;&nbsp;&nbsp; "));
}

} // namespace echorama
