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

#include "EchoramaTrackingModule.h"
#include "vtkPolyDataAlgorithm.h"

#ifndef __VTK_WRAP__
#include "Tracking/Calibration/HandEye.h"
#include <vector>
#endif
#include <string>

class vtkAlgorithmOutput;
class vtkMatrix4x4;

class ECHORAMATRACKING_EXPORT vtkUltrasoundHandEyeCalibration : public vtkPolyDataAlgorithm {
public:
  static vtkUltrasoundHandEyeCalibration* New();
  vtkTypeMacro(vtkUltrasoundHandEyeCalibration, vtkPolyDataAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  /** Connects the alignments, input 1. */
  void SetAlignmentsConnection(vtkAlgorithmOutput* alignments);

  ///@{
  /**
   * Scans of one's own, which come before those of the inputs: SensorToTracker and VolumeToWorld, mm. The name is for messages;
   * without one it is the scan's number, from 1.
   */
  void AddPair(vtkMatrix4x4* sensorToTracker, vtkMatrix4x4* volumeToWorld, const std::string& name = "");
  void RemoveAllPairs();
  int GetNumberOfPairs() const;
  ///@}

  ///@{
  /** Names of the arrays of the inputs. Defaults SensorToTracker, VolumeToWorld, and Name (strings). */
  vtkSetMacro(SensorArray, std::string);
  vtkGetMacro(SensorArray, std::string);
  vtkSetMacro(VolumeArray, std::string);
  vtkGetMacro(VolumeArray, std::string);
  vtkSetMacro(NameArray, std::string);
  vtkGetMacro(NameArray, std::string);
  ///@}

  ///@{
  /** Where in the volume the error counts, mm in the volume's frame: usually its centre. Default 0 0 0. */
  vtkSetVector3Macro(Target, double);
  vtkGetVector3Macro(Target, double);
  ///@}

  ///@{
  /**
   * Standard deviation of the noise of the sensor's poses, in its own axes, per axis: degrees in [0, 45], mm in [0, 100].
   * Defaults 0.25 and 0.7.
   */
  vtkSetClampMacro(SensorNoiseDegrees, double, 0.0, 45.0);
  vtkGetMacro(SensorNoiseDegrees, double);
  vtkSetClampMacro(SensorNoiseMm, double, 0.0, 100.0);
  vtkGetMacro(SensorNoiseMm, double);
  ///@}

  ///@{
  /**
   * Standard deviation of the noise of the alignments, in the volume's axes about the target, per axis: degrees in [0, 45], mm in
   * [0, 100]. Defaults 0.25 and 0.7.
   */
  vtkSetClampMacro(VolumeNoiseDegrees, double, 0.0, 45.0);
  vtkGetMacro(VolumeNoiseDegrees, double);
  vtkSetClampMacro(VolumeNoiseMm, double, 0.0, 100.0);
  vtkGetMacro(VolumeNoiseMm, double);
  ///@}

  ///@{
  /** Whether scans that do not agree with the others are left out, and named. Default on. */
  vtkSetMacro(RejectOutliers, bool);
  vtkGetMacro(RejectOutliers, bool);
  vtkBooleanMacro(RejectOutliers, bool);
  ///@}

  ///@{
  /** Whether both noises are scaled to what the residuals show; needs five scans that agree. Default off. */
  vtkSetMacro(EstimateNoise, bool);
  vtkGetMacro(EstimateNoise, bool);
  vtkBooleanMacro(EstimateNoise, bool);
  ///@}

  ///@{
  /** Seed of the search for scans that agree, >= 0. Default 1. */
  vtkSetClampMacro(Seed, int, 0, VTK_INT_MAX);
  vtkGetMacro(Seed, int);
  ///@}

  ///@{
  /** What the last update found. Returns false, and leaves \a pose alone, when it failed or there was none. */
  bool GetVolumeToSensor(vtkMatrix4x4* pose) const;
  bool GetWorldToTracker(vtkMatrix4x4* pose) const;
  ///@}

  ///@{
  /**
   * How well the calibration places the target: the radius that holds its true place with 95%, and the root mean square error
   * expected, mm; NaN when there is no result. How many scans agree; 0 without a result.
   */
  double GetTargetRadius95() const;
  double GetTargetRms() const;
  int GetNumberOfInliers() const;
  ///@}

  /** What the last update did, as JSON (Calibration/CalibrationJson.h). Empty when it failed. */
  std::string GetReport() const { return this->Report; }

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
  echorama::HandEyeParameters Parameters() const;
  void PutOut(vtkPolyData* output, const std::vector<echorama::HandEyePair>& pairs) const;

  std::vector<echorama::HandEyePair> Pairs;
  echorama::HandEyeResult Result;
  std::string SensorArray = "SensorToTracker";
  std::string VolumeArray = "VolumeToWorld";
  std::string NameArray = "Name";
  double Target[3] = {0.0, 0.0, 0.0};
  double SensorNoiseDegrees;
  double SensorNoiseMm;
  double VolumeNoiseDegrees;
  double VolumeNoiseMm;
  bool RejectOutliers;
  bool EstimateNoise;
  int Seed;
  bool HasResult = false;
  std::string Report;
#endif
};

#endif
