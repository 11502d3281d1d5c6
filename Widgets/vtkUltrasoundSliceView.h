// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class vtkUltrasoundSliceView
 * @brief what one slice view shows of an alignment session, in a renderer
 *
 * No window inside: GetRenderer() goes into any render window. Its camera is parallel and its world is the world in mm, so
 * handles that other classes draw in the plane lie where the volumes are. The view observes the session; whatever makes its
 * picture out of date fires ModifiedEvent. A window then calls Update() and renders.
 *
 * The axes are those of radiology, in LPS: "z" (axial) is seen from the feet with the front of the body up, "y" (coronal) from
 * the front and "x" (sagittal) from the body's left, both with the head up. So in axial and coronal views the body's right is on
 * the left.
 *
 * | axis | right of the picture | up              | towards the viewer |
 * | ---- | -------------------- | --------------- | ------------------ |
 * | z    | +x (left)            | -y (front)      | -z                 |
 * | y    | +x (left)            | +z (head)       | -y                 |
 * | x    | +y (back)            | +z (head)       | +x                 |
 *
 * Linked views have the zoom and the cursor in common, a point of the world that all their planes go through; each shows where
 * the others' planes cut its own. Pixels count from the lower left one, (0, 0), whose middle that is.
 *
 * Landmarks of the session that lie within 5 mm of the plane are crosses with labels, the fainter the farther; measurements are
 * drawn as far as they lie so near.
 *
 * Names that are none and numbers out of range are reported as errors, and change nothing.
 *
 * Source: dissertation 4.3.
 */
#ifndef vtkUltrasoundSliceView_h
#define vtkUltrasoundSliceView_h

#include "EchoramaWidgetsModule.h"
#include "vtkObject.h"
#ifndef __VTK_WRAP__
#include "Widgets/Pictures/SliceFrame.h"
#include <memory>
#endif
#include <string>

class vtkImageData;
class vtkRenderer;
class vtkUltrasoundAlignmentSession;

class ECHORAMAWIDGETS_EXPORT vtkUltrasoundSliceView : public vtkObject {
public:
  static vtkUltrasoundSliceView* New();
  vtkTypeMacro(vtkUltrasoundSliceView, vtkObject);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  ///@{
  /** What is shown. nullptr: nothing. */
  void SetSession(vtkUltrasoundAlignmentSession* session);
  vtkUltrasoundAlignmentSession* GetSession() const;
  ///@}

  /** The view's renderer: the view sets its camera. */
  vtkRenderer* GetRenderer() const;

  ///@{
  /** Size of the viewport, pixels. Default 400 x 400. */
  void SetPixelSize(int width, int height);
  void GetPixelSize(int size[2]) const
  {
    size[0] = this->Frame.width;
    size[1] = this->Frame.height;
  }
  ///@}

  ///@{
  /** "x", "y", "z" or "oblique" (as it is turned now). Default "z". */
  void SetAxis(const char* name);
  std::string GetAxis() const { return echorama::SliceAxes()[this->Frame.axis].name; }
  ///@}

  /** The colour of the line that shows this view's plane in the views linked with it, RGB in [0, 1]. Default: that of the axis.
   */
  void SetColour(double r, double g, double b);

  ///@{
  /** An oblique plane: its normal towards the viewer, and what is up (made perpendicular to the normal). */
  void SetNormalAndUp(double nx, double ny, double nz, double ux, double uy, double uz);
  /** Turns the plane about the picture's own axes through the cursor; it is oblique then. */
  void Turn(double degreesAboutRight, double degreesAboutUp);
  ///@}

  ///@{
  /** Unit vectors of the world: right and up in the picture, and towards the viewer. */
  void GetRight(double right[3]) const { Copy(this->Frame.right, right); }
  void GetUp(double up[3]) const { Copy(this->Frame.up, up); }
  void GetNormal(double normal[3]) const { Copy(this->Frame.Towards(), normal); }
  ///@}

  ///@{
  /** Where the plane is, mm: the world's coordinate along its axis; of an oblique plane along its normal. The range is that of
   * the visible volumes; [0, 0] when there are none. */
  void SetPosition(double mm);
  double GetPosition() const { return this->Frame.Position(); }
  void GetPositionRange(double range[2]) const;
  ///@}

  ///@{
  /** The middle of the view. The plane goes through it, so that the cursor follows. */
  void SetFocus(double x, double y, double z);
  void GetFocus(double focus[3]) const { Copy(this->Frame.focus, focus); }
  ///@}

  ///@{
  /** The point that linked views have in common: all of them go through it, none pans. */
  void SetCursor(double x, double y, double z);
  void GetCursor(double cursor[3]) const { Copy(this->Frame.cursor, cursor); }
  ///@}

  ///@{
  /** Zoom: mm per pixel in [1e-4, 1000]; by a factor, where the given pixel stays what it is. Pan: the picture moves by so many
   * pixels. Fit: all visible volumes are seen, and the plane goes through their middle if it missed them; done by itself when
   * the first volumes come. */
  void SetMillimetresPerPixel(double mm);
  double GetMillimetresPerPixel() const { return this->Frame.mmPerPixel; }
  void Zoom(double factor, double pixelX, double pixelY);
  void Pan(double pixelsX, double pixelsY);
  void Fit();
  ///@}

  ///@{
  /** Takes part in what \a other and its linked views have in common. */
  void LinkTo(vtkUltrasoundSliceView* other);
  void Unlink();
  bool IsLinked() const { return this->Linked->size() > 1; }
  ///@}

  ///@{
  /** Between pixels and the world, mm; a point off the plane goes to where it is seen. */
  void PixelToWorld(double pixelX, double pixelY, double world[3]) const { Copy(this->Frame.WorldOf(pixelX, pixelY), world); }
  void WorldToPixel(double x, double y, double z, double pixel[2]) const { Copy(this->Frame.PixelOf({x, y, z}), pixel); }
  ///@}

  ///@{
  /** Which of the visible volumes: "all", "selected" or "others". Default "all". */
  void SetShown(const char* which);
  std::string GetShown() const;
  ///@}

  ///@{
  /** These volumes alone, whatever is visible or shown: to look at some without an edit. None (default): all. */
  void AddOnly(int id)
  {
    this->Only.push_back(id);
    this->Outdate();
  }
  void ClearOnly()
  {
    this->Only.clear();
    this->Outdate();
  }
  ///@}

  ///@{
  /** "blend", "difference" or "checkerboard": of the selected against the others. Where all or none are selected, of the first
   * against the others. Default "blend". */
  void SetMode(const char* mode);
  std::string GetMode() const;
  ///@}

  ///@{
  /** Trilinear (default), or the nearest voxel. */
  void SetLinear(bool on) { this->Change(this->Parameters.linear, on); }
  bool GetLinear() const { return this->Parameters.linear; }
  ///@}

  ///@{
  /** Side of the squares of the checkerboard, pixels in [2, 10000]. Default 40. */
  void SetSquarePixels(int pixels);
  int GetSquarePixels() const { return this->Parameters.squarePixels; }
  ///@}

  ///@{
  /** While dragging: pictures that take longer than a sixtieth of a second (the other half of a frame is the rendering's) are
   * drawn from fewer samples. Turning it off makes the picture whole again. Default off. InteractiveStep: every so many pixels
   * both ways, in [1, 16]; 0 (default): as needed, at most 4. */
  void SetInteractive(bool on);
  bool GetInteractive() const { return this->Interactive; }
  void SetInteractiveStep(int step);
  int GetInteractiveStep() const { return this->InteractiveStep; }
  ///@}

  ///@{
  /** The outline of a spherical brush at a point of the world, where the plane cuts it. */
  void SetBrush(double x, double y, double z, double radiusMm);
  void HideBrush();
  ///@}

  ///@{
  /** A cross at a point of the world, where the plane is nearest to it, the fainter the farther: where the mouse is in another
   * view. Default: none. */
  void SetPointer(double x, double y, double z);
  void HidePointer();
  ///@}

  /** Lays a map of lengths in mm (one float per voxel, NaN: not known) over the picture, with a legend from 0 to \a mostMm;
   * stale: faint, and the legend says so. nullptr: none. Call it again when its values have changed. */
  void SetShifts(vtkImageData* map, double mostMm = 1.0, bool stale = false);

  ///@{
  /** Scale bar, letters of the body's sides (not in oblique planes), and the linked views' planes. Default on. */
  void SetAnnotated(bool on);
  bool GetAnnotated() const { return this->Annotated; }
  ///@}

  /** Brings picture, camera and lines up to date. Returns whether anything was out of date: time to render. */
  bool Update();

  /** The picture as it was last drawn: RGBA, lowest row first, placed in the world. */
  vtkImageData* GetPicture() const;
  /** Its outer corners: lower left, lower right, upper right, upper left; mm. */
  void GetPlaneCorners(double corners[12]) const;
  /** How many pixels apart the picture was sampled (1: in full), and how long drawing it took, s. */
  int GetPictureStep() const { return this->Parameters.step; }
  double GetPictureSeconds() const { return this->PictureSeconds; }

protected:
  vtkUltrasoundSliceView();
  ~vtkUltrasoundSliceView() override;

private:
  vtkUltrasoundSliceView(const vtkUltrasoundSliceView&) = delete;
  void operator=(const vtkUltrasoundSliceView&) = delete;
#ifndef __VTK_WRAP__
  template <class Vector>
  static void Copy(const Vector& from, double* to)
  {
    std::copy_n(from.data(), from.size(), to);
  }
  template <class T>
  void Change(T& member, const T& value)
  {
    if (value != member) {
      member = value;
      this->Outdate();
    }
  }
  bool InRange(const char* what, double value, double low, double high);
  void OnSession(vtkObject*, unsigned long event, void*);
  void Outdate();
  void OutdateLines();
  void OutdatePlane();

  echorama::SliceFrame Frame;
  std::optional<std::array<double, 3>> Colour; ///< of its line in linked views; nothing: the axis's
  bool NeverFitted = true;
  std::shared_ptr<std::vector<vtkUltrasoundSliceView*>> Linked; ///< with this view; one alone when it is not linked
  echorama::SliceShown Shown = echorama::SliceShown::All;
  std::vector<int> Only;
  echorama::SliceParameters Parameters;
  bool Interactive = false, Annotated = true;
  int InteractiveStep = 0;
  double PictureSeconds = 0.0;
  struct Internals;
  std::unique_ptr<Internals> Parts;

public:
  /** Only these volumes, as AddOnly. */
  void SetOnly(const std::vector<int>& ids)
  {
    this->Change(this->Only, ids);
  }
  /** A measurement that is being made: its points, world. */
  void SetDraft(const std::vector<Eigen::Vector3d>& points);
  const echorama::SliceFrame& GetFrame() const
  {
    return this->Frame;
  }
#endif
};

#endif
