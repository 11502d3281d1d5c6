// SPDX-License-Identifier: BSD-3-Clause
#include "vtkUltrasoundReader.h"

#include "BorderZeros.h"
#include "Readers/DataFile.h"
#include "Readers/ImageHeader.h"
#include "Readers/SequenceFile.h"
#include "Readers/VolumeFile.h"
#include "Readers/VolumeSource.h"
#include "Readers/VtkXmlFile.h"

#include "vtkCallbackCommand.h"
#include "vtkFieldData.h"
#include "vtkImageData.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkNew.h"
#include "vtkObjectFactory.h"
#include "vtkPointData.h"
#include "vtkSmartPointer.h"
#include "vtkStreamingDemandDrivenPipeline.h"
#include "vtkStringArray.h"
#include "vtkUltrasoundAcquisition.h"
#include "vtkUltrasoundVoxelTypes.h"
#include "vtkUnsignedCharArray.h"
#include "vtkXMLImageDataReader.h"
#include "vtkXMLReader.h"

#include <algorithm>
#include <cctype>
#include <filesystem>

using echorama::Error;
using echorama::FileFormat;
using echorama::HeaderField;
using echorama::VolumeContent;
using echorama::VolumeSource;
using echorama::VoxelType;

vtkStandardNewMacro(vtkUltrasoundReader);

vtkUltrasoundParametersMacro(vtkUltrasoundReader);

namespace {
// An array for the voxels of a file, which are read into its memory directly.
vtkSmartPointer<vtkDataArray> NewArray(VoxelType type, std::size_t count, const char* name)
{
  return vtkUltrasoundVolume::NewArray(echorama::VtkTypeOf(type), static_cast<vtkIdType>(count), name);
}

// Throws Error(TooLarge) when so many slices of a volume (all, where it is negative) do not fit in the free memory.
void CheckRoom(const VolumeContent& content, int slices = -1)
{
  const auto& n = content.geometry.dimensions;
  echorama::CheckMemory(content.path, static_cast<double>(n[0]) * n[1] * (slices < 0 ? n[2] : slices) *
                                          static_cast<double>(echorama::SizeOf(content.type)));
}

// Beams as an image: they lie in no space of millimetres, so samples, beams and steps are counted.
echorama::ImageGeometry BeamGrid(const echorama::BeamContent& beams)
{
  echorama::ImageGeometry grid;
  grid.dimensions = beams.dimensions;
  return grid;
}

std::unique_ptr<VolumeSource> OpenCompanion(const std::string& path, const std::string& companion,
                                            const echorama::ImageGeometry& geometry, int stride)
{
  echorama::VolumeReadParameters parameters;
  parameters.stride = stride;
  auto source = echorama::OpenVolume(companion, parameters);
  if (!source->Content().geometry.AgreesWith(geometry)) {
    throw Error(Error::Kind::BadFile, companion + ": its geometry is not that of " + path +
                                          "; remove it if it belongs to an earlier file of this name");
  }
  return source;
}

// The file NAME.array.ext beside NAME.ext, with the same geometry as the volume, or nullptr when there is none.
vtkSmartPointer<vtkDataArray> ReadCompanion(const std::string& path, const char* array, vtkImageData* volume, int stride,
                                            const echorama::Progress& progress)
{
  const std::string companion = echorama::CompanionPath(path, array);
  std::error_code ignored;
  if (!std::filesystem::exists(companion, ignored)) {
    return nullptr;
  }
  const auto source = OpenCompanion(path, companion, vtkUltrasoundVolume::GeometryOf(volume), stride);
  CheckRoom(source->Content());
  auto values = NewArray(source->Content().type, source->Content().geometry.VoxelCount(), array);
  source->Read(0, values->GetVoidPointer(0), nullptr, progress);
  return values;
}

// Which volume of a time series is the one for a time: the last that is not later, but for rounding. Times of files are sums
// of steps that are rounded, some to floats.
std::size_t IndexOfTime(const std::vector<double>& times, double time)
{
  const auto later = std::upper_bound(times.begin(), times.end(), time);
  if (later == times.begin()) {
    return 0;
  }
  const bool isRounded = later != times.end() && *later - time < 1e-3 * (*later - *(later - 1));
  return static_cast<std::size_t>(later - times.begin()) - (isRounded ? 0 : 1);
}

// Which volume is asked for, and its time.
std::size_t SetTime(const VolumeContent& content, vtkInformation* asked, vtkImageData* output)
{
  std::size_t index = 0;
  if (!content.times.empty()) {
    if (asked->Has(vtkStreamingDemandDrivenPipeline::UPDATE_TIME_STEP())) {
      index = IndexOfTime(content.times, asked->Get(vtkStreamingDemandDrivenPipeline::UPDATE_TIME_STEP()));
    }
    output->GetInformation()->Set(vtkDataObject::DATA_TIME_STEP(), content.times[index]);
    vtkUltrasoundAcquisition::SetTimeStamp(output, content.times[index]);
  }
  return index;
}

// A valid region as the contract wants it: 1 or 0 in unsigned chars.
vtkSmartPointer<vtkDataArray> AsValidRegion(vtkDataArray* array)
{
  const vtkIdType count = array->GetNumberOfTuples();
  const auto valid = vtkSmartPointer<vtkUnsignedCharArray>::New();
  valid->SetName(vtkUltrasoundVolume::ValidRegionName());
  valid->SetNumberOfTuples(count);
  if (auto* bytes = vtkUnsignedCharArray::SafeDownCast(array)) {
    std::transform(bytes->GetPointer(0), bytes->GetPointer(0) + count, valid->GetPointer(0),
                   [](unsigned char value) { return static_cast<unsigned char>(value != 0); });
    return valid;
  }
  for (vtkIdType i = 0; i < count; ++i) {
    valid->SetValue(i, array->GetComponent(i, 0) != 0.0 ? 1 : 0);
  }
  return valid;
}

// Collects what an object inside complains of, instead of printing it.
class Complaints {
public:
  explicit Complaints(vtkObject* object) : Object(object)
  {
    this->Command->SetClientData(this);
    this->Command->SetCallback([](vtkObject*, unsigned long, void* self, void* text) {
      std::string& collected = static_cast<Complaints*>(self)->Text;
      if (collected.empty() && text) // the first says what went wrong, the others follow from it
      {
        collected = static_cast<const char*>(text);
      }
    });
    object->AddObserver(vtkCommand::ErrorEvent, this->Command);
  }
  // The parser of an XML reader is an object of its own, which complains by itself.
  explicit Complaints(vtkXMLReader* reader) : Complaints(static_cast<vtkObject*>(reader))
  {
    this->Reader = reader;
    this->Reader->SetParserErrorObserver(this->Command);
  }
  ~Complaints()
  {
    this->Object->RemoveObserver(this->Command);
    if (this->Reader) {
      this->Reader->SetParserErrorObserver(nullptr);
    }
  }
  Complaints(const Complaints&) = delete;
  Complaints& operator=(const Complaints&) = delete;

  // The complaint without VTK's "ERROR: In file, line" and its line breaks; empty when there was none.
  std::string Sentence() const
  {
    const std::size_t pointer = this->Text.find("): ");
    std::string sentence = this->Text.empty() || pointer == std::string::npos ? this->Text : this->Text.substr(pointer + 3);
    while (!sentence.empty() && std::isspace(static_cast<unsigned char>(sentence.back()))) {
      sentence.pop_back();
    }
    std::replace(sentence.begin(), sentence.end(), '\n', ' ');
    return sentence;
  }

private:
  vtkSmartPointer<vtkObject> Object;
  vtkSmartPointer<vtkXMLReader> Reader;
  vtkNew<vtkCallbackCommand> Command;
  std::string Text;
};

// Reads what a .vti file says of itself.
echorama::ImageGeometry OpenXml(vtkXMLImageDataReader* reader, const std::string& path, std::vector<std::string>& notes)
{
  notes = echorama::CheckVtkXmlFile(path);
  reader->SetFileName(path.c_str());
  const Complaints complaints(reader);
  reader->UpdateInformation();
  vtkInformation* information = reader->GetOutputInformation(0);
  if (reader->GetErrorCode() != 0 || !complaints.Sentence().empty() ||
      !information->Has(vtkStreamingDemandDrivenPipeline::WHOLE_EXTENT())) {
    throw Error(Error::Kind::BadFile, path + ": it cannot be read as a VTK image file (" + complaints.Sentence() + ")");
  }
  int extent[6];
  information->Get(vtkStreamingDemandDrivenPipeline::WHOLE_EXTENT(), extent);
  echorama::ImageGeometry geometry;
  Eigen::Vector3d first;
  for (int axis = 0; axis < 3; ++axis) {
    geometry.dimensions[static_cast<std::size_t>(axis)] = extent[2 * axis + 1] - extent[2 * axis] + 1;
    first[axis] = extent[2 * axis];
  }
  information->Get(vtkDataObject::ORIGIN(), geometry.origin.data());
  information->Get(vtkDataObject::SPACING(), geometry.spacing.data());
  Eigen::Matrix<double, 3, 3, Eigen::RowMajor> direction = Eigen::Matrix3d::Identity();
  if (information->Has(vtkDataObject::DIRECTION())) {
    information->Get(vtkDataObject::DIRECTION(), direction.data());
  }
  geometry.direction = direction;
  geometry.origin += geometry.direction * geometry.spacing.cwiseProduct(first);
  echorama::CheckGeometry(path, geometry);
  echorama::CheckMemory(path, static_cast<double>(geometry.VoxelCount()));
  return geometry;
}
} // namespace

//----------------------------------------------------------------------------
// A volume and its companions, whose slices are asked for in turn.
struct vtkUltrasoundReader::OpenFiles {
  std::string Path;
  vtkMTimeType Made = 0; // of the reader
  std::filesystem::file_time_type Written;
  std::unique_ptr<VolumeSource> Main;
  std::vector<std::pair<const char*, std::unique_ptr<VolumeSource>>> Beside; // the valid region first
};

//----------------------------------------------------------------------------
vtkUltrasoundReader::~vtkUltrasoundReader()
{
  this->SetFileName(nullptr);
}

//----------------------------------------------------------------------------
vtkUltrasoundReader::vtkUltrasoundReader()
{
  this->SetNumberOfInputPorts(0);
  this->SetNumberOfOutputPorts(2);
}

//----------------------------------------------------------------------------
echorama::ParameterList vtkUltrasoundReader::Parameters()
{
  return Describe(this->Values);
}

//----------------------------------------------------------------------------
void vtkUltrasoundReader::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "FileName: " << (this->FileName ? this->FileName : "(none)") << "\n";
  vtkUltrasoundParameters::Print(os, indent, this->Parameters());
  os << indent << "Notes: " << this->GetNotes() << "\n";
}

//----------------------------------------------------------------------------
int vtkUltrasoundReader::CanReadFile(const char* fileName)
{
  try {
    return fileName && echorama::FormatOfContent(fileName) != FileFormat::Unknown && !echorama::LooksLikeSequence(fileName) ? 1
                                                                                                                            : 0;
  } catch (const Error&) {
    return 0;
  }
}

//----------------------------------------------------------------------------
int vtkUltrasoundReader::RequestInformation(vtkInformation*, vtkInformationVector**, vtkInformationVector* outputs)
{
  return vtkUltrasoundVolume::Run(this, nullptr, [this, outputs](const echorama::Progress&) {
    const std::string path = this->FileName ? this->FileName : "";
    vtkInformation* out = outputs->GetInformationObject(0);
    vtkInformation* beams = outputs->GetInformationObject(1);
    for (vtkInformation* each : {out, beams}) {
      each->Remove(vtkStreamingDemandDrivenPipeline::TIME_STEPS());
      each->Remove(vtkStreamingDemandDrivenPipeline::TIME_RANGE());
    }
    const int nothing[6] = {0, -1, 0, -1, 0, -1};
    beams->Set(vtkStreamingDemandDrivenPipeline::WHOLE_EXTENT(), nothing, 6);
    if (echorama::FormatOfContent(path) == FileFormat::VtkXmlImage) {
      if (this->Values.stride > 1) {
        throw Error(Error::Kind::InvalidParameter, path + ": Stride must be 1 for VTK image files, which are read as a whole");
      }
      const vtkNew<vtkXMLImageDataReader> reader;
      std::vector<std::string> unused;
      vtkUltrasoundVolume::SetGeometry(out, OpenXml(reader, path, unused));
      return;
    }
    const auto source = echorama::OpenVolume(path, this->Values);
    const VolumeContent& content = source->Content();
    vtkUltrasoundVolume::SetGeometry(out, content.geometry);
    vtkDataObject::SetPointDataActiveScalarInfo(out, echorama::VtkTypeOf(content.type), 1);
    if (content.beams) {
      vtkUltrasoundVolume::SetGeometry(beams, BeamGrid(*content.beams));
      vtkDataObject::SetPointDataActiveScalarInfo(beams, echorama::VtkTypeOf(content.beams->type), 1);
    }
    for (vtkInformation* each : {out, beams}) {
      if (!content.times.empty()) {
        const double range[2] = {content.times.front(), content.times.back()};
        each->Set(vtkStreamingDemandDrivenPipeline::TIME_STEPS(), content.times.data(), static_cast<int>(content.times.size()));
        each->Set(vtkStreamingDemandDrivenPipeline::TIME_RANGE(), range, 2);
      }
    }
  });
}

//----------------------------------------------------------------------------
int vtkUltrasoundReader::ProcessRequest(vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  // The output that nobody asks for now is made when somebody does: neither beams nor their conversion come for nothing.
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
int vtkUltrasoundReader::RequestData(vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  const int asked = request->Get(vtkExecutive::FROM_OUTPUT_PORT());
  if (asked != 1 && !this->Superclass::RequestData(request, inputs, outputs)) {
    return 0;
  }
  if (asked == 0) {
    return 1;
  }
  vtkInformation* out = outputs->GetInformationObject(1);
  vtkImageData* beams = vtkImageData::GetData(out);
  const int finished = vtkUltrasoundVolume::Run(this, nullptr, [this, beams, out](const echorama::Progress& progress) {
    this->ReadBeams(beams, progress);
    if (out->Has(vtkStreamingDemandDrivenPipeline::UPDATE_EXTENT())) {
      int wanted[6];
      out->Get(vtkStreamingDemandDrivenPipeline::UPDATE_EXTENT(), wanted);
      beams->Crop(wanted);
    }
  });
  if (!finished) {
    beams->Initialize();
  }
  return finished;
}

//----------------------------------------------------------------------------
void vtkUltrasoundReader::Execute(vtkInformationVector**, vtkImageData* output, const echorama::Progress& progress)
{
  this->Notes.clear();
  const std::string path = this->FileName ? this->FileName : "";
  if (this->ReadSlices(output, progress)) {
    return;
  }
  this->Opened.reset();
  if (echorama::FormatOfContent(path) == FileFormat::VtkXmlImage) {
    this->ReadXml(output);
    progress(0.7); // VTK's reader cannot be stopped, but we can
  } else {
    this->ReadSource(output, progress.Part(0.0, 0.7));
  }
  this->FindValidRegion(output, progress.Part(0.7, 0.9));
  this->FindCompanions(output, progress.Part(0.9, 1.0));
}

//----------------------------------------------------------------------------
// Reads the slices that are asked for, when these are not all and the file lets it. Without a file of the valid region that has
// to be guessed, from the whole.
bool vtkUltrasoundReader::ReadSlices(vtkImageData* output, const echorama::Progress& progress)
{
  const std::string path = this->FileName ? this->FileName : "";
  vtkInformation* out = this->GetOutputInformation(0);
  if (!out->Has(vtkStreamingDemandDrivenPipeline::UPDATE_EXTENT())) {
    return false;
  }
  int whole[6], wanted[6];
  out->Get(vtkStreamingDemandDrivenPipeline::WHOLE_EXTENT(), whole);
  out->Get(vtkStreamingDemandDrivenPipeline::UPDATE_EXTENT(), wanted);
  if (wanted[4] > wanted[5] || wanted[4] < whole[4] || wanted[5] > whole[5] || (wanted[4] == whole[4] && wanted[5] == whole[5])) {
    return false;
  }
  const int slices = wanted[5] - wanted[4] + 1;

  // 1. what there is, opened now or for the slices before
  std::error_code ignored;
  const auto written = std::filesystem::last_write_time(path, ignored);
  if (!this->Opened || this->Opened->Path != path || this->Opened->Made != this->GetMTime() || this->Opened->Written != written) {
    this->Opened.reset();
    if (echorama::FormatOfContent(path) == FileFormat::VtkXmlImage) {
      return false;
    }
    auto opened = std::make_unique<OpenFiles>();
    opened->Path = path;
    opened->Made = this->GetMTime();
    opened->Written = written;
    opened->Main = echorama::OpenVolume(path, this->Values);
    std::vector<const char*> names{vtkUltrasoundVolume::ValidRegionName()};
    names.insert(names.end(), echorama::CompanionArrays.begin(), echorama::CompanionArrays.end());
    for (const char* name : names) {
      const std::string companion = echorama::CompanionPath(path, name);
      if (std::filesystem::exists(companion, ignored)) {
        opened->Beside.emplace_back(name, OpenCompanion(path, companion, opened->Main->Content().geometry, this->Values.stride));
      }
    }
    const bool all =
        std::all_of(opened->Beside.begin(), opened->Beside.end(), [](const auto& each) { return each.second->ReadsSlices(); });
    if (!all || !opened->Main->ReadsSlices() || !opened->Main->Content().times.empty() || opened->Beside.empty() ||
        opened->Beside.front().first != names.front()) {
      return false;
    }
    this->Opened = std::move(opened);
  }

  // 2. their slices; after a failure the files are opened anew
  std::unique_ptr<OpenFiles> files = std::move(this->Opened);
  const VolumeContent& content = files->Main->Content();
  this->Notes = content.notes;
  vtkUltrasoundVolume::SetGeometry(output, content.geometry);
  output->SetExtent(whole[0], whole[1], whole[2], whole[3], wanted[4], wanted[5]);
  const auto read = [&](VolumeSource& source, const char* name, const echorama::Progress& part) {
    CheckRoom(source.Content(), slices);
    const auto values = NewArray(source.Content().type, static_cast<std::size_t>(output->GetNumberOfPoints()), name);
    source.ReadSlices(0, wanted[4] - whole[4], slices, values->GetVoidPointer(0), part);
    return values;
  };
  output->GetPointData()->SetScalars(read(*files->Main, vtkUltrasoundVolume::IntensityName(), progress.Part(0.0, 0.7)));
  const double each = 0.3 / static_cast<double>(files->Beside.size());
  double done = 0.7;
  for (const auto& [name, source] : files->Beside) {
    const auto values = read(*source, name, progress.Part(done, done + each));
    done += each;
    output->GetPointData()->AddArray(&source == &files->Beside.front().second ? AsValidRegion(values) : values);
  }
  this->SetFields(content, output);
  if (wanted[5] < whole[5]) {
    this->Opened = std::move(files);
  }
  return true;
}

//----------------------------------------------------------------------------
void vtkUltrasoundReader::ReadSource(vtkImageData* output, const echorama::Progress& progress)
{
  const auto source = echorama::OpenVolume(this->FileName, this->Values);
  const VolumeContent& content = source->Content();
  this->Notes = content.notes;
  const std::size_t index = SetTime(content, this->GetOutputInformation(0), output);
  vtkUltrasoundVolume::SetGeometry(output, content.geometry);
  CheckRoom(content);
  const auto intensity = NewArray(content.type, content.geometry.VoxelCount(), vtkUltrasoundVolume::IntensityName());
  unsigned char* valid = nullptr;
  if (content.holdsValidRegion) {
    const auto region = NewArray(VoxelType::UInt8, intensity->GetNumberOfTuples(), vtkUltrasoundVolume::ValidRegionName());
    output->GetPointData()->AddArray(region); // which holds it
    valid = static_cast<unsigned char*>(region->GetVoidPointer(0));
  }
  source->Read(index, intensity->GetVoidPointer(0), valid, progress);
  output->GetPointData()->SetScalars(intensity);
  this->SetFields(content, output);
}

//----------------------------------------------------------------------------
void vtkUltrasoundReader::ReadBeams(vtkImageData* output, const echorama::Progress& progress)
{
  const std::string path = this->FileName ? this->FileName : "";
  if (echorama::FormatOfContent(path) == FileFormat::VtkXmlImage) {
    return; // voxels
  }
  const auto source = echorama::OpenVolume(path, this->Values);
  const VolumeContent& content = source->Content();
  if (!content.beams) {
    return;
  }
  this->Notes = content.notes;
  const std::size_t index = SetTime(content, this->GetOutputInformation(1), output);
  const echorama::ImageGeometry grid = BeamGrid(*content.beams);
  vtkUltrasoundVolume::SetGeometry(output, grid);
  const auto samples = NewArray(content.beams->type, grid.VoxelCount(), vtkUltrasoundVolume::IntensityName());
  source->ReadBeams(index, samples->GetVoidPointer(0), progress);
  output->GetPointData()->SetScalars(samples);
  this->SetFields(content, output);
}

//----------------------------------------------------------------------------
void vtkUltrasoundReader::SetFields(const VolumeContent& content, vtkImageData* output)
{
  if (content.probe) {
    vtkUltrasoundAcquisition::SetProbeGeometry(output, *content.probe);
  }
  if (content.probeToWorld) {
    vtkUltrasoundAcquisition::SetProbeToWorld(output, *content.probeToWorld);
  }
  if (content.timeStamp && content.times.empty()) {
    vtkUltrasoundAcquisition::SetTimeStamp(output, *content.timeStamp);
  }
  const std::vector<std::string> acquisition = vtkUltrasoundAcquisition::Names();
  for (const HeaderField& field : content.fields) {
    const std::string& name = field.first;
    if (name.compare(0, echorama::OurFields.size(), echorama::OurFields) == 0) {
      if (!vtkUltrasoundAcquisition::SetFromText(output, name.substr(echorama::OurFields.size()), field.second)) {
        this->Notes.push_back("the header's " + name + " could not be understood and was left out");
      }
    } else if (std::find(acquisition.begin(), acquisition.end(), name) != acquisition.end()) {
      this->Notes.push_back("the header's " + name +
                            " is not ours, though it has the name of one of our fields; it was left out");
    } else {
      const vtkNew<vtkStringArray> text;
      text->SetName(name.c_str());
      text->InsertNextValue(field.second);
      output->GetFieldData()->AddArray(text);
    }
  }
}

//----------------------------------------------------------------------------
void vtkUltrasoundReader::ReadXml(vtkImageData* output)
{
  const std::string path = this->FileName;
  const auto fail = [&path](const std::string& reason) { throw Error(Error::Kind::BadFile, path + ": " + reason); };
  const vtkNew<vtkXMLImageDataReader> reader;
  OpenXml(reader, path, this->Notes);
  {
    const Complaints complaints(reader);
    reader->Update();
    if (reader->GetErrorCode() != 0 || !complaints.Sentence().empty()) {
      fail("the data are truncated or damaged (" + complaints.Sentence() + ")");
    }
  }
  output->ShallowCopy(reader->GetOutput());
  vtkUltrasoundVolume::SetGeometry(output, vtkUltrasoundVolume::GeometryOf(output)); // extents from zero
  output->GetFieldData()->RemoveArray("TimeValue");

  vtkPointData* arrays = output->GetPointData();
  const auto isIntensity = [](vtkDataArray* array) {
    const std::string name = array && array->GetName() ? array->GetName() : "";
    return array && name != vtkUltrasoundVolume::ValidRegionName() &&
           std::find(echorama::CompanionArrays.begin(), echorama::CompanionArrays.end(), name) == echorama::CompanionArrays.end();
  };
  vtkDataArray* intensity = vtkUltrasoundVolume::GetIntensity(output); // the array of that name, else the active one
  for (int i = 0; !isIntensity(intensity) && i < arrays->GetNumberOfArrays(); ++i) {
    intensity = arrays->GetArray(i);
  }
  if (!isIntensity(intensity)) {
    fail("it has no point array that could be the intensities");
  }
  if (intensity->GetNumberOfComponents() != 1) {
    fail("it has " + std::to_string(intensity->GetNumberOfComponents()) + " numbers per voxel; one is needed");
  }
  if (intensity->GetNumberOfTuples() != output->GetNumberOfPoints()) {
    fail("its intensities are not one per voxel");
  }
  const std::string name = intensity->GetName() ? intensity->GetName() : "";
  if (name != vtkUltrasoundVolume::IntensityName()) {
    this->Notes.push_back("the array " + name + " was taken as the intensities");
    const auto renamed = vtkSmartPointer<vtkDataArray>::Take(intensity->NewInstance());
    renamed->ShallowCopy(intensity);
    renamed->SetName(vtkUltrasoundVolume::IntensityName());
    arrays->RemoveArray(name.c_str());
    arrays->AddArray(renamed);
  }
  arrays->SetActiveScalars(vtkUltrasoundVolume::IntensityName());
}

//----------------------------------------------------------------------------
void vtkUltrasoundReader::FindValidRegion(vtkImageData* output, const echorama::Progress& progress)
{
  vtkPointData* arrays = output->GetPointData();
  vtkSmartPointer<vtkDataArray> found = vtkUltrasoundVolume::GetValidRegion(output);
  if (found && found->GetNumberOfTuples() != output->GetNumberOfPoints()) {
    throw Error(Error::Kind::BadFile, std::string(this->FileName) + ": its ValidRegion is not one number per voxel");
  }
  if (!found) {
    found = ReadCompanion(this->FileName, vtkUltrasoundVolume::ValidRegionName(), output, this->Values.stride, progress);
  }
  if (found) {
    arrays->AddArray(AsValidRegion(found));
    return;
  }

  const auto valid = NewArray(VoxelType::UInt8, output->GetNumberOfPoints(), vtkUltrasoundVolume::ValidRegionName());
  const auto target = vtkUltrasoundVolume::ViewOf<unsigned char>(valid, output);
  vtkDataArray* intensity = vtkUltrasoundVolume::GetIntensity(output);
  std::int64_t missing = 0;
  switch (intensity->GetDataType()) {
    vtkTemplateMacro(missing =
                         echorama::ValidFromBorderZeros(vtkUltrasoundVolume::ViewOf<const VTK_TT>(intensity, output), target));
  }
  arrays->AddArray(valid);
  if (missing > 0) {
    this->Notes.push_back("the valid region was guessed: everything but the zeros connected to the border (" +
                          std::to_string(missing) + " voxels) is taken as real");
  }
}

//----------------------------------------------------------------------------
void vtkUltrasoundReader::FindCompanions(vtkImageData* output, const echorama::Progress& progress)
{
  for (const char* name : echorama::CompanionArrays) {
    if (!output->GetPointData()->GetArray(name)) {
      if (const auto array = ReadCompanion(this->FileName, name, output, this->Values.stride, progress)) {
        output->GetPointData()->AddArray(array);
      }
    }
  }
}
