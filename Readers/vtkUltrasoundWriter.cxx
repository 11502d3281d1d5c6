// SPDX-License-Identifier: BSD-3-Clause
#include "vtkUltrasoundWriter.h"

#include "Core/Base/NumberText.h"
#include "Readers/BorderZeros.h"
#include "Readers/ImageHeader.h"
#include "Readers/NiftiFile.h"
#include "Readers/SequenceFile.h"
#include "Readers/VdbFile.h"
#include "Readers/VolumeFile.h"

#include "vtkCellData.h"
#include "vtkErrorCode.h"
#include "vtkFieldData.h"
#include "vtkImageData.h"
#include "vtkInformation.h"
#include "vtkNew.h"
#include "vtkObjectFactory.h"
#include "vtkPointData.h"
#include "vtkSmartPointer.h"
#include "vtkStringArray.h"
#include "vtkUltrasoundAcquisition.h"
#include "vtkUltrasoundSequenceWriter.h"
#include "vtkUltrasoundVolume.h"
#include "vtkUltrasoundVoxelTypes.h"
#include "vtkUnsignedCharArray.h"
#include "vtkXMLImageDataWriter.h"

#include <algorithm>

using echorama::Error;
using echorama::FileFormat;
using echorama::FileReplacement;
using echorama::ImageHeader;

vtkStandardNewMacro(vtkUltrasoundWriter);

namespace {
const std::string FieldPrefix = "Echorama_"; // of our fields in a file's header

// Whether the reader would find every voxel real without being told.
bool LooksValidEverywhere(vtkImageData* input, vtkDataArray* intensity)
{
  const vtkNew<vtkUnsignedCharArray> guess;
  guess->SetNumberOfTuples(input->GetNumberOfPoints());
  const auto target = vtkUltrasoundVolume::ViewOf<unsigned char>(guess, input);
  std::int64_t missing = 0;
  switch (intensity->GetDataType()) {
    vtkTemplateMacro(missing =
                         echorama::ValidFromBorderZeros(vtkUltrasoundVolume::ViewOf<const VTK_TT>(intensity, input), target));
  }
  return missing == 0;
}

// The valid region of a volume, 1 or 0, or nullptr when its file can be left out.
vtkSmartPointer<vtkDataArray> ValidRegionToWrite(vtkImageData* input, vtkDataArray* intensity)
{
  const vtkIdType count = input->GetNumberOfPoints();
  vtkDataArray* given = vtkUltrasoundVolume::GetValidRegion(input);
  const auto valid = vtkSmartPointer<vtkUnsignedCharArray>::New();
  valid->SetNumberOfTuples(count);
  bool everywhere = true;
  for (vtkIdType i = 0; i < count; ++i) {
    const bool real = !given || given->GetComponent(i, 0) != 0.0;
    valid->SetValue(i, real ? 1 : 0);
    everywhere = everywhere && real;
  }
  return everywhere && LooksValidEverywhere(input, intensity) ? nullptr : valid;
}
} // namespace

//----------------------------------------------------------------------------
vtkUltrasoundWriter::~vtkUltrasoundWriter()
{
  this->SetFileName(nullptr);
}

//----------------------------------------------------------------------------
void vtkUltrasoundWriter::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "FileName: " << (this->FileName ? this->FileName : "(none)") << "\n";
  os << indent << "UseCompression: " << this->UseCompression << "\n";
  os << indent << "Notes: " << this->GetNotes() << "\n";
}

//----------------------------------------------------------------------------
std::string vtkUltrasoundWriter::GetNotes() const
{
  std::string text;
  for (const std::string& note : this->Notes) {
    text += (text.empty() ? "" : "\n") + note;
  }
  return text;
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
  const std::string path = this->FileName ? this->FileName : "";
  if (echorama::NamesSequence(path)) {
    this->Finish(vtkUltrasoundVolume::Run(this, nullptr, [this, &path](const echorama::Progress& progress) {
      this->Notes = vtkUltrasoundSequenceWriter::WriteSteps(this, path, this->UseCompression != 0, progress);
    }));
  } else {
    this->Superclass::Write();
  }
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
}

//----------------------------------------------------------------------------
void vtkUltrasoundWriter::WriteData()
{
  this->Notes.clear();
  double rounding = 0.0;
  this->Finish(vtkUltrasoundVolume::Run(this, nullptr, [this, &rounding](const echorama::Progress& progress) {
    const std::string path = this->FileName ? this->FileName : "";
    if (path.empty()) {
      throw Error(Error::Kind::InvalidParameter, "no file name was given");
    }
    vtkImageData* input = vtkImageData::SafeDownCast(this->GetInput());
    if (!input) {
      throw Error(Error::Kind::BadInput, path + ": there is no volume to write");
    }
    vtkDataArray* intensity = vtkUltrasoundVolume::GetIntensity(input);
    vtkUltrasoundVolume::GeometryOf(input).Check(path);
    if (!intensity || intensity->GetNumberOfTuples() != input->GetNumberOfPoints()) {
      throw Error(Error::Kind::BadInput,
                  path + ": the volume has no intensities (a point array named Intensity, or active scalars)");
    }
    if (intensity->GetNumberOfComponents() != 1) {
      throw Error(Error::Kind::BadInput, path + ": the volume has several numbers per voxel; one can be written");
    }
    vtkUltrasoundVolume::CheckValidRegion(input, path);
    for (int i = 0; i < input->GetPointData()->GetNumberOfArrays(); ++i) {
      vtkAbstractArray* array = input->GetPointData()->GetAbstractArray(i);
      if (array->GetNumberOfTuples() != input->GetNumberOfPoints()) {
        throw Error(Error::Kind::BadInput, path + ": the point array " +
                                               (array->GetName() ? array->GetName() : "without a name") +
                                               " has not one value per voxel");
      }
    }

    FileReplacement files;
    switch (echorama::FormatOfName(path)) {
    case FileFormat::MetaImage:
    case FileFormat::Nrrd:
    case FileFormat::Nifti:
    case FileFormat::Vdb:
      rounding = this->WriteOneArrayFile(input, files, progress);
      break;
    case FileFormat::VtkXmlImage:
      this->WriteXml(input, files);
      break;
    default:
      throw Error(Error::Kind::InvalidParameter,
                  path + ": the extension must be .mha, .mhd, .nrrd, .nhdr, .nii, .nii.gz, .vdb or .vti");
    }
    files.Commit();
  }));
  // No warning: it is the format's own, and our reader does not see it.
  if (this->Written && rounding > 1e-9) {
    this->Notes.push_back("NIfTI holds the geometry as 32-bit floats: other programs see voxels up to " +
                          echorama::NumberText(static_cast<float>(rounding)) +
                          " mm off; for vtkUltrasoundReader the exact one is in an extension of the header");
  }
}

//----------------------------------------------------------------------------
double vtkUltrasoundWriter::WriteOneArrayFile(vtkImageData* input, FileReplacement& files, const echorama::Progress& progress)
{
  const std::string path = this->FileName;
  const bool compress = this->UseCompression != 0;
  vtkDataArray* intensity = vtkUltrasoundVolume::GetIntensity(input);
  ImageHeader header;
  header.geometry = vtkUltrasoundVolume::GeometryOf(input);

  const FileFormat format = echorama::FormatOfName(path);
  const auto write = [&](const std::string& target, vtkDataArray* array, const unsigned char* valid,
                         const echorama::Progress& part) {
    header.type = echorama::VoxelTypeOf(array);
    const void* voxels = array->GetVoidPointer(0);
    if (format == FileFormat::Nifti) {
      return echorama::WriteNifti(target, header, voxels, files, part);
    }
    if (format == FileFormat::Vdb) {
      echorama::WriteVdb(target, header, voxels, valid, compress, files, part);
    } else {
      echorama::WriteVolume(target, header, voxels, compress, files, part);
    }
    return 0.0;
  };

  // Files beside the main one, which is staged last; those of an earlier volume of this name must not stay.
  const auto writeBeside = [&](const char* name, vtkDataArray* array) {
    const std::string companion = echorama::CompanionPath(path, name);
    if (!array) {
      files.Remove(companion);
      return;
    }
    write(companion, array, nullptr, progress.Part(0.0, 0.2));
  };
  const bool holdsValid = format == FileFormat::Vdb; // as its active voxels
  writeBeside(vtkUltrasoundVolume::ValidRegionName(), holdsValid ? nullptr : ValidRegionToWrite(input, intensity));
  vtkDataArray* provenance = input->GetPointData()->GetArray(vtkUltrasoundVolume::ProvenanceName());
  const bool single =
      provenance && provenance->GetNumberOfComponents() == 1 && provenance->GetNumberOfTuples() == input->GetNumberOfPoints();
  writeBeside(vtkUltrasoundVolume::ProvenanceName(), single ? provenance : nullptr);

  // Field data: the acquisition, and lines that a header brought.
  for (const auto& [name, text] : vtkUltrasoundAcquisition::ToText(input)) {
    header.fields.emplace_back(FieldPrefix + name, text);
  }
  const std::vector<std::string> acquisition = vtkUltrasoundAcquisition::Names();
  std::vector<std::string> lost;
  vtkFieldData* fields = input->GetFieldData();
  for (int i = 0; i < fields->GetNumberOfArrays(); ++i) {
    vtkAbstractArray* array = fields->GetAbstractArray(i);
    const std::string name = array->GetName() ? array->GetName() : "";
    if (std::find(acquisition.begin(), acquisition.end(), name) != acquisition.end()) {
      continue;
    }
    vtkStringArray* text = vtkStringArray::SafeDownCast(array);
    if (text && text->GetNumberOfValues() == 1 && echorama::CanHold({name, text->GetValue(0)})) {
      header.fields.emplace_back(name, text->GetValue(0));
    } else {
      lost.push_back("field " + name);
    }
  }
  for (int i = 0; i < input->GetPointData()->GetNumberOfArrays(); ++i) {
    vtkAbstractArray* array = input->GetPointData()->GetAbstractArray(i);
    const std::string name = array->GetName() ? array->GetName() : "";
    if (array != intensity && name != vtkUltrasoundVolume::ValidRegionName() && (array != provenance || !single)) {
      lost.push_back("point array " + name);
    }
  }
  for (int i = 0; i < input->GetCellData()->GetNumberOfArrays(); ++i) {
    lost.push_back(std::string("cell array ") + input->GetCellData()->GetArrayName(i));
  }
  for (const std::string& what : lost) {
    this->Notes.push_back("the format cannot hold the " + what + "; .vti can");
  }

  vtkDataArray* valid = vtkUltrasoundVolume::GetValidRegion(input);
  return write(path, intensity, valid ? static_cast<const unsigned char*>(valid->GetVoidPointer(0)) : nullptr,
               progress.Part(0.2, 1.0));
}

//----------------------------------------------------------------------------
void vtkUltrasoundWriter::WriteXml(vtkImageData* input, FileReplacement& files)
{
  const std::string path = this->FileName;
  const std::string temporary = files.Stage(path);
  const vtkNew<vtkImageData> whole;
  whole->ShallowCopy(input);
  vtkUltrasoundVolume::SetGeometry(whole, vtkUltrasoundVolume::GeometryOf(input)); // extents from zero
  const vtkNew<vtkXMLImageDataWriter> writer;
  writer->SetInputData(whole);
  writer->SetFileName(temporary.c_str());
  writer->SetHeaderTypeToUInt64();
  writer->EncodeAppendedDataOff();
  if (!this->UseCompression) {
    writer->SetCompressorTypeToNone();
  }
  if (!writer->Write() || writer->GetErrorCode() != vtkErrorCode::NoError) {
    throw Error(Error::Kind::FileSystem, path + ": it cannot be written (" +
                                             vtkErrorCode::GetStringFromErrorCode(writer->GetErrorCode()) +
                                             "); what was there is left as it was");
  }
}
