// SPDX-License-Identifier: BSD-3-Clause
#include "vtkUltrasoundTemporalCalibration.h"

#include "Filters/Calibration/CalibrationJson.h"
#include "vtkUltrasoundTrackPoses.h"
#include "vtkUltrasoundVolume.h"

#include "vtkDoubleArray.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkNew.h"
#include "vtkObjectFactory.h"

#include <limits>

vtkStandardNewMacro(vtkUltrasoundTemporalCalibration);

vtkUltrasoundParametersMacro(vtkUltrasoundTemporalCalibration);

namespace {
constexpr double NaN = std::numeric_limits<double>::quiet_NaN();

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
  this->Forget();
}

//----------------------------------------------------------------------------
vtkUltrasoundTemporalCalibration::~vtkUltrasoundTemporalCalibration() = default;

//----------------------------------------------------------------------------
echorama::ParameterList vtkUltrasoundTemporalCalibration::Parameters()
{
  using echorama::Parameter;
  const std::string only = " by its name in ToolNames. Empty takes the only one.";
  return echorama::Join(
      {{Parameter("FirstTool", this->FirstTool, "The tool of the first track," + only),
        Parameter("SecondTool", this->SecondTool, "The tool of the second track," + only),
        Parameter("PoseArray", this->PoseArray, "The point array of 16 numbers that holds the poses, in both tracks.")
            .Advanced()},
       Describe(this->Values),
       {Parameter("CorrectDrift", this->CorrectDrift,
                  "Whether a drift between the clocks, where one was found, is taken out of the times too.")}});
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
    echorama::CheckRanges(this->Values);
    vtkPolyData* const second = vtkPolyData::GetData(inputs[1]);
    const auto a = echorama::TrackPosesOf(vtkPolyData::GetData(inputs[0]), this->PoseArray, this->FirstTool, "the first track");
    const auto b = echorama::TrackPosesOf(second, this->PoseArray, this->SecondTool, "the second track");
    const echorama::TemporalResult result = echorama::CalibrateTime(a.poses, b.poses, this->Values, progress);
    vtkPolyData* const output = vtkPolyData::GetData(outputs);
    output->ShallowCopy(second);
    MoveTimes(output, result, this->CorrectDrift);
    vtkUltrasoundVolume::AddField(output, "TimeOffset", &result.offsetSeconds, 1);
    vtkUltrasoundVolume::AddField(output, "TimeOffsetError", &result.standardErrorSeconds, 1);
    this->Offset = result.offsetSeconds;
    this->StandardError = result.standardErrorSeconds;
    this->Report = echorama::Report(result, a.tool, b.tool);
  });
}

//----------------------------------------------------------------------------
void vtkUltrasoundTemporalCalibration::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  vtkUltrasoundParameters::Print(os, indent, this->Parameters());
  os << indent << "Offset: " << this->Offset << "\n";
  os << indent << "StandardError: " << this->StandardError << "\n";
}
