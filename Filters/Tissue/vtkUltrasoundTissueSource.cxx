// SPDX-License-Identifier: BSD-3-Clause
#include "vtkUltrasoundTissueSource.h"

#include "Core/Base/NumberText.h"
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
using echorama::PackedTissueParameters;
using echorama::SpherePackingParameters;

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

//----------------------------------------------------------------------------
vtkUltrasoundTissueSource::vtkUltrasoundTissueSource()
{
  this->SetNumberOfInputPorts(0);
  const PackedTissueParameters defaults;
  const SpherePackingParameters& packing = defaults.packing;
  this->Method = static_cast<int>(packing.method);
  this->Region = static_cast<int>(packing.region);
  for (int axis = 0; axis < 3; ++axis) {
    this->Box[2 * axis] = packing.boxMin[axis];
    this->Box[2 * axis + 1] = packing.boxMax[axis];
    this->ProbePosition[axis] = defaults.cell.probe[axis];
  }
  this->Distribution = static_cast<int>(packing.radii);
  this->Exponent = packing.exponent;
  this->RadiusMin = packing.radiusMin;
  this->RadiusMax = packing.radiusMax;
  this->GapMm = packing.gapMm;
  this->FillFraction = packing.fillFraction;
  this->Count = static_cast<int>(packing.count);
  this->Misses = packing.misses;
  this->Seed = static_cast<vtkTypeInt64>(packing.seed);
  this->CellMm = defaults.cell.mm;
  this->CellGrowth = defaults.cell.growth;
  this->Deviation = defaults.deviation;
  this->TrueVolume = defaults.trueVolume;
  this->Turned = defaults.turned;
  this->MaxTriangles = static_cast<int>(defaults.maxTriangles);
  this->SetBackground(defaults.background.name.c_str());
  this->SetMaterials(TextOf(defaults.materials).c_str());
}

//----------------------------------------------------------------------------
vtkUltrasoundTissueSource::~vtkUltrasoundTissueSource()
{
  this->SetBackground(nullptr);
  this->SetMaterials(nullptr);
}

//----------------------------------------------------------------------------
PackedTissueParameters vtkUltrasoundTissueSource::Parameters() const
{
  PackedTissueParameters parameters;
  SpherePackingParameters& packing = parameters.packing;
  packing.method = static_cast<SpherePackingParameters::Method>(this->Method);
  packing.region = static_cast<SpherePackingParameters::Region>(this->Region);
  packing.boxMin = {this->Box[0], this->Box[2], this->Box[4]};
  packing.boxMax = {this->Box[1], this->Box[3], this->Box[5]};
  packing.radii = static_cast<SpherePackingParameters::Radii>(this->Distribution);
  packing.exponent = this->Exponent;
  packing.radiusMin = this->RadiusMin;
  packing.radiusMax = this->RadiusMax;
  packing.gapMm = this->GapMm;
  packing.fillFraction = this->FillFraction;
  packing.count = this->Count;
  packing.misses = this->Misses;
  packing.seed = static_cast<std::uint64_t>(this->Seed);
  parameters.cell = {this->CellMm, this->CellGrowth, Eigen::Vector3d(this->ProbePosition)};
  parameters.deviation = this->Deviation;
  parameters.trueVolume = this->TrueVolume;
  parameters.turned = this->Turned;
  parameters.maxTriangles = this->MaxTriangles;
  parameters.background = echorama::StandardMaterial(this->Background ? this->Background : "");
  parameters.materials = MaterialsFrom(this->Materials ? this->Materials : "");
  return parameters;
}

//----------------------------------------------------------------------------
int vtkUltrasoundTissueSource::RequestData(vtkInformation*, vtkInformationVector**, vtkInformationVector* outputs)
{
  this->PackedFillFraction = 0.0;
  this->SphereCount = 0;
  this->Saturated = false;
  return vtkUltrasoundVolume::Run(this, outputs, [this, outputs](const echorama::Progress& progress) {
    const echorama::PackedTissue tissue = echorama::MakePackedTissue(this->Parameters(), progress);
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
  os << indent << "Method: " << (this->Method == RANDOM ? "random" : "empty space") << "\n";
  os << indent << "Region: " << (this->Region == BOX ? "box" : "ball") << "\n";
  os << indent << "Box:";
  for (const double side : this->Box) {
    os << " " << side;
  }
  os << "\n";
  os << indent << "Distribution: " << this->Distribution << ", exponent " << this->Exponent << "\n";
  os << indent << "Radii: " << this->RadiusMin << " to " << this->RadiusMax << "\n";
  os << indent << "GapMm: " << this->GapMm << "\n";
  os << indent << "FillFraction: " << this->FillFraction << "\n";
  os << indent << "Count: " << this->Count << "\n";
  os << indent << "Misses: " << this->Misses << "\n";
  os << indent << "Seed: " << this->Seed << "\n";
  os << indent << "CellMm: " << this->CellMm << ", growing by " << this->CellGrowth << " from " << this->ProbePosition[0] << " "
     << this->ProbePosition[1] << " " << this->ProbePosition[2] << "\n";
  os << indent << "Deviation: " << this->Deviation << "\n";
  os << indent << "TrueVolume: " << this->TrueVolume << "\n";
  os << indent << "Turned: " << this->Turned << "\n";
  os << indent << "MaxTriangles: " << this->MaxTriangles << "\n";
  os << indent << "Background: " << (this->Background ? this->Background : "(none)") << "\n";
  os << indent << "Materials: " << (this->Materials ? this->Materials : "(none)") << "\n";
  os << indent << "PackedFillFraction: " << this->PackedFillFraction << "\n";
  os << indent << "SphereCount: " << this->SphereCount << (this->Saturated ? " (saturated)" : "") << "\n";
}
