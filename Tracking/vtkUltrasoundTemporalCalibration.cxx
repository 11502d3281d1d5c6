// SPDX-License-Identifier: BSD-3-Clause
#include "vtkUltrasoundTemporalCalibration.h"

#include "Tracking/Calibration/CalibrationJson.h"
#include "vtkUltrasoundTrackPoses.h"
#include "vtkUltrasoundVolume.h"

#include "vtkDoubleArray.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkNew.h"
#include "vtkObjectFactory.h"

#include <limits>

vtkStandardNewMacro(vtkUltrasoundTemporalCalibration);

namespace {
constexpr double NaN = std::numeric_limits<double>::quiet_NaN();

std::string TextOf(const char* text)
{
  return text ? text : "";
}

void AddField(vtkPolyData* output, const char* name, double value)
{
  vtkNew<vtkDoubleArray> array;
  array->SetName(name);
  array->InsertNextValue(value);
  output->GetFieldData()->AddArray(array);
}

// The track with other times: t + offset, and where \a drift is on with the drift taken out, which is zero in the middle.
void MoveTimes(vtkPolyData* output, const echorama::TemporalResult& result, bool drift)
{
  vtkDataArray* times = output->GetPointData()->GetArray("TimeStamp");
  const double growth = drift && result.drifts ? 1e-6 * result.driftPpm : 0.0;
  vtkNew<vtkDoubleArray> moved;
  moved->SetName("TimeStamp");
  moved->SetNumberOfValues(times->GetNumberOfTuples());
  for (vtkIdType i = 0; i < times->GetNumberOfTuples(); ++i) {
    const double time = times->GetComponent(i, 0) + result.offsetSeconds;
    moved->SetValue(i, time + growth / (1.0 - growth) * (time - result.middleSeconds));
  }
  output->GetPointData()->AddArray(moved);
}
} // namespace

//----------------------------------------------------------------------------
vtkUltrasoundTemporalCalibration::vtkUltrasoundTemporalCalibration()
{
  this->SetNumberOfInputPorts(2);
  const echorama::TemporalParameters defaults;
  this->LargestOffset = defaults.largestOffsetSeconds;
  this->Smoothing = defaults.smoothingSeconds;
  this->LongestGap = defaults.longestGapSeconds;
  this->LeastOverlap = defaults.leastOverlapSeconds;
  this->SetPoseArray("ToolToWorld");
  this->Forget();
}

//----------------------------------------------------------------------------
vtkUltrasoundTemporalCalibration::~vtkUltrasoundTemporalCalibration()
{
  this->SetFirstTool(nullptr);
  this->SetSecondTool(nullptr);
  this->SetPoseArray(nullptr);
}

//----------------------------------------------------------------------------
void vtkUltrasoundTemporalCalibration::Forget()
{
  this->Offset = this->StandardError = NaN;
  this->Report.clear();
}

//----------------------------------------------------------------------------
int vtkUltrasoundTemporalCalibration::RequestData(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  this->Forget();
  return vtkUltrasoundVolume::Run(this, outputs, [&](const echorama::Progress& progress) {
    vtkPolyData* const second = vtkPolyData::GetData(inputs[1]);
    const std::string array = TextOf(this->PoseArray);
    const auto a = echorama::TrackPosesOf(vtkPolyData::GetData(inputs[0]), array, TextOf(this->FirstTool), "the first track");
    const auto b = echorama::TrackPosesOf(second, array, TextOf(this->SecondTool), "the second track");
    echorama::TemporalParameters parameters;
    parameters.signal = this->Signal == ROTATION      ? echorama::SpeedSignal::Rotation
                        : this->Signal == TRANSLATION ? echorama::SpeedSignal::Translation
                                                      : echorama::SpeedSignal::Automatic;
    parameters.largestOffsetSeconds = this->LargestOffset;
    parameters.smoothingSeconds = this->Smoothing;
    parameters.longestGapSeconds = this->LongestGap;
    parameters.leastOverlapSeconds = this->LeastOverlap;
    const echorama::TemporalResult result = echorama::CalibrateTime(a.poses, b.poses, parameters, progress);
    vtkPolyData* const output = vtkPolyData::GetData(outputs);
    output->ShallowCopy(second);
    MoveTimes(output, result, this->CorrectDrift);
    AddField(output, "TimeOffset", result.offsetSeconds);
    AddField(output, "TimeOffsetError", result.standardErrorSeconds);
    this->Offset = result.offsetSeconds;
    this->StandardError = result.standardErrorSeconds;
    this->Report = echorama::Report(result, a.tool, b.tool);
  });
}

//----------------------------------------------------------------------------
void vtkUltrasoundTemporalCalibration::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "FirstTool: " << TextOf(this->FirstTool) << "\n";
  os << indent << "SecondTool: " << TextOf(this->SecondTool) << "\n";
  os << indent << "PoseArray: " << TextOf(this->PoseArray) << "\n";
  os << indent << "Signal: " << this->Signal << "\n";
  os << indent << "LargestOffset: " << this->LargestOffset << "\n";
  os << indent << "Smoothing: " << this->Smoothing << "\n";
  os << indent << "LongestGap: " << this->LongestGap << "\n";
  os << indent << "LeastOverlap: " << this->LeastOverlap << "\n";
  os << indent << "CorrectDrift: " << (this->CorrectDrift ? "on" : "off") << "\n";
  os << indent << "Offset: " << this->Offset << "\n";
  os << indent << "StandardError: " << this->StandardError << "\n";
}
