// SPDX-License-Identifier: BSD-3-Clause
#include "vtkUltrasoundAcquisition.h"

#include "vtkDataObject.h"
#include "vtkDoubleArray.h"
#include "vtkFieldData.h"
#include "vtkMatrix4x4.h"
#include "vtkNew.h"
#include "vtkObjectFactory.h"
#include "vtkStringArray.h"
#include "vtkTypeUInt64Array.h"

vtkStandardNewMacro(vtkUltrasoundAcquisition);

namespace
{
constexpr double DegreesPerRadian = 57.29577951308232;

// The numbers of a field, or nothing when the field is missing, too short or not finite.
std::optional<std::vector<double>> NumbersOf(vtkDataObject* data, const char* name, int count)
{
  vtkDataArray* array = data && data->GetFieldData() ? data->GetFieldData()->GetArray(name) : nullptr;
  if (!array || array->GetNumberOfValues() != count)
  {
    return {};
  }
  std::vector<double> numbers(count);
  const int components = array->GetNumberOfComponents();
  for (int i = 0; i < count; ++i)
  {
    numbers[i] = array->GetComponent(i / components, i % components);
    if (!std::isfinite(numbers[i]))
    {
      return {};
    }
  }
  return numbers;
}

void SetNumbers(vtkDataObject* data, const char* name, const std::vector<double>& numbers, const char* const* components = nullptr)
{
  vtkNew<vtkDoubleArray> array;
  array->SetName(name);
  array->SetNumberOfComponents(static_cast<int>(numbers.size()));
  for (std::size_t i = 0; components && i < numbers.size(); ++i)
  {
    array->SetComponentName(static_cast<vtkIdType>(i), components[i]);
  }
  array->InsertNextTuple(numbers.data());
  data->GetFieldData()->AddArray(array); // replaces one of the same name
}
}

//----------------------------------------------------------------------------
std::vector<std::string> vtkUltrasoundAcquisition::Names()
{
  return { ProbeGeometryName(), ProbeToWorldName(), TimeStampName(), SeedName(), SceneName() };
}

//----------------------------------------------------------------------------
std::optional<echorama::ProbeGeometry> vtkUltrasoundAcquisition::ProbeGeometryOf(vtkDataObject* data)
{
  const auto n = NumbersOf(data, ProbeGeometryName(), 6);
  if (!n)
  {
    return {};
  }
  echorama::ProbeGeometry geometry;
  geometry.fanAngle = (*n)[0] / DegreesPerRadian;
  geometry.fanWidth = (*n)[1];
  geometry.sweepAngle = (*n)[2] / DegreesPerRadian;
  geometry.sweepWidth = (*n)[3];
  geometry.depthMin = (*n)[4];
  geometry.depthMax = (*n)[5];
  return geometry;
}

//----------------------------------------------------------------------------
void vtkUltrasoundAcquisition::SetProbeGeometry(vtkDataObject* data, const echorama::ProbeGeometry& g)
{
  static const char* const components[] = { "FanAngleDegrees", "FanWidthMm", "SweepAngleDegrees", "SweepWidthMm", "DepthMinMm",
    "DepthMaxMm" };
  SetNumbers(data, ProbeGeometryName(),
    { g.fanAngle * DegreesPerRadian, g.fanWidth, g.sweepAngle * DegreesPerRadian, g.sweepWidth, g.depthMin, g.depthMax }, components);
}

//----------------------------------------------------------------------------
std::optional<echorama::Pose> vtkUltrasoundAcquisition::ProbeToWorldOf(vtkDataObject* data)
{
  const auto n = NumbersOf(data, ProbeToWorldName(), 16);
  if (!n)
  {
    return {};
  }
  echorama::Pose pose;
  pose.matrix() = Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(n->data());
  return pose;
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAcquisition::GetProbeToWorld(vtkDataObject* data, vtkMatrix4x4* matrix)
{
  const auto pose = ProbeToWorldOf(data);
  if (!pose)
  {
    return false;
  }
  const Eigen::Matrix<double, 4, 4, Eigen::RowMajor> rows = pose->matrix();
  matrix->DeepCopy(rows.data());
  return true;
}

//----------------------------------------------------------------------------
void vtkUltrasoundAcquisition::SetProbeToWorld(vtkDataObject* data, const echorama::Pose& pose)
{
  const Eigen::Matrix<double, 4, 4, Eigen::RowMajor> rows = pose.matrix();
  SetNumbers(data, ProbeToWorldName(), std::vector<double>(rows.data(), rows.data() + 16));
}

//----------------------------------------------------------------------------
std::optional<double> vtkUltrasoundAcquisition::TimeStampOf(vtkDataObject* data)
{
  const auto n = NumbersOf(data, TimeStampName(), 1);
  return n ? std::optional<double>(n->front()) : std::nullopt;
}

//----------------------------------------------------------------------------
void vtkUltrasoundAcquisition::SetTimeStamp(vtkDataObject* data, double seconds)
{
  SetNumbers(data, TimeStampName(), { seconds });
}

//----------------------------------------------------------------------------
std::optional<std::uint64_t> vtkUltrasoundAcquisition::SeedOf(vtkDataObject* data)
{
  vtkDataArray* array = data && data->GetFieldData() ? data->GetFieldData()->GetArray(SeedName()) : nullptr;
  if (!array || array->GetNumberOfValues() != 1)
  {
    return {};
  }
  // Files may bring the seed back as another integer type; a double would lose bits beyond 2^53.
  return array->GetVariantValue(0).ToTypeUInt64();
}

//----------------------------------------------------------------------------
void vtkUltrasoundAcquisition::SetSeed(vtkDataObject* data, std::uint64_t seed)
{
  vtkNew<vtkTypeUInt64Array> array;
  array->SetName(SeedName());
  array->InsertNextValue(seed);
  data->GetFieldData()->AddArray(array);
}

//----------------------------------------------------------------------------
std::optional<std::string> vtkUltrasoundAcquisition::SceneOf(vtkDataObject* data)
{
  auto* array =
    vtkStringArray::SafeDownCast(data && data->GetFieldData() ? data->GetFieldData()->GetAbstractArray(SceneName()) : nullptr);
  return array && array->GetNumberOfValues() == 1 ? std::optional<std::string>(array->GetValue(0)) : std::nullopt;
}

//----------------------------------------------------------------------------
void vtkUltrasoundAcquisition::SetScene(vtkDataObject* data, const std::string& scene)
{
  vtkNew<vtkStringArray> array;
  array->SetName(SceneName());
  array->InsertNextValue(scene);
  data->GetFieldData()->AddArray(array);
}
