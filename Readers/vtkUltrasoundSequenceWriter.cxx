// SPDX-License-Identifier: BSD-3-Clause
#include "vtkUltrasoundSequenceWriter.h"

#include "Readers/SequenceWriter.h"

#include "vtkCommand.h"
#include "vtkErrorCode.h"
#include "vtkFieldData.h"
#include "vtkImageData.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkNew.h"
#include "vtkObjectFactory.h"
#include "vtkPointData.h"
#include "vtkStreamingDemandDrivenPipeline.h"
#include "vtkStringArray.h"
#include "vtkUltrasoundAcquisition.h"
#include "vtkUltrasoundVolume.h"
#include "vtkUltrasoundVoxelTypes.h"

#include <algorithm>
#include <memory>
#include <set>

using echorama::Error;
using echorama::SequenceContent;
using echorama::SequenceFrame;
using echorama::SequenceTransform;
using echorama::TransformStatus;

vtkStandardNewMacro(vtkUltrasoundSequenceWriter);

vtkUltrasoundParametersMacro(vtkUltrasoundSequenceWriter);

namespace {
const std::string FramePrefix = "Frame_"; // of fields of single frames

std::optional<std::string> StringOf(vtkImageData* image, const std::string& name)
{
  vtkStringArray* array = vtkStringArray::SafeDownCast(image->GetFieldData()->GetAbstractArray(name.c_str()));
  return array && array->GetNumberOfValues() == 1 ? std::optional<std::string>(array->GetValue(0)) : std::nullopt;
}

bool EndsWith(const std::string& text, const std::string& end)
{
  return text.size() >= end.size() && text.compare(text.size() - end.size(), end.size(), end) == 0;
}

// The field as a transform; nothing when it is none.
std::optional<SequenceTransform> TransformOf(vtkImageData* image, vtkAbstractArray* field)
{
  vtkDataArray* numbers = vtkDataArray::SafeDownCast(field);
  const std::string name = field->GetName() ? field->GetName() : "", end = "Transform";
  if (!numbers || numbers->GetNumberOfValues() != 16 || !EndsWith(name, end) || !echorama::FramesOf(name)) {
    return {};
  }
  SequenceTransform transform;
  transform.name = name.substr(0, name.size() - end.size());
  for (int i = 0; i < 16; ++i) {
    transform.matrix(i / 4, i % 4) =
        numbers->GetComponent(i / numbers->GetNumberOfComponents(), i % numbers->GetNumberOfComponents());
  }
  if (const auto status = StringOf(image, name + "Status")) {
    transform.statusText = *status;
  }
  transform.status = echorama::TransformStatusOf(transform.statusText);
  return transform;
}

// Whether a field is one that we make out of something else, or write in a way of its own.
bool IsOurs(vtkImageData* image, const std::string& name)
{
  const std::vector<std::string> acquisition = vtkUltrasoundAcquisition::Names();
  return name == "FrameIndex" || name == "WorldFrame" || name == "UltrasoundImageType" ||
         std::find(acquisition.begin(), acquisition.end(), name) != acquisition.end() ||
         (EndsWith(name, "TransformStatus") && image->GetFieldData()->GetArray(name.substr(0, name.size() - 6).c_str()));
}

// What holds for the whole file, as the first frame has it.
SequenceContent ContentOf(vtkImageData* image, const std::string& path, std::vector<std::string>& lost)
{
  SequenceContent content;
  vtkDataArray* intensity = vtkUltrasoundVolume::GetIntensity(image);
  if (image->GetNumberOfPoints() > 0) {
    if (!intensity) {
      throw Error(Error::Kind::BadInput,
                  path + ": the frames have no intensities (a point array named Intensity, or active scalars)");
    }
    image->GetDimensions(content.dimensions.data());
    content.type = echorama::VoxelTypeOf(intensity);
  }
  content.imageType = StringOf(image, "UltrasoundImageType").value_or("");
  bool placed = vtkUltrasoundAcquisition::ImageToWorldOf(image).has_value() || StringOf(image, "WorldFrame");
  vtkFieldData* fields = image->GetFieldData();
  for (int i = 0; i < fields->GetNumberOfArrays(); ++i) {
    vtkAbstractArray* field = fields->GetAbstractArray(i);
    const std::string name = field->GetName() ? field->GetName() : "";
    if (TransformOf(image, field)) {
      placed = true;
    } else if (!IsOurs(image, name) && name.rfind(FramePrefix, 0) != 0) {
      const auto text = StringOf(image, name);
      if (text && echorama::CanHold({name, *text})) {
        content.fields.emplace_back(name, *text);
      } else {
        lost.push_back("field " + name);
      }
    }
  }
  for (const auto& [name, text] : vtkUltrasoundAcquisition::ToText(image)) {
    if (name == vtkUltrasoundAcquisition::ProbeGeometryName() || name == vtkUltrasoundAcquisition::SeedName() ||
        name == vtkUltrasoundAcquisition::SceneName()) {
      content.fields.emplace_back(echorama::OurFields + name, text);
    }
  }
  if (!placed && image->GetNumberOfPoints() > 0) {
    content.geometry = vtkUltrasoundVolume::GeometryOf(image); // else pixels are counted, as Plus does
  }
  return content;
}

// \a placed: whether a frame so far had a place in the world.
SequenceFrame FrameOf(vtkImageData* image, double timeStep, bool& placed)
{
  SequenceFrame frame;
  const bool ofSequence = image->GetFieldData()->GetAbstractArray("FrameIndex") != nullptr;
  frame.time =
      vtkUltrasoundAcquisition::TimeStampOf(image).value_or(ofSequence ? std::numeric_limits<double>::quiet_NaN() : timeStep);
  vtkFieldData* fields = image->GetFieldData();
  for (int i = 0; i < fields->GetNumberOfArrays(); ++i) {
    vtkAbstractArray* field = fields->GetAbstractArray(i);
    const std::string name = field->GetName() ? field->GetName() : "";
    if (const auto transform = TransformOf(image, field)) {
      frame.transforms.push_back(*transform);
    } else if (const auto text = StringOf(image, name); text && name.rfind(FramePrefix, 0) == 0) {
      frame.fields.emplace_back(name.substr(FramePrefix.size()), *text);
    }
  }
  for (const auto& [name, text] : vtkUltrasoundAcquisition::ToText(image)) {
    if (name == vtkUltrasoundAcquisition::ProbeToWorldName()) {
      frame.fields.emplace_back(echorama::OurFields + name, text);
    }
  }
  const auto imageToWorld = vtkUltrasoundAcquisition::ImageToWorldOf(image);
  placed = placed || imageToWorld || StringOf(image, "WorldFrame");
  const std::string composed = "ImageTo" + StringOf(image, "WorldFrame").value_or("Reference");
  if (placed && !frame.Find(composed)) {
    SequenceTransform transform;
    transform.name = composed;
    transform.matrix = imageToWorld.value_or(Eigen::Affine3d::Identity());
    transform.statusText = imageToWorld ? "OK" : "INVALID";
    transform.status = echorama::TransformStatusOf(transform.statusText);
    frame.transforms.push_back(transform);
  }
  vtkDataArray* valid = vtkUltrasoundVolume::GetValidRegion(image);
  frame.imageValid = image->GetNumberOfPoints() > 0 && (!valid || valid->GetRange()[1] != 0.0);
  return frame;
}
} // namespace

//----------------------------------------------------------------------------
echorama::ParameterList vtkUltrasoundSequenceWriter::Parameters()
{
  using echorama::Parameter;
  return {Parameter("UseCompression", this->UseCompression, "Whether pixels are compressed, without loss.")};
}

//----------------------------------------------------------------------------
void vtkUltrasoundSequenceWriter::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "FileName: " << (this->FileName ? this->FileName : "(none)") << "\n";
  vtkUltrasoundParameters::Print(os, indent, this->Parameters());
  os << indent << "Notes: " << this->GetNotes() << "\n";
}

//----------------------------------------------------------------------------
int vtkUltrasoundSequenceWriter::FillInputPortInformation(int, vtkInformation* information)
{
  information->Set(vtkAlgorithm::INPUT_REQUIRED_DATA_TYPE(), "vtkImageData");
  return 1;
}

//----------------------------------------------------------------------------
int vtkUltrasoundSequenceWriter::Write()
{
  this->SetErrorCode(vtkErrorCode::NoError);
  this->Notes.clear();
  this->InvokeEvent(vtkCommand::StartEvent);
  const int written = vtkUltrasoundVolume::Run(this, nullptr, [this](const echorama::Progress& progress) {
    this->Notes = WriteSteps(this, this->FileName ? this->FileName : "", this->UseCompression, progress);
  });
  this->InvokeEvent(vtkCommand::EndEvent);
  if (!written) {
    this->SetErrorCode(vtkErrorCode::UnknownError);
  } else if (!this->Notes.empty()) {
    vtkWarningMacro(<< this->FileName << ": " << this->GetNotes());
  }
  return written;
}

//----------------------------------------------------------------------------
std::vector<std::string> vtkUltrasoundSequenceWriter::WriteSteps(vtkWriter* sink, const std::string& path, bool compress,
                                                                 const echorama::Progress& progress)
{
  if (path.empty()) {
    throw Error(Error::Kind::InvalidParameter, "no file name was given");
  }
  int port = 0;
  vtkAlgorithm* source = sink->GetNumberOfInputConnections(0) > 0 ? sink->GetInputAlgorithm(0, 0, port) : nullptr;
  if (!source) {
    throw Error(Error::Kind::BadInput, path + ": there are no frames to write");
  }
  if (!source->GetExecutive()->UpdateInformation()) {
    throw Error(Error::Kind::BadInput, path + ": the input failed");
  }
  vtkInformation* information = source->GetOutputInformation(port);
  std::vector<double> times(static_cast<std::size_t>(information->Length(vtkStreamingDemandDrivenPipeline::TIME_STEPS())));
  information->Get(vtkStreamingDemandDrivenPipeline::TIME_STEPS(), times.data());
  const bool steps = !times.empty();
  if (!steps) {
    times.push_back(std::numeric_limits<double>::quiet_NaN());
  }

  echorama::FileReplacement files;
  std::unique_ptr<echorama::SequenceWriter> writer;
  SequenceContent content;
  std::vector<std::string> lost;
  std::set<std::string> lostArrays;
  bool placed = false;
  for (std::size_t step = 0; step < times.size(); ++step) {
    const vtkNew<vtkInformationVector> requests;
    requests->SetNumberOfInformationObjects(source->GetNumberOfOutputPorts());
    if (steps) {
      requests->GetInformationObject(port)->Set(vtkStreamingDemandDrivenPipeline::UPDATE_TIME_STEP(), times[step]);
    }
    const std::string which = "frame " + std::to_string(step);
    vtkImageData* image =
        source->Update(port, requests) ? vtkImageData::SafeDownCast(source->GetOutputDataObject(port)) : nullptr;
    if (!image || source->GetErrorCode() != vtkErrorCode::NoError) {
      throw Error(Error::Kind::BadInput, path + ": the input failed at " + which);
    }
    vtkDataArray* intensity = vtkUltrasoundVolume::GetIntensity(image);
    if (!writer) {
      content = ContentOf(image, path, lost);
      writer = std::make_unique<echorama::SequenceWriter>(path, content, compress, files);
    }
    if (image->GetNumberOfPoints() == 0) {
      intensity = nullptr;
    } else {
      std::array<int, 3> dimensions{};
      image->GetDimensions(dimensions.data());
      if (!intensity || dimensions != content.dimensions || echorama::VoxelTypeOf(intensity) != content.type) {
        throw Error(Error::Kind::BadInput, path + ": " + which + " is of another size or type than the first one");
      }
      if (intensity->GetNumberOfComponents() != 1 || intensity->GetNumberOfTuples() != image->GetNumberOfPoints()) {
        throw Error(Error::Kind::BadInput, path + ": " + which + " has not one number per pixel");
      }
      vtkUltrasoundVolume::CheckValidRegion(image, path + ": " + which);
    }
    const SequenceFrame frame = FrameOf(image, times[step], placed);
    const echorama::Progress part = progress.Part(static_cast<double>(step) / static_cast<double>(times.size() + 1),
                                                  static_cast<double>(step + 1) / static_cast<double>(times.size() + 1));
    writer->Append(frame, intensity ? intensity->GetVoidPointer(0) : nullptr, part);
    part(1.0);

    vtkDataArray* valid = vtkUltrasoundVolume::GetValidRegion(image);
    if (valid && valid->GetNumberOfTuples() > 0 && valid->GetRange()[0] != valid->GetRange()[1]) {
      lostArrays.insert("valid regions of parts of frames");
    }
    for (int i = 0; i < image->GetPointData()->GetNumberOfArrays(); ++i) {
      vtkAbstractArray* array = image->GetPointData()->GetAbstractArray(i);
      if (array != intensity && array != valid) {
        lostArrays.insert(std::string("point array ") + (array->GetName() ? array->GetName() : "without a name"));
      }
    }
  }
  writer->Finish(progress.Part(static_cast<double>(times.size()) / static_cast<double>(times.size() + 1), 1.0));
  files.Commit();
  lost.insert(lost.end(), lostArrays.begin(), lostArrays.end());
  for (std::string& what : lost) {
    what.insert(0, "sequences cannot hold the ");
  }
  return lost;
}
