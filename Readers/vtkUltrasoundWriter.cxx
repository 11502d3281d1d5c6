// SPDX-License-Identifier: BSD-3-Clause
#include "vtkUltrasoundWriter.h"

#include "BorderZeros.h"
#include "Core/Base/FileReplacement.h"
#include "Core/Base/NumberText.h"
#include "Readers/ImageHeader.h"
#include "Readers/NiftiFile.h"
#include "Readers/SequenceFile.h"
#include "Readers/VdbFile.h"
#include "Readers/VolumeFile.h"
#include "Readers/VolumeWriter.h"

#include "vtkCellData.h"
#include "vtkCommand.h"
#include "vtkErrorCode.h"
#include "vtkFieldData.h"
#include "vtkImageData.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkMatrix3x3.h"
#include "vtkNew.h"
#include "vtkObjectFactory.h"
#include "vtkPointData.h"
#include "vtkStreamingDemandDrivenPipeline.h"
#include "vtkStringArray.h"
#include "vtkUltrasoundAcquisition.h"
#include "vtkUltrasoundSequenceWriter.h"
#include "vtkUltrasoundVolume.h"
#include "vtkUltrasoundVoxelTypes.h"
#include "vtkUnsignedCharArray.h"
#include "vtkXMLImageDataWriter.h"

#include <algorithm>
#include <cstring>
#include <memory>
#include <optional>

using echorama::Error;
using echorama::FileFormat;
using echorama::FileReplacement;
using echorama::ImageHeader;
using echorama::VolumeWriter;

vtkStandardNewMacro(vtkUltrasoundWriter);

vtkUltrasoundParametersMacro(vtkUltrasoundWriter);

namespace {
const char* const UnknownExtension = ": the extension must be .mha, .mhd, .nrrd, .nhdr, .nii, .nii.gz, .vdb or .vti";

using Extent = std::array<int, 6>;

// A slab of a volume, checked, and where its voxels lie.
struct Slab {
  vtkImageData* Image = nullptr;
  vtkDataArray* Intensity = nullptr;
  vtkDataArray* Valid = nullptr;                                        // nullptr: every voxel is real
  std::array<vtkDataArray*, echorama::CompanionArrays.size()> Beside{}; // nullptr: none that a file could hold
  std::array<int, 3> Dimensions{0, 0, 0};
  std::size_t First = 0; // voxel of the image: the input may hand out more slices than were asked for

  std::size_t Count() const { return static_cast<std::size_t>(Dimensions[0]) * Dimensions[1] * Dimensions[2]; }
  template <class T>
  const T* Voxels(vtkDataArray* array) const
  {
    return static_cast<const T*>(array->GetVoidPointer(static_cast<vtkIdType>(First)));
  }
  const void* Voxels(vtkDataArray* array) const { return array->GetVoidPointer(static_cast<vtkIdType>(First)); }
  std::uint64_t Bytes(vtkDataArray* array) const { return Count() * static_cast<std::uint64_t>(array->GetDataTypeSize()); }
};

// The voxels of \a image that lie in \a extent.
Slab CheckedSlab(vtkImageData* image, const Extent& extent, const std::string& path)
{
  Slab slab;
  slab.Image = image;
  slab.Intensity = vtkUltrasoundVolume::GetIntensity(image);
  vtkUltrasoundVolume::GeometryOf(image).Check(path);
  if (!slab.Intensity || slab.Intensity->GetNumberOfTuples() != image->GetNumberOfPoints()) {
    throw Error(Error::Kind::BadInput,
                path + ": the volume has no intensities (a point array named Intensity, or active scalars)");
  }
  if (slab.Intensity->GetNumberOfComponents() != 1) {
    throw Error(Error::Kind::BadInput, path + ": the volume has several numbers per voxel; one can be written");
  }
  slab.Valid = vtkUltrasoundVolume::CheckValidRegion(image, path);
  for (int i = 0; i < image->GetPointData()->GetNumberOfArrays(); ++i) {
    vtkAbstractArray* array = image->GetPointData()->GetAbstractArray(i);
    if (array->GetNumberOfTuples() != image->GetNumberOfPoints()) {
      throw Error(Error::Kind::BadInput, path + ": the point array " + (array->GetName() ? array->GetName() : "without a name") +
                                             " has not one value per voxel");
    }
  }
  for (std::size_t i = 0; i < slab.Beside.size(); ++i) {
    vtkDataArray* array = image->GetPointData()->GetArray(echorama::CompanionArrays[i]);
    slab.Beside[i] = array && array != slab.Intensity && array->GetNumberOfComponents() == 1 ? array : nullptr;
  }
  Extent given{};
  image->GetExtent(given.data());
  if (!std::equal(given.begin(), given.begin() + 4, extent.begin()) || given[4] > extent[4] || given[5] < extent[5]) {
    throw Error(Error::Kind::BadInput, path + ": the input did not give the slices " + std::to_string(extent[4]) + " to " +
                                           std::to_string(extent[5]) + " that it was asked for");
  }
  slab.Dimensions = {extent[1] - extent[0] + 1, extent[3] - extent[2] + 1, extent[5] - extent[4] + 1};
  slab.First = static_cast<std::size_t>(slab.Dimensions[0]) * static_cast<std::size_t>(slab.Dimensions[1]) *
               static_cast<std::size_t>(extent[4] - given[4]);
  return slab;
}

// What must not change from one slab to the next.
struct Kind {
  std::array<double, 15> Pose{}; // origin, spacing, direction
  std::vector<int> Types;

  explicit Kind(const Slab& slab)
  {
    std::copy_n(slab.Image->GetOrigin(), 3, Pose.begin());
    std::copy_n(slab.Image->GetSpacing(), 3, Pose.begin() + 3);
    std::copy_n(slab.Image->GetDirectionMatrix()->GetData(), 9, Pose.begin() + 6);
    Types = {slab.Intensity->GetDataType(), slab.Valid ? slab.Valid->GetDataType() : -1};
    for (vtkDataArray* array : slab.Beside) {
      Types.push_back(array ? array->GetDataType() : -1);
    }
  }
  bool operator==(const Kind& other) const { return Pose == other.Pose && Types == other.Types; }
};

// Whether the reader would find every voxel of a slab real without being told.
bool LooksValidEverywhere(const Slab& slab, int first, int slices)
{
  bool valid = false;
  switch (slab.Intensity->GetDataType()) {
    vtkTemplateMacro(
        valid = echorama::LooksValidEverywhere(
            echorama::VolumeView<const VTK_TT>(slab.Voxels<VTK_TT>(slab.Intensity), slab.Dimensions), first, slices));
  }
  return valid;
}

// The valid region of a slab, 1 or 0; \a made is where it goes when it does not come like that.
const unsigned char* ValidOf(const Slab& slab, std::vector<unsigned char>& made)
{
  const unsigned char* given = slab.Valid ? slab.Voxels<unsigned char>(slab.Valid) : nullptr;
  if (given && std::all_of(given, given + slab.Count(), [](unsigned char v) { return v <= 1; })) {
    return given;
  }
  made.assign(slab.Count(), 1);
  if (given) {
    std::transform(given, given + made.size(), made.begin(), [](unsigned char v) { return v != 0 ? 1 : 0; });
  }
  return made.data();
}

// Field data that a header can hold: the acquisition, and lines that a header brought. Names of all else go to \a lost.
std::vector<echorama::HeaderField> FieldsOf(const Slab& slab, std::vector<std::string>& lost)
{
  std::vector<echorama::HeaderField> held;
  vtkImageData* image = slab.Image;
  for (const auto& [name, text] : vtkUltrasoundAcquisition::ToText(image)) {
    held.emplace_back(echorama::OurFields + name, text);
  }
  const std::vector<std::string> acquisition = vtkUltrasoundAcquisition::Names();
  vtkFieldData* fields = image->GetFieldData();
  for (int i = 0; i < fields->GetNumberOfArrays(); ++i) {
    vtkAbstractArray* array = fields->GetAbstractArray(i);
    const std::string name = array->GetName() ? array->GetName() : "";
    if (std::find(acquisition.begin(), acquisition.end(), name) != acquisition.end()) {
      continue;
    }
    vtkStringArray* text = vtkStringArray::SafeDownCast(array);
    if (text && text->GetNumberOfValues() == 1 && echorama::CanHold({name, text->GetValue(0)})) {
      held.emplace_back(name, text->GetValue(0));
    } else {
      lost.push_back("field " + name);
    }
  }
  for (int i = 0; i < image->GetPointData()->GetNumberOfArrays(); ++i) {
    vtkAbstractArray* array = image->GetPointData()->GetAbstractArray(i);
    const std::string name = array->GetName() ? array->GetName() : "";
    if (array != slab.Intensity && name != vtkUltrasoundVolume::ValidRegionName() &&
        std::find(slab.Beside.begin(), slab.Beside.end(), array) == slab.Beside.end()) {
      lost.push_back("point array " + name);
    }
  }
  for (int i = 0; i < image->GetCellData()->GetNumberOfArrays(); ++i) {
    lost.push_back(std::string("cell array ") + image->GetCellData()->GetArrayName(i));
  }
  return held;
}

// Tells how far an algorithm is, and asks it to stop when that is wished.
struct Telling {
  vtkAlgorithm* Algorithm;
  const echorama::Progress* Progress; // nullptr: not now
  bool Stopped = false;

  void Tell()
  {
    try {
      if (Progress) {
        (*Progress)(Algorithm->GetProgress());
      }
    } catch (const Error&) { // must not fly through VTK
      Stopped = true;
      Algorithm->SetAbortExecute(1);
    }
  }
  void Check() const
  {
    if (Stopped) {
      throw Error(Error::Kind::Cancelled, "stopped on request");
    }
  }
};

std::unique_ptr<VolumeWriter> OpenFile(const std::string& path, ImageHeader header, vtkDataArray* array, bool compress,
                                       FileReplacement& files)
{
  header.type = array ? echorama::VoxelTypeOf(array) : echorama::VoxelType::UInt8;
  return std::make_unique<VolumeWriter>(path, std::move(header), compress, files);
}
} // namespace

//----------------------------------------------------------------------------
echorama::ParameterList vtkUltrasoundWriter::Parameters()
{
  using echorama::Parameter;
  return {Parameter("UseCompression", this->UseCompression,
                    "Whether voxels are compressed, without loss. NIfTI goes by its extension: .nii is not, .nii.gz is."),
          Parameter(
              "NumberOfSlabs", this->NumberOfSlabs, {1, echorama::Unlimited}, "",
              "In how many slabs along z the input is asked for its voxels, one after the other; at most so many as there are "
              "slices. With more than 1 the volume is never in memory as a whole, when the input makes no more than it is asked "
              "for; the files are the same to the last byte. For .mha, .mhd, .nrrd, .nhdr, .nii and .nii.gz.")
              .Advanced()};
}

//----------------------------------------------------------------------------
void vtkUltrasoundWriter::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "FileName: " << (this->FileName ? this->FileName : "(none)") << "\n";
  vtkUltrasoundParameters::Print(os, indent, this->Parameters());
  os << indent << "Notes: " << this->GetNotes() << "\n";
}

//----------------------------------------------------------------------------
int vtkUltrasoundWriter::FillInputPortInformation(int, vtkInformation* information)
{
  information->Set(vtkAlgorithm::INPUT_REQUIRED_DATA_TYPE(), "vtkImageData");
  return 1;
}

//----------------------------------------------------------------------------
int vtkUltrasoundWriter::Write()
{
  // When the input fails, WriteData() is never called and the superclass reports success.
  this->Written = false;
  this->Notes.clear();
  this->RoundingMm = 0.0;
  const std::string path = this->FileName ? this->FileName : "";
  const bool sequence = echorama::NamesSequence(path);
  if (!sequence && this->NumberOfSlabs == 1) {
    this->Superclass::Write();
    return this->Written ? 1 : 0;
  }
  this->InvokeEvent(vtkCommand::StartEvent);
  this->Finish(vtkUltrasoundVolume::Run(this, nullptr, [this, &path, sequence](const echorama::Progress& progress) {
    echorama::CheckRanges(this->Parameters());
    if (!sequence) {
      this->WriteBySlabs(path, progress);
    } else if (this->NumberOfSlabs == 1) {
      this->Notes = vtkUltrasoundSequenceWriter::WriteSteps(this, path, this->UseCompression, progress);
    } else {
      throw Error(Error::Kind::InvalidParameter, path + ": a sequence is written frame by frame, not by slabs");
    }
  }));
  this->InvokeEvent(vtkCommand::EndEvent);
  return this->Written ? 1 : 0;
}

//----------------------------------------------------------------------------
void vtkUltrasoundWriter::Finish(int written)
{
  this->Written = written != 0;
  this->SetErrorCode(this->Written ? vtkErrorCode::NoError : vtkErrorCode::UnknownError);
  if (this->Written && !this->Notes.empty()) {
    vtkWarningMacro(<< this->FileName << ": " << this->GetNotes());
  }
  // No warning: it is the format's own, and our reader does not see it.
  if (this->Written && this->RoundingMm > 1e-9) {
    this->Notes.push_back("NIfTI holds the geometry as 32-bit floats: other programs see voxels up to " +
                          echorama::NumberText(static_cast<float>(this->RoundingMm)) +
                          " mm off; for vtkUltrasoundReader the exact one is in an extension of the header");
  }
}

//----------------------------------------------------------------------------
void vtkUltrasoundWriter::WriteData()
{
  this->Notes.clear();
  this->RoundingMm = 0.0;
  this->Finish(vtkUltrasoundVolume::Run(this, nullptr, [this](const echorama::Progress& progress) {
    const std::string path = this->FileName ? this->FileName : "";
    if (path.empty()) {
      throw Error(Error::Kind::InvalidParameter, "no file name was given");
    }
    vtkImageData* input = vtkImageData::SafeDownCast(this->GetInput());
    if (!input) {
      throw Error(Error::Kind::BadInput, path + ": there is no volume to write");
    }
    Extent extent{};
    input->GetExtent(extent.data());
    const Slab whole = CheckedSlab(input, extent, path); // whatever the format

    switch (echorama::FormatOfName(path)) {
    case FileFormat::MetaImage:
    case FileFormat::Nrrd:
    case FileFormat::Nifti:
      this->WriteSlabs(
          path, extent, 1, [input](const Extent&, const echorama::Progress&) { return input; }, progress);
      break;
    case FileFormat::Vdb: {
      std::vector<std::string> lost;
      ImageHeader header;
      header.geometry = vtkUltrasoundVolume::GeometryOf(input);
      FileReplacement files;
      // The valid region are its active voxels; a file of an earlier volume of this name must not stay.
      files.Remove(echorama::CompanionPath(path, vtkUltrasoundVolume::ValidRegionName()));
      for (std::size_t i = 0; i < whole.Beside.size(); ++i) {
        const std::string companion = echorama::CompanionPath(path, echorama::CompanionArrays[i]);
        if (whole.Beside[i]) {
          header.type = echorama::VoxelTypeOf(whole.Beside[i]);
          echorama::WriteVdb(companion, header, whole.Voxels(whole.Beside[i]), nullptr, this->UseCompression, files);
        } else {
          files.Remove(companion);
        }
      }
      header.type = echorama::VoxelTypeOf(whole.Intensity);
      header.fields = FieldsOf(whole, lost);
      echorama::WriteVdb(path, header, whole.Voxels(whole.Intensity),
                         whole.Valid ? whole.Voxels<unsigned char>(whole.Valid) : nullptr, this->UseCompression, files, progress);
      files.Commit();
      this->NoteLost(lost);
      break;
    }
    case FileFormat::VtkXmlImage:
      this->WriteXml(input, whole.Valid || LooksValidEverywhere(whole, 0, whole.Dimensions[2]), progress);
      break;
    default:
      throw Error(Error::Kind::InvalidParameter, path + UnknownExtension);
    }
  }));
}

//----------------------------------------------------------------------------
void vtkUltrasoundWriter::WriteBySlabs(const std::string& path, const echorama::Progress& progress)
{
  if (path.empty()) {
    throw Error(Error::Kind::InvalidParameter, "no file name was given");
  }
  switch (echorama::FormatOfName(path)) {
  case FileFormat::MetaImage:
  case FileFormat::Nrrd:
  case FileFormat::Nifti:
    break;
  case FileFormat::Vdb:
  case FileFormat::VtkXmlImage:
    throw Error(Error::Kind::InvalidParameter,
                path + ": this format is written whole; by slabs: .mha, .mhd, .nrrd, .nhdr, .nii, .nii.gz");
  default:
    throw Error(Error::Kind::InvalidParameter, path + UnknownExtension);
  }
  int port = 0;
  vtkAlgorithm* source = this->GetNumberOfInputConnections(0) > 0 ? this->GetInputAlgorithm(0, 0, port) : nullptr;
  if (!source) {
    throw Error(Error::Kind::BadInput, path + ": there is no volume to write");
  }
  if (!source->GetExecutive()->UpdateInformation()) {
    throw Error(Error::Kind::BadInput, path + ": the input failed");
  }
  vtkInformation* information = source->GetOutputInformation(port);
  if (!information->Has(vtkStreamingDemandDrivenPipeline::WHOLE_EXTENT())) {
    throw Error(Error::Kind::BadInput, path + ": the input does not say how large it is");
  }
  Extent whole{};
  information->Get(vtkStreamingDemandDrivenPipeline::WHOLE_EXTENT(), whole.data());

  // The input tells how far it is with a slab, and stops when this is to stop.
  Telling telling{source, nullptr};
  const unsigned long tag = source->AddObserver(vtkCommand::ProgressEvent, &telling, &Telling::Tell);
  const auto atTheEnd = [&](void*) {
    source->RemoveObserver(tag);
    // Whoever updates the input next without saying what of it wants the whole, as ever.
    information->Set(vtkStreamingDemandDrivenPipeline::UPDATE_EXTENT(), whole.data(), 6);
  };
  const std::shared_ptr<void> cleanup(nullptr, atTheEnd);

  const auto slabOf = [&](const Extent& extent, const echorama::Progress& slabProgress) {
    const vtkNew<vtkInformationVector> requests;
    requests->SetNumberOfInformationObjects(source->GetNumberOfOutputPorts());
    requests->GetInformationObject(port)->Set(vtkStreamingDemandDrivenPipeline::UPDATE_EXTENT(), extent.data(), 6);
    telling.Progress = &slabProgress;
    const bool made = source->Update(port, requests) != 0;
    telling.Progress = nullptr;
    telling.Check();
    vtkImageData* image = made ? vtkImageData::SafeDownCast(source->GetOutputDataObject(port)) : nullptr;
    if (!image || source->GetErrorCode() != vtkErrorCode::NoError) {
      throw Error(Error::Kind::BadInput,
                  path + ": the input failed at slices " + std::to_string(extent[4]) + " to " + std::to_string(extent[5]));
    }
    return image;
  };
  this->WriteSlabs(path, whole, this->NumberOfSlabs, slabOf, progress);
}

//----------------------------------------------------------------------------
void vtkUltrasoundWriter::WriteSlabs(const std::string& path, const Extent& whole, int slabs, const SlabSource& slabOf,
                                     const echorama::Progress& progress)
{
  const bool compress = this->UseCompression;
  const int slices = whole[5] - whole[4] + 1;
  slabs = std::max(1, std::min(slabs, slices));
  FileReplacement files;
  std::unique_ptr<VolumeWriter> main, valid;
  std::array<std::unique_ptr<VolumeWriter>, echorama::CompanionArrays.size()> beside;
  const std::string validPath = echorama::CompanionPath(path, vtkUltrasoundVolume::ValidRegionName());
  bool validIsSeen = true; // by the reader, without a file that says so
  std::vector<std::string> lost;
  std::optional<Kind> kind;
  std::vector<unsigned char> made;
  for (int s = 0; s < slabs; ++s) {
    Extent extent = whole;
    extent[4] = whole[4] + static_cast<int>(std::int64_t{slices} * s / slabs);
    extent[5] = whole[4] + static_cast<int>(std::int64_t{slices} * (s + 1) / slabs) - 1;
    const echorama::Progress part = progress.Part(s / (slabs + 0.2), (s + 1) / (slabs + 0.2));
    const double making = slabs > 1 ? 0.8 : 0.0;
    const Slab slab = CheckedSlab(slabOf(extent, part.Part(0.0, making)), extent, path);
    const unsigned char* const validValues = ValidOf(slab, made);
    validIsSeen =
        validIsSeen && !std::memchr(validValues, 0, slab.Count()) && LooksValidEverywhere(slab, extent[4] - whole[4], slices);
    if (s == 0) {
      ImageHeader header;
      header.geometry = vtkUltrasoundVolume::GeometryOf(slab.Image);
      header.geometry.dimensions[2] = slices;
      // Files beside the main one, which is staged last; those of an earlier volume of this name must not stay.
      if (!validIsSeen || slabs > 1) {
        valid = OpenFile(validPath, header, nullptr, compress, files);
      }
      for (std::size_t i = 0; i < beside.size(); ++i) {
        const std::string companion = echorama::CompanionPath(path, echorama::CompanionArrays[i]);
        if (slab.Beside[i]) {
          beside[i] = OpenFile(companion, header, slab.Beside[i], compress, files);
        } else {
          files.Remove(companion);
        }
      }
      header.fields = FieldsOf(slab, lost);
      main = OpenFile(path, header, slab.Intensity, compress, files);
      kind.emplace(slab);
    } else if (!(Kind(slab) == *kind)) {
      throw Error(Error::Kind::BadInput, path + ": the input gave slices " + std::to_string(extent[4]) + " to " +
                                             std::to_string(extent[5]) +
                                             " with another pose or other types of numbers than the ones before");
    }
    const echorama::Progress writing = part.Part(making, 1.0);
    if (valid) {
      valid->Append(validValues, slab.Count(), writing.Part(0.0, 0.1));
    }
    for (std::size_t i = 0; i < beside.size(); ++i) {
      if (beside[i]) {
        beside[i]->Append(slab.Voxels(slab.Beside[i]), slab.Bytes(slab.Beside[i]), writing.Part(0.1, 0.2));
      }
    }
    main->Append(slab.Voxels(slab.Intensity), slab.Bytes(slab.Intensity), writing.Part(0.2, 1.0));
  }
  const echorama::Progress rest = progress.Part(slabs / (slabs + 0.2), 1.0);
  if (valid && validIsSeen) {
    valid->Discard();
  } else if (valid) {
    valid->Finish(rest.Part(0.0, 0.1));
  }
  if (validIsSeen) {
    files.Remove(validPath);
  }
  for (const std::unique_ptr<VolumeWriter>& file : beside) {
    if (file) {
      file->Finish(rest.Part(0.1, 0.2));
    }
  }
  main->Finish(rest.Part(0.2, 1.0));
  files.Commit();
  this->NoteLost(lost);
  this->RoundingMm = main->RoundingMm();
}

//----------------------------------------------------------------------------
void vtkUltrasoundWriter::NoteLost(const std::vector<std::string>& lost)
{
  for (const std::string& what : lost) {
    this->Notes.push_back("the format cannot hold the " + what + "; .vti can");
  }
}

//----------------------------------------------------------------------------
void vtkUltrasoundWriter::WriteXml(vtkImageData* input, bool validIsSeen, const echorama::Progress& progress)
{
  const std::string path = this->FileName;
  FileReplacement files;
  const std::string temporary = files.Stage(path);
  const vtkNew<vtkImageData> whole;
  whole->ShallowCopy(input);
  vtkUltrasoundVolume::SetGeometry(whole, vtkUltrasoundVolume::GeometryOf(input)); // extents from zero
  if (!validIsSeen) { // else the reader would take zeros at the border for what was never scanned
    const vtkNew<vtkUnsignedCharArray> valid;
    valid->SetName(vtkUltrasoundVolume::ValidRegionName());
    valid->SetNumberOfValues(whole->GetNumberOfPoints());
    valid->FillValue(1);
    whole->GetPointData()->AddArray(valid);
  }
  const vtkNew<vtkXMLImageDataWriter> writer;
  writer->SetInputData(whole);
  writer->SetFileName(temporary.c_str());
  writer->SetHeaderTypeToUInt64();
  // Not raw bytes at the end: VTK 9.1 cannot always read those with a libexpat that has the security fixes of 2024.
  writer->SetDataModeToBinary();
  if (!this->UseCompression) {
    writer->SetCompressorTypeToNone();
  }
  Telling telling{writer, &progress};
  writer->AddObserver(vtkCommand::ProgressEvent, &telling, &Telling::Tell);
  const int written = writer->Write();
  telling.Check(); // VTK's writer, asked to stop, goes on to its end and tells no more
  if (!written || writer->GetErrorCode() != vtkErrorCode::NoError) {
    throw Error(Error::Kind::FileSystem, path + ": it cannot be written (" +
                                             vtkErrorCode::GetStringFromErrorCode(writer->GetErrorCode()) +
                                             "); what was there is left as it was");
  }
  progress(1.0); // the last moment to stop
  files.Commit();
}
