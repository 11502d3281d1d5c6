// SPDX-License-Identifier: BSD-3-Clause
// Particles of several volumes, blended over each other in the order of their depth.
#ifndef vtkUltrasoundParticleCloud_h
#define vtkUltrasoundParticleCloud_h

#include "vtkNew.h"
#include "Widgets/Pictures/Splat.h"

#include <vector>

class vtkActor;
class vtkPolyData;
class vtkRenderer;
class vtkRenderWindow;

namespace echorama {

/** Drawn by the processor (DrawParticles), or by the graphics card: then particles of all volumes are the points of one
 * vtkPolyData in world coordinates, and one cell names them from back to front; a pose that changes moves points, a camera that
 * turns sorts them; both are linear in their number. Either is done in the opaque pass without writing depths: there VTK blends
 * in the order of drawing, while its translucent pass would mix without any order. So what is opaque must be drawn first: the
 * actor of the particles is the last of its renderer. */
class ParticleCloud {
public:
  /** The particles of a volume; they must outlive what is drawn of them. */
  struct Part : SplatSet {
    int volume = 0;
    Eigen::AlignedBox3f box; ///< of the particles' middles, in their own space
  };

  vtkNew<vtkActor> Actor;

  ParticleCloud();
  ~ParticleCloud();

  int Count() const; ///< that are seen
  /** Other particles, or colours; Move follows. \a sides: width of a particle, in sides of its block. */
  void Fill(std::vector<Part> parts, double sides);
  std::vector<Part>& Parts() { return this->Filled; }
  /** To where the parts are. */
  void Move();
  /** For the camera and the size of the renderer, before it draws. */
  void Face(vtkRenderer* renderer, bool onProcessor);

private:
  class Mapper;
  void FillPoints();
  void MovePoints();
  void Sort(const Eigen::Vector3d& towards);
  void DrawOnProcessor(vtkRenderer* renderer) const;

  vtkNew<vtkPolyData> Cloud; ///< empty until a graphics card has drawn
  std::vector<Part> Filled;
  double Sides = 1.0;
  bool IsOnProcessor = false, PointsDirty = false, PlacesDirty = false;
  Eigen::Vector3d SortedAlong = Eigen::Vector3d::Zero(); ///< towards the viewer; zero: not sorted
};

/** Whether its OpenGL is a program rather than a graphics card. Its context must be current. */
bool DrawsInSoftware(vtkRenderWindow* window);

} // namespace echorama

#endif
