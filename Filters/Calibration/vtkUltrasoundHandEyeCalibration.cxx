// SPDX-License-Identifier: BSD-3-Clause
#include "vtkUltrasoundHandEyeCalibration.h"

#include "Core/Geometry/MatrixRows.h"
#include "Filters/Calibration/CalibrationJson.h"
#include "vtkCellArray.h"
#include "vtkDataSet.h"
#include "vtkDoubleArray.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkMatrix4x4.h"
#include "vtkNew.h"
#include "vtkObjectFactory.h"
#include "vtkPointData.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"
#include "vtkStringArray.h"
#include "vtkTable.h"
#include "vtkUltrasoundNewDataArray.h"
#include "vtkUltrasoundVolume.h"
#include "vtkUnsignedCharArray.h"

#include <map>

using echorama::Error;

vtkStandardNewMacro(vtkUltrasoundHandEyeCalibration);

vtkUltrasoundParametersMacro(vtkUltrasoundHandEyeCalibration);

namespace {
// The poses of one input, as they stand: the kernel checks them.
struct Side {
  std::vector<echorama::Pose> Poses;
  std::vector<std::string> Names; // empty when the input has none
};

Side SideOf(vtkDataObject* data, const std::string& arrayName, const std::string& nameArray, const char* what)
{
  const auto complain = [what](const std::string& reason) {
    throw Error(Error::Kind::BadInput, std::string("the input of ") + what + " " + reason);
  };
  vtkFieldData* arrays = nullptr;
  if (vtkDataSet* dataSet = vtkDataSet::SafeDownCast(data)) {
    arrays = dataSet->GetPointData();
  } else if (vtkTable* table = vtkTable::SafeDownCast(data)) {
    arrays = table->GetRowData();
  } else {
    complain("is neither a data set nor a table");
  }
  vtkDataArray* numbers = arrays->GetArray(arrayName.c_str());
  if (!numbers) {
    int candidates = 0;
    for (int i = 0; i < arrays->GetNumberOfArrays(); ++i) {
      vtkDataArray* array = arrays->GetArray(i);
      if (array && array->GetNumberOfComponents() == 16) {
        numbers = array;
        ++candidates;
      }
    }
    if (candidates != 1) {
      complain("has no array \"" + arrayName + "\", and " + std::to_string(candidates) + " others of 16 components");
    }
  }
  if (numbers->GetNumberOfComponents() != 16) {
    complain("has an array \"" + arrayName + "\" of " + std::to_string(numbers->GetNumberOfComponents()) +
             " components; 16 are needed, a matrix row by row");
  }
  Side side;
  for (vtkIdType i = 0; i < numbers->GetNumberOfTuples(); ++i) {
    double values[16];
    numbers->GetTuple(i, values);
    side.Poses.emplace_back(echorama::MatrixRows(values));
  }
  if (vtkStringArray* names = vtkStringArray::SafeDownCast(arrays->GetAbstractArray(nameArray.c_str()))) {
    if (names->GetNumberOfValues() != numbers->GetNumberOfTuples()) {
      complain("has " + std::to_string(names->GetNumberOfValues()) + " names in the array \"" + nameArray + "\" for " +
               std::to_string(numbers->GetNumberOfTuples()) + " poses");
    }
    for (vtkIdType i = 0; i < numbers->GetNumberOfTuples(); ++i) {
      side.Names.push_back(names->GetValue(i));
    }
  }
  return side;
}

// Row by row.
template <class Derived>
void AddField(vtkDataObject* data, const char* name, const Eigen::MatrixBase<Derived>& matrix)
{
  const Eigen::Matrix<double, Derived::RowsAtCompileTime, Derived::ColsAtCompileTime, Eigen::RowMajor> rows = matrix;
  vtkUltrasoundVolume::AddField(data, name, rows.data(), static_cast<int>(rows.size()));
}
} // namespace

//----------------------------------------------------------------------------
vtkUltrasoundHandEyeCalibration::vtkUltrasoundHandEyeCalibration()
{
  this->SetNumberOfInputPorts(2);
}

//----------------------------------------------------------------------------
vtkUltrasoundHandEyeCalibration::~vtkUltrasoundHandEyeCalibration() = default;

//----------------------------------------------------------------------------
int vtkUltrasoundHandEyeCalibration::FillInputPortInformation(int, vtkInformation* info)
{
  info->Set(INPUT_REQUIRED_DATA_TYPE(), "vtkDataSet");
  info->Append(INPUT_REQUIRED_DATA_TYPE(), "vtkTable");
  info->Set(INPUT_IS_OPTIONAL(), 1);
  return 1;
}

//----------------------------------------------------------------------------
void vtkUltrasoundHandEyeCalibration::AddPair(vtkMatrix4x4* sensorToTracker, vtkMatrix4x4* volumeToWorld, const std::string& name)
{
  if (!sensorToTracker || !volumeToWorld) {
    vtkErrorMacro("a pair is two matrices");
    return;
  }
  echorama::HandEyePair pair;
  pair.sensorToTracker = echorama::FromRows<echorama::Pose>(sensorToTracker->GetData());
  pair.volumeToWorld = echorama::FromRows<echorama::Pose>(volumeToWorld->GetData());
  pair.name = name;
  this->Pairs.push_back(pair);
  this->Modified();
}

//----------------------------------------------------------------------------
void vtkUltrasoundHandEyeCalibration::RemoveAllPairs()
{
  if (!this->Pairs.empty()) {
    this->Pairs.clear();
    this->Modified();
  }
}

//----------------------------------------------------------------------------
echorama::ParameterList vtkUltrasoundHandEyeCalibration::Parameters()
{
  using echorama::Parameter;
  const std::string other = " When it is not there, the only one of 16 components is taken.";
  return echorama::Join(
      {Describe(this->Values),
       {Parameter("SensorArray", this->SensorArray, "Name of the array of the sensor's poses." + other).Advanced(),
        Parameter("VolumeArray", this->VolumeArray, "Name of the array of the alignments." + other).Advanced(),
        Parameter(
            "NameArray", this->NameArray,
            "Name of the array of the scans' names. When both inputs have it, scans belong together by name, else by order.")
            .Advanced()}});
}

//----------------------------------------------------------------------------
std::vector<echorama::HandEyePair> vtkUltrasoundHandEyeCalibration::CollectPairs(vtkDataObject* sensors, vtkDataObject* volumes,
                                                                                 std::vector<std::string>& notes) const
{
  std::vector<echorama::HandEyePair> pairs = this->Pairs;
  if (!sensors && !volumes) {
    return pairs;
  }
  if (!sensors || !volumes) {
    throw Error(Error::Kind::BadInput, sensors ? "there are sensor poses but no alignments (input 1)"
                                               : "there are alignments (input 1) but no sensor poses (input 0)");
  }
  const Side s = SideOf(sensors, this->SensorArray, this->NameArray, "sensor poses");
  const Side m = SideOf(volumes, this->VolumeArray, this->NameArray, "alignments");
  if (!s.Names.empty() && !m.Names.empty()) {
    const auto numbersOf = [](const Side& side, const char* what) {
      std::map<std::string, std::size_t> numbers;
      for (std::size_t i = 0; i < side.Names.size(); ++i) {
        if (!numbers.emplace(side.Names[i], i).second) {
          throw Error(Error::Kind::BadInput, std::string("the input of ") + what + " names \"" + side.Names[i] + "\" twice");
        }
      }
      return numbers;
    };
    const auto sensorNumbers = numbersOf(s, "sensor poses"), volumeNumbers = numbersOf(m, "alignments");
    for (std::size_t i = 0; i < s.Names.size(); ++i) {
      const auto found = volumeNumbers.find(s.Names[i]);
      if (found == volumeNumbers.end()) {
        notes.push_back("Left out: " + s.Names[i] + " has a sensor pose and no alignment.");
      } else {
        pairs.push_back({s.Poses[i], m.Poses[found->second], s.Names[i]});
      }
    }
    for (const std::string& name : m.Names) {
      if (!sensorNumbers.count(name)) {
        notes.push_back("Left out: " + name + " has an alignment and no sensor pose.");
      }
    }
    return pairs;
  }
  if (s.Poses.size() != m.Poses.size()) {
    throw Error(Error::Kind::BadInput, "there are " + std::to_string(s.Poses.size()) + " sensor poses and " +
                                           std::to_string(m.Poses.size()) +
                                           " alignments; one of each is needed for every scan, or names (array \"" +
                                           this->NameArray + "\") on both sides");
  }
  const std::vector<std::string>& names = s.Names.empty() ? m.Names : s.Names;
  for (std::size_t i = 0; i < s.Poses.size(); ++i) {
    pairs.push_back({s.Poses[i], m.Poses[i], names.empty() ? "" : names[i]});
  }
  return pairs;
}

//----------------------------------------------------------------------------
int vtkUltrasoundHandEyeCalibration::RequestData(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  this->HasResult = false;
  this->Report.clear();
  return vtkUltrasoundVolume::Run(this, outputs, [this, inputs, outputs](const echorama::Progress& progress) {
    echorama::CheckRanges(this->Values);
    std::vector<std::string> notes;
    const auto pairs = this->CollectPairs(vtkDataObject::GetData(inputs[0]), vtkDataObject::GetData(inputs[1]), notes);
    this->Result = echorama::CalibrateHandEye(pairs, this->Values, progress);
    this->Result.notes.insert(this->Result.notes.begin(), notes.begin(), notes.end());
    this->PutOut(vtkPolyData::GetData(outputs), pairs);
    this->Report = echorama::Report(this->Result, this->Values.With(this->Result.noise));
    this->HasResult = true;
  });
}

//----------------------------------------------------------------------------
void vtkUltrasoundHandEyeCalibration::PutOut(vtkPolyData* output, const std::vector<echorama::HandEyePair>& pairs) const
{
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  vtkNew<vtkCellArray> vertices;
  vtkPointData* arrays = output->GetPointData();
  const auto residuals = echorama::NewDataArray<vtkDoubleArray>(arrays, "Residual", 3);
  const auto degrees = echorama::NewDataArray<vtkDoubleArray>(arrays, "ResidualDegrees");
  const auto inliers = echorama::NewDataArray<vtkUnsignedCharArray>(arrays, "Inlier");
  const auto names = echorama::NewDataArray<vtkStringArray>(arrays, "ScanName");
  const Eigen::Vector3d& target = this->Values.target;
  const echorama::HandEyeSolution& solution = this->Result.solution;
  const echorama::Pose trackerToWorld = solution.worldToTracker.inverse();
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const Eigen::Vector3d byAlignment = pairs[i].volumeToWorld * target;
    const Eigen::Vector3d byTracker = trackerToWorld * pairs[i].sensorToTracker * solution.volumeToSensor * target;
    const vtkIdType id = points->InsertNextPoint(byAlignment.data());
    vertices->InsertNextCell(1, &id);
    residuals->InsertNextTuple(Eigen::Vector3d(byTracker - byAlignment).data());
    degrees->InsertNextValue(this->Result.residuals[i].degrees);
    inliers->InsertNextValue(this->Result.residuals[i].inlier ? 1 : 0);
    names->InsertNextValue(this->Result.residuals[i].name);
  }
  output->SetPoints(points);
  output->SetVerts(vertices);
  arrays->SetActiveVectors("Residual");
  arrays->SetActiveScalars("Inlier");
  AddField(output, "VolumeToSensor", solution.volumeToSensor.matrix());
  AddField(output, "WorldToTracker", solution.worldToTracker.matrix());
  AddField(output, "Covariance", this->Result.covariance);
  AddField(output, "TargetCovariance", this->Result.targetCovariance);
  vtkUltrasoundVolume::AddField(output, "TargetRadius95", &this->Result.targetRadius95Mm, 1);
}

//----------------------------------------------------------------------------
bool vtkUltrasoundHandEyeCalibration::GetFound(const echorama::Pose& found, vtkMatrix4x4* pose) const
{
  if (!this->HasResult || !pose) {
    return false;
  }
  pose->DeepCopy(echorama::MatrixRows(found.matrix()).data());
  return true;
}

//----------------------------------------------------------------------------
void vtkUltrasoundHandEyeCalibration::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "Pairs: " << this->Pairs.size() << "\n";
  vtkUltrasoundParameters::Print(os, indent, this->Parameters());
  os << indent << "TargetRadius95: " << this->GetTargetRadius95() << "\n";
}
