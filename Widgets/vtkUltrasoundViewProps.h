// SPDX-License-Identifier: BSD-3-Clause
// What the views of a session draw beside volumes: pictures on planes, and lines and text on top of everything.
#ifndef vtkUltrasoundViewProps_h
#define vtkUltrasoundViewProps_h

#include "vtkActor.h"
#include "vtkActor2D.h"
#include "vtkCamera.h"
#include "vtkCellArray.h"
#include "vtkCellData.h"
#include "vtkFloatArray.h"
#include "vtkMatrix4x4.h"
#include "vtkNew.h"
#include "vtkPointData.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"
#include "vtkPolyDataMapper.h"
#include "vtkPolyDataMapper2D.h"
#include "vtkProperty.h"
#include "vtkProperty2D.h"
#include "vtkRenderer.h"
#include "vtkShaderProperty.h"
#include "vtkTextActor.h"
#include "vtkTextProperty.h"
#include "vtkTexture.h"
#include "vtkUltrasoundAlignmentSession.h"
#include "vtkUnsignedCharArray.h"

#include <array>
#include <cmath>
#include <Eigen/Core>
#include <vector>

namespace echorama {

/** A picture of bytes on a rectangle of the world. */
struct PlanePicture {
  vtkNew<vtkPoints> Corners; ///< lower left, lower right, upper right, upper left
  vtkNew<vtkTexture> Texture;
  vtkNew<vtkActor> Actor;

  PlanePicture()
  {
    this->Corners->SetDataTypeToDouble();
    this->Corners->SetNumberOfPoints(4);
    vtkNew<vtkCellArray> face;
    face->InsertNextCell({0, 1, 2, 3});
    vtkNew<vtkFloatArray> places;
    places->SetNumberOfComponents(2);
    for (const auto& [u, v] : {std::pair{0.0, 0.0}, {1.0, 0.0}, {1.0, 1.0}, {0.0, 1.0}}) {
      places->InsertNextTuple2(u, v);
    }
    vtkNew<vtkPolyData> rectangle;
    rectangle->SetPoints(this->Corners);
    rectangle->SetPolys(face);
    rectangle->GetPointData()->SetTCoords(places);
    vtkNew<vtkPolyDataMapper> mapper;
    mapper->SetInputData(rectangle);
    this->Texture->SetColorModeToDirectScalars();
    this->Actor->SetMapper(mapper);
    this->Actor->SetTexture(this->Texture);
    this->Actor->ForceOpaqueOn();
    this->Actor->PickableOff();
    this->Actor->GetProperty()->LightingOff();
  }

  void Place(const double corners[12])
  {
    for (vtkIdType corner = 0; corner < 4; ++corner) {
      this->Corners->SetPoint(corner, corners + 3 * corner);
    }
    this->Corners->Modified();
  }
};

/** Lines in pixels. */
class ScreenLines {
public:
  vtkNew<vtkActor2D> Actor;

  ScreenLines()
  {
    this->Colours->SetNumberOfComponents(4);
    this->Data->SetPoints(this->Points);
    this->Data->SetLines(this->Cells);
    this->Data->GetCellData()->SetScalars(this->Colours);
    vtkNew<vtkPolyDataMapper2D> mapper;
    mapper->SetInputData(this->Data);
    this->Actor->SetMapper(mapper);
    this->Actor->PickableOff();
  }
  void Clear()
  {
    this->Points->Reset();
    this->Cells->Reset();
    this->Colours->Reset();
  }
  void Add(const std::vector<Eigen::Vector2d>& path, const std::array<double, 3>& rgb, int opacity = 255)
  {
    this->Cells->InsertNextCell(static_cast<vtkIdType>(path.size()));
    for (const Eigen::Vector2d& p : path) {
      this->Cells->InsertCellPoint(this->Points->InsertNextPoint(p.x(), p.y(), 0.0));
    }
    this->Colours->InsertNextTuple4(std::round(255.0 * rgb[0]), std::round(255.0 * rgb[1]), std::round(255.0 * rgb[2]), opacity);
  }
  void Done()
  {
    this->Points->Modified();
    this->Cells->Modified();
    this->Colours->Modified();
    this->Data->Modified();
  }

private:
  vtkNew<vtkPoints> Points;
  vtkNew<vtkCellArray> Cells;
  vtkNew<vtkUnsignedCharArray> Colours;
  vtkNew<vtkPolyData> Data;
};

/** Text whose point (0, 0) is its middle, or with \a across, \a along of -1 and 1 its left or right and lower or upper side. */
inline void SetUpText(vtkTextActor* text, vtkRenderer* renderer, int size, const std::array<double, 3>& rgb, int across = 0,
                      int along = 0)
{
  vtkTextProperty* property = text->GetTextProperty();
  property->SetFontSize(size);
  property->SetFontFamilyToArial();
  property->SetColor(rgb[0], rgb[1], rgb[2]);
  property->SetJustification(across < 0 ? VTK_TEXT_LEFT : across > 0 ? VTK_TEXT_RIGHT : VTK_TEXT_CENTERED);
  property->SetVerticalJustification(along < 0 ? VTK_TEXT_BOTTOM : along > 0 ? VTK_TEXT_TOP : VTK_TEXT_CENTERED);
  text->PickableOff();
  renderer->AddActor2D(text);
}

/** A line without light. */
inline void SetUpLine(vtkActor* actor)
{
  actor->GetProperty()->LightingOff();
  actor->GetProperty()->SetLineWidth(1.5f);
  actor->PickableOff();
}

/** Such a picture in 3D, see-through where its alpha is 0, with a frame around it. */
struct FramedPicture {
  PlanePicture Picture;
  vtkNew<vtkActor> Outline;

  FramedPicture()
  {
    this->Picture.Texture->InterpolateOn();
    this->Picture.Texture->EdgeClampOn();
    // Where the picture shows nothing it hides nothing.
    this->Picture.Actor->GetShaderProperty()->AddFragmentShaderReplacement(
        "//VTK::Picking::Impl", true, "//VTK::Picking::Impl\n  if (gl_FragData[0].a < 0.5) discard;\n", false);
    vtkNew<vtkCellArray> lines;
    lines->InsertNextCell({0, 1, 2, 3, 0});
    vtkNew<vtkPolyData> frame;
    frame->SetPoints(this->Picture.Corners);
    frame->SetLines(lines);
    vtkNew<vtkPolyDataMapper> mapper;
    mapper->SetInputData(frame);
    this->Outline->SetMapper(mapper);
    SetUpLine(this->Outline);
    this->Outline->GetProperty()->SetColor(0.9, 0.8, 0.3);
  }

  void Show(bool on)
  {
    this->Picture.Actor->SetVisibility(on && this->Picture.Texture->GetInput() != nullptr);
    this->Outline->SetVisibility(on);
  }
};

/** The axes L, P and S in the corner at the lower left. */
class OrientationMarker {
public:
  explicit OrientationMarker(vtkRenderer* renderer)
  {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      this->Letters[axis]->SetInput(axis == 0 ? "L" : axis == 1 ? "P" : "S");
      SetUpText(this->Letters[axis], renderer, 15, Colours[axis]);
    }
    this->Axes.Actor->GetProperty()->SetLineWidth(2.0f);
    renderer->AddActor2D(this->Axes.Actor);
  }

  /** As the camera sees them. */
  void Update(vtkCamera* camera, bool shown)
  {
    constexpr double Length = 30.0; // pixels
    const Eigen::Vector2d middle(48.0, 48.0);
    vtkMatrix4x4* view = camera->GetViewTransformMatrix();
    this->Axes.Clear();
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::Vector2d way(view->GetElement(0, axis), view->GetElement(1, axis)), end = middle + 1.35 * Length * way;
      vtkTextActor* letter = this->Letters[static_cast<std::size_t>(axis)];
      this->Axes.Add({middle, middle + Length * way}, Colours[static_cast<std::size_t>(axis)]);
      letter->SetPosition(end.x(), end.y());
      letter->SetVisibility(shown && way.norm() > 0.25); // of an axis along the view it would lie on the others
    }
    this->Axes.Done();
    this->Axes.Actor->SetVisibility(shown);
  }

private:
  static constexpr std::array<double, 3> Colours[3] = {
      {235 / 255.0, 80 / 255.0, 80 / 255.0}, {90 / 255.0, 210 / 255.0, 90 / 255.0}, {100 / 255.0, 140 / 255.0, 1.0}};
  ScreenLines Axes;
  std::array<vtkNew<vtkTextActor>, 3> Letters;
};

/** Calls \a method of a view at all that a session tells of its volumes. (AnyEvent would not do: errors of the session would
 * count as handled, and nobody would see them.) */
template <class View>
std::vector<unsigned long> ObserveSession(vtkUltrasoundAlignmentSession* session, View* view,
                                          void (View::*method)(vtkObject*, unsigned long, void*))
{
  std::vector<unsigned long> observers;
  for (const auto event :
       {vtkUltrasoundAlignmentSession::VolumesChangedEvent, vtkUltrasoundAlignmentSession::PosesChangedEvent,
        vtkUltrasoundAlignmentSession::SelectionChangedEvent, vtkUltrasoundAlignmentSession::VoxelsChangedEvent,
        vtkUltrasoundAlignmentSession::MeasurementsChangedEvent}) {
    observers.push_back(session->AddObserver(event, view, method));
  }
  return observers;
}

} // namespace echorama

#endif
