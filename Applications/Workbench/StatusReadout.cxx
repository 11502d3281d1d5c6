// SPDX-License-Identifier: BSD-3-Clause
#include "StatusReadout.h"
#include "Workbench.h"
#include <QStringList>
#include <vtkDataArray.h>
#include <vtkImageData.h>
#include <vtkUltrasoundVolume.h>

namespace echorama {

StatusReadout::StatusReadout(Workbench* bench, QWidget* parent) : QLabel(parent), bench_(bench)
{
  setObjectName("readout");
  setToolTip(tr("Position under the mouse in mm (left, posterior, superior), and the grey level of each volume there"));
}

void StatusReadout::ShowAt(double x, double y, double z)
{
  const double world[3] = {x, y, z};
  QString text = QString("%1  %2  %3 mm").arg(x, 0, 'f', 1).arg(y, 0, 'f', 1).arg(z, 0, 'f', 1);
  const auto* session = bench_->Session();
  QStringList levels;
  for (bool selected : {true, false})
    for (int id : bench_->Volumes()) {
      const vtkIdType voxel = session->GetVoxelAt(id, world);
      if (session->IsSelected(id) == selected && session->GetVisible(id) && levels.size() < 3 && voxel >= 0)
        levels.append(QString("%1: %2")
                          .arg(bench_->NameOf(id))
                          .arg(vtkUltrasoundVolume::GetIntensity(session->GetImage(id))->GetComponent(voxel, 0), 0, 'g', 5));
    }
  if (!levels.isEmpty())
    text += "    " + levels.join("    ");
  setText(text);
}

} // namespace echorama
