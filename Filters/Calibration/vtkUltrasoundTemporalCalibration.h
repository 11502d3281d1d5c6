// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class vtkUltrasoundTemporalCalibration
 * @brief the offset between the clocks of two tracks that saw the same motion
 *
 * Inputs 0 and 1: tracks, vtkPolyData with one point per pose, as output 1 of vtkUltrasoundSequenceReader: the point arrays
 * ToolToWorld (16 numbers, row by row) and TimeStamp, optionally Status (0: valid), and Tool with the field data ToolNames. Both
 * may be the same track, when the tools are different.
 *
 * Output: the second track, all of it, with TimeStamp on the clock of the first; and the field data TimeOffset and
 * TimeOffsetError (seconds).
 *
 * Speeds are compared, so nothing needs to be known of the frames of coordinates. The motion must have structure: back and forth
 * with pauses, without a rhythm. Refused otherwise, with a message that says why; see echorama::CalibrateTime.
 *
 * @sa vtkUltrasoundSequenceReader, vtkUltrasoundPivotCalibration
 */
#ifndef vtkUltrasoundTemporalCalibration_h
#define vtkUltrasoundTemporalCalibration_h

#include "EchoramaFiltersCalibrationModule.h"
#include "vtkPolyDataAlgorithm.h"
#include "vtkUltrasoundParameters.h"

#include <string> // for the report

#ifndef __VTK_WRAP__
#include "Filters/Calibration/TemporalCalibration.h"
#endif

class ECHORAMAFILTERSCALIBRATION_EXPORT vtkUltrasoundTemporalCalibration : public vtkPolyDataAlgorithm {
public:
  static vtkUltrasoundTemporalCalibration* New();
  vtkTypeMacro(vtkUltrasoundTemporalCalibration, vtkPolyDataAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  ///@{
  /**
   * Results of the last update, seconds: what was added to the times of the second track, and its standard error. NaN when there
   * are none.
   */
  vtkGetMacro(Offset, double);
  vtkGetMacro(StandardError, double);
  ///@}

  /** All results, as JSON. Empty when there are none. */
  std::string GetReport() const { return this->Report; }

  // BEGIN parameters
  /** The tool of the first track, by its name in ToolNames. Empty takes the only one. Default none. */
  vtkUltrasoundTextMacro(FirstTool);

  /** The tool of the second track, by its name in ToolNames. Empty takes the only one. Default none. */
  vtkUltrasoundTextMacro(SecondTool);

  /** The point array of 16 numbers that holds the poses, in both tracks. Default ToolToWorld. */
  vtkUltrasoundTextMacro(PoseArray);

  enum Signals { AUTOMATIC = 0, ROTATION = 1, TRANSLATION = 2 };

  ///@{
  /**
   * Which speed is compared: of rotation, the same for all that is fixed to one body; of translation, the same for two that
   * follow one point; or of rotation, and where that does not tell, of translation. Default automatic. There are AUTOMATIC,
   * ROTATION, TRANSLATION.
   */
  vtkUltrasoundChoiceMacro(Signal);
  void SetSignalToAutomatic() { this->SetSignal(AUTOMATIC); }
  void SetSignalToRotation() { this->SetSignal(ROTATION); }
  void SetSignalToTranslation() { this->SetSignal(TRANSLATION); }
  ///@}

  /** How far the search goes either way. In (0, 3600] s; default 5. */
  vtkUltrasoundNumberMacro(LargestOffset);

  /**
   * Standard deviation of the window that poses are smoothed with, made at least the time between two poses. In [0.005, 2] s;
   * default 0.05.
   */
  vtkUltrasoundNumberMacro(Smoothing);

  /** Poses further apart are not connected. In (0, 600] s; default 0.5. */
  vtkUltrasoundNumberMacro(LongestGap);

  /** What both streams must have in common at every offset that is looked at. In [0.5, 3600] s; default 3. */
  vtkUltrasoundNumberMacro(LeastOverlap);

  /** Whether a drift between the clocks, where one was found, is taken out of the times too. Default on. */
  vtkUltrasoundSwitchMacro(CorrectDrift);

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
  vtkUltrasoundTemporalCalibration();
  ~vtkUltrasoundTemporalCalibration() override;

  int RequestData(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs) override;

  double Offset, StandardError;

private:
  vtkUltrasoundTemporalCalibration(const vtkUltrasoundTemporalCalibration&) = delete;
  void operator=(const vtkUltrasoundTemporalCalibration&) = delete;

  void Forget();

  std::string Report;
#ifndef __VTK_WRAP__
  std::string FirstTool, SecondTool, PoseArray = "ToolToWorld";
  echorama::TemporalParameters Values;
  bool CorrectDrift = true;
#endif
};

#endif
