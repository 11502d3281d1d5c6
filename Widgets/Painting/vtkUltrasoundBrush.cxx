// SPDX-License-Identifier: BSD-3-Clause
#include "vtkUltrasoundBrush.h"

#include "vtkCellArray.h"
#include "vtkIdList.h"
#include "vtkImageData.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkNew.h"
#include "vtkObjectFactory.h"
#include "vtkPolyData.h"
#include "Widgets/Painting/VoxelEdits.h"

vtkStandardNewMacro(vtkUltrasoundBrush);

vtkUltrasoundParametersMacro(vtkUltrasoundBrush);

//----------------------------------------------------------------------------
echorama::ParameterList vtkUltrasoundBrush::Parameters()
{
  // To restore is to take the filter, or a point, away.
  echorama::ParameterList brush = Describe(this->Values);
  echorama::Named(brush, "Mode") =
      echorama::Parameter("Mode", echorama::Choice(this->Values.mode, {"paint", "carve"}),
                          "Whether voxels get the intensity of the brush, or leave the valid region.");
  for (const char* name : {"Intensity", "Opacity", "Hardness", "InsideValid"}) {
    echorama::Named(brush, name).When("Mode", "paint");
  }
  return brush;
}

//----------------------------------------------------------------------------
vtkUltrasoundBrush::vtkUltrasoundBrush()
{
  this->SetNumberOfInputPorts(2);
}

//----------------------------------------------------------------------------
vtkUltrasoundBrush::~vtkUltrasoundBrush() = default;

//----------------------------------------------------------------------------
void vtkUltrasoundBrush::AddPoint(double x, double y, double z)
{
  this->Points.emplace_back(x, y, z);
  this->Modified();
}

//----------------------------------------------------------------------------
void vtkUltrasoundBrush::ClearPoints()
{
  if (!this->Points.empty()) {
    this->Points.clear();
    this->Modified();
  }
}

//----------------------------------------------------------------------------
int vtkUltrasoundBrush::FillInputPortInformation(int port, vtkInformation* info)
{
  if (port == 0) {
    return this->Superclass::FillInputPortInformation(port, info);
  }
  info->Set(vtkAlgorithm::INPUT_REQUIRED_DATA_TYPE(), "vtkPolyData");
  info->Set(vtkAlgorithm::INPUT_IS_OPTIONAL(), 1);
  return 1;
}

//----------------------------------------------------------------------------
std::vector<echorama::Stroke> vtkUltrasoundBrush::Strokes(vtkInformationVector* paths) const
{
  std::vector<echorama::Stroke> strokes;
  if (paths->GetNumberOfInformationObjects() == 0) {
    if (!this->Points.empty()) {
      strokes.push_back({this->Values, this->Points});
    }
    return strokes;
  }
  vtkPolyData* data = vtkPolyData::GetData(paths);
  vtkNew<vtkIdList> ids;
  const auto point = [&](vtkIdType i) { return Eigen::Vector3d(data->GetPoint(ids->GetId(i))); };
  for (vtkIdType cell = 0; cell < data->GetNumberOfLines(); ++cell) {
    data->GetLines()->GetCellAtId(cell, ids);
    echorama::Stroke stroke{this->Values, {}};
    for (vtkIdType i = 0; i < ids->GetNumberOfIds(); ++i) {
      stroke.pathMm.push_back(point(i));
    }
    strokes.push_back(std::move(stroke));
  }
  for (vtkIdType cell = 0; cell < data->GetNumberOfVerts(); ++cell) {
    data->GetVerts()->GetCellAtId(cell, ids);
    for (vtkIdType i = 0; i < ids->GetNumberOfIds(); ++i) {
      strokes.push_back({this->Values, {point(i)}});
    }
  }
  return strokes;
}

//----------------------------------------------------------------------------
void vtkUltrasoundBrush::Execute(vtkInformationVector** inputs, vtkImageData* output, const echorama::Progress& progress)
{
  progress(0.0);
  echorama::CheckRanges(this->Parameters());
  vtkImageData* image = vtkImageData::GetData(inputs[0]);
  const auto input = vtkUltrasoundVolume::CheckInput(this, image, "the input");
  const std::vector<echorama::Stroke> strokes = this->Strokes(inputs[1]);
  vtkDataArray* intensity = CopyWithNewIntensity(image, input.Intensity, output, input.Intensity->GetDataType());
  intensity->DeepCopy(input.Intensity);
  vtkDataArray* valid = AddArray(output, vtkUltrasoundVolume::ValidRegionName(), VTK_UNSIGNED_CHAR);
  if (input.ValidRegion) {
    valid->DeepCopy(input.ValidRegion);
  } else {
    valid->Fill(1.0);
  }

  vtkUltrasoundVolume::Dispatch(intensity, [&](auto type) {
    using T = decltype(type);
    echorama::VoxelEdits<T> edits(vtkUltrasoundVolume::ViewOf<T>(intensity, output),
                                  vtkUltrasoundVolume::ViewOf<unsigned char>(valid, output),
                                  vtkUltrasoundVolume::GeometryOf(output));
    echorama::StrokeChain chain;
    for (std::size_t i = 0; i < strokes.size(); ++i) {
      const echorama::Progress part = progress.Part(static_cast<double>(i) / static_cast<double>(strokes.size()),
                                                    static_cast<double>(i + 1) / static_cast<double>(strokes.size()));
      edits.Begin(strokes[i].brush);
      const std::vector<Eigen::Vector3d>& path = strokes[i].pathMm;
      for (std::size_t p = 0; p < path.size(); ++p) {
        edits.Extend(path[p]);
        part(static_cast<double>(p + 1) / static_cast<double>(path.size()));
      }
      chain = echorama::Append(chain, strokes[i]);
      edits.End(chain);
    }
  });
}

//----------------------------------------------------------------------------
void vtkUltrasoundBrush::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  vtkUltrasoundParameters::Print(os, indent, this->Parameters());
  os << indent << "Points: " << this->Points.size() << "\n";
}
