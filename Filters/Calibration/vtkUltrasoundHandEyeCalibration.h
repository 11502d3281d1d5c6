// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class vtkUltrasoundHandEyeCalibration
 * @brief where a volume lies on the sensor of its probe, from scans whose alignment is known
 *
 * For each scan i the tracker gives the pose S_i of the sensor, and an alignment (the aligner's or a person's) the place M_i of
 * the volume. Sought are C, from the volume to the sensor, and O, from the world of the alignments to the tracker, so that S_i C
 * = O M_i (dissertation 4.1.2). echorama::CalibrateHandEye finds them by maximum likelihood with noise on both sides, says how
 * well the calibration places the target, names scans that do not agree, and refuses motions that do not determine C.
 *
 * Input 0 (optional): sensor poses, a data set or table with one point (row) for each scan and an array of 16 numbers, row by
 * row: SensorArray, or the only array with 16 components. Input 1 (optional): the alignments, likewise, VolumeArray. When both
 * have the array NameArray, scans belong together by their names, and those that have no counterpart are left out with a note;
 * else by their order. Scripts may give scans one by one instead, or as well: AddPair. All lengths are in mm.
 *
 * Output: vtkPolyData with a vertex for each scan, at its target as the alignment places it.
 *
 * | array (point data) | values                                                                                  |
 * | ------------------ | --------------------------------------------------------------------------------------- |
 * | Residual           | 3 doubles, mm: from there to where the tracker and the calibration place it             |
 * | ResidualDegrees    | 1 double: the angle between the two                                                     |
 * | Inlier             | unsigned char: 1 when the scan agrees with the others                                   |
 * | ScanName           | string                                                                                  |
 *
 * | array (field data) | values                                                                                  |
 * | ------------------ | --------------------------------------------------------------------------------------- |
 * | VolumeToSensor     | 16 doubles, row by row: C                                                               |
 * | WorldToTracker     | 16 doubles, row by row: O                                                               |
 * | Covariance         | 144 doubles, row by row: of the twists (mm, radians) by which C, then O may be wrong    |
 * | TargetCovariance   | 9 doubles, mm^2: of the target as C places it on the sensor                             |
 * | TargetRadius95     | 1 double, mm: of the sphere about it that holds the true place with 95%                 |
 *
 * Under MPI every rank needs all scans and computes the same.
 *
 * @sa vtkUltrasoundAligner vtkUltrasoundTrackerSource
 */
#ifndef vtkUltrasoundHandEyeCalibration_h
#define vtkUltrasoundHandEyeCalibration_h

#include "EchoramaFiltersCalibrationModule.h"
#include "vtkMath.h"
#include "vtkPolyDataAlgorithm.h"
#include "vtkUltrasoundParameters.h"

#ifndef __VTK_WRAP__
#include "Filters/Calibration/HandEye.h"
#include <vector>
#endif
#include <string>

class vtkAlgorithmOutput;
class vtkMatrix4x4;

class ECHORAMAFILTERSCALIBRATION_EXPORT vtkUltrasoundHandEyeCalibration : public vtkPolyDataAlgorithm {
public:
  static vtkUltrasoundHandEyeCalibration* New();
  vtkTypeMacro(vtkUltrasoundHandEyeCalibration, vtkPolyDataAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  /** Connects the alignments, input 1. */
  void SetAlignmentsConnection(vtkAlgorithmOutput* alignments) { this->SetInputConnection(1, alignments); }

  ///@{
  /**
   * Scans of one's own, which come before those of the inputs: SensorToTracker and VolumeToWorld, mm. The name is for messages;
   * without one it is the scan's number, from 1.
   */
  void AddPair(vtkMatrix4x4* sensorToTracker, vtkMatrix4x4* volumeToWorld, const std::string& name = "");
  void RemoveAllPairs();
  int GetNumberOfPairs() const { return static_cast<int>(this->Pairs.size()); }
  ///@}

  ///@{
  /** What the last update found. Returns false, and leaves \a pose alone, when it failed or there was none. */
  bool GetVolumeToSensor(vtkMatrix4x4* pose) const { return this->GetFound(this->Result.solution.volumeToSensor, pose); }
  bool GetWorldToTracker(vtkMatrix4x4* pose) const { return this->GetFound(this->Result.solution.worldToTracker, pose); }
  ///@}

  ///@{
  /**
   * How well the calibration places the target: the radius that holds its true place with 95%, and the root mean square error
   * expected, mm; NaN when there is no result. How many scans agree; 0 without a result.
   */
  double GetTargetRadius95() const { return this->HasResult ? this->Result.targetRadius95Mm : vtkMath::Nan(); }
  double GetTargetRms() const { return this->HasResult ? this->Result.targetRmsMm : vtkMath::Nan(); }
  int GetNumberOfInliers() const { return this->HasResult ? this->Result.inliers : 0; }
  ///@}

  /** What the last update did, as JSON (Calibration/CalibrationJson.h). Empty when it failed. */
  std::string GetReport() const { return this->Report; }

  // BEGIN parameters
  /** Where in the volume the error counts, in the volume's frame: usually its centre. In mm; default (0, 0, 0). */
  vtkUltrasoundVectorMacro(Target);

  /** Standard deviation of the sensor's turns by the tracker, about each of its own axes. In [0, 45] degrees; default 0.25. */
  vtkUltrasoundNumberMacro(SensorNoiseDegrees);

  /** Standard deviation of the sensor's position by the tracker, along each of its own axes. In [0, 100] mm; default 0.7. */
  vtkUltrasoundNumberMacro(SensorNoiseMm);

  /** Standard deviation of the turns of the alignments, about each axis of the volume. In [0, 45] degrees; default 0.25. */
  vtkUltrasoundNumberMacro(VolumeNoiseDegrees);

  /** Standard deviation of the target's place by the alignments, along each axis of the volume. In [0, 100] mm; default 0.7. */
  vtkUltrasoundNumberMacro(VolumeNoiseMm);

  /**
   * Whether the noise is estimated from the residuals: its size from five scans that agree; from eight also the ratio of its
   * parts, and about which point of the volume alignments err, where residuals contradict what is stated. Otherwise it stays as
   * stated. Notes say which. Default on.
   */
  vtkUltrasoundSwitchMacro(EstimateNoise);

  /** Whether scans that do not agree with the others are left out, and named. Default on. */
  vtkUltrasoundSwitchMacro(RejectOutliers);

  /** Seed of the search for scans that agree. At least 0; default 1. */
  vtkUltrasoundInteger64Macro(Seed);

  /**
   * Name of the array of the sensor's poses. When it is not there, the only one of 16 components is taken. Default
   * SensorToTracker.
   */
  vtkUltrasoundTextMacro(SensorArray);

  /** Name of the array of the alignments. When it is not there, the only one of 16 components is taken. Default VolumeToWorld. */
  vtkUltrasoundTextMacro(VolumeArray);

  /**
   * Name of the array of the scans' names. When both inputs have it, scans belong together by name, else by order. Default Name.
   */
  vtkUltrasoundTextMacro(NameArray);

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
  vtkUltrasoundHandEyeCalibration();
  ~vtkUltrasoundHandEyeCalibration() override;

  int FillInputPortInformation(int port, vtkInformation* info) override;
  int RequestData(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs) override;

private:
  vtkUltrasoundHandEyeCalibration(const vtkUltrasoundHandEyeCalibration&) = delete;
  void operator=(const vtkUltrasoundHandEyeCalibration&) = delete;

#ifndef __VTK_WRAP__
  std::vector<echorama::HandEyePair> CollectPairs(vtkDataObject* sensors, vtkDataObject* volumes,
                                                  std::vector<std::string>& notes) const;
  bool GetFound(const echorama::Pose& found, vtkMatrix4x4* pose) const;
  void PutOut(vtkPolyData* output, const std::vector<echorama::HandEyePair>& pairs) const;

  std::vector<echorama::HandEyePair> Pairs;
  echorama::HandEyeResult Result;
  std::string SensorArray = "SensorToTracker";
  std::string VolumeArray = "VolumeToWorld";
  std::string NameArray = "Name";
  echorama::HandEyeParameters Values;
  bool HasResult = false;
  std::string Report;
#endif
};

#endif
