// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class vtkUltrasoundRigFit
 * @brief finds a calibration rig of balls in a volume
 *
 * Input: one volume with `ProbeGeometry` and `ProbeToWorld` (vtkUltrasoundProbeFit finds them where they are missing). Output: a
 * vtkPolyData with one point per ball, in the world, where the volume shows it (true depth; see DepthScale), with the point
 * arrays `Name`, `Found` (1 or 0; 0: where it should be) and `Residual` (mm, from where the pose puts it), and the field data
 * `RigToWorld` (16 numbers, row by row), `RigToProbe` and `DepthScale`.
 *
 * Balls are given by AddBall in the rig's own frame; those of vtkUltrasoundAnatomySource's calibration rig are known by its size
 * (dissertation 4.1.2).
 *
 * Fails, with a message that names the reason, for numbers out of their range, a volume without probe, and when the rig is not
 * found or not in one place alone.
 *
 * @sa echorama::FitRig, vtkUltrasoundHandEyeCalibration
 */
#ifndef vtkUltrasoundRigFit_h
#define vtkUltrasoundRigFit_h

#include "EchoramaFiltersCalibrationModule.h"
#include "vtkPolyDataAlgorithm.h"
#include "vtkUltrasoundParameters.h"

#ifndef __VTK_WRAP__
#include "Filters/Calibration/RigFit.h"
#endif

class vtkMatrix4x4;

class ECHORAMAFILTERSCALIBRATION_EXPORT vtkUltrasoundRigFit : public vtkPolyDataAlgorithm {
public:
  static vtkUltrasoundRigFit* New();
  vtkTypeMacro(vtkUltrasoundRigFit, vtkPolyDataAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  ///@{
  /** The balls of the rig: a centre in mm in the rig's frame, and a radius in mm above 0. Default: none. */
  void AddBall(const char* name, const double centre[3], double radius);
  void AddBall(const char* name, double x, double y, double z, double radius)
  {
    const double centre[]{x, y, z};
    this->AddBall(name, centre, radius);
  }
  void ClearBalls();
  int GetNumberOfBalls() const;
  ///@}

  ///@{
  /**
   * The balls as a text, for ParaView: "name x y z radius" of each, separated by semicolons. Setting it replaces all balls; what
   * cannot be read is an error when the filter runs. Default: empty, which leaves the balls as they are.
   */
  void SetBalls(const char* text);
  ///@}

  // BEGIN parameters
  /**
   * Depth in the image over true depth, at least 0.9: the scanner's speed of sound over the bath's, 1540 / 1482 in water at 20
   * degrees Celsius. 0: found out from the distances between the balls. In [0, 1.1]; default 0.
   */
  vtkUltrasoundNumberMacro(DepthScale);

  /** How far a ball may be from where the others say. In [0.1, 20] mm; default 3. */
  vtkUltrasoundNumberMacro(ToleranceMm);

  /** Balls that must be found. In [3, 1000]; default 4. */
  vtkUltrasoundIntegerMacro(FewestBalls);

  /**
   * Any parameter by its name: as a number (of a switch 0 or 1, of a choice its place from 0), as text ("1.5", "on", the name of
   * a choice, "1 0 0"), integers and vectors without a loss. Setting returns false, after an error event, when there is no such
   * parameter or value. GetParameterDescriptions tells what parameters there are, as JSON: an array of objects with name, type,
   * value, unit, low, high, choices, help ...
   */
  vtkUltrasoundAnyParameterMacro();
  // END parameters

  ///@{
  /** Of the last run. Matrix: false, and the identity, when there was none. Rms: mm. */
  bool GetRigToWorld(vtkMatrix4x4* matrix) const;
  int GetNumberOfFoundBalls() const;
  double GetRmsMm() const;
  double GetFoundDepthScale() const;
  ///@}

#ifndef __VTK_WRAP__
  echorama::ParameterList Parameters(); ///< for C++: they point into this object
  const std::vector<echorama::RigBall>& RigBalls() const
  {
    return this->Balls;
  }
  const echorama::RigFit& Fit() const
  {
    return this->Last;
  }
#endif

protected:
  vtkUltrasoundRigFit() = default;
  ~vtkUltrasoundRigFit() override = default;

  int FillInputPortInformation(int port, vtkInformation* information) override;
  int RequestUpdateExtent(vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) override;
  int RequestData(vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) override;

private:
  vtkUltrasoundRigFit(const vtkUltrasoundRigFit&) = delete;
  void operator=(const vtkUltrasoundRigFit&) = delete;

#ifndef __VTK_WRAP__
  echorama::RigFitParameters Values;
  std::vector<echorama::RigBall> Balls;
  std::string Complaint; // about the text of SetBalls
  echorama::RigFit Last;
  echorama::Pose RigToWorld = echorama::Pose::Identity();
#endif
};

#endif
