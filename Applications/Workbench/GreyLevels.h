// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <Eigen/Core>
#include <optional>
#include <QColor>
#include <QString>
#include <vector>

namespace echorama {

class Workbench;

/// The grey level of one volume at a place.
struct GreyLevel {
  int id = 0;
  QString name;
  QColor colour;
  std::optional<double> value; ///< of the nearest voxel; none: the volume has no data there
  QString Text() const;        ///< "outside" when it has none
};

/// Of all volumes that are shown, the selected ones first.
std::vector<GreyLevel> GreyLevelsAt(const Workbench& bench, const Eigen::Vector3d& world);

QColor ColourOf(const Workbench& bench, int id);

} // namespace echorama
