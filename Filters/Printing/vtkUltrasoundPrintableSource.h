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
#endif

class ECHORAMAFILTERSPRINTING_EXPORT vtkUltrasoundPrintableSource : public vtkPolyDataAlgorithm {
public:
  static vtkUltrasoundPrintableSource* New();
  vtkTypeMacro(vtkUltrasoundPrintableSource, vtkPolyDataAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  enum Kinds { Rig = 0, Clip = 1 };

  ///@{
  /** What is made: Rig (default) or Clip. */
  vtkSetClampMacro(Kind, int, Rig, Clip);
  vtkGetMacro(Kind, int);
  void SetKindToRig() { this->SetKind(Rig); }
  void SetKindToClip() { this->SetKind(Clip); }
  ///@}

  ///@{
  /** Edge of the sampling cells in mm. In [0.1, 5]. Default 0.5. */
  vtkSetMacro(Resolution, double);
  vtkGetMacro(Resolution, double);
  ///@}

  // Of the rig.

  ///@{
  /** Size of the whole rig. In [0.2, 5]. Default 1. */
  vtkSetMacro(Scale, double);
  vtkGetMacro(Scale, double);
  ///@}

  ///@{
  /** Thickness of the base in mm. In (0, 20]. Default 2. */
  vtkSetMacro(BaseMm, double);
  vtkGetMacro(BaseMm, double);
  ///@}

  ///@{
  /** Radius of the pins in mm; never wider than 0.6 of a ball. In (0, 5]. Default 1.2. */
  vtkSetMacro(StemRadiusMm, double);
  vtkGetMacro(StemRadiusMm, double);
  ///@}

  // Of the clip.

  ///@{
  /** The handle along the fan (width) and along the sweep (thickness) in mm. In [5, 200]. Default 30 and 22. */
  vtkSetMacro(HandleWidthMm, double);
  vtkGetMacro(HandleWidthMm, double);
  vtkSetMacro(HandleThicknessMm, double);
  vtkGetMacro(HandleThicknessMm, double);
  ///@}

  ///@{
  /** Length of the sleeve in mm. In [10, 200]. Default 36. */
  vtkSetMacro(LengthMm, double);
  vtkGetMacro(LengthMm, double);
  ///@}

  ///@{
  /** Thickness of all walls in mm. In [1, 20]. Default 3. */
  vtkSetMacro(WallMm, double);
  vtkGetMacro(WallMm, double);
  ///@}

  ///@{
  /** Between sleeve and handle in mm: a printer's tolerance, or a coat of rubber. In [0, 5]. Default 0.4. */
  vtkSetMacro(ClearanceMm, double);
  vtkGetMacro(ClearanceMm, double);
  ///@}

  ///@{
  /** Width of the sleeve's open side in mm; 0: a ring. In [0, 0.9 of the handle's width]. Default 12. */
  vtkSetMacro(OpeningMm, double);
  vtkGetMacro(OpeningMm, double);
  ///@}

  ///@{
  /** Number of grooves for cable ties. In [0, 8]. Default 2. */
  vtkSetMacro(TieGrooves, int);
  vtkGetMacro(TieGrooves, int);
  ///@}

  ///@{
  /** From the middle of the sleeve to the middle of the sensor, backwards along the handle, in mm. In [0, 300]. Default 70. */
  vtkSetMacro(ArmMm, double);
  vtkGetMacro(ArmMm, double);
  ///@}

  ///@{
  /** From the sleeve to the sensor, sideways, in mm. In [0, 100]. Default 15. */
  vtkSetMacro(StandOffMm, double);
  vtkGetMacro(StandOffMm, double);
  ///@}

  ///@{
  /** The sensor in mm: across, sideways and along the handle. In [1, 80]. Default 8.2, 8.2, 20. */
  vtkSetVector3Macro(SensorMm, double);
  vtkGetVector3Macro(SensorMm, double);
  ///@}

#ifndef __VTK_WRAP__
  /** The surface of \a solid. \throws echorama::Error(TooLarge) beyond 2^30 samples, Error(Cancelled). */
  static void Mesh(const echorama::PrintableSolid& solid, double resolution, vtkPolyData* output,
                   const echorama::Progress& progress = {});
#endif

protected:
  vtkUltrasoundPrintableSource();
  ~vtkUltrasoundPrintableSource() override = default;

  int RequestData(vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) override;

  int Kind = Rig;
  double Resolution = 0.5;
  double Scale, BaseMm, StemRadiusMm;
  double HandleWidthMm, HandleThicknessMm, LengthMm, WallMm, ClearanceMm, OpeningMm, ArmMm, StandOffMm;
  double SensorMm[3];
  int TieGrooves;

private:
  vtkUltrasoundPrintableSource(const vtkUltrasoundPrintableSource&) = delete;
  void operator=(const vtkUltrasoundPrintableSource&) = delete;
};

#endif
