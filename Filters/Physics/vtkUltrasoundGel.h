// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class vtkUltrasoundGel
 * @brief gel between probe and skin: where it goes when the probe presses it, and where it leaves air
 *
 * Input 0: tissue (see vtkUltrasoundTissue) before the probe came. Input 1, repeatable: data with the field data `ProbeGeometry`
 * and, unless the probe lies at the origin, `ProbeToWorld` (see vtkUltrasoundAcquisition). A cap of gel is put on the face; the
 * probe comes along its axis, out of clear space, to the first of these poses, and goes on from each to the next: in the time
 * between their `TimeStamp`s where both have one, else at SpeedMmPerS. Input 2, optional and repeatable: the same tissue when the
 * probe has come to each pose, in their order, or one for the last pose alone (vtkUltrasoundTissuePress,
 * vtkUltrasoundDeformGeometry).
 *
 * When nothing but poses, with their tissue, was added since the last update, gel goes on from where it was; the result
 * is that of all at once.
 *
 * Output 0: the tissue as it is then, in air, and with gel, if there is any, as its first body: what
 * vtkUltrasoundSynthesizer takes. Where gel touches skin or the head, its surface lies a little within them. Materials of the
 * names "gel" and "air" that the tissue brings are theirs; else the standard ones.
 *
 * Output 1: the face of the probe, a rectangle of quadrilaterals with these point arrays.
 *
 * | array   | values                                                                                        |
 * | ------- | --------------------------------------------------------------------------------------------- |
 * | Gel     | double: mm of gel on the beam from here to the skin, or to the end of what was computed         |
 * | Air     | double: mm of air there                                                                       |
 * | Couples | unsigned char: 1 where the beam meets skin and no air before                                   |
 *
 * | field data | values                                                                                     |
 * | ---------- | ------------------------------------------------------------------------------------------ |
 * | Coupled    | double: the share of the face that couples                                                  |
 * | GelVolume  | double: of the gel that is left, mm^3, as it is compressed                                  |
 * | GelGone    | double: of the gel that left the space that is computed, mm^3                               |
 * | Seconds    | double: simulated, settling included                                                       |
 *
 * Fails, with a message, for what is no tissue, for probes without geometry or of several kinds, for more gel than a face holds,
 * where the probe has no clear way to its first pose, for time stamps that do not rise, and when gel becomes unstable. Under MPI
 * each rank computes the whole.
 *
 * @sa echorama::GelMotion, echorama::GelSolver
 */
#ifndef vtkUltrasoundGel_h
#define vtkUltrasoundGel_h

#include "EchoramaFiltersPhysicsModule.h"
#include "vtkPolyDataAlgorithm.h"
#include "vtkUltrasoundParameters.h"

#ifndef __VTK_WRAP__
#include "Filters/Physics/GelCoat.h"
#include "Filters/Tissue/TissueSurface.h"
#include <memory>
#endif

class vtkDataObject;
class vtkPolyData;

class ECHORAMAFILTERSPHYSICS_EXPORT vtkUltrasoundGel : public vtkPolyDataAlgorithm {
public:
  static vtkUltrasoundGel* New();
  vtkTypeMacro(vtkUltrasoundGel, vtkPolyDataAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  ///@{
  /** Names of the arrays and fields. */
  static const char* GelName() { return "Gel"; }
  static const char* AirName() { return "Air"; }
  static const char* CouplesName() { return "Couples"; }
  static const char* CoupledName() { return "Coupled"; }
  static const char* GelVolumeName() { return "GelVolume"; }
  static const char* GelGoneName() { return "GelGone"; }
  static const char* SecondsName() { return "Seconds"; }
  ///@}

  ///@{
  /** One more pose of the probe; those that there are already come before it. */
  void AddProbeConnection(vtkAlgorithmOutput* probe) { this->AddInputConnection(1, probe); }
  void AddProbeData(vtkDataObject* probe) { this->AddInputDataObject(1, probe); }
  void RemoveAllProbes() { this->RemoveAllInputConnections(1); }
  ///@}

  ///@{
  /** The tissue under the probe at its last pose, or (Add) at one pose more; none: it does not yield. */
  void SetPressedConnection(vtkAlgorithmOutput* pressed) { this->SetInputConnection(2, pressed); }
  void SetPressedData(vtkDataObject* pressed) { this->SetInputDataObject(2, pressed); }
  void AddPressedConnection(vtkAlgorithmOutput* pressed) { this->AddInputConnection(2, pressed); }
  void AddPressedData(vtkDataObject* pressed) { this->AddInputDataObject(2, pressed); }
  void RemoveAllPressed() { this->RemoveAllInputConnections(2); }
  ///@}

  /** How many poses the last update still had to go to: the others were known from the one before. */
  vtkGetMacro(PosesComputed, int);

  // BEGIN parameters
  /** How much gel is put on the face of the probe. In [0, 1000] ml; default 10. */
  vtkUltrasoundNumberMacro(AmountMl);

  /** Which part of the head's width and of its length the cap of gel covers at first. In [0.05, 1]; default 0.9. */
  vtkUltrasoundNumberMacro(Coverage);

  /**
   * Edge of the cells that gel is computed with: thinner layers of air are not seen. Half of it takes sixteen times as long. In
   * [0.1, 20] mm; default 2.
   */
  vtkUltrasoundNumberMacro(CellMm);

  /** How fast the probe moves. In [1, 1000] mm/s; default 40. */
  vtkUltrasoundNumberMacro(SpeedMmPerS);

  /** How long gel goes on flowing when the probe has stopped. In [0, 100] s; default 0.1. */
  vtkUltrasoundNumberMacro(SettleS);

  /** Mass of the gel per volume. In [1, 20000] kg/m^3; default 1000. */
  vtkUltrasoundNumberMacro(Density);

  /** How stiff the gel is below its yield stress. In (0, 10000000] Pa; default 400. */
  vtkUltrasoundNumberMacro(ShearModulus);

  /**
   * How much the gel resists a change of its volume: some hundred times the pressures that occur. Steps become shorter with its
   * root. In [1, 1000000000] Pa; default 60000.
   */
  vtkUltrasoundNumberMacro(BulkModulus);

  /** The stress in shear from which on the gel flows. In [0, 1000000] Pa; default 60. */
  vtkUltrasoundNumberMacro(YieldStress);

  /**
   * The stress above the yield stress at a rate of shear of 1/s; the viscosity of a fluid whose exponent is 1. In [0, 1000000] Pa
   * s^n; default 30.
   */
  vtkUltrasoundNumberMacro(Consistency);

  /** How that stress grows with the rate: below 1, gel thins as it is sheared. In [0.1, 1]; default 0.4. */
  vtkUltrasoundNumberMacro(Exponent);

  /** How far the head of the probe reaches beyond its outermost beams. In [0.1, 1000] mm; default 5. */
  vtkUltrasoundNumberMacro(HeadMarginMm);

  /** Radius of the head's edges, at most HeadMarginMm. In [0, 1000] mm; default 4. */
  vtkUltrasoundNumberMacro(HeadEdgeMm);

  /** How far the head reaches back. In [1, 1000] mm; default 80. */
  vtkUltrasoundNumberMacro(HeadLengthMm);

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
  /** The surface of gel, as a body of it in air; no body where there is none. */
  static echorama::TissueSurface SurfaceOf(const echorama::GelCoat& coat, const echorama::Material& gel,
                                           const echorama::Material& air);
  /** Makes \a face output 1. */
  static void SetFace(const echorama::GelCoat& coat, vtkPolyData* face);
#endif

protected:
  vtkUltrasoundGel();
  ~vtkUltrasoundGel() override;

  int FillInputPortInformation(int port, vtkInformation* info) override;
  int RequestData(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs) override;

private:
  vtkUltrasoundGel(const vtkUltrasoundGel&) = delete;
  void operator=(const vtkUltrasoundGel&) = delete;

#ifndef __VTK_WRAP__
  echorama::GelCoatParameters Coat;
  echorama::GelMaterial Material;
  echorama::ProbeHead Head;
  struct Kept; ///< a motion, and what it was made of
  std::unique_ptr<Kept> Last;
#endif
  int PosesComputed = 0;
};

#endif
