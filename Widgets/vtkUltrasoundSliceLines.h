// SPDX-License-Identifier: BSD-3-Clause
// What a slice view draws over its picture: lines and texts, in pixels.
#ifndef vtkUltrasoundSliceLines_h
#define vtkUltrasoundSliceLines_h

#include "Core/Base/FormatText.h"
#include "vtkUltrasoundLandmarkCrosses.h"
#include "vtkUltrasoundMeasureLines.h"
#include "vtkUltrasoundViewProps.h"
#include "Widgets/Pictures/ShiftColours.h"

#include <algorithm>
#include <array>
#include <optional>
#include <utility>
#include <vector>

namespace echorama {

/** The plane of another view, and the colour of its line. */
struct OtherPlane {
  const SliceFrame* Frame;
  std::array<double, 3> Colour;
};

class SliceLines {
public:
  Eigen::Vector3d Brush = Eigen::Vector3d::Zero();
  double BrushMm = 0.0;                   ///< 0: no brush
  std::optional<Eigen::Vector3d> Pointer; ///< where the mouse is, in another view
  std::vector<Eigen::Vector3d> Draft;     ///< points of a measurement that is being made
  double LegendMm = 0.0;                  ///< of the last colour of a map of shifts; 0: no legend
  bool IsLegendStale = false;

  explicit SliceLines(vtkRenderer* renderer) : Renderer(renderer)
  {
    renderer->AddActor2D(this->Lines.Actor);
    SetUpText(this->ScaleText, renderer, 12, {0.9, 0.9, 0.9}, -1, -1);
    SetUpText(this->LegendLow, renderer, 12, {0.9, 0.9, 0.9}, 1, 0);
    SetUpText(this->LegendHigh, renderer, 12, {0.9, 0.9, 0.9}, 1, 0);
    constexpr int Across[4] = {-1, 1, 0, 0}, Along[4] = {0, 0, -1, 1};
    for (int side = 0; side < 4; ++side) {
      SetUpText(this->Letters[static_cast<std::size_t>(side)], renderer, 13, {0.65, 0.65, 0.65}, Across[side], Along[side]);
    }
  }

  void Draw(vtkUltrasoundAlignmentSession* session, const SliceFrame& frame, const std::vector<OtherPlane>& others,
            bool annotated)
  {
    this->Lines.Clear();
    const double width = frame.width, height = frame.height;
    const bool room = annotated && width >= 64 && height >= 64;
    for (const OtherPlane& other : others) {
      this->DrawPlane(frame, other);
    }
    if (const std::vector<Eigen::Vector2d> brush = frame.CutOf(this->Brush, this->BrushMm); !brush.empty()) {
      this->Lines.Add(brush, {1.0, 1.0, 1.0}, 200);
    }
    this->Landmarks.Draw(session, frame, this->Lines, this->Renderer);
    this->Measures.Draw(session, this->Draft, frame, this->Lines, this->Renderer);
    if (this->Pointer) {
      this->DrawPointer(frame);
    }
    if (room) {
      this->DrawScaleBar(frame);
    }
    const bool legend = room && this->LegendMm > 0.0 && height >= 160;
    if (legend) {
      this->DrawLegend(width, height);
    }
    this->Lines.Done();
    this->ScaleText->SetVisibility(room);
    this->LegendLow->SetVisibility(legend);
    this->LegendHigh->SetVisibility(legend);
    const double x[4] = {6.0, width - 6.0, 0.5 * width, 0.5 * width};
    const double y[4] = {0.5 * height, 0.5 * height, 6.0, height - 6.0};
    for (std::size_t side = 0; side < 4; ++side) {
      const char* letter = SliceAxes()[frame.axis].sides[side];
      this->Letters[side]->SetVisibility(room && *letter);
      this->Letters[side]->SetInput(letter);
      this->Letters[side]->SetPosition(x[side], y[side]);
    }
  }

private:
  void DrawPlane(const SliceFrame& frame, const OtherPlane& other)
  {
    constexpr double gap = 8.0; // pixels around the cursor that stay free
    const Eigen::Vector2d cursor = frame.PixelOf(frame.cursor);
    const auto line = frame.CutBy(*other.Frame);
    if (!line) {
      return;
    }
    const Eigen::Vector2d direction = ((*line)[1] - (*line)[0]).normalized();
    for (const double side : {-1.0, 1.0}) {
      const Eigen::Vector2d near = cursor + side * gap * direction;
      const Eigen::Vector2d& end = (*line)[side < 0.0 ? 0 : 1];
      if (side * (end - near).dot(direction) > 0.0) {
        this->Lines.Add({near, end}, other.Colour, 110);
      }
    }
  }

  // A cross that leaves the point itself free, the fainter the farther it lies from the plane.
  void DrawPointer(const SliceFrame& frame)
  {
    constexpr double arm = 12.0, gap = 3.0, fadeMm = 20.0;
    const std::array<double, 3> colour{0.35, 0.95, 0.95};
    const double depth = std::min(std::abs(frame.DepthOf(*this->Pointer)), fadeMm);
    const Eigen::Vector2d at = frame.PixelOf(*this->Pointer);
    for (const Eigen::Vector2d& way :
         {Eigen::Vector2d(1, 0), Eigen::Vector2d(-1, 0), Eigen::Vector2d(0, 1), Eigen::Vector2d(0, -1)}) {
      this->Lines.Add({at + gap * way, at + arm * way}, colour, static_cast<int>(255.0 - 145.0 * depth / fadeMm));
    }
  }

  void DrawScaleBar(const SliceFrame& frame)
  {
    const double length = frame.ScaleBarMm(), pixels = length / frame.mmPerPixel;
    const double left = 12.0, bottom = 12.0, tick = 4.0, grey = 230 / 255.0;
    this->Lines.Add({{left, bottom + tick}, {left, bottom}, {left + pixels, bottom}, {left + pixels, bottom + tick}},
                    {grey, grey, grey}, 220);
    this->ScaleText->SetInput(Format("%g mm", length).c_str());
    this->ScaleText->SetPosition(left, bottom + tick + 2.0);
  }

  void DrawLegend(double width, double height)
  {
    constexpr int rows = 96, across = 10;
    const double right = width - 12.0, bottom = 0.5 * height + 20.0;
    const double rise = std::min<double>(rows, 0.5 * height - 36.0);
    for (int row = 0; row < static_cast<int>(rise); ++row) {
      const auto colour = ShiftColour(row / rise);
      this->Lines.Add({{right - across, bottom + row}, {right, bottom + row}}, colour, this->IsLegendStale ? 110 : 255);
    }
    this->LegendLow->SetInput("0 mm");
    this->LegendHigh->SetInput(Format(this->IsLegendStale ? "stale: %g mm" : "%g mm", this->LegendMm).c_str());
    this->LegendLow->SetPosition(right - across - 4.0, bottom);
    this->LegendHigh->SetPosition(right - across - 4.0, bottom + rise);
  }

  vtkRenderer* Renderer;
  ScreenLines Lines;
  vtkNew<vtkTextActor> ScaleText, LegendLow, LegendHigh;
  std::array<vtkNew<vtkTextActor>, 4> Letters;
  LandmarkCrosses Landmarks;
  MeasureLines Measures;
};

} // namespace echorama

#endif
