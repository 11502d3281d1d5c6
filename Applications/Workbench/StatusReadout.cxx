// SPDX-License-Identifier: BSD-3-Clause
#include "StatusReadout.h"
#include "Workbench.h"
#include <cmath>
#include <QStringList>
#include <vtkDataArray.h>
#include <vtkImageData.h>
#include <vtkUltrasoundVolume.h>

namespace echorama {

namespace {

// The nearest voxel's grey level; false where the volume has no data.
bool GreyLevelAt(vtkImageData* image, const double world[3], double& level)
{
  double index[3];
  image->TransformPhysicalPointToContinuousIndex(world, index);
  const int* extent = image->GetExtent();
  int voxel[3];
  for (int axis = 0; axis < 3; axis++) {
    const double rounded = std::round(index[axis]);
    if (!(rounded >= extent[2 * axis] && rounded <= extent[2 * axis + 1]))
      return false;
    voxel[axis] = static_cast<int>(rounded);
  }
  const vtkIdType point = image->ComputePointId(voxel);
  vtkDataArray* valid = vtkUltrasoundVolume::GetValidRegion(image);
  if (valid && valid->GetComponent(point, 0) == 0.0)
    return false;
  level = vtkUltrasoundVolume::GetIntensity(image)->GetComponent(point, 0);
  return true;
}

} // namespace

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
      double level = 0.0;
      if (session->IsSelected(id) == selected && session->GetVisible(id) && levels.size() < 3 &&
          GreyLevelAt(session->GetImage(id), world, level))
        levels.append(QString("%1: %2").arg(bench_->NameOf(id)).arg(level, 0, 'g', 5));
    }
  if (!levels.isEmpty())
    text += "    " + levels.join("    ");
  setText(text);
}

} // namespace echorama
