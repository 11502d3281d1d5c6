// SPDX-License-Identifier: BSD-3-Clause
#include "GreyLevels.h"
#include "Workbench.h"
#include <QObject>
#include <vtkDataArray.h>
#include <vtkImageData.h>
#include <vtkUltrasoundVolume.h>

namespace echorama {

QString GreyLevel::Text() const
{
  return value ? QString::number(*value, 'g', 5) : QObject::tr("outside");
}

QColor ColourOf(const Workbench& bench, int id)
{
  double rgb[3] = {1.0, 1.0, 1.0};
  bench.Session()->GetColour(id, rgb);
  return QColor::fromRgbF(rgb[0], rgb[1], rgb[2]);
}

std::vector<GreyLevel> GreyLevelsAt(const Workbench& bench, const Eigen::Vector3d& world)
{
  const auto* session = bench.Session();
  std::vector<GreyLevel> levels;
  for (bool selected : {true, false})
    for (int id : bench.Volumes()) {
      if (session->IsSelected(id) != selected || !session->GetVisible(id))
        continue;
      levels.push_back({id, bench.NameOf(id), ColourOf(bench, id), {}});
      const vtkIdType voxel = session->GetVoxelAt(id, world.data());
      if (voxel >= 0)
        levels.back().value = vtkUltrasoundVolume::GetIntensity(session->GetImage(id))->GetComponent(voxel, 0);
    }
  return levels;
}

} // namespace echorama
