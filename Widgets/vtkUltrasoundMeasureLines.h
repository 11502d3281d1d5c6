// SPDX-License-Identifier: BSD-3-Clause
// The measurements of a session in a slice.
#ifndef vtkUltrasoundMeasureLines_h
#define vtkUltrasoundMeasureLines_h

#include "Core/Base/FormatText.h"
#include "vtkSmartPointer.h"
#include "vtkUltrasoundViewProps.h"
#include "Widgets/Pictures/SliceFrame.h"

namespace echorama {

/** Callipers and angles, as far as they lie near the plane, with number and value. What is being made comes without a number. */
class MeasureLines {
public:
  static constexpr double DepthMm = 5.0; ///< what is farther from the plane is not drawn

  void Draw(vtkUltrasoundAlignmentSession* session, const std::vector<Eigen::Vector3d>& draft, const SliceFrame& frame,
            ScreenLines& lines, vtkRenderer* renderer)
  {
    std::size_t used = 0;
    if (session) {
      for (const Measurement& each : session->GetKernel().State().measurements) {
        this->DrawOne(each, frame, lines, renderer, used);
      }
    }
    this->DrawOne({0, draft}, frame, lines, renderer, used);
    for (; used < this->Texts.size(); ++used) {
      this->Texts[used]->VisibilityOff();
    }
  }

private:
  void DrawOne(const Measurement& measurement, const SliceFrame& frame, ScreenLines& lines, vtkRenderer* renderer,
               std::size_t& used)
  {
    constexpr double arm = 5.0; // pixels
    const std::array<double, 3> colour{1.0, 0.85, 0.3};
    const auto& points = measurement.points;
    double nearest = 2.0 * DepthMm;
    for (const Eigen::Vector3d& point : points) {
      const double depth = std::abs(frame.DepthOf(point));
      nearest = std::min(nearest, depth);
      if (depth > DepthMm) {
        continue;
      }
      const Eigen::Vector2d at = frame.PixelOf(point);
      for (const Eigen::Vector2d& along : {Eigen::Vector2d(arm, arm), Eigen::Vector2d(arm, -arm)}) {
        lines.Add({at - along, at + along}, colour, OpacityAt(depth));
      }
    }
    bool seen = nearest <= DepthMm;
    Eigen::Vector2d place = seen && !points.empty() ? frame.PixelOf(points.back()) : Eigen::Vector2d::Zero();
    for (std::size_t i = 1; i < points.size(); ++i) {
      if (const auto part = frame.PartNear(points[i - 1], points[i], DepthMm)) {
        lines.Add({(*part)[0], (*part)[1]}, colour, OpacityAt(std::min(nearest, DepthMm)));
        place = (*part)[1];
        seen = true;
      }
    }
    if (!seen || points.size() < 2) {
      return;
    }
    if (used == this->Texts.size()) {
      this->Texts.push_back(vtkSmartPointer<vtkTextActor>::New());
      SetUpText(this->Texts.back(), renderer, 12, colour, -1, -1);
    }
    const double value = measurement.Value();
    const std::string text = Format(measurement.IsAngle() ? "%.1f\u00b0" : "%.2f mm", value);
    vtkTextActor* label = this->Texts[used++];
    label->SetInput((measurement.number > 0 ? std::to_string(measurement.number) + ": " + text : text).c_str());
    label->SetPosition(place.x() + arm, place.y() + arm);
    label->VisibilityOn();
  }

  static int OpacityAt(double depth) { return static_cast<int>(255.0 - 170.0 * depth / DepthMm); }

  std::vector<vtkSmartPointer<vtkTextActor>> Texts; ///< as many as were ever needed; the others are hidden
};

} // namespace echorama

#endif
