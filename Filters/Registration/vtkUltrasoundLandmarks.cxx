// SPDX-License-Identifier: BSD-3-Clause
#include "vtkUltrasoundLandmarks.h"

#include "vtkImageData.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkObjectFactory.h"
#include "vtkUltrasoundLandmarkField.h"

#include <algorithm>

using echorama::Error;
using echorama::Landmark;

vtkStandardNewMacro(vtkUltrasoundLandmarks);

namespace {
bool Has(const std::vector<Landmark>& landmarks, const std::string& label)
{
  return std::any_of(landmarks.begin(), landmarks.end(), [&label](const Landmark& each) { return each.label == label; });
}
} // namespace

//----------------------------------------------------------------------------
vtkUltrasoundLandmarks::vtkUltrasoundLandmarks() = default;

//----------------------------------------------------------------------------
vtkUltrasoundLandmarks::~vtkUltrasoundLandmarks() = default;

//----------------------------------------------------------------------------
void vtkUltrasoundLandmarks::AddPoint(double x, double y, double z)
{
  this->Points.emplace_back(x, y, z);
  this->Modified();
}

//----------------------------------------------------------------------------
void vtkUltrasoundLandmarks::ClearPoints()
{
  if (!this->Points.empty()) {
    this->Points.clear();
    this->Modified();
  }
}

//----------------------------------------------------------------------------
void vtkUltrasoundLandmarks::AddLabel(const char* label)
{
  this->Labels.emplace_back(label ? label : "");
  this->Modified();
}

//----------------------------------------------------------------------------
void vtkUltrasoundLandmarks::ClearLabels()
{
  if (!this->Labels.empty()) {
    this->Labels.clear();
    this->Modified();
  }
}

//----------------------------------------------------------------------------
std::vector<Landmark> vtkUltrasoundLandmarks::Landmarks() const
{
  if (this->Labels.size() > this->Points.size()) {
    throw Error(Error::Kind::InvalidParameter, "there are " + std::to_string(this->Labels.size()) + " labels of landmarks and " +
                                                   std::to_string(this->Points.size()) + " points");
  }
  std::vector<Landmark> landmarks;
  for (std::size_t i = 0; i < this->Points.size(); ++i) {
    const std::string number = std::to_string(i + 1);
    const std::string label = i < this->Labels.size() ? this->Labels[i] : number;
    if (label.empty()) {
      throw Error(Error::Kind::InvalidParameter, "landmark " + number + " has an empty label");
    }
    if (Has(landmarks, label)) {
      throw Error(Error::Kind::InvalidParameter, "two landmarks are called " + label);
    }
    if (!this->Points[i].allFinite()) {
      throw Error(Error::Kind::InvalidParameter, "the landmark " + label + " has a coordinate that is not finite");
    }
    landmarks.push_back({label, this->Points[i]});
  }
  return landmarks;
}

//----------------------------------------------------------------------------
void vtkUltrasoundLandmarks::Execute(vtkInformationVector** inputs, vtkImageData* output, const echorama::Progress& progress)
{
  progress(0.0);
  vtkImageData* image = vtkImageData::GetData(inputs[0]);
  vtkUltrasoundVolume::CheckInput(this, image, "the input");
  const std::vector<Landmark> here = this->Landmarks();
  std::vector<Landmark> all;
  for (const Landmark& before : vtkUltrasoundLandmarkField::Of(image)) {
    if (!Has(here, before.label)) {
      all.push_back(before);
    }
  }
  all.insert(all.end(), here.begin(), here.end());
  output->ShallowCopy(image);
  vtkUltrasoundLandmarkField::Set(output, all);
}

//----------------------------------------------------------------------------
void vtkUltrasoundLandmarks::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "Points: " << this->Points.size() << "\n";
  os << indent << "Labels: " << this->Labels.size() << "\n";
}
