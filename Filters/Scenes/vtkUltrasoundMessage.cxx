// SPDX-License-Identifier: BSD-3-Clause
#include "vtkUltrasoundMessage.h"

#include "vtkCellArray.h"
#include "vtkCellData.h"
#include "vtkIdTypeArray.h"
#include "vtkImageData.h"
#include "vtkInformation.h"
#include "vtkMultiBlockDataSet.h"
#include "vtkNew.h"
#include "vtkPointData.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"
#include "vtkStringArray.h"
#include "vtkUltrasoundVolume.h"

using echorama::Error;
using echorama::Packed;
using echorama::Unpacked;

namespace {

enum class Kind : char { Nothing, Image, Surface, Blocks };

std::string TextOf(const char* text)
{
  return text ? text : "";
}

void PackArray(Packed& to, vtkAbstractArray* array)
{
  to(TextOf(array->GetName()), array->GetDataType(), array->GetNumberOfComponents(), array->GetNumberOfTuples());
  for (int n = 0; n < array->GetNumberOfComponents(); ++n) {
    to(TextOf(array->GetComponentName(n)));
  }
  if (auto* texts = vtkStringArray::SafeDownCast(array)) {
    for (vtkIdType i = 0; i < texts->GetNumberOfValues(); ++i) {
      to(static_cast<const std::string&>(texts->GetValue(i)));
    }
  } else if (auto* numbers = vtkDataArray::SafeDownCast(array)) {
    to(std::string(static_cast<const char*>(numbers->GetVoidPointer(0)),
                   static_cast<std::size_t>(numbers->GetDataSize() * numbers->GetDataTypeSize())));
  } else {
    throw Error(Error::Kind::NotPossible,
                std::string("arrays of the class ") + array->GetClassName() + " cannot be sent to other ranks");
  }
}

vtkSmartPointer<vtkAbstractArray> UnpackArray(Unpacked& from)
{
  std::string name, bytes;
  int type = 0, components = 0;
  vtkIdType tuples = 0;
  from(name, type, components, tuples);
  const auto array = vtkSmartPointer<vtkAbstractArray>::Take(vtkAbstractArray::CreateArray(type));
  array->SetName(name.c_str());
  array->SetNumberOfComponents(components);
  array->SetNumberOfTuples(tuples);
  for (int n = 0; n < components; ++n) {
    from(name);
    if (!name.empty()) {
      array->SetComponentName(n, name.c_str());
    }
  }
  if (auto* texts = vtkStringArray::SafeDownCast(array)) {
    for (vtkIdType i = 0; i < texts->GetNumberOfValues(); ++i) {
      from(bytes);
      texts->SetValue(i, bytes);
    }
  } else {
    from(bytes);
    bytes.copy(static_cast<char*>(array->GetVoidPointer(0)), bytes.size());
  }
  return array;
}

void PackArrays(Packed& to, vtkFieldData* fields)
{
  to(fields->GetNumberOfArrays());
  for (int n = 0; n < fields->GetNumberOfArrays(); ++n) {
    PackArray(to, fields->GetAbstractArray(n));
  }
  if (auto* attributes = vtkDataSetAttributes::SafeDownCast(fields)) {
    int active[vtkDataSetAttributes::NUM_ATTRIBUTES]; // which array is the scalars, which the vectors ...
    attributes->GetAttributeIndices(active);
    for (const int index : active) {
      to(index);
    }
  }
}

void UnpackArrays(Unpacked& from, vtkFieldData* fields)
{
  int count = 0;
  for (from(count); count > 0; --count) {
    fields->AddArray(UnpackArray(from));
  }
  if (auto* attributes = vtkDataSetAttributes::SafeDownCast(fields)) {
    for (int type = 0; type < vtkDataSetAttributes::NUM_ATTRIBUTES; ++type) {
      int index = -1;
      from(index);
      attributes->SetActiveAttribute(index, type);
    }
  }
}

void PackCells(Packed& to, vtkCellArray* cells)
{
  for (vtkDataArray* numbers : {cells->GetOffsetsArray(), cells->GetConnectivityArray()}) {
    vtkNew<vtkIdTypeArray> ids; // however wide they are kept
    ids->DeepCopy(numbers);
    PackArray(to, ids);
  }
}

vtkSmartPointer<vtkCellArray> UnpackCells(Unpacked& from)
{
  const auto offsets = UnpackArray(from), ids = UnpackArray(from);
  const auto cells = vtkSmartPointer<vtkCellArray>::New();
  cells->SetData(vtkIdTypeArray::SafeDownCast(offsets), vtkIdTypeArray::SafeDownCast(ids));
  return cells;
}

void PackDataSet(Packed& to, vtkDataSet* data)
{
  for (vtkFieldData* fields : {static_cast<vtkFieldData*>(data->GetPointData()), static_cast<vtkFieldData*>(data->GetCellData()),
                               data->GetFieldData()}) {
    PackArrays(to, fields);
  }
}

void UnpackDataSet(Unpacked& from, vtkDataSet* data)
{
  for (vtkFieldData* fields : {static_cast<vtkFieldData*>(data->GetPointData()), static_cast<vtkFieldData*>(data->GetCellData()),
                               data->GetFieldData()}) {
    UnpackArrays(from, fields);
  }
}

} // namespace

//----------------------------------------------------------------------------
void vtkUltrasoundMessage::Pack(Packed& to, vtkDataObject* data)
{
  if (!data) {
    to(Kind::Nothing);
  } else if (auto* image = vtkImageData::SafeDownCast(data)) {
    to(Kind::Image, vtkUltrasoundVolume::GeometryOf(image));
    PackDataSet(to, image);
  } else if (auto* surface = vtkPolyData::SafeDownCast(data)) {
    const bool hasPoints = surface->GetPoints() != nullptr;
    to(Kind::Surface, hasPoints);
    if (hasPoints) {
      PackArray(to, surface->GetPoints()->GetData());
    }
    for (vtkCellArray* cells : {surface->GetVerts(), surface->GetLines(), surface->GetPolys(), surface->GetStrips()}) {
      PackCells(to, cells);
    }
    PackDataSet(to, surface);
  } else if (auto* blocks = vtkMultiBlockDataSet::SafeDownCast(data)) {
    to(Kind::Blocks, blocks->GetNumberOfBlocks());
    for (unsigned int n = 0; n < blocks->GetNumberOfBlocks(); ++n) {
      to(TextOf(blocks->HasMetaData(n) ? blocks->GetMetaData(n)->Get(vtkCompositeDataSet::NAME()) : nullptr));
      Pack(to, blocks->GetBlock(n));
    }
  } else {
    throw Error(Error::Kind::NotPossible,
                std::string("data of the class ") + data->GetClassName() + " cannot be sent to other ranks");
  }
}

//----------------------------------------------------------------------------
vtkSmartPointer<vtkDataObject> vtkUltrasoundMessage::Unpack(Unpacked& from)
{
  auto kind = Kind::Nothing;
  from(kind);
  if (kind == Kind::Image) {
    const auto image = vtkSmartPointer<vtkImageData>::New();
    echorama::ImageGeometry geometry;
    from(geometry);
    vtkUltrasoundVolume::SetGeometry(image, geometry);
    UnpackDataSet(from, image);
    return image;
  }
  if (kind == Kind::Surface) {
    const auto surface = vtkSmartPointer<vtkPolyData>::New();
    bool hasPoints = false;
    from(hasPoints);
    if (hasPoints) {
      const auto numbers = UnpackArray(from);
      vtkNew<vtkPoints> points;
      points->SetData(vtkDataArray::SafeDownCast(numbers));
      surface->SetPoints(points);
    }
    surface->SetVerts(UnpackCells(from));
    surface->SetLines(UnpackCells(from));
    surface->SetPolys(UnpackCells(from));
    surface->SetStrips(UnpackCells(from));
    UnpackDataSet(from, surface);
    return surface;
  }
  if (kind == Kind::Blocks) {
    const auto blocks = vtkSmartPointer<vtkMultiBlockDataSet>::New();
    unsigned int count = 0;
    from(count);
    for (unsigned int n = 0; n < count; ++n) {
      std::string name;
      from(name);
      blocks->SetBlock(n, Unpack(from));
      blocks->GetMetaData(n)->Set(vtkCompositeDataSet::NAME(), name.c_str());
    }
    return blocks;
  }
  return nullptr;
}
