// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class vtkUltrasoundAnatomySource
 * @brief an invented abdomen, or a rig of balls to calibrate a probe by, as tissue
 *
 * No input. Output: a vtkPolyData of closed surfaces with materials (vtkUltrasoundTissue), which the synthesizer images. A
 * probe at the origin that looks along +z sees it: x runs along its fan, y along its sweep.
 *
 * Kind Anatomy: layers of skin, fat and muscle; a liver with capsule, branching vessels, cysts and lesions; a kidney; a
 * gallbladder with stones; great vessels; ribs and spine. One Seed is one individual. Kind CalibrationRig: balls of known
 * places and sizes on a glass plate in a bath of water (dissertation 4.1.2), and their centres as truth.
 *
 * Fails, with a message that names the number and its range, for parameters out of their range.
 *
 * @sa echorama::AnatomyParameters, echorama::CalibrationRigParameters
 */
#ifndef vtkUltrasoundAnatomySource_h
#define vtkUltrasoundAnatomySource_h

#include "EchoramaFiltersPhantomsModule.h"
#include "vtkPolyDataAlgorithm.h"
#include "vtkUltrasoundParameters.h"

#ifndef __VTK_WRAP__
#include <memory> // for what is set
#endif

class vtkPoints;
class vtkStringArray;

class ECHORAMAFILTERSPHANTOMS_EXPORT vtkUltrasoundAnatomySource : public vtkPolyDataAlgorithm {
public:
  static vtkUltrasoundAnatomySource* New();
  vtkTypeMacro(vtkUltrasoundAnatomySource, vtkPolyDataAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  // BEGIN parameters
  enum Kinds { ANATOMY = 0, CALIBRATION_RIG = 1 };

  ///@{
  /**
   * What is made: an invented abdomen, or a rig of balls in a water bath. Default anatomy. There are ANATOMY, CALIBRATION_RIG.
   */
  vtkUltrasoundChoiceMacro(Kind);
  void SetKindToAnatomy() { this->SetKind(ANATOMY); }
  void SetKindToCalibrationRig() { this->SetKind(CALIBRATION_RIG); }
  ///@}

  /** Which individual: shapes, places, vessels and lesions. Used when Kind is anatomy. At least 0; default 1. */
  vtkUltrasoundInteger64Macro(Seed);

  /**
   * How far individuals (seeds) differ in shape and place; 0: they are alike but for their vessels and lesions. Used when Kind is
   * anatomy. In [0, 2]; default 1.
   */
  vtkUltrasoundNumberMacro(Variation);

  /** Edge of the triangles of large bodies; small bodies are finer. Used when Kind is anatomy. In [0.5, 10] mm; default 1.5. */
  vtkUltrasoundNumberMacro(DetailMm);

  /** Size of all organs and of the spine beside an adult's. Used when Kind is anatomy. In [0.5, 1.2]; default 1. */
  vtkUltrasoundNumberMacro(OrganScale);

  /** Size of the trunk along x. Used when Kind is anatomy. In [150, 600] mm; default 290. */
  vtkUltrasoundNumberMacro(TrunkWidthMm);

  /** Size of the trunk along y. Used when Kind is anatomy. In [120, 600] mm; default 240. */
  vtkUltrasoundNumberMacro(TrunkLengthMm);

  /** Size of the trunk along z, from the skin. Used when Kind is anatomy. In [60, 400] mm; default 190. */
  vtkUltrasoundNumberMacro(TrunkDepthMm);

  /**
   * Gel between the middle of the probe's face (z = 0) and the skin; below 0 the face lies inside the body, which is not
   * deformed. Used when Kind is anatomy. In [-10, 20] mm; default 1.
   */
  vtkUltrasoundNumberMacro(StandoffMm);

  /**
   * How far a layer's thickness deviates from its mean, never by more than half of it. Used when Kind is anatomy. In [0, 4] mm;
   * default 1.5.
   */
  vtkUltrasoundNumberMacro(UndulationMm);

  /** Thickness of the skin. Used when Kind is anatomy. In [0.5, 5] mm; default 2. */
  vtkUltrasoundNumberMacro(SkinMm);

  /** Thickness of the fat. Used when Kind is anatomy. In [2, 60] mm; default 12. */
  vtkUltrasoundNumberMacro(FatMm);

  /** Thickness of the muscle. Used when Kind is anatomy. In [2, 30] mm; default 10. */
  vtkUltrasoundNumberMacro(MuscleMm);

  /**
   * Thickness of the bright sheets on both sides of the muscle; 0: none. Used when Kind is anatomy. In [0, 2] mm; default 0.7.
   */
  vtkUltrasoundNumberMacro(FasciaMm);

  /** Number of thin bright leaves in fat and muscle. Used when Kind is anatomy. In [0, 2000]; default 600. */
  vtkUltrasoundIntegerMacro(Septa);

  /** Number of lobules of fat and loops of bowel around the organs. Used when Kind is anatomy. In [0, 1000]; default 700. */
  vtkUltrasoundIntegerMacro(Lumps);

  /** Whether there is a liver, with its vessels and what is found in it. Used when Kind is anatomy. Default on. */
  vtkUltrasoundSwitchMacro(Liver);

  /** Whether there is a kidney, with pyramids and a bright sinus. Used when Kind is anatomy. Default on. */
  vtkUltrasoundSwitchMacro(Kidney);

  /** Whether there is a gallbladder, with its stones. Used when Kind is anatomy. Default on. */
  vtkUltrasoundSwitchMacro(Gallbladder);

  /**
   * Thickness of the capsules of liver and kidney and of the wall of the gallbladder; 0: none. Used when Kind is anatomy. In [0,
   * 3] mm; default 0.8.
   */
  vtkUltrasoundNumberMacro(CapsuleMm);

  /** Number of stones in the gallbladder. Used when Kind is anatomy. In [0, 5]; default 1. */
  vtkUltrasoundIntegerMacro(Stones);

  /** Radius of the largest stone. Used when Kind is anatomy. In [1, 7] mm; default 4. */
  vtkUltrasoundNumberMacro(StoneMm);

  /** Whether aorta and vena cava run along the spine. Used when Kind is anatomy. Default on. */
  vtkUltrasoundSwitchMacro(GreatVessels);

  /**
   * Branchings from the root of the liver's vessels to a tip at most; 0: no trees. Used when Kind is anatomy. In [0, 9]; default
   * 6.
   */
  vtkUltrasoundIntegerMacro(Generations);

  /** Radius of the portal vein. Used when Kind is anatomy. In [1, 8] mm; default 5.5. */
  vtkUltrasoundNumberMacro(VesselRadiusMm);

  /** Radius of the narrowest vessels. Used when Kind is anatomy. In [0.4, 8] mm; default 0.9. */
  vtkUltrasoundNumberMacro(SmallestVesselMm);

  /** By which share the smaller of two branches is narrower, on average. Used when Kind is anatomy. In [0, 0.6]; default 0.25. */
  vtkUltrasoundNumberMacro(BranchAsymmetry);

  /** Thickness of a vessel's wall beside its radius. Used when Kind is anatomy. In [0.02, 0.5]; default 0.22. */
  vtkUltrasoundNumberMacro(WallShare);

  /** Number of cysts in the liver, as far as there is room. Used when Kind is anatomy. In [0, 20]; default 2. */
  vtkUltrasoundIntegerMacro(Cysts);

  /** Number of dark lesions in the liver, as far as there is room. Used when Kind is anatomy. In [0, 20]; default 2. */
  vtkUltrasoundIntegerMacro(DarkLesions);

  /** Number of bright lesions in the liver, as far as there is room. Used when Kind is anatomy. In [0, 20]; default 2. */
  vtkUltrasoundIntegerMacro(BrightLesions);

  /**
   * Radius of the largest cyst and lesions; the others are down to half of it. Used when Kind is anatomy. In [1, 20] mm; default
   * 7.
   */
  vtkUltrasoundNumberMacro(LesionRadiusMm);

  /** Number of ribs across the muscle on the -x side. Used when Kind is anatomy. In [0, 6]; default 2. */
  vtkUltrasoundIntegerMacro(Ribs);

  /** Whether there are vertebrae behind the great vessels. Used when Kind is anatomy. Default on. */
  vtkUltrasoundSwitchMacro(Spine);

  /**
   * Size of the rig: places and radii of the balls are multiplied by it. Used when Kind is calibration-rig. In [0.2, 5]; default
   * 1.
   */
  vtkUltrasoundNumberMacro(RigScale);

  /** z of the glass plate's upper side in the world. Used when Kind is calibration-rig. In [10, 500] mm; default 105. */
  vtkUltrasoundNumberMacro(PlateDepthMm);

  /** Thickness of the plate; 0: no plate, base and stems. Used when Kind is calibration-rig. In [0, 50] mm; default 6. */
  vtkUltrasoundNumberMacro(PlateMm);

  /**
   * Thickness of the slab on the glass that the pins stand on; 0: none. Used when Kind is calibration-rig. In [0, 20] mm; default
   * 2.
   */
  vtkUltrasoundNumberMacro(BaseMm);

  /** Radius of the pins that carry the balls; 0: none. Used when Kind is calibration-rig. In [0, 5] mm; default 1.2. */
  vtkUltrasoundNumberMacro(StemRadiusMm);

  /**
   * Temperature of the bath; the water's speed of sound follows. Used when Kind is calibration-rig. In [0, 95] degrees Celsius;
   * default 20.
   */
  vtkUltrasoundNumberMacro(WaterCelsius);

  /** Edge of the triangles of the balls. Used when Kind is calibration-rig. In [0.1, 5] mm; default 0.5. */
  vtkUltrasoundNumberMacro(BallDetailMm);

  /** What balls and stems are made of: the name of a standard material. Used when Kind is calibration-rig. Default nylon. */
  vtkUltrasoundTextMacro(BallMaterial);

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

  ///@{
  /**
   * The balls, by a name, the centre in the rig in mm (z = 0 is the plate's upper side, -z up to the probe) and the radius in mm.
   * Seven of different sizes and heights are there at first.
   */
  void AddBall(const char* name, const double centre[3], double radius);
  void ClearBalls();
  int GetNumberOfBalls() const;
  ///@}

  /**
   * The truth of the calibration rig: the centres of the balls in the world in mm, and their names. What the arrays held is
   * replaced; an error leaves them empty.
   */
  void GetLandmarks(vtkPoints* centres, vtkStringArray* names);

protected:
  vtkUltrasoundAnatomySource();
  ~vtkUltrasoundAnatomySource() override;

  int RequestData(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs) override;

private:
  struct Settings;
#ifndef __VTK_WRAP__
  std::unique_ptr<Settings> Values;
#endif

  vtkUltrasoundAnatomySource(const vtkUltrasoundAnatomySource&) = delete;
  void operator=(const vtkUltrasoundAnatomySource&) = delete;
};

#endif
