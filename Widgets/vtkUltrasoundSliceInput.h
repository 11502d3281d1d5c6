// SPDX-License-Identifier: BSD-3-Clause
// What of a session a slice view draws.
#ifndef vtkUltrasoundSliceInput_h
#define vtkUltrasoundSliceInput_h

#include "vtkUltrasoundAlignmentSession.h"
#include "vtkUltrasoundVolume.h"
#include "Widgets/Pictures/SlicePicture.h"

#include <algorithm>
#include <vector>

namespace echorama {

inline AnyPosedVolume PosedVolumeOf(vtkUltrasoundAlignmentSession* session, int id)
{
  vtkUltrasoundVolume::Input input;
  input.Image = session->GetShownImage(id);
  input.Intensity = vtkUltrasoundVolume::GetIntensity(input.Image);
  input.ValidRegion = vtkUltrasoundVolume::GetValidRegion(input.Image);
  AnyPosedVolume volume;
  vtkUltrasoundVolume::Dispatch(input.Intensity,
                                [&](auto type) { volume = vtkUltrasoundVolume::PosedVolumeOf<decltype(type)>(input); });
  return volume;
}

/** \param only the ids of those that are drawn, whatever is visible or shown; none: all that are */
inline std::vector<SliceLayer> LayersOf(vtkUltrasoundAlignmentSession* session, SliceShown shown, const std::vector<int>& only)
{
  std::vector<SliceLayer> layers;
  if (!session) {
    return layers;
  }
  SliceLayer layer;
  double window[2];
  session->GetGreyWindow(window);
  layer.black = window[0];
  layer.white = window[1];
  for (const SessionVolume& volume : session->GetKernel().State().volumes) {
    layer.selected = session->IsSelected(volume.id);
    const bool isShown = volume.visible && (shown == SliceShown::All || layer.selected == (shown == SliceShown::Selected));
    if (only.empty() ? !isShown : std::find(only.begin(), only.end(), volume.id) == only.end()) {
      continue;
    }
    layer.volume = PosedVolumeOf(session, volume.id);
    layer.colour = volume.colour;
    layer.opacity = volume.opacity;
    layers.push_back(layer);
  }
  // Where all or none are selected, the first is held against the others.
  const auto selected = std::count_if(layers.begin(), layers.end(), [](const SliceLayer& each) { return each.selected; });
  if (selected == 0 || selected == static_cast<std::ptrdiff_t>(layers.size())) {
    for (SliceLayer& each : layers) {
      each.selected = &each == &layers.front();
    }
  }
  return layers;
}

/** The box of the visible volumes along three directions of the world, the columns. */
inline Eigen::AlignedBox3d BoxOf(vtkUltrasoundAlignmentSession* session, const Eigen::Matrix3d& directions)
{
  Eigen::AlignedBox3d box;
  for (int i = 0; session && i < session->GetNumberOfVolumes(); ++i) {
    const int id = session->GetVolumeId(i);
    if (!session->GetVisible(id)) {
      continue;
    }
    const ImageGeometry geometry = vtkUltrasoundVolume::GeometryOf(session->GetImage(id));
    for (int corner = 0; corner < 8; ++corner) {
      Eigen::Vector3d index;
      for (int axis = 0; axis < 3; ++axis) {
        index[axis] = (corner >> axis & 1) != 0 ? geometry.dimensions[axis] - 0.5 : -0.5;
      }
      const Eigen::Vector3d at = geometry.IndexToWorld() * index;
      box.extend(Eigen::Vector3d(at.dot(directions.col(0)), at.dot(directions.col(1)), at.dot(directions.col(2))));
    }
  }
  return box;
}

} // namespace echorama

#endif
