// SPDX-License-Identifier: BSD-3-Clause
#include "vtkUltrasoundPivotCalibration.h"

#include "Filters/Calibration/CalibrationJson.h"
#include "vtkUltrasoundNewDataArray.h"
#include "vtkUltrasoundTrackPoses.h"
#include "vtkUltrasoundVolume.h"

#include "vtkCellArray.h"
#include "vtkDoubleArray.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkNew.h"
#include "vtkObjectFactory.h"
#include "vtkPoints.h"
#include "vtkUnsignedCharArray.h"

#include <algorithm>
#include <limits>

vtkStandardNewMacro(vtkUltrasoundPivotCalibration);

vtkUltrasoundParametersMacro(vtkUltrasoundPivotCalibration);

namespace {
// The tips by their poses, and what follows from them.
void Fill(vtkPolyData* output, const echorama::TrackPoses& track, const echorama::PivotResult& result)
{
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  vtkNew<vtkCellArray> vertices;
  const auto residuals = echorama::NewDataArray<vtkDoubleArray>(output->GetPointData(), "Residual", 3);
  const auto times = echorama::NewDataArray<vtkDoubleArray>(output->GetPointData(), "TimeStamp");
  const auto inliers = echorama::NewDataArray<vtkUnsignedCharArray>(output->GetPointData(), "Inlier");
  for (std::size_t i = 0; i < track.poses.size(); ++i) {
    const Eigen::Vector3d tip = track.poses[i].pose * result.tip, residual = tip - result.pivot;
    const vtkIdType id = points->InsertNextPoint(tip.data());
    vertices->InsertNextCell(1, &id);
    residuals->InsertNextTuple(residual.data());
    times->InsertNextValue(track.poses[i].time);
    inliers->InsertNextValue(result.residuals[i].inlier ? 1 : 0);
  }
  output->SetPoints(points);
  output->SetVerts(vertices);
  output->GetPointData()->SetActiveScalars("Inlier");
  const Eigen::Matrix3d covariance = result.covariance.topLeftCorner<3, 3>();
  vtkUltrasoundVolume::AddField(output, "Tip", result.tip.data(), 3);
  vtkUltrasoundVolume::AddField(output, "TipRadius95", &result.tipRadius95Mm, 1);
  vtkUltrasoundVolume::AddField(output, "TipCovariance", covariance.data(), 9);
  vtkUltrasoundVolume::AddField(output, "Pivot", result.pivot.data(), 3);
}
} // namespace

//----------------------------------------------------------------------------
vtkUltrasoundPivotCalibration::vtkUltrasoundPivotCalibration()
{
  this->Forget();
}

//----------------------------------------------------------------------------
vtkUltrasoundPivotCalibration::~vtkUltrasoundPivotCalibration() = default;

//----------------------------------------------------------------------------
echorama::ParameterList vtkUltrasoundPivotCalibration::Parameters()
{
  using echorama::Parameter;
  return echorama::Join(
      {{Parameter("Tool", this->Tool, "The tool, by its name in ToolNames. Empty takes the only one."),
        Parameter("PoseArray", this->PoseArray, "The point array of 16 numbers that holds the poses, from the tool to the world.")
            .Advanced()},
       Describe(this->Values)});
}

//----------------------------------------------------------------------------
void vtkUltrasoundPivotCalibration::Forget()
{
  std::fill_n(this->Tip, 3, std::numeric_limits<double>::quiet_NaN());
  std::fill_n(this->Pivot, 3, std::numeric_limits<double>::quiet_NaN());
  this->Radius95 = std::numeric_limits<double>::quiet_NaN();
  this->Report.clear();
}

//----------------------------------------------------------------------------
int vtkUltrasoundPivotCalibration::RequestData(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  this->Forget();
  return vtkUltrasoundVolume::Run(this, outputs, [&](const echorama::Progress& progress) {
    echorama::CheckRanges(this->Values);
    const echorama::TrackPoses track =
        echorama::TrackPosesOf(vtkPolyData::GetData(inputs[0]), this->PoseArray, this->Tool, "the track");
    const echorama::PivotResult result = echorama::CalibratePivot(track.poses, this->Values, progress);
    Fill(vtkPolyData::GetData(outputs), track, result);
    std::copy_n(result.tip.data(), 3, this->Tip);
    std::copy_n(result.pivot.data(), 3, this->Pivot);
    this->Radius95 = result.tipRadius95Mm;
    this->Report = echorama::Report(result, track.tool);
  });
}

//----------------------------------------------------------------------------
void vtkUltrasoundPivotCalibration::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  vtkUltrasoundParameters::Print(os, indent, this->Parameters());
  os << indent << "Tip: " << this->Tip[0] << " " << this->Tip[1] << " " << this->Tip[2] << "\n";
  os << indent << "Pivot: " << this->Pivot[0] << " " << this->Pivot[1] << " " << this->Pivot[2] << "\n";
  os << indent << "Radius95: " << this->Radius95 << "\n";
}
