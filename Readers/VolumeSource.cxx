// SPDX-License-Identifier: BSD-3-Clause
// The one place that knows which file holds which format. Each format lies in a file of its own.
#include "Readers/VolumeSource.h"
#include "Core/Base/Error.h"
#include "Readers/CoarseVolume.h"
#include "Readers/DicomFile.h"
#include "Readers/ImageStackFile.h"
#include "Readers/KretzFile.h"
#include "Readers/NiftiFile.h"
#include "Readers/VdbFile.h"
#include "Readers/VolumeFile.h"
#include <algorithm>

namespace echorama {

void VolumeSource::ReadSlices(std::size_t, int, int, void*, const Progress&)
{
  Fail("its slices cannot be read one by one");
}

void VolumeSource::ReadBeams(std::size_t, void*, const Progress&)
{
  throw Error(Error::Kind::BadInput, content_.path + ": it holds no beams");
}

void VolumeSource::LeaveOldPoses()
{
  auto& fields = content_.fields;
  const auto of = std::find_if(fields.begin(), fields.end(), [](const HeaderField& f) { return f.first == GeometryField; });
  if (of == fields.end())
    return;
  const auto before = GeometryOfText(of->second, content_.geometry.dimensions);
  fields.erase(of);
  if (before && before->AgreesWith(content_.geometry, 1e-2))
    return;
  for (const HeaderField& field : fields)
    if (IsPose(field))
      Note(field.first.substr(OurFields.size()) + " belonged to a geometry that another program has changed, and was left out");
  fields.erase(std::remove_if(fields.begin(), fields.end(), IsPose), fields.end());
}

ParameterList Describe(VolumeReadParameters& p)
{
  return {
      Parameter(
          "SpacingMm", p.spacingMm, {0, 1000}, "mm",
          "Edge of the voxels that a file of beams (GE Kretz) is scan-converted to. 0 takes about as many voxels inside the fan "
          "as there are samples."),
      Parameter(
          "StackSpacingMm", p.stackSpacingMm, {0, Unlimited}, "mm",
          "Spacing of a stack of pictures: along x, along y and from picture to picture. Where it is 0, that of the files is "
          "taken, else 1 mm, with a note. Other formats know theirs.")
          .Advanced(),
      Parameter(
          "Stride", p.stride, {0, 1000}, "voxels",
          "Only one of so many voxels along each axis is read, for a first look at a large volume; those between are skipped. "
          "For MetaImage, NRRD and NIfTI. 0 takes the smallest that leaves at most 128 million voxels, and 1 for other formats.")
          .Advanced(),
  };
}

namespace {

std::unique_ptr<VolumeSource> OpenWhole(const std::string& path, const VolumeReadParameters& parameters)
{
  switch (FormatOfContent(path)) {
  case FileFormat::MetaImage:
  case FileFormat::Nrrd:
    return OpenHeaderVolume(path);
  case FileFormat::Nifti:
    return OpenNifti(path);
  case FileFormat::Dicom:
    return OpenDicom(path, parameters);
  case FileFormat::Vdb:
    return OpenVdb(path);
  case FileFormat::ImageStack:
    return OpenImageStack(path, parameters);
  case FileFormat::Kretz:
    return OpenKretz(path, parameters);
  default:
    throw Error(Error::Kind::BadFile, path + ": the content is none of " + KnownFormats());
  }
}

} // namespace

std::unique_ptr<VolumeSource> OpenVolume(const std::string& path, const VolumeReadParameters& parameters)
{
  CheckRanges(parameters, path);
  auto whole = OpenWhole(path, parameters);
  whole->LeaveOldPoses();
  return CoarseVolume(std::move(whole), parameters.stride);
}

} // namespace echorama
