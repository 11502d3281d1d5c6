// SPDX-License-Identifier: BSD-3-Clause
#include "vtkUltrasoundTissue.h"

#include "Core/Base/Error.h"
#include "vtkCellArray.h"
#include "vtkCellArrayIterator.h"
#include "vtkCellData.h"
#include "vtkDoubleArray.h"
#include "vtkFieldData.h"
#include "vtkFloatArray.h"
#include "vtkIdList.h"
#include "vtkIntArray.h"
#include "vtkNew.h"
#include "vtkObjectFactory.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"
#include "vtkPolygon.h"
#include "vtkSmartPointer.h"
#include "vtkStringArray.h"

#include <algorithm>
#include <array>
#include <cmath>

using echorama::Error;
using echorama::Material;
using echorama::TissueSurface;

vtkStandardNewMacro(vtkUltrasoundTissue);

namespace {

// The numbers of a material, by the names of the components that hold them.
struct Component {
  const char* Name;
  double Material::*Value;
};

constexpr std::array<Component, 9> components{{
    {"SoundSpeed", &Material::soundSpeed},
    {"Density", &Material::density},
    {"Attenuation", &Material::attenuation},
    {"AttenuationPower", &Material::attenuationPower},
    {"ScattererDensity", &Material::scattererDensity},
    {"BackscatterDb", &Material::backscatterDb},
    {"Roughness", &Material::roughness},
    {"ScatterProbability", &Material::scatterProbability},
    {"YoungsModulusKPa", &Material::youngsModulusKPa},
}};

[[noreturn]] void Refuse(const std::string& reason)
{
  throw Error(Error::Kind::BadInput, "the tissue " + reason);
}

std::vector<Material> MaterialsOf(vtkFieldData* field)
{
  const auto names = vtkStringArray::SafeDownCast(field->GetAbstractArray(vtkUltrasoundTissue::MaterialNameName()));
  vtkDataArray* const numbers = field->GetArray(vtkUltrasoundTissue::MaterialPropertyName());
  if (!names || names->GetNumberOfValues() == 0) {
    Refuse("has no field data MaterialName, a text per material");
  }
  if (!numbers || numbers->GetNumberOfTuples() != names->GetNumberOfValues()) {
    Refuse("has no field data MaterialProperty with as many rows as MaterialName");
  }
  std::vector<Material> materials(static_cast<std::size_t>(names->GetNumberOfValues()));
  for (const Component& component : components) {
    int column = 0;
    const auto is = [&](int i) {
      return numbers->GetComponentName(i) && std::string(numbers->GetComponentName(i)) == component.Name;
    };
    while (column < numbers->GetNumberOfComponents() && !is(column)) {
      ++column;
    }
    if (column == numbers->GetNumberOfComponents()) {
      Refuse(std::string("has no component ") + component.Name + " in its field data MaterialProperty");
    }
    for (std::size_t i = 0; i < materials.size(); ++i) {
      materials[i].*component.Value = numbers->GetComponent(static_cast<vtkIdType>(i), column);
    }
  }
  for (std::size_t i = 0; i < materials.size(); ++i) {
    materials[i].name = names->GetValue(static_cast<vtkIdType>(i));
  }
  return materials;
}

// A whole number that an array may hold as any type.
int WholeNumber(double value, const char* what)
{
  if (!(value >= 0.0 && value < 2147483647.0 && value == std::floor(value))) {
    Refuse(std::string("has an entry in ") + what + " that is no index");
  }
  return static_cast<int>(value);
}

} // namespace

//----------------------------------------------------------------------------
bool vtkUltrasoundTissue::IsTissue(vtkPolyData* data)
{
  return data && data->GetFieldData()->GetAbstractArray(MaterialNameName()) != nullptr;
}

//----------------------------------------------------------------------------
void vtkUltrasoundTissue::Set(vtkPolyData* data, const TissueSurface& surface)
{
  data->Initialize();
  vtkNew<vtkFloatArray> coordinates;
  coordinates->SetNumberOfComponents(3);
  coordinates->SetNumberOfTuples(static_cast<vtkIdType>(surface.points.size()));
  for (std::size_t i = 0; i < surface.points.size(); ++i) {
    coordinates->SetTypedTuple(static_cast<vtkIdType>(i), surface.points[i].data());
  }
  vtkNew<vtkPoints> points;
  points->SetData(coordinates);
  data->SetPoints(points);

  const auto count = static_cast<vtkIdType>(surface.triangles.size());
  vtkNew<vtkCellArray> cells;
  cells->AllocateExact(count, 3 * count);
  vtkNew<vtkIntArray> body, material;
  body->SetName(BodyName());
  body->SetNumberOfTuples(count);
  material->SetName(MaterialName());
  material->SetNumberOfTuples(count);
  for (vtkIdType i = 0; i < count; ++i) {
    const auto& corners = surface.triangles[static_cast<std::size_t>(i)];
    cells->InsertNextCell(
        {static_cast<vtkIdType>(corners[0]), static_cast<vtkIdType>(corners[1]), static_cast<vtkIdType>(corners[2])});
    const int index = surface.bodyOfTriangle[static_cast<std::size_t>(i)];
    body->SetValue(i, index);
    material->SetValue(i, surface.bodies[static_cast<std::size_t>(index)].material);
  }
  data->SetPolys(cells);
  data->GetCellData()->AddArray(body);
  data->GetCellData()->AddArray(material);
  data->GetCellData()->SetActiveScalars(MaterialName());

  vtkNew<vtkIntArray> bodyMaterial;
  bodyMaterial->SetName(BodyMaterialName());
  vtkNew<vtkStringArray> bodyNames;
  bodyNames->SetName(BodyNameName());
  bool named = false;
  for (const TissueSurface::Body& one : surface.bodies) {
    bodyMaterial->InsertNextValue(one.material);
    bodyNames->InsertNextValue(one.name);
    named = named || !one.name.empty();
  }
  data->GetFieldData()->AddArray(bodyMaterial);
  if (named) {
    data->GetFieldData()->AddArray(bodyNames);
  }
  vtkNew<vtkStringArray> names;
  names->SetName(MaterialNameName());
  vtkNew<vtkDoubleArray> numbers;
  numbers->SetName(MaterialPropertyName());
  numbers->SetNumberOfComponents(static_cast<int>(components.size()));
  numbers->SetNumberOfTuples(static_cast<vtkIdType>(surface.materials.size()));
  for (std::size_t j = 0; j < components.size(); ++j) {
    numbers->SetComponentName(static_cast<vtkIdType>(j), components[j].Name);
    for (std::size_t i = 0; i < surface.materials.size(); ++i) {
      numbers->SetComponent(static_cast<vtkIdType>(i), static_cast<int>(j), surface.materials[i].*components[j].Value);
    }
  }
  for (const Material& one : surface.materials) {
    names->InsertNextValue(one.name);
  }
  data->GetFieldData()->AddArray(names);
  data->GetFieldData()->AddArray(numbers);
}

//----------------------------------------------------------------------------
TissueSurface vtkUltrasoundTissue::Of(vtkPolyData* data)
{
  TissueSurface surface;
  surface.materials = MaterialsOf(data->GetFieldData());
  vtkDataArray* const bodyMaterial = data->GetFieldData()->GetArray(BodyMaterialName());
  const auto bodyNames = vtkStringArray::SafeDownCast(data->GetFieldData()->GetAbstractArray(BodyNameName()));
  if (bodyMaterial) {
    for (vtkIdType i = 0; i < bodyMaterial->GetNumberOfTuples(); ++i) {
      surface.bodies.push_back({bodyNames && i < bodyNames->GetNumberOfValues() ? std::string(bodyNames->GetValue(i)) : "",
                                WholeNumber(bodyMaterial->GetComponent(i, 0), BodyMaterialName())});
    }
  }

  surface.points.resize(static_cast<std::size_t>(data->GetNumberOfPoints()));
  for (std::size_t i = 0; i < surface.points.size(); ++i) {
    double point[3];
    data->GetPoint(static_cast<vtkIdType>(i), point);
    surface.points[i] = Eigen::Vector3d(point).cast<float>();
  }
  vtkDataArray* const body = data->GetCellData()->GetArray(BodyName());
  const vtkIdType polygons = data->GetNumberOfPolys(), strips = data->GetNumberOfStrips();
  if (polygons + strips > 0 && (!body || body->GetNumberOfTuples() != data->GetNumberOfCells())) {
    Refuse("has no cell data Body, which names the body of each triangle");
  }
  vtkIdType cell = data->GetNumberOfVerts() + data->GetNumberOfLines();
  const auto add = [&](vtkIdType a, vtkIdType b, vtkIdType c) {
    surface.triangles.push_back({static_cast<std::uint32_t>(a), static_cast<std::uint32_t>(b), static_cast<std::uint32_t>(c)});
    surface.bodyOfTriangle.push_back(WholeNumber(body->GetComponent(cell, 0), BodyName()));
  };
  surface.triangles.reserve(static_cast<std::size_t>(polygons));
  surface.bodyOfTriangle.reserve(static_cast<std::size_t>(polygons));
  vtkNew<vtkIdList> cut;
  vtkNew<vtkPoints> places;
  vtkIdType count;
  const vtkIdType* ids;
  for (auto cells = vtk::TakeSmartPointer(data->GetPolys()->NewIterator()); !cells->IsDoneWithTraversal();
       cells->GoToNextCell(), ++cell) {
    cells->GetCurrentCell(count, ids);
    if (count == 3) {
      add(ids[0], ids[1], ids[2]);
    } else if (count > 3) {
      vtkNew<vtkPolygon> polygon;
      polygon->Initialize(static_cast<int>(count), ids, data->GetPoints());
      polygon->Triangulate(0, cut, places);
      for (vtkIdType i = 0; i + 2 < cut->GetNumberOfIds(); i += 3) {
        add(cut->GetId(i), cut->GetId(i + 1), cut->GetId(i + 2));
      }
    }
  }
  for (auto cells = vtk::TakeSmartPointer(data->GetStrips()->NewIterator()); !cells->IsDoneWithTraversal();
       cells->GoToNextCell(), ++cell) {
    cells->GetCurrentCell(count, ids);
    for (vtkIdType i = 0; i + 2 < count; ++i) {
      add(ids[i], ids[i + 1 + i % 2], ids[i + 2 - i % 2]);
    }
  }
  surface.Check();
  return surface;
}
