// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <array>
#include <Eigen/Core>
#include <QVector>
#include <QWidget>

class QSplitter;

namespace echorama {

class SlicePane;
class VolumePane;
class Workbench;

/// The four views: axial and coronal above, sagittal and 3D below. Any of them can take all of the space for a while.
class ViewGrid : public QWidget {
  Q_OBJECT

public:
  explicit ViewGrid(Workbench* bench, QWidget* parent = nullptr);

  const std::array<SlicePane*, 3>& Slices() const { return slices_; }
  VolumePane* Volume() const { return volume_; }
  /// The one under the mouse or with the focus; the first when there is none.
  SlicePane* CurrentSlice() const;
  QWidget* CurrentView() const;
  /// Makes one view large, or, when it is, all four visible again.
  void ToggleLarge(QWidget* view);
  void Fit();
  /// Brings a place of the world to the middle of all slices.
  void CentreOn(const Eigen::Vector3d& place);
  void SetLinked(bool linked);
  bool Linked() const { return linked_; }

private:
  QVector<QWidget*> Views() const;
  void FollowSlice(SlicePane* changed);
  void FitToNew(int volumes);
  void CentreOnOverlap(int a, int b);

  std::array<SlicePane*, 3> slices_;
  VolumePane* volume_;
  Workbench* bench_;
  QSplitter *rows_, *above_, *below_;
  QWidget* large_ = nullptr;
  bool linked_ = false;
  int volumes_ = 0;
};

} // namespace echorama
