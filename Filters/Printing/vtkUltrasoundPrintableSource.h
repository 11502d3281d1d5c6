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
#include "vtkUltrasoundParameters.h"

#ifndef __VTK_WRAP__
#include "Core/Base/Progress.h"
#include "Filters/Printing/PrintableSolid.h"
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
  vtkUltrasoundChoiceMacro(Kind);
  void SetKindToRig() { this->SetKind(RIG); }
  void SetKindToClip() { this->SetKind(CLIP); }
  ///@}

  /** Edge of the sampling cells. In [0.1, 5] mm; default 0.5. */
  vtkUltrasoundNumberMacro(Resolution);

  /** Size of the whole rig. Used when Kind is rig. In [0.2, 5]; default 1. */
  vtkUltrasoundNumberMacro(Scale);

  /** Thickness of the base. Used when Kind is rig. In (0, 20] mm; default 2. */
  vtkUltrasoundNumberMacro(BaseMm);

  /** Radius of the pins; never wider than 0.6 of a ball. Used when Kind is rig. In (0, 5] mm; default 1.2. */
  vtkUltrasoundNumberMacro(StemRadiusMm);

  /**
   * The handle along the fan; its outline is a rectangle with round sides. Used when Kind is clip. In [5, 200] mm; default 30.
   */
  vtkUltrasoundNumberMacro(HandleWidthMm);

  /** The handle along the sweep. Used when Kind is clip. In [5, 200] mm; default 22. */
  vtkUltrasoundNumberMacro(HandleThicknessMm);

  /** Length of the sleeve, along the handle. Used when Kind is clip. In [10, 200] mm; default 36. */
  vtkUltrasoundNumberMacro(LengthMm);

  /** Thickness of all walls. Used when Kind is clip. In [1, 20] mm; default 3. */
  vtkUltrasoundNumberMacro(WallMm);

  /** Between sleeve and handle: a printer's tolerance, or a coat of rubber. Used when Kind is clip. In [0, 5] mm; default 0.4. */
  vtkUltrasoundNumberMacro(ClearanceMm);

  /**
   * Width of the sleeve's open side, at most 0.9 of the handle's. 0: a ring that is pushed on. Used when Kind is clip. In [0,
   * 180] mm; default 12.
   */
  vtkUltrasoundNumberMacro(OpeningMm);

  /** Number of grooves for cable ties. Used when Kind is clip. In [0, 8]; default 2. */
  vtkUltrasoundIntegerMacro(TieGrooves);

  /**
   * From the middle of the sleeve to the middle of the sensor, backwards along the handle. Used when Kind is clip. In [0, 300]
   * mm; default 70.
   */
  vtkUltrasoundNumberMacro(ArmMm);

  /** From the sleeve to the sensor, sideways. Used when Kind is clip. In [0, 100] mm; default 15. */
  vtkUltrasoundNumberMacro(StandOffMm);

  /** The sensor: across, sideways and along the handle. Used when Kind is clip. In [1, 80] mm; default (8.2, 8.2, 20). */
  vtkUltrasoundVectorMacro(SensorMm);

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
