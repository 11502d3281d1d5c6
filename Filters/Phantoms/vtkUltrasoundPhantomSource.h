// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class vtkUltrasoundPhantomSource
 * @brief a synthetic ultrasound volume of a known scene, seen from a known place
 *
 * No input. Output: a vtkImageData with `Intensity` (unsigned char, log-compressed B-mode), `ValidRegion` (1 inside the fan),
 * and the field data `ProbeGeometry`, `ProbeToWorld`, `Seed` and `Scene`. Its geometry is the pose: the grid is aligned
 * to the axes of the probe.
 *
 * The scene lies in the world and its scatterers are fixed to it, so volumes of the same scene and seed from different
 * poses show the same tissue, and share speckle as far as their viewing angles are near. That makes them test data for
 * alignment and blending whose truth is known. What sets volumes of one tissue apart in life can be planted: changed speckle,
 * tissue that the probe deforms, noise, the shadow of a rib, and bodies that come and go.
 *
 * Fails, with a message that names the number, for a probe geometry without volume or with beams that cross, a pose that is
 * not rigid, a scene that cannot be read, or a volume that is too large.
 *
 * @sa echorama::PhantomParameters, echorama::SimulateEchoes (the model and its limits)
 */
#ifndef vtkUltrasoundPhantomSource_h
#define vtkUltrasoundPhantomSource_h

#include "EchoramaFiltersPhantomsModule.h"
#include "vtkUltrasoundImageAlgorithm.h"
#include "vtkUltrasoundParameters.h"

#ifndef __VTK_WRAP__
#include "Filters/Phantoms/Phantom.h"
#include <memory> // for what is set
#endif

class vtkMatrix4x4;
class vtkPoints;

class ECHORAMAFILTERSPHANTOMS_EXPORT vtkUltrasoundPhantomSource : public vtkUltrasoundImageAlgorithm {
public:
  static vtkUltrasoundPhantomSource* New();
  vtkTypeMacro(vtkUltrasoundPhantomSource, vtkUltrasoundImageAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  // BEGIN parameters
  /**
   * Seed of the tissue: where the scatterers lie and how strong they are. Volumes with one seed show the same tissue. At least 0;
   * default 1.
   */
  vtkUltrasoundInteger64Macro(Seed);

  /** Edge of the cubic voxels. Above 0 mm; default 1. */
  vtkUltrasoundNumberMacro(SpacingMm);

  /** Gain of this volume. In [-200, 200] dB; default 0. */
  vtkUltrasoundNumberMacro(GainDb);

  /** How much the 255 steps of grey span. In [10, 200] dB; default 60. */
  vtkUltrasoundNumberMacro(DynamicRangeDb);

  /** Mean grey of the background at a gain of 0 dB. In [0, 255]; default 100. */
  vtkUltrasoundNumberMacro(BackgroundGrey);

  /** Whether attenuating bodies (the stone of the default scene) cast shadows. Default on. */
  vtkUltrasoundSwitchMacro(Shadows);

  /**
   * How far the speckle has changed: complex echoes of volumes of one Seed and different ChangeSeeds that are seen alike
   * correlate by 1 less this. Bodies stay where and as loud as they are. In [0, 1]; default 0.
   */
  vtkUltrasoundNumberMacro(Decorrelation);

  /** Seed of the change and of the noise: volumes with the same one have changed alike. At least 0; default 1. */
  vtkUltrasoundInteger64Macro(ChangeSeed);

  /**
   * How far the pressed probe moves the tissue below the middle of its face. It fades with depth and sideways. In [0, 10] mm;
   * default 0.
   */
  vtkUltrasoundNumberMacro(DeformationMm);

  /** Power of the receiver's noise beside that of the background; -120: none. In [-120, 60] dB; default -120. */
  vtkUltrasoundNumberMacro(NoiseDb);

  /** Share of the fan in the shadow of a rib close below the face; 0: no rib. In [0, 0.6]; default 0. */
  vtkUltrasoundNumberMacro(RibShare);

  /** Whether bodies that come and go (jets and puffs at places of the default scene) are there. Default off. */
  vtkUltrasoundSwitchMacro(Jets);

  /** Wavelength in tissue. The longer, the longer speckle stays alike as the probe turns. In [0.05, 10] mm; default 0.6. */
  vtkUltrasoundNumberMacro(WavelengthMm);

  /** Angle between the first and the last beam of a fan. In [0, 359.999] degrees; default 65. */
  vtkUltrasoundNumberMacro(FanAngle);

  /** Radius of the array's arc. In [0, 10000] mm; default 40. */
  vtkUltrasoundNumberMacro(FanRadius);

  /** Angle that the array sweeps. In [0, 359.999] degrees; default 55. */
  vtkUltrasoundNumberMacro(SweepAngle);

  /**
   * Distance of the sweep's axis behind the middle of the face. The edges of the fan must stay in front of it. In [0, 10000] mm;
   * default 30.
   */
  vtkUltrasoundNumberMacro(SweepRadius);

  /** First depth along the beams, from the face. In [-10000, 10000] mm; default 5. */
  vtkUltrasoundNumberMacro(DepthMin);

  /** Last depth along the beams, from the face. In [-10000, 10000] mm; default 100. */
  vtkUltrasoundNumberMacro(DepthMax);

  /** Where the middle of the probe's face lies in the world. In mm; default (0, 0, 0). */
  vtkUltrasoundVectorMacro(Position);

  /** How the probe is turned: axis times angle. (0, 0, 0): it looks along +z, the fan along x. In degrees; default (0, 0, 0). */
  vtkUltrasoundVectorMacro(Orientation);

  /** The scene as JSON text, as it stands in the field data Scene of a phantom; empty: the default scene. Default none. */
  vtkUltrasoundTextMacro(Scene);

  /**
   * Any parameter by its name: as a number (of a switch 0 or 1, of a choice its place from 0), as text ("1.5", "on", the name of
   * a choice, "1 0 0"), integers and vectors without a loss. Setting returns false, after an error event, when there is no such
   * parameter or value. GetParameterDescriptions tells what parameters there are, as JSON: an array of objects with name, type,
   * value, unit, low, high, choices, help ...
   */
  vtkUltrasoundAnyParameterMacro();
  // END parameters
#ifndef __VTK_WRAP__
  echorama::ParameterList Parameters(); ///< for C++: they point into this object
#endif

  /**
   * Sets Position and Orientation from a rigid transform. Any other matrix is refused with an error, and nothing changes.
   */
  void SetProbeToWorld(vtkMatrix4x4* probeToWorld);

  /** The pose that Position and Orientation make. */
  void GetProbeToWorld(vtkMatrix4x4* probeToWorld);

  ///@{
  /**
   * The truth of the deformation, in the world, mm: where the tissue at each point (unpressed) is seen, and back (to 1e-9
   * mm). The points that come out replace those in \a to; their precision is double.
   */
  void TissueToSeen(vtkPoints* from, vtkPoints* to);
  void SeenToTissue(vtkPoints* from, vtkPoints* to);
  ///@}

  ///@{
  /**
   * Adds a body to the scene: \a echogenicityDb beside the background of 0 dB, in [-120, 60], -120 for clear fluid. Later
   * bodies count where they overlap. Lengths in mm, world coordinates.
   */
  void AddEllipsoid(const double centre[3], const double radii[3], double echogenicityDb);
  void AddTube(const double from[3], const double to[3], double radius, double echogenicityDb);
  ///@}

  /** Leaves only the background, to begin a scene of one's own. */
  void ClearScene();

#ifndef __VTK_WRAP__
  /** The kernel's parameters for the present properties; throws echorama::Error when the scene cannot be read. */
  echorama::PhantomParameters Phantom() const;

  /** Sets Position, Orientation and GainDb. */
  void SetView(const echorama::Pose& probeToWorld, double gainDb);
#endif

protected:
  vtkUltrasoundPhantomSource();
  ~vtkUltrasoundPhantomSource() override;

  int RequestInformation(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs) override;
#ifndef __VTK_WRAP__
  void Execute(vtkInformationVector** inputs, vtkImageData* output, const echorama::Progress& progress) override;
#endif

private:
  struct Settings;
#ifndef __VTK_WRAP__
  void Add(echorama::Inclusion inclusion);
  std::unique_ptr<Settings> Values;
#endif

  vtkUltrasoundPhantomSource(const vtkUltrasoundPhantomSource&) = delete;
  void operator=(const vtkUltrasoundPhantomSource&) = delete;
};

#endif
