// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class vtkUltrasoundPrintableSource
 * @brief what a calibration needs from a 3D printer: the rig of balls, and the clip that holds a sensor to a probe
 *
 * No input. Output: a vtkPolyData, one closed surface of triangles, outward, in mm, that stands on z = 0 as it is printed: what
 * vtkSTLWriter takes.
 *
 * Kind Rig: base, pins and balls of vtkUltrasoundAnatomySource's CalibrationRig, as one piece. Kind Clip: a sleeve for the handle
 * of vtkUltrasoundProbeSource, an arm, and a pocket for the sensor (dissertation 4.1.1, 4.1.2).
 *
 * The solid is a signed distance that is sampled, contoured, and whose points are moved onto the surface: flat and round sides
 * are true to 0.01 mm, sharp edges are broken by up to half of Resolution.
 *
 * Fails, with a message that names the number and its range, for parameters out of their range.
 *
 * @sa echorama::PrintableRig, echorama::PrintableClip
 */
#ifndef vtkUltrasoundPrintableSource_h
#define vtkUltrasoundPrintableSource_h

#include "EchoramaFiltersPrintingModule.h"
#include "vtkPolyDataAlgorithm.h"

#ifndef __VTK_WRAP__
#include "Core/Base/Progress.h"
#include "Filters/Printing/PrintableSolid.h"
#include "vtkUltrasoundParameters.h"
#endif

class ECHORAMAFILTERSPRINTING_EXPORT vtkUltrasoundPrintableSource : public vtkPolyDataAlgorithm {
public:
  static vtkUltrasoundPrintableSource* New();
  vtkTypeMacro(vtkUltrasoundPrintableSource, vtkPolyDataAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  // BEGIN parameters
  enum Kinds { RIG = 0, CLIP = 1 };

  ///@{
  /** What is made: the rig of balls, or the clip that holds a sensor to a probe. Default rig. There are RIG, CLIP. */
  void SetKind(int value) { this->SetParameter("Kind", value); }
  int GetKind() { return static_cast<int>(this->GetParameter("Kind")); }
  void SetKindToRig() { this->SetKind(RIG); }
  void SetKindToClip() { this->SetKind(CLIP); }
  std::string GetKindAsString() { return this->GetParameterAsText("Kind"); }
  ///@}

  ///@{
  /** Edge of the sampling cells. In [0.1, 5] mm; default 0.5. */
  void SetResolution(double value) { this->SetParameter("Resolution", value); }
  double GetResolution() { return this->GetParameter("Resolution"); }
  ///@}

  ///@{
  /** Size of the whole rig. Used when Kind is rig. In [0.2, 5]; default 1. */
  void SetScale(double value) { this->SetParameter("Scale", value); }
  double GetScale() { return this->GetParameter("Scale"); }
  ///@}

  ///@{
  /** Thickness of the base. Used when Kind is rig. In (0, 20] mm; default 2. */
  void SetBaseMm(double value) { this->SetParameter("BaseMm", value); }
  double GetBaseMm() { return this->GetParameter("BaseMm"); }
  ///@}

  ///@{
  /** Radius of the pins; never wider than 0.6 of a ball. Used when Kind is rig. In (0, 5] mm; default 1.2. */
  void SetStemRadiusMm(double value) { this->SetParameter("StemRadiusMm", value); }
  double GetStemRadiusMm() { return this->GetParameter("StemRadiusMm"); }
  ///@}

  ///@{
  /**
   * The handle along the fan; its outline is a rectangle with round sides. Used when Kind is clip. In [5, 200] mm; default 30.
   */
  void SetHandleWidthMm(double value) { this->SetParameter("HandleWidthMm", value); }
  double GetHandleWidthMm() { return this->GetParameter("HandleWidthMm"); }
  ///@}

  ///@{
  /** The handle along the sweep. Used when Kind is clip. In [5, 200] mm; default 22. */
  void SetHandleThicknessMm(double value) { this->SetParameter("HandleThicknessMm", value); }
  double GetHandleThicknessMm() { return this->GetParameter("HandleThicknessMm"); }
  ///@}

  ///@{
  /** Length of the sleeve, along the handle. Used when Kind is clip. In [10, 200] mm; default 36. */
  void SetLengthMm(double value) { this->SetParameter("LengthMm", value); }
  double GetLengthMm() { return this->GetParameter("LengthMm"); }
  ///@}

  ///@{
  /** Thickness of all walls. Used when Kind is clip. In [1, 20] mm; default 3. */
  void SetWallMm(double value) { this->SetParameter("WallMm", value); }
  double GetWallMm() { return this->GetParameter("WallMm"); }
  ///@}

  ///@{
  /** Between sleeve and handle: a printer's tolerance, or a coat of rubber. Used when Kind is clip. In [0, 5] mm; default 0.4. */
  void SetClearanceMm(double value) { this->SetParameter("ClearanceMm", value); }
  double GetClearanceMm() { return this->GetParameter("ClearanceMm"); }
  ///@}

  ///@{
  /**
   * Width of the sleeve's open side, at most 0.9 of the handle's. 0: a ring that is pushed on. Used when Kind is clip. In [0,
   * 180] mm; default 12.
   */
  void SetOpeningMm(double value) { this->SetParameter("OpeningMm", value); }
  double GetOpeningMm() { return this->GetParameter("OpeningMm"); }
  ///@}

  ///@{
  /** Number of grooves for cable ties. Used when Kind is clip. In [0, 8]; default 2. */
  void SetTieGrooves(int value) { this->SetParameter("TieGrooves", value); }
  int GetTieGrooves() { return static_cast<int>(this->GetParameter("TieGrooves")); }
  ///@}

  ///@{
  /**
   * From the middle of the sleeve to the middle of the sensor, backwards along the handle. Used when Kind is clip. In [0, 300]
   * mm; default 70.
   */
  void SetArmMm(double value) { this->SetParameter("ArmMm", value); }
  double GetArmMm() { return this->GetParameter("ArmMm"); }
  ///@}

  ///@{
  /** From the sleeve to the sensor, sideways. Used when Kind is clip. In [0, 100] mm; default 15. */
  void SetStandOffMm(double value) { this->SetParameter("StandOffMm", value); }
  double GetStandOffMm() { return this->GetParameter("StandOffMm"); }
  ///@}

  ///@{
  /** The sensor: across, sideways and along the handle. Used when Kind is clip. In [1, 80] mm; default (8.2, 8.2, 20). */
  void SetSensorMm(double x, double y, double z)
  {
    const double value[3] = {x, y, z};
    this->SetSensorMm(value);
  }
  void SetSensorMm(const double value[3]) { this->SetParameterAsVector("SensorMm", value); }
  double* GetSensorMm() VTK_SIZEHINT(3) { return this->GetParameterAsVector("SensorMm"); }
  ///@}

  ///@{
  /**
   * Any parameter by its name: as a number (of a switch 0 or 1, of a choice its place from 0), as text ("1.5", "on", the name of
   * a choice, "1 0 0"), integers and vectors without a loss. Setting returns false, after an error event, when there is no such
   * parameter or value.
   */
  bool SetParameter(const char* name, double value);
  bool SetParameterAsText(const char* name, const char* value);
  bool SetParameterAsInteger(const char* name, vtkTypeInt64 value);
  bool SetParameterAsVector(const char* name, const double value[3]);
  double GetParameter(const char* name);
  std::string GetParameterAsText(const char* name);
  vtkTypeInt64 GetParameterAsInteger(const char* name);
  double* GetParameterAsVector(const char* name) VTK_SIZEHINT(3);
  ///@}

  /** What parameters there are, as JSON: an array of objects with name, type, value, unit, low, high, choices, help ... */
  std::string GetParameterDescriptions();
  // END parameters
#ifndef __VTK_WRAP__
  echorama::ParameterList Parameters(); ///< for C++: they point into this object
#endif

#ifndef __VTK_WRAP__
  /** The surface of \a solid, by cells of \a resolution mm. \throws echorama::Error(TooLarge) beyond 2^30 samples,
   * Error(Cancelled). */
  static void Mesh(const echorama::PrintableSolid& solid, double resolution, vtkPolyData* output,
                   const echorama::Progress& progress = {});
#endif

protected:
  vtkUltrasoundPrintableSource();
  ~vtkUltrasoundPrintableSource() override = default;

  int RequestData(vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) override;

private:
  vtkUltrasoundPrintableSource(const vtkUltrasoundPrintableSource&) = delete;
  void operator=(const vtkUltrasoundPrintableSource&) = delete;

  int Printed = 0; // of Kinds
  double CellMm = 0.5;
#ifndef __VTK_WRAP__
  echorama::CalibrationRigParameters RigValues;
  echorama::ProbeClipParameters ClipValues;
#endif
};

#endif
