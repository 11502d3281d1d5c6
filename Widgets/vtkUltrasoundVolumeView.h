// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class vtkUltrasoundVolumeView
 * @brief the 3D view of an alignment session, in a renderer
 *
 * Shows the visible volumes of a vtkUltrasoundAlignmentSession where they lie, in one of three styles: as particles that are
 * sorted by depth across all volumes and blended over each other, by volume rendering, or as boxes. Boxes of selected volumes are
 * always shown. Planes of slice views, error vectors and an orientation marker (L, P, S) are added. There is no window inside:
 * put GetRenderer() into any, call Update() and render. The view follows the session by itself: Update() is also called when the
 * renderer begins to render.
 *
 * Moving a volume changes matrices alone: particles belong to the space of the volume's file and are made anew only when
 * voxels or parameters change.
 *
 * While something is dragged (SetInteractive), frames are timed and the level of detail is chosen so that they stay below
 * FrameBudget: fewer and larger particles of the same total opacity, or coarser volumes and rays. Voxels and the grey window that
 * change meanwhile are shown afterwards. Turning it off shows the full picture again, however long that takes; Refine() goes
 * there step by step.
 *
 * Source: dissertation 4.3 (particles), 4.4.2 (error vectors).
 *
 * @sa vtkUltrasoundAlignmentSession
 */
#ifndef vtkUltrasoundVolumeView_h
#define vtkUltrasoundVolumeView_h

#include "EchoramaWidgetsModule.h"
#include "vtkObject.h"
#ifndef __VTK_WRAP__
#include "Widgets/Pictures/DetailLevel.h"
#include "Widgets/Pictures/Particles.h"
#include <memory>
#endif
#include <string>

class vtkImageData;
class vtkRenderer;
class vtkUltrasoundAlignmentSession;

class ECHORAMAWIDGETS_EXPORT vtkUltrasoundVolumeView : public vtkObject {
public:
  static vtkUltrasoundVolumeView* New();
  vtkTypeMacro(vtkUltrasoundVolumeView, vtkObject);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  ///@{
  /** What is shown. nullptr: nothing. */
  void SetSession(vtkUltrasoundAlignmentSession* session);
  vtkUltrasoundAlignmentSession* GetSession() const;
  ///@}

  /** The view's own renderer, with a perspective camera that may be moved freely. */
  vtkRenderer* GetRenderer() const;

  /** Brings the renderer up to date with the session and the parameters. */
  void Update();

  /** Moves the camera so that all visible volumes are seen. Before the first call they are seen from the left, the front and
   * above. */
  void Fit();

  ///@{
  /** These volumes alone, whatever is visible: to look at some without an edit. None (default): all that are. */
  void AddOnly(int id)
  {
    std::vector<int> ids = this->Only;
    ids.push_back(id);
    this->SetOnly(ids);
  }
  void ClearOnly() { this->SetOnly({}); }
  ///@}

  ///@{
  /** "points", "volume" or "outline". Default "points". */
  bool SetStyle(const char* style);
  std::string GetStyle() const { return this->Style; }
  ///@}

  ///@{
  /** Voxels along each axis of the block that becomes one particle, in [1, 64]. Default 2. Volumes together have at most
   * Budget particles; blocks grow when there would be more. Default 2000000, at least 1000. */
  void SetDownsampling(int voxels);
  int GetDownsampling() const { return this->Parameters.downsampling; }
  void SetBudget(int particles);
  int GetBudget() const { return this->Parameters.budget; }
  ///@}

  ///@{
  /** Width of a particle, in sides of its block: at 1 they touch when seen along the axes. In [0.1, 10]. Default 1.25: closed
   * also when seen obliquely. */
  void SetParticleSize(double factor);
  double GetParticleSize() const { return this->ParticleSize; }
  ///@}

  ///@{
  /** Opacity of each particle, and of as much of a rendered volume, in [0, 1]; times that of the volume. Default 0.3. With
   * ValueOpacity (default on) also times the grey level, so that dark regions are seen through. */
  void SetOpacity(double opacity);
  double GetOpacity() const { return this->Parameters.opacity; }
  void SetValueOpacity(bool on);
  bool GetValueOpacity() const { return this->Parameters.valueOpacity; }
  ///@}

  ///@{
  /** Grey levels below Minimum and above Maximum are hidden. Defaults 1 and 1e300. */
  void SetMinimum(double grey);
  double GetMinimum() const { return this->Parameters.minimum; }
  void SetMaximum(double grey);
  double GetMaximum() const { return this->Parameters.maximum; }
  ///@}

  ///@{
  /** Level of detail while something is dragged; off shows the full picture. Default off. */
  void SetInteractive(bool on);
  bool GetInteractive() const { return this->Detail.Interactive(); }
  ///@}

  /** After a drag: makes the next frame one level finer, or takes what waited. False: there is nothing to add, or it would take
   * longer than RestBudget, going by the frames before. SetInteractive(true) begins anew. */
  bool Refine();

  ///@{
  /** The time that a frame of Refine() may take to draw, ms, in [5, 1000000]. Default 1000. */
  void SetRestBudget(double milliseconds);
  double GetRestBudget() const { return this->Detail.restSeconds * 1000.0; }
  ///@}

  ///@{
  /** The time that a frame may take while dragging, ms, in [5, 10000]. Default 100. */
  void SetFrameBudget(double milliseconds);
  double GetFrameBudget() const { return this->Detail.Budget() * 1000.0; }
  ///@}

  ///@{
  /** Of the last frame: its time from begin to end, s; its level of detail (0: full); how many particles it showed. */
  double GetLastFrameSeconds() const { return this->LastSeconds; }
  int GetDetailLevel() const { return this->Detail.Level(); }
  int GetNumberOfParticles() const;
  ///@}

  ///@{
  /** Planes of slice views, by any number that the caller gives them. Corners: lower left, lower right, upper right, upper left
   * of the picture, mm in the world. A picture of RGBA (or RGB) bytes is shown on the plane, see-through where its alpha is 0;
   * without one only the frame is shown. Colour is that of the frame. ShowPlanes hides and shows all. Default on. */
  bool SetPlane(int plane, const double corners[12], vtkImageData* picture = nullptr);
  void SetPlaneColour(int plane, double r, double g, double b);
  void RemovePlane(int plane);
  int GetNumberOfPlanes() const;
  void SetShowPlanes(bool on);
  bool GetShowPlanes() const { return this->ShowPlanes; }
  ///@}

  /** The volumes on the line of sight of a pixel (from the lower left of the window), by where their first voxel lies that is
   * bright and dark enough to be shown, the nearest first. 0: there are not so many. */
  int GetVolumeAt(double pixelX, double pixelY, int which = 0);

  ///@{
  /** Arrows from where points of the volumes are to where they belong, coloured by their length, with a scale in mm. They are
   * there when the session has a truth. Default off. */
  void SetErrorVectors(bool on);
  bool GetErrorVectors() const { return this->ShowErrors; }
  ///@}

  ///@{
  /** Who draws particles and renders volumes: "automatic" (the graphics card, and the processor where OpenGL is software: it is
   * several times as fast there), "processor" or "graphics". The pictures differ by rounding. Default "automatic". */
  bool SetDrawnBy(const char* who);
  std::string GetDrawnBy() const { return this->DrawnBy; }
  ///@}

  ///@{
  /** The axes L, P and S in the corner at the lower left. Default on. */
  void SetOrientationMarker(bool on);
  bool GetOrientationMarker() const { return this->ShowMarker; }
  ///@}

protected:
  vtkUltrasoundVolumeView();
  ~vtkUltrasoundVolumeView() override;

private:
  vtkUltrasoundVolumeView(const vtkUltrasoundVolumeView&) = delete;
  void operator=(const vtkUltrasoundVolumeView&) = delete;

#ifndef __VTK_WRAP__
  void OnSession(vtkObject* caller, unsigned long event, void* data);
  void OnStart();
  void OnEnd();

  std::vector<int> Only;
  std::string Style = "points", DrawnBy = "automatic";
  echorama::ParticleParameters Parameters;
  double ParticleSize = 1.25;
  bool ShowPlanes = true, ShowErrors = false, ShowMarker = true;
  echorama::FrameDetail Detail;
  double LastSeconds = 0.0;
  struct Internals;
  std::unique_ptr<Internals> Parts;

public:
  /** Only these volumes, as AddOnly. Returns whether others were shown. */
  bool SetOnly(const std::vector<int>& ids);
#endif
};

#endif
