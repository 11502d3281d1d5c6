// SPDX-License-Identifier: BSD-3-Clause
#include "vtkUltrasoundAcquisition.h"

#include "Core/Base/Angles.h"
#include "Core/Base/Error.h"
#include "Core/Base/NumberText.h"
#include "Core/Geometry/MatrixRows.h"

#include "vtkDataObject.h"
#include "vtkDoubleArray.h"
#include "vtkFieldData.h"
#include "vtkInformationVector.h"
#include "vtkMatrix4x4.h"
#include "vtkNew.h"
#include "vtkObjectFactory.h"
#include "vtkStringArray.h"
#include "vtkTypeUInt64Array.h"

#include <sstream>

vtkStandardNewMacro(vtkUltrasoundAcquisition);

namespace {
const char* const ProbeGeometryComponents[] = {"FanAngleDegrees", "FanWidthMm", "SweepAngleDegrees", "SweepWidthMm",
                                               "DepthMinMm",      "DepthMaxMm", "FanOffset"};

// The numbers of a field, or nothing when the field is missing, too short or not finite.
std::optional<std::vector<double>> NumbersOf(vtkDataObject* data, const char* name, int count)
{
  vtkDataArray* array = data && data->GetFieldData() ? data->GetFieldData()->GetArray(name) : nullptr;
  if (!array || array->GetNumberOfValues() != count) {
    return {};
  }
  std::vector<double> numbers(count);
  const int components = array->GetNumberOfComponents();
  for (int i = 0; i < count; ++i) {
    numbers[i] = array->GetComponent(i / components, i % components);
    if (!std::isfinite(numbers[i])) {
      return {};
    }
  }
  return numbers;
}

void SetNumbers(vtkDataObject* data, const char* name, const std::vector<double>& numbers,
                const char* const* components = nullptr)
{
  vtkNew<vtkDoubleArray> array;
  array->SetName(name);
  array->SetNumberOfComponents(static_cast<int>(numbers.size()));
  for (std::size_t i = 0; components && i < numbers.size(); ++i) {
    array->SetComponentName(static_cast<vtkIdType>(i), components[i]);
  }
  array->InsertNextTuple(numbers.data());
  data->GetFieldData()->AddArray(array); // replaces one of the same name
}

template <class Transform>
std::optional<Transform> MatrixOf(vtkDataObject* data, const char* name)
{
  const auto n = NumbersOf(data, name, 16);
  if (!n) {
    return {};
  }
  return echorama::FromRows<Transform>(n->data());
}

void SetMatrix(vtkDataObject* data, const char* name, const Eigen::Matrix4d& matrix)
{
  const echorama::MatrixRows rows = matrix;
  SetNumbers(data, name, std::vector<double>(rows.data(), rows.data() + 16));
}

// A string in quotes, on one line.
std::string Quoted(const std::string& plain)
{
  std::string text = "\"";
  for (const char c : plain) {
    text += c == '\n' ? "\\n" : c == '\r' ? "\\r" : c == '\\' ? "\\\\" : std::string(1, c);
  }
  return text + "\"";
}

std::optional<std::string> Unquoted(const std::string& text)
{
  if (text.size() < 2 || text.front() != '"' || text.back() != '"') {
    return {};
  }
  std::string plain;
  for (std::size_t i = 1; i + 1 < text.size(); ++i) {
    if (text[i] != '\\') {
      plain += text[i];
      continue;
    }
    if (++i + 1 >= text.size()) {
      return {};
    }
    plain += text[i] == 'n' ? '\n' : text[i] == 'r' ? '\r' : text[i];
  }
  return plain;
}
} // namespace

//----------------------------------------------------------------------------
std::vector<std::string> vtkUltrasoundAcquisition::Names()
{
  return {ProbeGeometryName(), ProbeToWorldName(), ImageToWorldName(), TimeStampName(), SeedName(), SceneName()};
}

//----------------------------------------------------------------------------
std::optional<echorama::ProbeGeometry> vtkUltrasoundAcquisition::ProbeGeometryOf(vtkDataObject* data)
{
  auto n = NumbersOf(data, ProbeGeometryName(), 6);
  if (!n) {
    n = NumbersOf(data, ProbeGeometryName(), 7);
  }
  if (!n) {
    return {};
  }
  echorama::ProbeGeometry geometry;
  geometry.fanAngle = (*n)[0] / echorama::DegreesPerRadian;
  geometry.fanWidth = (*n)[1];
  geometry.sweepAngle = (*n)[2] / echorama::DegreesPerRadian;
  geometry.sweepWidth = (*n)[3];
  geometry.depthMin = (*n)[4];
  geometry.depthMax = (*n)[5];
  geometry.fanOffset = n->size() > 6 ? (*n)[6] : 0.0;
  return geometry;
}

//----------------------------------------------------------------------------
void vtkUltrasoundAcquisition::SetProbeGeometry(vtkDataObject* data, const echorama::ProbeGeometry& g)
{
  std::vector<double> numbers{g.fanAngle * echorama::DegreesPerRadian,
                              g.fanWidth,
                              g.sweepAngle * echorama::DegreesPerRadian,
                              g.sweepWidth,
                              g.depthMin,
                              g.depthMax};
  if (g.fanOffset != 0.0) {
    numbers.push_back(g.fanOffset);
  }
  SetNumbers(data, ProbeGeometryName(), numbers, ProbeGeometryComponents);
}

//----------------------------------------------------------------------------
std::optional<echorama::Pose> vtkUltrasoundAcquisition::ProbeToWorldOf(vtkDataObject* data)
{
  return MatrixOf<echorama::Pose>(data, ProbeToWorldName());
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAcquisition::GetProbeToWorld(vtkDataObject* data, vtkMatrix4x4* matrix)
{
  const auto pose = ProbeToWorldOf(data);
  if (!pose) {
    return false;
  }
  matrix->DeepCopy(echorama::MatrixRows(pose->matrix()).data());
  return true;
}

//----------------------------------------------------------------------------
void vtkUltrasoundAcquisition::SetProbeToWorld(vtkDataObject* data, const echorama::Pose& pose)
{
  SetMatrix(data, ProbeToWorldName(), pose.matrix());
}

//----------------------------------------------------------------------------
std::vector<echorama::PlacedProbe> vtkUltrasoundAcquisition::ProbesOf(vtkInformationVector* port)
{
  std::vector<echorama::PlacedProbe> probes;
  for (int number = 0; number < port->GetNumberOfInformationObjects(); ++number) {
    vtkDataObject* data = vtkDataObject::GetData(port, number);
    const auto geometry = data ? ProbeGeometryOf(data) : std::nullopt;
    if (!geometry) {
      throw echorama::Error(echorama::Error::Kind::BadInput, "probe " + std::to_string(number + 1) + " has no field data " +
                                                                 ProbeGeometryName() + " of 6 or 7 finite numbers");
    }
    probes.push_back({*geometry, ProbeToWorldOf(data).value_or(echorama::Pose::Identity())});
  }
  return probes;
}

//----------------------------------------------------------------------------
std::optional<Eigen::Affine3d> vtkUltrasoundAcquisition::ImageToWorldOf(vtkDataObject* data)
{
  return MatrixOf<Eigen::Affine3d>(data, ImageToWorldName());
}

//----------------------------------------------------------------------------
void vtkUltrasoundAcquisition::SetImageToWorld(vtkDataObject* data, const Eigen::Affine3d& imageToWorld)
{
  SetMatrix(data, ImageToWorldName(), imageToWorld.matrix());
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
  SetNumbers(data, TimeStampName(), {seconds});
}

//----------------------------------------------------------------------------
std::optional<std::uint64_t> vtkUltrasoundAcquisition::SeedOf(vtkDataObject* data)
{
  vtkDataArray* array = data && data->GetFieldData() ? data->GetFieldData()->GetArray(SeedName()) : nullptr;
  if (!array || array->GetNumberOfValues() != 1) {
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

//----------------------------------------------------------------------------
std::vector<std::pair<std::string, std::string>> vtkUltrasoundAcquisition::ToText(vtkDataObject* data)
{
  std::vector<std::pair<std::string, std::string>> texts;
  for (const char* name : {ProbeGeometryName(), ProbeToWorldName(), ImageToWorldName(), TimeStampName()}) {
    vtkDataArray* array = data->GetFieldData()->GetArray(name);
    std::string text;
    for (vtkIdType i = 0; array && i < array->GetNumberOfValues(); ++i) {
      const int components = array->GetNumberOfComponents();
      text += (i ? " " : "") + echorama::NumberText(array->GetComponent(i / components, static_cast<int>(i % components)));
    }
    if (array) {
      texts.emplace_back(name, text);
    }
  }
  if (const auto seed = SeedOf(data)) {
    texts.emplace_back(SeedName(), echorama::NumberText(*seed));
  }
  if (const auto scene = SceneOf(data)) {
    texts.emplace_back(SceneName(), Quoted(*scene));
  }
  return texts;
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAcquisition::SetFromText(vtkDataObject* data, const std::string& name, const std::string& text)
{
  std::uint64_t seed = 0;
  if (name == SeedName()) {
    const bool good = echorama::ParseNumber(text, seed);
    if (good) {
      SetSeed(data, seed);
    }
    return good;
  }
  if (name == SceneName()) {
    const auto scene = Unquoted(text);
    if (scene) {
      SetScene(data, *scene);
    }
    return scene.has_value();
  }

  std::vector<double> numbers;
  std::istringstream words(text);
  for (std::string word; words >> word;) {
    numbers.push_back(0.0);
    if (!echorama::ParseNumber(word, numbers.back()) || !std::isfinite(numbers.back())) {
      return false;
    }
  }
  const bool matrix = name == ProbeToWorldName() || name == ImageToWorldName();
  const bool offset = name == ProbeGeometryName() && numbers.size() == 7;
  const std::size_t wanted = name == ProbeGeometryName() ? (offset ? 7 : 6) : matrix ? 16 : name == TimeStampName() ? 1 : 0;
  if (wanted == 0 || numbers.size() != wanted) {
    return false;
  }
  SetNumbers(data, name.c_str(), numbers, name == ProbeGeometryName() ? ProbeGeometryComponents : nullptr);
  return true;
}
