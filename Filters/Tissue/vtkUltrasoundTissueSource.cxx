// SPDX-License-Identifier: BSD-3-Clause
#include "vtkUltrasoundTissueSource.h"

#include "Core/Base/NumberText.h"
#include "PackedTissue.h"
#include "vtkDoubleArray.h"
#include "vtkFieldData.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkIntArray.h"
#include "vtkNew.h"
#include "vtkObjectFactory.h"
#include "vtkPolyData.h"
#include "vtkUltrasoundTissue.h"
#include "vtkUltrasoundVolume.h"

#include <sstream>

using echorama::Error;

vtkStandardNewMacro(vtkUltrasoundTissueSource);

namespace {

// "liver 2, cyst" and the like.
std::vector<echorama::WeightedMaterial> MaterialsFrom(const std::string& text)
{
  std::vector<echorama::WeightedMaterial> materials;
  std::istringstream list(text);
  for (std::string entry; std::getline(list, entry, ',');) {
    std::istringstream words(entry);
    std::string name, weight, more;
    if (!(words >> name)) {
      continue;
    }
    echorama::WeightedMaterial one{echorama::StandardMaterial(name), 1.0};
    if (((words >> weight) && !echorama::ParseNumber(weight, one.weight)) || (words >> more)) {
      throw Error(Error::Kind::InvalidParameter,
                  "Materials: \"" + entry + "\" is not a material's name with a number, its share, after it");
    }
    materials.push_back(std::move(one));
  }
  return materials;
}

std::string TextOf(const std::vector<echorama::WeightedMaterial>& materials)
{
  std::string text;
  for (const auto& one : materials) {
    text += (text.empty() ? "" : ", ") + one.material.name + " " + echorama::NumberText(one.weight);
  }
  return text;
}

template <class Array, class Value>
void AddField(vtkPolyData* data, const char* name, Value value)
{
  vtkNew<Array> array;
  array->SetName(name);
  array->InsertNextValue(value);
  data->GetFieldData()->AddArray(array);
}

} // namespace

vtkUltrasoundParametersMacro(vtkUltrasoundTissueSource);

struct vtkUltrasoundTissueSource::Settings {
  echorama::PackedTissueParameters tissue; // but for the materials, which are named here
  std::string background = tissue.background.name, materials = TextOf(tissue.materials);
};

//----------------------------------------------------------------------------
echorama::ParameterList vtkUltrasoundTissueSource::Parameters()
{
  using echorama::Parameter;
  Settings& v = *this->Values;
  return echorama::Join(
      {Renamed(Describe(v.tissue.packing), "Radii", "Distribution"),
       {Parameter("Materials", v.materials,
                  "The standard materials of the spheres, separated by commas, each with its share beside the others' (1 when "
                  "left out)."),
        Parameter("Background", v.background, "The standard material between the spheres.")},
       Describe(v.tissue)});
}

//----------------------------------------------------------------------------
vtkUltrasoundTissueSource::vtkUltrasoundTissueSource() : Values(new Settings)
{
  this->SetNumberOfInputPorts(0);
}

//----------------------------------------------------------------------------
vtkUltrasoundTissueSource::~vtkUltrasoundTissueSource() = default;

//----------------------------------------------------------------------------
void vtkUltrasoundTissueSource::SetBox(double xMin, double xMax, double yMin, double yMax, double zMin, double zMax)
{
  const double low[3] = {xMin, yMin, zMin}, high[3] = {xMax, yMax, zMax};
  this->SetParameterAsVector("BoxMin", low);
  this->SetParameterAsVector("BoxMax", high);
}

//----------------------------------------------------------------------------
void vtkUltrasoundTissueSource::GetBox(double box[6])
{
  const echorama::SpherePackingParameters& packing = this->Values->tissue.packing;
  for (int axis = 0; axis < 3; ++axis) {
    box[2 * axis] = packing.boxMin[axis];
    box[2 * axis + 1] = packing.boxMax[axis];
  }
}

//----------------------------------------------------------------------------
int vtkUltrasoundTissueSource::RequestData(vtkInformation*, vtkInformationVector**, vtkInformationVector* outputs)
{
  this->PackedFillFraction = 0.0;
  this->SphereCount = 0;
  this->Saturated = false;
  return vtkUltrasoundVolume::Run(this, outputs, [this, outputs](const echorama::Progress& progress) {
    echorama::CheckRanges(this->Parameters());
    echorama::PackedTissueParameters parameters = this->Values->tissue;
    parameters.background = echorama::StandardMaterial(this->Values->background);
    parameters.materials = MaterialsFrom(this->Values->materials);
    const echorama::PackedTissue tissue = echorama::MakePackedTissue(parameters, progress);
    vtkPolyData* output = vtkPolyData::GetData(outputs);
    vtkUltrasoundTissue::Set(output, tissue.surface);

    this->PackedFillFraction = tissue.packing.fillFraction;
    this->SphereCount = static_cast<int>(tissue.packing.spheres.size());
    this->Saturated = tissue.packing.saturated;
    AddField<vtkDoubleArray>(output, "FillFraction", this->PackedFillFraction);
    AddField<vtkIntArray>(output, "SphereCount", this->SphereCount);
    AddField<vtkIntArray>(output, "Saturated", this->Saturated ? 1 : 0);
    vtkNew<vtkDoubleArray> spheres;
    spheres->SetName("Spheres");
    spheres->SetNumberOfComponents(4);
    spheres->SetNumberOfTuples(this->SphereCount);
    for (vtkIdType i = 0; i < this->SphereCount; ++i) {
      const echorama::Sphere& sphere = tissue.packing.spheres[static_cast<std::size_t>(i)];
      spheres->SetTuple4(i, sphere.centre.x(), sphere.centre.y(), sphere.centre.z(), sphere.radius);
    }
    output->GetFieldData()->AddArray(spheres);
  });
}

//----------------------------------------------------------------------------
void vtkUltrasoundTissueSource::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  vtkUltrasoundParameters::Print(os, indent, this->Parameters());
  os << indent << "PackedFillFraction: " << this->PackedFillFraction << "\n";
  os << indent << "SphereCount: " << this->SphereCount << (this->Saturated ? " (saturated)" : "") << "\n";
}
