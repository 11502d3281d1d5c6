// SPDX-License-Identifier: BSD-3-Clause
// One volume of a session as the 3D view keeps it: its particles, its bytes for volume rendering, its box.
#ifndef vtkUltrasoundShownVolume_h
#define vtkUltrasoundShownVolume_h

#include "vtkActor.h"
#include "vtkNew.h"
#include "vtkSmartPointer.h"
#include "vtkVolume.h"
#include "Widgets/Pictures/Particles.h"
#include "Widgets/Session/SessionState.h"

#include <map>

class vtkCubeSource;
class vtkFixedPointVolumeRayCastMapper;
class vtkGPUVolumeRayCastMapper;
class vtkImageData;

namespace echorama {

/** Volume rendering takes bytes (0: nothing) on a grid along the volume's own axes, which its pose then places in the world: the
 * ray caster on the CPU does not know oblique directions. Both particles and bytes belong to the space of the volume's file, are
 * made when they are asked for, and kept for each level of detail until voxels or parameters change. */
class ShownVolume {
public:
  vtkNew<vtkActor> Box; ///< around its real voxels
  vtkNew<vtkVolume> Volume;
  bool VoxelsDirty = false;

  ShownVolume();
  ~ShownVolume();

  double RealVoxels() const { return this->InBox; }
  const ParticleParameters& Look() const { return this->Parameters; }
  /** \returns whether it is another one. */
  bool SetLook(const ParticleParameters& look);
  void TakeVoxels(const SessionVolume& volume, vtkImageData* image);

  ///@{
  /** At a level of detail. */
  const Particles& ParticlesAt(int level, const SessionVolume& volume, vtkImageData* image);
  vtkImageData* BytesAt(int level, const SessionVolume& volume, vtkImageData* image);
  void CastRays(int level, const SessionVolume& volume, vtkImageData* image, bool onProcessor);
  ///@}

  void Place(const SessionVolume& volume);

private:
  ParticleParameters Parameters;
  std::map<int, Particles> Clouds; ///< by the block that was asked for
  std::map<int, vtkSmartPointer<vtkImageData>> Bytes;
  vtkNew<vtkFixedPointVolumeRayCastMapper> RayCaster;
  vtkSmartPointer<vtkGPUVolumeRayCastMapper> Graphics; ///< made when it is asked for
  vtkNew<vtkCubeSource> Cube;
  double InBox = 0.0;
};

} // namespace echorama

#endif
