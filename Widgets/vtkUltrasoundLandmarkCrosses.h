// SPDX-License-Identifier: BSD-3-Clause
// The landmarks of a session in a slice.
#ifndef vtkUltrasoundLandmarkCrosses_h
#define vtkUltrasoundLandmarkCrosses_h

#include "vtkSmartPointer.h"
#include "vtkUltrasoundViewProps.h"
#include "Widgets/Pictures/SliceFrame.h"

namespace echorama {

/** A cross and its label in the colour of the volume for each that lies near the plane, the fainter the farther. */
class LandmarkCrosses {
public:
  void Draw(vtkUltrasoundAlignmentSession* session, const SliceFrame& frame, ScreenLines& lines, vtkRenderer* renderer)
  {
    constexpr double depthMm = 5.0, arm = 6.0; // pixels
    std::size_t used = 0;
    for (const SessionVolume& volume : session ? session->GetKernel().State().volumes : std::vector<SessionVolume>()) {
      for (const Landmark& landmark : volume.landmarks) {
        const Eigen::Vector3d place = volume.volumeToWorld * landmark.position;
        const double distance = std::abs((place - frame.focus).dot(frame.Towards()));
        if (!volume.visible || distance > depthMm) {
          continue;
        }
        const Eigen::Vector2d at = frame.PixelOf(place), across(arm, 0.0), up(0.0, arm);
        const double opacity = 1.0 - 0.8 * distance / depthMm;
        for (const Eigen::Vector2d& along : {across, up}) {
          lines.Add({at - along, at + along}, volume.colour, static_cast<int>(255.0 * opacity));
        }
        if (used == this->Labels.size()) {
          this->Labels.push_back(vtkSmartPointer<vtkTextActor>::New());
          SetUpText(this->Labels.back(), renderer, 12, volume.colour, -1, -1);
        }
        vtkTextActor* label = this->Labels[used++];
        label->SetInput(landmark.label.c_str());
        label->SetPosition(at.x() + 0.5 * arm, at.y() + 0.5 * arm);
        label->GetTextProperty()->SetColor(volume.colour[0], volume.colour[1], volume.colour[2]);
        label->GetTextProperty()->SetOpacity(opacity);
        label->VisibilityOn();
      }
    }
    for (; used < this->Labels.size(); ++used) {
      this->Labels[used]->VisibilityOff();
    }
  }

private:
  std::vector<vtkSmartPointer<vtkTextActor>> Labels; ///< as many as were ever needed; the others are hidden
};

} // namespace echorama

#endif
