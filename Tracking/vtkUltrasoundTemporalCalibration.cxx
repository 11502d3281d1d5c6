// SPDX-License-Identifier: BSD-3-Clause
#include "vtkUltrasoundTemporalCalibration.h"

#include "Core/Base/Json.h"
#include "Tracking/Calibration/TemporalCalibration.h"
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

std::string ReportOf(const std::string& first, const std::string& second, const echorama::TemporalResult& result)
{
  using Json = nlohmann::ordered_json;
  Json curve = Json::array();
  for (std::size_t i = 0; i < result.offsets.size(); ++i) {
    curve.push_back({result.offsets[i], result.correlations[i]}); // NaN becomes null
  }
  const Json report{{"first_tool", first},
                    {"second_tool", second},
                    {"offset_s", result.offsetSeconds},
                    {"standard_error_s", result.standardErrorSeconds},
                    {"signal", result.signal == echorama::SpeedSignal::Rotation ? "rotation" : "translation"},
                    {"correlation", result.correlation},
                    {"confidence", result.confidence},
                    {"next_correlation", result.nextCorrelation},
                    {"next_offset_s", result.nextOffsetSeconds},
                    {"speed_ratio", result.speedRatio},
                    {"overlap_s", result.overlapSeconds},
                    {"middle_s", result.middleSeconds},
                    {"drift_ppm", result.driftPpm},
                    {"drift_error_ppm", result.driftErrorPpm},
                    {"drifts", result.drifts},
                    {"notes", result.notes},
                    {"correlation_by_offset", curve}};
  return report.dump(2, ' ', false, Json::error_handler_t::replace);
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
    this->Report = ReportOf(a.tool, b.tool, result);
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
