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

#include <string>

#ifndef __VTK_WRAP__
#include "Filters/Phantoms/Anatomy.h"
#include "Filters/Phantoms/CalibrationRig.h"
#endif

class vtkPoints;
class vtkStringArray;

class ECHORAMAFILTERSPHANTOMS_EXPORT vtkUltrasoundAnatomySource : public vtkPolyDataAlgorithm {
public:
  static vtkUltrasoundAnatomySource* New();
  vtkTypeMacro(vtkUltrasoundAnatomySource, vtkPolyDataAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  enum Kinds { Anatomy = 0, CalibrationRig = 1 };

  ///@{
  /** What is made: Anatomy (default) or CalibrationRig. */
  vtkSetClampMacro(Kind, int, Anatomy, CalibrationRig);
  vtkGetMacro(Kind, int);
  void SetKindToAnatomy() { this->SetKind(Anatomy); }
  void SetKindToCalibrationRig() { this->SetKind(CalibrationRig); }
  ///@}

  ///@{
  /** Which individual: shapes, places, vessels and lesions. At least 0. Default 1. */
  vtkSetClampMacro(Seed, vtkTypeInt64, 0, VTK_TYPE_INT64_MAX);
  vtkGetMacro(Seed, vtkTypeInt64);
  ///@}

  // Of the anatomy.

  ///@{
  /**
   * How far individuals (seeds) differ in shape and place; 0: they are alike but for their vessels and lesions. In [0, 2].
   * Default 1.
   */
  vtkSetMacro(Variation, double);
  vtkGetMacro(Variation, double);
  ///@}

  ///@{
  /** Edge of the triangles of large bodies in mm; small bodies are finer. In [0.5, 10]. Default 1.5. */
  vtkSetMacro(DetailMm, double);
  vtkGetMacro(DetailMm, double);
  ///@}

  ///@{
  /** Size of all organs and of the spine beside an adult's. In [0.5, 1.2]. Default 1. */
  vtkSetMacro(OrganScale, double);
  vtkGetMacro(OrganScale, double);
  ///@}

  ///@{
  /** The trunk along x in mm. In [150, 600]. Default 290. */
  vtkSetMacro(TrunkWidthMm, double);
  vtkGetMacro(TrunkWidthMm, double);
  ///@}

  ///@{
  /** The trunk along y in mm. In [120, 600]. Default 240. */
  vtkSetMacro(TrunkLengthMm, double);
  vtkGetMacro(TrunkLengthMm, double);
  ///@}

  ///@{
  /** The trunk along z in mm, from the skin. In [60, 400]. Default 190. */
  vtkSetMacro(TrunkDepthMm, double);
  vtkGetMacro(TrunkDepthMm, double);
  ///@}

  ///@{
  /**
   * Gel between the middle of the probe's face (z = 0) and the skin in mm; below 0 the face lies inside the body, which is not
   * deformed. In [-10, 20]. Default 1.
   */
  vtkSetMacro(StandoffMm, double);
  vtkGetMacro(StandoffMm, double);
  ///@}

  ///@{
  /** How far a layer's thickness deviates from its mean in mm, never by more than half of it. In [0, 4]. Default 1.5. */
  vtkSetMacro(UndulationMm, double);
  vtkGetMacro(UndulationMm, double);
  ///@}

  ///@{
  /** Thickness of the skin in mm. In [0.5, 5]. Default 2. */
  vtkSetMacro(SkinMm, double);
  vtkGetMacro(SkinMm, double);
  ///@}

  ///@{
  /** Thickness of the fat in mm. In [2, 60]. Default 12. */
  vtkSetMacro(FatMm, double);
  vtkGetMacro(FatMm, double);
  ///@}

  ///@{
  /** Thickness of the muscle in mm. In [2, 30]. Default 10. */
  vtkSetMacro(MuscleMm, double);
  vtkGetMacro(MuscleMm, double);
  ///@}

  ///@{
  /** Thickness in mm of the bright sheets on both sides of the muscle; 0: none. In [0, 2]. Default 0.7. */
  vtkSetMacro(FasciaMm, double);
  vtkGetMacro(FasciaMm, double);
  ///@}

  ///@{
  /** Number of thin bright leaves in fat and muscle. In [0, 2000]. Default 600. */
  vtkSetMacro(Septa, int);
  vtkGetMacro(Septa, int);
  ///@}

  ///@{
  /** Number of lobules of fat and loops of bowel around the organs. In [0, 1000]. Default 700. */
  vtkSetMacro(Lumps, int);
  vtkGetMacro(Lumps, int);
  ///@}

  ///@{
  /** Whether there is a liver, with its vessels and what is found in it. Default on. */
  vtkSetMacro(Liver, bool);
  vtkGetMacro(Liver, bool);
  vtkBooleanMacro(Liver, bool);
  ///@}

  ///@{
  /** Whether there is a kidney, with pyramids and a bright sinus. Default on. */
  vtkSetMacro(Kidney, bool);
  vtkGetMacro(Kidney, bool);
  vtkBooleanMacro(Kidney, bool);
  ///@}

  ///@{
  /** Whether there is a gallbladder, with its stones. Default on. */
  vtkSetMacro(Gallbladder, bool);
  vtkGetMacro(Gallbladder, bool);
  vtkBooleanMacro(Gallbladder, bool);
  ///@}

  ///@{
  /**
   * Thickness in mm of the capsules of liver and kidney and of the wall of the gallbladder; 0: none. In [0, 3]. Default
   * 0.8.
   */
  vtkSetMacro(CapsuleMm, double);
  vtkGetMacro(CapsuleMm, double);
  ///@}

  ///@{
  /** Number of stones in the gallbladder. In [0, 5]. Default 1. */
  vtkSetMacro(Stones, int);
  vtkGetMacro(Stones, int);
  ///@}

  ///@{
  /** Radius of the largest stone in mm. In [1, 7]. Default 4. */
  vtkSetMacro(StoneMm, double);
  vtkGetMacro(StoneMm, double);
  ///@}

  ///@{
  /** Whether aorta and vena cava run along the spine. Default on. */
  vtkSetMacro(GreatVessels, bool);
  vtkGetMacro(GreatVessels, bool);
  vtkBooleanMacro(GreatVessels, bool);
  ///@}

  ///@{
  /** Branchings from the root of the liver's vessels to a tip at most; 0: no trees. In [0, 9]. Default 6. */
  vtkSetMacro(Generations, int);
  vtkGetMacro(Generations, int);
  ///@}

  ///@{
  /** Radius of the portal vein in mm. In [1, 8]. Default 5.5. */
  vtkSetMacro(VesselRadiusMm, double);
  vtkGetMacro(VesselRadiusMm, double);
  ///@}

  ///@{
  /** Radius in mm of the narrowest vessels. In [0.4, 8]. Default 0.9. */
  vtkSetMacro(SmallestVesselMm, double);
  vtkGetMacro(SmallestVesselMm, double);
  ///@}

  ///@{
  /** By which share the smaller of two branches is narrower, on average. In [0, 0.6]. Default 0.25. */
  vtkSetMacro(BranchAsymmetry, double);
  vtkGetMacro(BranchAsymmetry, double);
  ///@}

  ///@{
  /** Thickness of a vessel's wall beside its radius. In [0.02, 0.5]. Default 0.22. */
  vtkSetMacro(WallShare, double);
  vtkGetMacro(WallShare, double);
  ///@}

  ///@{
  /** Number of cysts in the liver, as far as there is room. In [0, 20]. Default 2. */
  vtkSetMacro(Cysts, int);
  vtkGetMacro(Cysts, int);
  ///@}

  ///@{
  /** Number of dark lesions in the liver, as far as there is room. In [0, 20]. Default 2. */
  vtkSetMacro(DarkLesions, int);
  vtkGetMacro(DarkLesions, int);
  ///@}

  ///@{
  /** Number of bright lesions in the liver, as far as there is room. In [0, 20]. Default 2. */
  vtkSetMacro(BrightLesions, int);
  vtkGetMacro(BrightLesions, int);
  ///@}

  ///@{
  /** Radius in mm of the largest cyst and lesions; the others are down to half of it. In [1, 20]. Default 7. */
  vtkSetMacro(LesionRadiusMm, double);
  vtkGetMacro(LesionRadiusMm, double);
  ///@}

  ///@{
  /** Number of ribs across the muscle on the -x side. In [0, 6]. Default 2. */
  vtkSetMacro(Ribs, int);
  vtkGetMacro(Ribs, int);
  ///@}

  ///@{
  /** Whether there are vertebrae behind the great vessels. Default on. */
  vtkSetMacro(Spine, bool);
  vtkGetMacro(Spine, bool);
  vtkBooleanMacro(Spine, bool);
  ///@}

  // Of the calibration rig.

  ///@{
  /** Size of the rig: places and radii of the balls are multiplied by it. In [0.2, 5]. Default 1. */
  vtkSetMacro(RigScale, double);
  vtkGetMacro(RigScale, double);
  ///@}

  ///@{
  /** z of the glass plate's upper side in mm. In [10, 500]. Default 105. */
  vtkSetMacro(PlateDepthMm, double);
  vtkGetMacro(PlateDepthMm, double);
  ///@}

  ///@{
  /** Thickness of the plate in mm; 0: no plate, base and stems. In [0, 50]. Default 6. */
  vtkSetMacro(PlateMm, double);
  vtkGetMacro(PlateMm, double);
  ///@}

  ///@{
  /** Thickness in mm of the slab on the glass that the pins stand on; 0: none. In [0, 20]. Default 2. */
  vtkSetMacro(BaseMm, double);
  vtkGetMacro(BaseMm, double);
  ///@}

  ///@{
  /** Radius in mm of the pins that carry the balls; 0: none. In [0, 5]. Default 1.2. */
  vtkSetMacro(StemRadiusMm, double);
  vtkGetMacro(StemRadiusMm, double);
  ///@}

  ///@{
  /** Temperature of the bath in degrees Celsius; the water's speed of sound follows. In [0, 95]. Default 20. */
  vtkSetMacro(WaterCelsius, double);
  vtkGetMacro(WaterCelsius, double);
  ///@}

  ///@{
  /** Edge of the triangles of the balls in mm. In [0.1, 5]. Default 0.5. */
  vtkSetMacro(BallDetailMm, double);
  vtkGetMacro(BallDetailMm, double);
  ///@}

  ///@{
  /** What balls and stems are made of: the name of a standard material. Default "nylon". */
  vtkSetStdStringFromCharMacro(BallMaterial);
  vtkGetCharFromStdStringMacro(BallMaterial);
  ///@}

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

#ifndef __VTK_WRAP__
  /** The kernels' parameters for the present properties. */
  echorama::AnatomyParameters AnatomyParameters() const;
  echorama::CalibrationRigParameters RigParameters() const;
#endif

protected:
  vtkUltrasoundAnatomySource();
  ~vtkUltrasoundAnatomySource() override;

  int RequestData(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs) override;

private:
  int Kind;
  vtkTypeInt64 Seed;
  double Variation;
  double DetailMm;
  double OrganScale;
  double TrunkWidthMm;
  double TrunkLengthMm;
  double TrunkDepthMm;
  double StandoffMm;
  double UndulationMm;
  double SkinMm;
  double FatMm;
  double MuscleMm;
  double FasciaMm;
  int Septa;
  int Lumps;
  bool Liver;
  bool Kidney;
  bool Gallbladder;
  double CapsuleMm;
  int Stones;
  double StoneMm;
  bool GreatVessels;
  int Generations;
  double VesselRadiusMm;
  double SmallestVesselMm;
  double BranchAsymmetry;
  double WallShare;
  int Cysts;
  int DarkLesions;
  int BrightLesions;
  double LesionRadiusMm;
  int Ribs;
  bool Spine;
  double RigScale;
  double PlateDepthMm;
  double PlateMm;
  double BaseMm;
  double StemRadiusMm;
  double WaterCelsius;
  double BallDetailMm;
  std::string BallMaterial;
#ifndef __VTK_WRAP__
  std::vector<echorama::CalibrationRigParameters::Ball> Balls;
#endif

  vtkUltrasoundAnatomySource(const vtkUltrasoundAnatomySource&) = delete;
  void operator=(const vtkUltrasoundAnatomySource&) = delete;
};

#endif
