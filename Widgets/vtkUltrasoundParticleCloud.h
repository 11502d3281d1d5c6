// SPDX-License-Identifier: BSD-3-Clause
// Particles of several volumes, blended over each other in the order of their depth.
#ifndef vtkUltrasoundParticleCloud_h
#define vtkUltrasoundParticleCloud_h

#include "Core/Geometry/RigidTransform.h"
#include "vtkNew.h"
#include "Widgets/Particles/Particles.h"

#include <array>
#include <vector>

class vtkActor;
class vtkPolyData;
class vtkRenderer;

namespace echorama {

/** Particles of all volumes are the points of one vtkPolyData in world coordinates, and one cell names them from back to front. A
 * pose that changes moves points, a camera that turns sorts them; both are linear in their number. Points are drawn in the
 * opaque pass without writing depths: there VTK blends in the order of drawing, while its translucent pass would mix without any
 * order. So what is opaque must be drawn first: the actor of the particles is the last of its renderer. */
class ParticleCloud {
public:
  /** The particles of a volume; they must outlive what is drawn of them. */
  struct Part {
    int volume;
    const Particles* particles;
    std::array<double, 3> colour;
    double opacity;
    Pose volumeToWorld;
  };

  vtkNew<vtkActor> Actor;

  ParticleCloud();
  ~ParticleCloud();

  int Count() const; ///< that are seen
  /** Other particles, or colours; Move follows. \a size: of a particle, in sides of its block. */
  void Fill(std::vector<Part> parts, double size);
  std::vector<Part>& Parts() { return this->Filled; }
  /** To where the parts are. */
  void Move();
  /** For the camera and the size of the renderer, before it draws. */
  void Face(vtkRenderer* renderer);

private:
  void Sort(const Eigen::Vector3d& towards);

  vtkNew<vtkPolyData> Cloud;
  std::vector<Part> Filled;
  Eigen::Vector3d SortedAlong = Eigen::Vector3d::Zero(); ///< towards the viewer; zero: not sorted
};

} // namespace echorama

#endif
