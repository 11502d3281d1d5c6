// SPDX-License-Identifier: BSD-3-Clause
#include "vtkUltrasoundRigFit.h"

#include "Core/Base/Error.h"
#include "Core/Base/NumberText.h"
#include "Core/Geometry/MatrixRows.h"
#include "vtkDoubleArray.h"
#include "vtkImageData.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkMatrix4x4.h"
#include "vtkNew.h"
#include "vtkObjectFactory.h"
#include "vtkPointData.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"
#include "vtkStringArray.h"
#include "vtkUltrasoundAcquisition.h"
#include "vtkUltrasoundVolume.h"
#include "vtkUnsignedCharArray.h"

#include <sstream>

vtkStandardNewMacro(vtkUltrasoundRigFit);

vtkUltrasoundParametersMacro(vtkUltrasoundRigFit);

echorama::ParameterList vtkUltrasoundRigFit::Parameters()
{
  return echorama::Without(Describe(this->Values), {"LargestRmsMm", "Candidates"});
}

void vtkUltrasoundRigFit::AddBall(const char* name, const double centre[3], double radius)
{
  this->Balls.push_back({name ? name : "", Eigen::Vector3d(centre), radius});
  this->Modified();
}

void vtkUltrasoundRigFit::ClearBalls()
{
  this->Balls.clear();
  this->Complaint.clear();
  this->Modified();
}

int vtkUltrasoundRigFit::GetNumberOfBalls() const
{
  return static_cast<int>(this->Balls.size());
}

void vtkUltrasoundRigFit::SetBalls(const char* text)
{
  if (!text || !*text)
    return;
  this->ClearBalls();
  std::istringstream list(text);
  for (std::string entry; std::getline(list, entry, ';');) {
    std::istringstream words(entry);
    std::vector<std::string> parts;
    for (std::string word; words >> word;)
      parts.push_back(word);
    if (parts.empty())
      continue;
    echorama::RigBall ball;
    ball.name = parts[0];
    if (parts.size() != 5 || !echorama::ParseNumber(parts[1], ball.centre.x()) ||
        !echorama::ParseNumber(parts[2], ball.centre.y()) || !echorama::ParseNumber(parts[3], ball.centre.z()) ||
        !echorama::ParseNumber(parts[4], ball.radius))
      this->Complaint = "Balls: \"" + entry + "\" is not \"name x y z radius\"";
    this->Balls.push_back(ball);
  }
}

bool vtkUltrasoundRigFit::GetRigToWorld(vtkMatrix4x4* matrix) const
{
  vtkUltrasoundVolume::SetMatrix(matrix, this->RigToWorld);
  return this->Last.found > 0;
}

int vtkUltrasoundRigFit::GetNumberOfFoundBalls() const
{
  return this->Last.found;
}

double vtkUltrasoundRigFit::GetRmsMm() const
{
  return this->Last.rmsMm;
}

double vtkUltrasoundRigFit::GetFoundDepthScale() const
{
  return this->Last.depthScale;
}

int vtkUltrasoundRigFit::FillInputPortInformation(int, vtkInformation* information)
{
  information->Set(vtkAlgorithm::INPUT_REQUIRED_DATA_TYPE(), "vtkImageData");
  return 1;
}

int vtkUltrasoundRigFit::RequestUpdateExtent(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector*)
{
  vtkUltrasoundVolume::RequestWhole(inputs[0]);
  return 1;
}

int vtkUltrasoundRigFit::RequestData(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  using echorama::Error;
  this->Last = {};
  this->RigToWorld.setIdentity();
  return vtkUltrasoundVolume::Run(this, outputs, [&](const echorama::Progress& progress) {
    if (!this->Complaint.empty())
      throw Error(Error::Kind::InvalidParameter, this->Complaint);
    vtkImageData* image = vtkImageData::GetData(inputs[0]);
    const vtkUltrasoundVolume::Input input = vtkUltrasoundVolume::CheckInput(this, image, "the volume");
    const auto geometry = vtkUltrasoundAcquisition::ProbeGeometryOf(image);
    const auto pose = vtkUltrasoundAcquisition::ProbeToWorldOf(image);
    if (!geometry || !pose)
      throw Error(Error::Kind::BadInput,
                  "the volume does not say which probe imaged it, and from where (ProbeGeometry, ProbeToWorld)");
    const echorama::ImageGeometry grid = vtkUltrasoundVolume::GeometryOf(image);
    echorama::Volume<float> samples(grid.dimensions);
    vtkUltrasoundVolume::Dispatch(input.Intensity, [&](auto zero) {
      const auto view = vtkUltrasoundVolume::ViewOf<const decltype(zero)>(input.Intensity, image);
      std::copy(view.begin(), view.end(), samples.View().begin());
    });
    this->Last = echorama::FitRig(samples.View(), vtkUltrasoundVolume::ViewOf<const unsigned char>(input.ValidRegion, image),
                                  grid, {*geometry, *pose}, this->Balls, this->Values, progress);
    this->RigToWorld = *pose * this->Last.rigToProbe;

    vtkPolyData* output = vtkPolyData::GetData(outputs);
    vtkNew<vtkPoints> points;
    points->SetDataTypeToDouble();
    vtkNew<vtkStringArray> names;
    names->SetName("Name");
    vtkNew<vtkUnsignedCharArray> found;
    found->SetName("Found");
    vtkNew<vtkDoubleArray> residuals;
    residuals->SetName("Residual");
    output->AllocateExact(static_cast<vtkIdType>(this->Balls.size()), 1, 0, 0, 0, 0, 0, 0);
    for (const echorama::RigFit::Ball& ball : this->Last.balls) {
      const vtkIdType id = points->InsertNextPoint((*pose * ball.centre).eval().data());
      output->InsertNextCell(VTK_VERTEX, 1, &id);
      names->InsertNextValue(ball.name);
      found->InsertNextValue(ball.found ? 1 : 0);
      residuals->InsertNextValue(ball.residualMm);
    }
    output->SetPoints(points);
    output->GetPointData()->AddArray(names);
    output->GetPointData()->AddArray(found);
    output->GetPointData()->AddArray(residuals);
    vtkUltrasoundVolume::AddField(output, "RigToWorld", echorama::MatrixRows(this->RigToWorld.matrix()).data(), 16);
    vtkUltrasoundVolume::AddField(output, "RigToProbe", echorama::MatrixRows(this->Last.rigToProbe.matrix()).data(), 16);
    vtkUltrasoundVolume::AddField(output, "DepthScale", &this->Last.depthScale, 1);
  });
}

void vtkUltrasoundRigFit::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "Balls: " << this->Balls.size() << "\n";
  vtkUltrasoundParameters::Print(os, indent, this->Parameters());
}
