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

#include "EchoramaTrackingModule.h"
#include "vtkPolyDataAlgorithm.h"

#include <string> // for the report

class ECHORAMATRACKING_EXPORT vtkUltrasoundTemporalCalibration : public vtkPolyDataAlgorithm {
public:
  static vtkUltrasoundTemporalCalibration* New();
  vtkTypeMacro(vtkUltrasoundTemporalCalibration, vtkPolyDataAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  ///@{
  /** The tools, by their names in ToolNames. Default: empty, the only one of each track. */
  vtkSetStringMacro(FirstTool);
  vtkGetStringMacro(FirstTool);
  vtkSetStringMacro(SecondTool);
  vtkGetStringMacro(SecondTool);
  ///@}

  ///@{
  /** The point array of 16 numbers that holds the poses, in both tracks. Default: ToolToWorld. */
  vtkSetStringMacro(PoseArray);
  vtkGetStringMacro(PoseArray);
  ///@}

  enum SignalType { AUTOMATIC = 0, ROTATION = 1, TRANSLATION = 2 };
  ///@{
  /**
   * Which speed is compared: of rotation (the same for all that is fixed to one body), of translation (the same for two that
   * follow one point), or automatic, rotation and where that does not tell translation. Default AUTOMATIC.
   */
  vtkSetClampMacro(Signal, int, AUTOMATIC, TRANSLATION);
  vtkGetMacro(Signal, int);
  ///@}

  ///@{
  /** The search goes this far either way; seconds, in (0, 3600]. Default 5. */
  vtkSetMacro(LargestOffset, double);
  vtkGetMacro(LargestOffset, double);
  ///@}

  ///@{
  /** Standard deviation of the window that poses are smoothed with; seconds, in [0.005, 2]. Default 0.05. */
  vtkSetMacro(Smoothing, double);
  vtkGetMacro(Smoothing, double);
  ///@}

  ///@{
  /** Poses further apart are not connected; seconds, in (0, 600]. Default 0.5. */
  vtkSetMacro(LongestGap, double);
  vtkGetMacro(LongestGap, double);
  ///@}

  ///@{
  /** What both tracks must have in common at every offset that is looked at; seconds, in [0.5, 3600]. Default 3. */
  vtkSetMacro(LeastOverlap, double);
  vtkGetMacro(LeastOverlap, double);
  ///@}

  ///@{
  /** Whether a drift between the clocks, where one was found, is taken out of the times too. Default: on. */
  vtkSetMacro(CorrectDrift, bool);
  vtkGetMacro(CorrectDrift, bool);
  vtkBooleanMacro(CorrectDrift, bool);
  ///@}

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

protected:
  vtkUltrasoundTemporalCalibration();
  ~vtkUltrasoundTemporalCalibration() override;

  int RequestData(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs) override;

  char* FirstTool = nullptr;
  char* SecondTool = nullptr;
  char* PoseArray = nullptr;
  int Signal = AUTOMATIC;
  double LargestOffset, Smoothing, LongestGap, LeastOverlap;
  bool CorrectDrift = true;

  double Offset, StandardError;

private:
  vtkUltrasoundTemporalCalibration(const vtkUltrasoundTemporalCalibration&) = delete;
  void operator=(const vtkUltrasoundTemporalCalibration&) = delete;

  void Forget();

  std::string Report;
};

#endif
