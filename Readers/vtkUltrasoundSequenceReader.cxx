// SPDX-License-Identifier: BSD-3-Clause
#include "vtkUltrasoundSequenceReader.h"

#include "Core/Base/JoinedText.h"
#include "Core/Base/NumberText.h"
#include "Core/Geometry/MatrixRows.h"
#include "Core/Geometry/TransformFile.h"
#include "Readers/SequenceFile.h"
#include "Readers/SequencePoses.h"

#include "vtkCellArray.h"
#include "vtkDoubleArray.h"
#include "vtkFieldData.h"
#include "vtkImageData.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkIntArray.h"
#include "vtkNew.h"
#include "vtkObjectFactory.h"
#include "vtkPointData.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"
#include "vtkSmartPointer.h"
#include "vtkStreamingDemandDrivenPipeline.h"
#include "vtkStringArray.h"
#include "vtkUltrasoundAcquisition.h"
#include "vtkUltrasoundVoxelTypes.h"
#include "vtkUnsignedCharArray.h"

#include <algorithm>
#include <cmath>
#include <filesystem>

using echorama::Error;
using echorama::SequenceContent;
using echorama::SequenceFile;
using echorama::SequenceFrame;
using echorama::SequencePoses;
using echorama::SequenceTransform;
using echorama::TransformStatus;

vtkStandardNewMacro(vtkUltrasoundSequenceReader);

vtkUltrasoundParametersMacro(vtkUltrasoundSequenceReader);

namespace {
std::string TextOf(const char* text)
{
  return text ? text : "";
}

void InsertMatrix(vtkDoubleArray* array, const Eigen::Affine3d& matrix)
{
  array->InsertNextTuple(echorama::MatrixRows(matrix.matrix()).data());
}

vtkSmartPointer<vtkDoubleArray> NewMatrices(const std::string& name)
{
  auto array = vtkSmartPointer<vtkDoubleArray>::New();
  array->SetName(name.c_str());
  array->SetNumberOfComponents(16);
  return array;
}

// What tells a file from an earlier one of the same name.
std::string StampOf(const std::string& path)
{
  std::error_code ignored;
  return path + "|" + std::to_string(std::filesystem::file_size(path, ignored)) + "|" +
         std::to_string(std::filesystem::last_write_time(path, ignored).time_since_epoch().count());
}
} // namespace

// A file that is open, with its poses.
struct vtkUltrasoundSequenceReader::Sequence {
  std::string Stamp; // of all that it was made from
  SequenceFile File;
  SequencePoses Poses;
  std::vector<double> Times;
  std::vector<std::string> Notes;

  Sequence(const std::string& stamp, const std::string& path, const std::string& transforms, const std::string& image,
           const std::string& world)
    : Stamp(stamp), File(path),
      Poses(File.Content(), transforms.empty() ? std::vector<echorama::NamedTransform>() : echorama::ReadTransforms(transforms),
            image, world),
      Notes(File.Content().notes)
  {
    const SequenceContent& content = File.Content();
    if (content.components == 2) {
      throw Error(Error::Kind::BadFile, path + ": it has 2 numbers per pixel; one, or colours, are needed");
    }
    if (content.components > 1) {
      Notes.push_back("colours were turned into grey");
    }
    bool increasing = true;
    for (int i = 0; i < content.frames; ++i) {
      Times.push_back(File.Time(i));
      increasing = increasing && std::isfinite(Times.back()) && (i == 0 || Times[Times.size() - 2] < Times.back());
    }
    if (!increasing) {
      for (int i = 0; i < content.frames; ++i) {
        Times[static_cast<std::size_t>(i)] = i;
      }
      Notes.push_back("the time steps are indices of frames: the file has no time stamps that increase from frame to frame");
    }
    if (content.HasImages() && !Poses.ImageIsPlaced()) {
      Notes.push_back("the images are not placed: no transforms lead from " + Poses.Image() +
                      (Poses.World().empty() ? std::string(" anywhere") : " to " + Poses.World()) +
                      " (a TransformFile may hold what is missing)");
    }
  }

  // The frame nearest in time.
  int IndexOf(double time) const
  {
    const auto after = std::lower_bound(Times.begin(), Times.end(), time);
    if (after == Times.begin()) {
      return 0;
    }
    const auto before = after - 1;
    return static_cast<int>((after == Times.end() || time - *before <= *after - time ? before : after) - Times.begin());
  }

  // Where a frame of coordinates lies at the moment; nothing when that is not known.
  std::optional<Eigen::Affine3d> PoseOf(const std::string& frame) const
  {
    const echorama::ComposedTransform found = Poses.Find(frame);
    if (found.status != TransformStatus::Valid || !found.matrix.matrix().allFinite()) {
      return {};
    }
    return found.matrix;
  }

  // The grid of a frame: where the image lies, else where the header puts it.
  echorama::ImageGeometry GridOf(const std::optional<Eigen::Affine3d>& pose) const
  {
    const SequenceContent& content = File.Content();
    try {
      return pose ? echorama::FrameGeometry(*pose, content.dimensions) : content.geometry;
    } catch (const Error& error) {
      throw Error(error.GetKind(), content.path + ": " + Poses.Image() + "To" + Poses.World() + ": " + error.what());
    }
  }
};

//----------------------------------------------------------------------------
vtkUltrasoundSequenceReader::vtkUltrasoundSequenceReader()
{
  this->SetNumberOfInputPorts(0);
  this->SetNumberOfOutputPorts(2);
}

//----------------------------------------------------------------------------
vtkUltrasoundSequenceReader::~vtkUltrasoundSequenceReader()
{
  this->SetFileName(nullptr);
  this->SetTransformFile(nullptr);
}

//----------------------------------------------------------------------------
echorama::ParameterList vtkUltrasoundSequenceReader::Parameters()
{
  using echorama::Parameter;
  return {
      Parameter(
          "WorldFrame", this->WorldFrame,
          "The frame of coordinates that is the world. Empty takes the first of Reference, World and Tracker that transforms "
          "lead to from the image (from anything, when none begins at the image), else the only frame that transforms lead "
          "to and none leads from; where that leaves a choice, it has to be made here."),
      Parameter("ImageFrame", this->ImageFrame, "The frame of coordinates that counts pixels.").Advanced(),
      Parameter("ToolFrame", this->ToolFrame,
                "Whose track output 1 is: a frame of coordinates. Empty takes the image where it can be placed, else every frame "
                "that a transform of the file begins at and that can be placed.")
          .Advanced()};
}

//----------------------------------------------------------------------------
void vtkUltrasoundSequenceReader::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "FileName: " << (this->FileName ? this->FileName : "(none)") << "\n";
  os << indent << "TransformFile: " << (this->TransformFile ? this->TransformFile : "(none)") << "\n";
  vtkUltrasoundParameters::Print(os, indent, this->Parameters());
  os << indent << "NumberOfFrames: " << this->GetNumberOfFrames() << "\n";
  os << indent << "Notes: " << this->GetNotes() << "\n";
}

//----------------------------------------------------------------------------
int vtkUltrasoundSequenceReader::CanReadFile(const char* fileName)
{
  return fileName && echorama::LooksLikeSequence(fileName) ? 1 : 0;
}

//----------------------------------------------------------------------------
int vtkUltrasoundSequenceReader::GetNumberOfFrames() const
{
  return this->Opened ? this->Opened->File.Content().frames : 0;
}

//----------------------------------------------------------------------------
std::string vtkUltrasoundSequenceReader::GetCoordinateFrames() const
{
  return this->Opened ? echorama::Joined(this->Opened->Poses.Frames()) : "";
}

//----------------------------------------------------------------------------
std::string vtkUltrasoundSequenceReader::GetWorldFrameInUse() const
{
  return this->Opened ? this->Opened->Poses.World() : "";
}

//----------------------------------------------------------------------------
std::string vtkUltrasoundSequenceReader::GetNotes() const
{
  return this->Opened ? echorama::Joined(this->Opened->Notes, "\n") : "";
}

//----------------------------------------------------------------------------
int vtkUltrasoundSequenceReader::FillOutputPortInformation(int port, vtkInformation* information)
{
  information->Set(vtkDataObject::DATA_TYPE_NAME(), port == 0 ? "vtkImageData" : "vtkPolyData");
  return 1;
}

//----------------------------------------------------------------------------
vtkUltrasoundSequenceReader::Sequence& vtkUltrasoundSequenceReader::Open()
{
  const std::string path = TextOf(this->FileName), transforms = TextOf(this->TransformFile);
  const std::string &image = this->ImageFrame, &world = this->WorldFrame;
  const std::string stamp = StampOf(path) + "|" + StampOf(transforms) + "|" + image + "|" + world;
  if (!this->Opened || this->Opened->Stamp != stamp) {
    this->Opened.reset();
    this->Opened = std::make_unique<Sequence>(stamp, path, transforms, image, world);
  }
  return *this->Opened;
}

//----------------------------------------------------------------------------
int vtkUltrasoundSequenceReader::ProcessRequest(vtkInformation* request, vtkInformationVector** inputs,
                                                vtkInformationVector* outputs)
{
  // The output that nobody asks for now is made when somebody does.
  if (request->Has(vtkDemandDrivenPipeline::REQUEST_DATA_NOT_GENERATED())) {
    const int asked = request->Get(vtkExecutive::FROM_OUTPUT_PORT());
    if (asked >= 0) {
      outputs->GetInformationObject(1 - asked)->Set(vtkDemandDrivenPipeline::DATA_NOT_GENERATED(), 1);
    }
    return 1;
  }
  return this->Superclass::ProcessRequest(request, inputs, outputs);
}

//----------------------------------------------------------------------------
int vtkUltrasoundSequenceReader::RequestInformation(vtkInformation*, vtkInformationVector**, vtkInformationVector* outputs)
{
  return vtkUltrasoundVolume::Run(this, nullptr, [this, outputs](const echorama::Progress&) {
    vtkInformation* out = outputs->GetInformationObject(0);
    out->Remove(vtkStreamingDemandDrivenPipeline::TIME_STEPS());
    out->Remove(vtkStreamingDemandDrivenPipeline::TIME_RANGE());
    Sequence& sequence = this->Open();
    const SequenceContent& content = sequence.File.Content();
    if (content.HasImages()) {
      sequence.Poses.MoveTo(sequence.File.Frame(0));
      const auto pose = sequence.Poses.ImageIsPlaced() ? sequence.PoseOf(sequence.Poses.Image()) : std::nullopt;
      vtkUltrasoundVolume::SetGeometry(out, sequence.GridOf(pose));
      vtkDataObject::SetPointDataActiveScalarInfo(out, echorama::VtkTypeOf(content.type), 1);
    } else {
      const int nothing[6] = {0, -1, 0, -1, 0, -1};
      out->Set(vtkStreamingDemandDrivenPipeline::WHOLE_EXTENT(), nothing, 6);
    }
    const double range[2] = {sequence.Times.front(), sequence.Times.back()};
    out->Set(vtkStreamingDemandDrivenPipeline::TIME_STEPS(), sequence.Times.data(), content.frames);
    out->Set(vtkStreamingDemandDrivenPipeline::TIME_RANGE(), range, 2);
  });
}

//----------------------------------------------------------------------------
int vtkUltrasoundSequenceReader::RequestData(vtkInformation* request, vtkInformationVector** inputs,
                                             vtkInformationVector* outputs)
{
  const int asked = request->Get(vtkExecutive::FROM_OUTPUT_PORT());
  if (asked != 1) {
    vtkInformation* out = outputs->GetInformationObject(0);
    this->RequestedTime = out->Has(vtkStreamingDemandDrivenPipeline::UPDATE_TIME_STEP())
                              ? out->Get(vtkStreamingDemandDrivenPipeline::UPDATE_TIME_STEP())
                              : -VTK_DOUBLE_MAX;
    if (!this->Superclass::RequestData(request, inputs, outputs)) {
      return 0;
    }
  }
  if (asked == 0) {
    return 1;
  }
  vtkPolyData* track = vtkPolyData::GetData(outputs, 1);
  const int finished = vtkUltrasoundVolume::Run(
      this, nullptr, [this, track](const echorama::Progress& progress) { this->MakeTrack(track, progress); });
  if (!finished) {
    track->Initialize();
  }
  return finished;
}

//----------------------------------------------------------------------------
void vtkUltrasoundSequenceReader::Execute(vtkInformationVector**, vtkImageData* output, const echorama::Progress& progress)
{
  const Sequence& sequence = this->Open();
  const int index = sequence.IndexOf(this->RequestedTime);
  this->ReadFrame(index, output, progress);
  output->GetInformation()->Set(vtkDataObject::DATA_TIME_STEP(), sequence.Times[static_cast<std::size_t>(index)]);
}

//----------------------------------------------------------------------------
void vtkUltrasoundSequenceReader::ReadFrame(int index, vtkImageData* output, const echorama::Progress& progress)
{
  Sequence& sequence = this->Open();
  const SequenceContent& content = sequence.File.Content();
  const SequenceFrame frame = sequence.File.Frame(index);
  output->Initialize();

  std::optional<Eigen::Affine3d> pose;
  if (sequence.Poses.ImageIsPlaced()) {
    sequence.Poses.MoveTo(frame);
    pose = sequence.PoseOf(sequence.Poses.Image());
    vtkUltrasoundVolume::AddField(output, "WorldFrame", sequence.Poses.World());
  }
  if (content.HasImages()) {
    vtkUltrasoundVolume::SetGeometry(output, sequence.GridOf(pose));
    vtkDataArray* intensity = AddArray(output, vtkUltrasoundVolume::IntensityName(), echorama::VtkTypeOf(content.type));
    if (content.components == 1) {
      sequence.File.ReadFrame(index, intensity->GetVoidPointer(0), progress);
    } else {
      std::vector<char> colours(content.FrameBytes());
      sequence.File.ReadFrame(index, colours.data(), progress);
      echorama::DispatchVoxelType(content.type, [&](auto zero) {
        using T = decltype(zero);
        echorama::MakeGrey(reinterpret_cast<const T*>(colours.data()), content.components,
                           static_cast<T*>(intensity->GetVoidPointer(0)), intensity->GetNumberOfTuples());
      });
    }
    output->GetPointData()->SetActiveScalars(vtkUltrasoundVolume::IntensityName());
    AddArray(output, vtkUltrasoundVolume::ValidRegionName(), VTK_UNSIGNED_CHAR)->Fill(frame.imageValid ? 1.0 : 0.0);
  }

  if (pose) {
    vtkUltrasoundAcquisition::SetImageToWorld(output, *pose);
  }
  if (!std::isnan(frame.time)) {
    vtkUltrasoundAcquisition::SetTimeStamp(output, frame.time);
  }
  const vtkNew<vtkIntArray> number;
  number->SetName("FrameIndex");
  number->InsertNextValue(index);
  output->GetFieldData()->AddArray(number);
  for (const SequenceTransform& transform : frame.transforms) {
    const auto matrix = NewMatrices(transform.name + "Transform");
    InsertMatrix(matrix, transform.matrix);
    output->GetFieldData()->AddArray(matrix);
    vtkUltrasoundVolume::AddField(output, (transform.name + "TransformStatus").c_str(), transform.statusText);
  }
  // Ours come back as what they were.
  const auto add = [output](const std::string& key, const std::string& value, const std::string& prefix) {
    if (key.compare(0, echorama::OurFields.size(), echorama::OurFields) != 0 ||
        !vtkUltrasoundAcquisition::SetFromText(output, key.substr(echorama::OurFields.size()), value)) {
      vtkUltrasoundVolume::AddField(output, (prefix + key).c_str(), value);
    }
  };
  for (const auto& [key, value] : frame.fields) {
    add(key, value, "Frame_");
  }
  if (!content.imageType.empty()) {
    vtkUltrasoundVolume::AddField(output, "UltrasoundImageType", content.imageType);
  }
  for (const auto& [key, value] : content.fields) {
    add(key, value, "");
  }
}

//----------------------------------------------------------------------------
void vtkUltrasoundSequenceReader::MakeTrack(vtkPolyData* output, const echorama::Progress& progress)
{
  Sequence& sequence = this->Open();
  const SequenceContent& content = sequence.File.Content();
  SequencePoses& poses = sequence.Poses;
  std::vector<std::string> tools;
  if (const std::string& tool = this->ToolFrame; !tool.empty()) {
    if (!poses.Reaches(tool)) {
      throw Error(Error::Kind::NotPossible, content.path + ": no transforms lead from the ToolFrame " + tool + " to the world; " +
                                                "there are " + this->GetCoordinateFrames());
    }
    tools = {tool};
  } else if (poses.ImageIsPlaced()) {
    tools = {poses.Image()};
  } else {
    tools = poses.Tools();
  }

  const vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  const vtkNew<vtkCellArray> lines;
  const vtkNew<vtkIntArray> frameIndex, toolIndex;
  const vtkNew<vtkDoubleArray> times;
  const vtkNew<vtkStringArray> names;
  const auto toWorld = NewMatrices("ToolToWorld");
  frameIndex->SetName("FrameIndex");
  toolIndex->SetName("Tool");
  times->SetName("TimeStamp");
  names->SetName("ToolNames");
  std::vector<vtkSmartPointer<vtkDoubleArray>> matrices;
  std::vector<vtkSmartPointer<vtkUnsignedCharArray>> statuses;
  for (const std::string& name : content.transforms) {
    matrices.push_back(NewMatrices(name + "Transform"));
    statuses.push_back(vtkSmartPointer<vtkUnsignedCharArray>::New());
    statuses.back()->SetName((name + "TransformStatus").c_str());
  }
  for (std::size_t tool = 0; tool < tools.size(); ++tool) {
    names->InsertNextValue(tools[tool]);
    std::vector<vtkIdType> line;
    const auto endLine = [&lines, &line] {
      if (line.size() > 1) {
        lines->InsertNextCell(static_cast<vtkIdType>(line.size()), line.data());
      }
      line.clear();
    };
    for (int index = 0; index < content.frames; ++index) {
      const SequenceFrame frame = sequence.File.Frame(index);
      poses.MoveTo(frame);
      const auto pose = sequence.PoseOf(tools[tool]);
      if (!pose) {
        endLine();
        continue;
      }
      line.push_back(points->InsertNextPoint(pose->translation().data()));
      frameIndex->InsertNextValue(index);
      toolIndex->InsertNextValue(static_cast<int>(tool));
      times->InsertNextValue(frame.time);
      InsertMatrix(toWorld, *pose);
      for (std::size_t i = 0; i < content.transforms.size(); ++i) {
        const SequenceTransform* transform = frame.Find(content.transforms[i]);
        InsertMatrix(matrices[i], transform ? transform->matrix : Eigen::Affine3d::Identity());
        statuses[i]->InsertNextValue(static_cast<unsigned char>(transform ? transform->status : TransformStatus::Missing));
      }
      progress((static_cast<double>(tool) + static_cast<double>(index) / content.frames) / static_cast<double>(tools.size()));
    }
    endLine();
  }
  output->Initialize();
  output->SetPoints(points);
  output->SetLines(lines);
  vtkPointData* arrays = output->GetPointData();
  arrays->AddArray(frameIndex);
  arrays->AddArray(times);
  arrays->AddArray(toolIndex);
  arrays->AddArray(toWorld);
  for (std::size_t i = 0; i < matrices.size(); ++i) {
    arrays->AddArray(matrices[i]);
    arrays->AddArray(statuses[i]);
  }
  output->GetFieldData()->AddArray(names);
  vtkUltrasoundVolume::AddField(output, "WorldFrame", poses.World());
}
