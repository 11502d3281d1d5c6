// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class vtkUltrasoundPivotCalibration
 * @brief where the tip of a tool is, from turning the tool about its tip
 *
 * Input: a track, vtkPolyData with one point per pose, as output 1 of vtkUltrasoundSequenceReader: the point array ToolToWorld
 * (16 numbers, row by row), optionally TimeStamp, Status (0: valid), and Tool with the field data ToolNames.
 *
 * Output: vtkPolyData, one point per pose of the tool: its tip, as this pose places it in the world (mm). In a good recording
 * they all lie close together.
 *
 * | array         | values                                                                                   |
 * | ------------- | ---------------------------------------------------------------------------------------- |
 * | Residual      | point: the vector from the fixed point to this tip, mm                                   |
 * | Inlier        | point: 1, or 0 where the tip was not in place                                            |
 * | TimeStamp     | point: of the pose                                                                       |
 * | Tip           | field: 3 numbers, in the tool's frame, mm                                                |
 * | TipRadius95   | field: of the sphere that holds the true tip with 95%, mm                                |
 * | TipCovariance | field: 9 numbers, mm^2                                                                   |
 * | Pivot         | field: 3 numbers, the fixed point in the world, mm                                       |
 *
 * Refused, with a message that says why: turns that are too little or about one axis only, poses without a fixed point, poses
 * that are not finite or not rigid; see echorama::CalibratePivot.
 *
 * @sa vtkUltrasoundSequenceReader, vtkUltrasoundHandEyeCalibration, vtkUltrasoundTemporalCalibration
 */
#ifndef vtkUltrasoundPivotCalibration_h
#define vtkUltrasoundPivotCalibration_h

#include "EchoramaFiltersCalibrationModule.h"
#include "vtkPolyDataAlgorithm.h"
#include "vtkUltrasoundParameters.h"

#include <string> // for the report

#ifndef __VTK_WRAP__
#include "Filters/Calibration/PivotCalibration.h"
#endif

class ECHORAMAFILTERSCALIBRATION_EXPORT vtkUltrasoundPivotCalibration : public vtkPolyDataAlgorithm {
public:
  static vtkUltrasoundPivotCalibration* New();
  vtkTypeMacro(vtkUltrasoundPivotCalibration, vtkPolyDataAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  ///@{
  /** Results of the last update: tip in the tool's frame and fixed point in the world, mm. NaN when there is none. */
  vtkGetVector3Macro(Tip, double);
  vtkGetVector3Macro(Pivot, double);
  ///@}

  /** The radius of the sphere about the tip that holds the true one with 95%, mm. NaN when there is none. */
  vtkGetMacro(Radius95, double);

  /** All results, as JSON. Empty when there are none. */
  std::string GetReport() const { return this->Report; }

  // BEGIN parameters
  /** The tool, by its name in ToolNames. Empty takes the only one. Default none. */
  vtkUltrasoundTextMacro(Tool);

  /** The point array of 16 numbers that holds the poses, from the tool to the world. Default ToolToWorld. */
  vtkUltrasoundTextMacro(PoseArray);

  /** Standard deviation of the angle of a pose, about each axis of the tool. In [0, 45] degrees; default 0.25. */
  vtkUltrasoundNumberMacro(NoiseDegrees);

  /** Standard deviation of the position of a pose, along each axis of the tool. In (0, 100] mm; default 0.7. */
  vtkUltrasoundNumberMacro(NoiseMm);

  /**
   * Whether the noise is scaled to what the residuals say. Off: it is taken as stated, and decides what is an outlier. Default
   * on.
   */
  vtkUltrasoundSwitchMacro(EstimateNoise);

  /** Whether poses at which the tip was not in place are left out. Default on. */
  vtkUltrasoundSwitchMacro(RejectOutliers);

  /**
   * What every direction of the tool must swing by (RMS), less what the noise pretends; otherwise the tip is refused. In [0.1,
   * 45] degrees; default 2.
   */
  vtkUltrasoundNumberMacro(LeastSwing);

  /** Seed of the search among poses with outliers. At least 0; default 1. */
  vtkUltrasoundInteger64Macro(Seed);

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

protected:
  vtkUltrasoundPivotCalibration();
  ~vtkUltrasoundPivotCalibration() override;

  int RequestData(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs) override;

  double Tip[3], Pivot[3];
  double Radius95;

private:
  vtkUltrasoundPivotCalibration(const vtkUltrasoundPivotCalibration&) = delete;
  void operator=(const vtkUltrasoundPivotCalibration&) = delete;

  void Forget();

  std::string Report;
#ifndef __VTK_WRAP__
  std::string Tool, PoseArray = "ToolToWorld";
  echorama::PivotParameters Values;
#endif
};

#endif
