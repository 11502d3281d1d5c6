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

#include "EchoramaTrackingModule.h"
#include "vtkPolyDataAlgorithm.h"

#include <string> // for the report

class ECHORAMATRACKING_EXPORT vtkUltrasoundPivotCalibration : public vtkPolyDataAlgorithm {
public:
  static vtkUltrasoundPivotCalibration* New();
  vtkTypeMacro(vtkUltrasoundPivotCalibration, vtkPolyDataAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  ///@{
  /** The tool, by its name in ToolNames. Default: empty, the only one. */
  vtkSetStringMacro(Tool);
  vtkGetStringMacro(Tool);
  ///@}

  ///@{
  /** The point array of 16 numbers that holds the poses, from the tool to the world. Default: ToolToWorld. */
  vtkSetStringMacro(PoseArray);
  vtkGetStringMacro(PoseArray);
  ///@}

  ///@{
  /** Standard deviation of a pose's noise per axis, degrees in [0, 45] and mm in (0, 100]. Default 0.25 and 0.7. */
  vtkSetMacro(NoiseDegrees, double);
  vtkGetMacro(NoiseDegrees, double);
  vtkSetMacro(NoiseMm, double);
  vtkGetMacro(NoiseMm, double);
  ///@}

  ///@{
  /** Whether the noise is scaled to what the residuals say. Off: it is taken as stated. Default: on. */
  vtkSetMacro(EstimateNoise, bool);
  vtkGetMacro(EstimateNoise, bool);
  vtkBooleanMacro(EstimateNoise, bool);
  ///@}

  ///@{
  /** Whether poses at which the tip was not in place are left out. Default: on. */
  vtkSetMacro(RejectOutliers, bool);
  vtkGetMacro(RejectOutliers, bool);
  vtkBooleanMacro(RejectOutliers, bool);
  ///@}

  ///@{
  /** What every direction of the tool must swing by (RMS); degrees, in [0.1, 45]. Default 2. */
  vtkSetMacro(LeastSwing, double);
  vtkGetMacro(LeastSwing, double);
  ///@}

  ///@{
  /** Of the search among poses with outliers. Default 1. */
  vtkSetMacro(Seed, int);
  vtkGetMacro(Seed, int);
  ///@}

  ///@{
  /** Results of the last update: tip in the tool's frame and fixed point in the world, mm. NaN when there is none. */
  vtkGetVector3Macro(Tip, double);
  vtkGetVector3Macro(Pivot, double);
  ///@}

  /** The radius of the sphere about the tip that holds the true one with 95%, mm. NaN when there is none. */
  vtkGetMacro(Radius95, double);

  /** All results, as JSON. Empty when there are none. */
  std::string GetReport() const { return this->Report; }

protected:
  vtkUltrasoundPivotCalibration();
  ~vtkUltrasoundPivotCalibration() override;

  int RequestData(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs) override;

  char* Tool = nullptr;
  char* PoseArray = nullptr;
  double NoiseDegrees, NoiseMm;
  bool EstimateNoise, RejectOutliers;
  double LeastSwing;
  int Seed = 1;

  double Tip[3], Pivot[3];
  double Radius95;

private:
  vtkUltrasoundPivotCalibration(const vtkUltrasoundPivotCalibration&) = delete;
  void operator=(const vtkUltrasoundPivotCalibration&) = delete;

  void Forget();

  std::string Report;
};

#endif
