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

#ifndef __VTK_WRAP__
#include "Filters/Phantoms/Phantom.h"
#endif

class vtkMatrix4x4;
class vtkPoints;

class ECHORAMAFILTERSPHANTOMS_EXPORT vtkUltrasoundPhantomSource : public vtkUltrasoundImageAlgorithm {
public:
  static vtkUltrasoundPhantomSource* New();
  vtkTypeMacro(vtkUltrasoundPhantomSource, vtkUltrasoundImageAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  ///@{
  /**
   * Seed of the tissue: where the scatterers lie and how strong they are. Views with one seed see the same. At least 0.
   * Default 1.
   */
  vtkSetClampMacro(Seed, vtkTypeInt64, 0, VTK_TYPE_INT64_MAX);
  vtkGetMacro(Seed, vtkTypeInt64);
  ///@}

  ///@{
  /** Edge of the cubic voxels in mm, > 0. Default 1. */
  vtkSetMacro(SpacingMm, double);
  vtkGetMacro(SpacingMm, double);
  ///@}

  ///@{
  /** Gain of this volume in dB, in [-200, 200]. Default 0. */
  vtkSetClampMacro(GainDb, double, -200.0, 200.0);
  vtkGetMacro(GainDb, double);
  ///@}

  ///@{
  /** How many dB the 255 steps of grey span, in [10, 200]. Default 60. */
  vtkSetClampMacro(DynamicRangeDb, double, 10.0, 200.0);
  vtkGetMacro(DynamicRangeDb, double);
  ///@}

  ///@{
  /** Mean grey of the background at a gain of 0 dB, in [0, 255]. Default 100. */
  vtkSetClampMacro(BackgroundGrey, double, 0.0, 255.0);
  vtkGetMacro(BackgroundGrey, double);
  ///@}

  ///@{
  /** Whether attenuating bodies (the stone of the default scene) cast shadows. Default on. */
  vtkSetMacro(Shadows, bool);
  vtkGetMacro(Shadows, bool);
  vtkBooleanMacro(Shadows, bool);
  ///@}

  ///@{
  /**
   * How far the speckle has changed, in [0, 1]. Volumes of one Seed, different ChangeSeeds and decorrelation d that are seen
   * alike have complex echoes that correlate by 1 - d; bodies stay where and as loud as they are. Default 0.
   */
  vtkSetClampMacro(Decorrelation, double, 0.0, 1.0);
  vtkGetMacro(Decorrelation, double);
  ///@}

  ///@{
  /** Seed of the change and of the noise: volumes with the same one have changed alike. At least 0. Default 1. */
  vtkSetClampMacro(ChangeSeed, vtkTypeInt64, 0, VTK_TYPE_INT64_MAX);
  vtkGetMacro(ChangeSeed, vtkTypeInt64);
  ///@}

  ///@{
  /**
   * How far the pressed probe moves the tissue below the middle of its face, in mm, in [0, 10]. The displacement fades with
   * depth and sideways; TissueToSeen gives it exactly. Default 0.
   */
  vtkSetClampMacro(DeformationMm, double, 0.0, 10.0);
  vtkGetMacro(DeformationMm, double);
  ///@}

  ///@{
  /** Power of the receiver's noise beside that of the background, in dB, in [-120, 60]. Default -120: none. */
  vtkSetClampMacro(NoiseDb, double, -120.0, 60.0);
  vtkGetMacro(NoiseDb, double);
  ///@}

  ///@{
  /** Share of the fan in the shadow of a rib close below the face of this view, in [0, 0.6]. Default 0: no rib. */
  vtkSetClampMacro(RibShare, double, 0.0, 0.6);
  vtkGetMacro(RibShare, double);
  ///@}

  ///@{
  /** Whether bodies that come and go (jets and puffs at places of the default scene) are there in this volume. Default off. */
  vtkSetMacro(Jets, bool);
  vtkGetMacro(Jets, bool);
  vtkBooleanMacro(Jets, bool);
  ///@}

  ///@{
  /** Wavelength in tissue in mm, in [0.05, 10]. Default 0.6 (2.6 MHz). The longer, the longer speckle stays alike as the
   * probe turns. */
  vtkSetClampMacro(WavelengthMm, double, 0.05, 10.0);
  vtkGetMacro(WavelengthMm, double);
  ///@}

  ///@{
  /**
   * The head: angle of the fan (degrees, below 180; default 65) and its radius (mm, at least 0; default 40), angle of the
   * sweep (degrees, above 0 and below 180; default 55) and its radius (mm, at least 0; default 30).
   */
  vtkSetMacro(FanAngle, double);
  vtkGetMacro(FanAngle, double);
  vtkSetMacro(FanRadius, double);
  vtkGetMacro(FanRadius, double);
  vtkSetMacro(SweepAngle, double);
  vtkGetMacro(SweepAngle, double);
  vtkSetMacro(SweepRadius, double);
  vtkGetMacro(SweepRadius, double);
  ///@}

  ///@{
  /** First and last depth along the beams, mm from the face. Default 5 and 100. */
  vtkSetMacro(DepthMin, double);
  vtkGetMacro(DepthMin, double);
  vtkSetMacro(DepthMax, double);
  vtkGetMacro(DepthMax, double);
  ///@}

  ///@{
  /** Where the middle of the probe's face lies in the world, mm. Default (0, 0, 0). */
  vtkSetVector3Macro(Position, double);
  vtkGetVector3Macro(Position, double);
  ///@}

  ///@{
  /** How the probe is turned: axis times angle, in degrees. Default (0, 0, 0): it looks along +z, its fan along x. */
  vtkSetVector3Macro(Orientation, double);
  vtkGetVector3Macro(Orientation, double);
  ///@}

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
   * The scene as JSON text, as it stands in the field data `Scene` of our volumes (see Documentation/filters/PhantomSource.md).
   * Empty (default): the default scene.
   */
  vtkSetStringMacro(Scene);
  vtkGetStringMacro(Scene);
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
  echorama::PhantomParameters Parameters() const;

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
#ifndef __VTK_WRAP__
  void Add(echorama::Inclusion inclusion);
  echorama::Pose ProbeToWorld() const;
#endif

  vtkTypeInt64 Seed;
  double SpacingMm;
  double GainDb;
  double DynamicRangeDb;
  double BackgroundGrey;
  bool Shadows;
  double Decorrelation;
  vtkTypeInt64 ChangeSeed;
  double DeformationMm;
  double NoiseDb;
  double RibShare;
  bool Jets;
  double WavelengthMm;
  double FanAngle;
  double FanRadius;
  double SweepAngle;
  double SweepRadius;
  double DepthMin;
  double DepthMax;
  double Position[3];
  double Orientation[3];
  char* Scene;

  vtkUltrasoundPhantomSource(const vtkUltrasoundPhantomSource&) = delete;
  void operator=(const vtkUltrasoundPhantomSource&) = delete;
};

#endif
