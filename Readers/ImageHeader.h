// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Geometry/ImageGeometry.h"
#include "Readers/VoxelType.h"
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace echorama {

/// What a file is, told from its first bytes; its name is not asked.
enum class FileFormat { Unknown, MetaImage, Nrrd, VtkXmlImage, Nifti, Dicom, Kretz, Vdb, ImageStack };

/// \throws Error(FileSystem) when the path is missing, a folder or cannot be read, Error(BadFile) when the file is empty.
FileFormat FormatOfContent(const std::string& path);

/// The formats by their names, for messages.
const char* KnownFormats();

/// What the extension of a name asks for: .mha .mhd, .nrrd .nhdr, .vti, .nii .nii.gz, .vdb (in any case of letters).
FileFormat FormatOfName(const std::string& path);

/// The extension of a name, in small letters: ".nii.gz" has ".gz".
std::string LowerExtension(const std::string& path);

/// "key = value" of a MetaImage header, "key:=value" of a NRRD header; line breaks inside values are escaped in files.
using HeaderField = std::pair<std::string, std::string>;

/// The header of a MetaImage (.mha, .mhd) or NRRD (.nrrd, .nhdr) file: what the voxels are, where they lie in the world
/// and where in the file.
///
/// The geometry is that of the voxels in memory, in mm and LPS: NRRD's RAS and LAS spaces and other units of length are
/// converted, and where the axes of a file are left-handed the slices are taken in reverse (see reverseSlices), because
/// the geometry of a volume is a rigid pose. A 2D image is one slice. Row i of a MetaImage's TransformMatrix is the
/// direction of axis i, as ITK writes it; a NRRD's space directions are direction times spacing.
struct ImageHeader {
  enum class Encoding { Raw, Zlib, Text };

  std::string path; ///< the file that was asked for
  FileFormat format = FileFormat::Unknown;
  ImageGeometry geometry;     ///< not yet checked: tracked sequences hold frames of 0 x 0 pixels
  bool reverseSlices = false; ///< the last axis runs backwards in the file
  VoxelType type = VoxelType::UInt8;
  bool typeIsKnown = true;      ///< false: the file names a type that holds no numbers (MET_OTHER, block)
  std::uint64_t components = 1; ///< numbers per voxel
  bool bigEndian = false;
  Encoding encoding = Encoding::Raw;
  std::string dataPath;            ///< the file that holds the voxels; often \a path itself
  std::int64_t dataOffset = 0;     ///< bytes before the voxels in that file; -1: they are its last bytes
  std::uint64_t skipDecoded = 0;   ///< bytes to drop after decompression
  std::vector<HeaderField> fields; ///< everything else that the header holds, in its order
  std::vector<std::string> notes;  ///< what was missing and assumed, or lost: sentences for people

  std::uint64_t ByteCount() const; ///< of the voxels; the geometry must have been checked
};

/// Reads the header of a MetaImage or NRRD file; the voxels are not touched.
/// \throws Error(FileSystem) as FormatOfContent, Error(BadFile) that names the file and the line or field, also for a tracked
/// sequence of frames (see ReadSequenceHeader).
ImageHeader ReadImageHeader(const std::string& path);

/// What of a header makes it that of a sequence of frames.
struct FrameAxis {
  std::int64_t frames = 1; ///< samples along the axis of kind list or time; 1 when there is no such axis
  bool fastest = false;    ///< that axis is the first: the frames are interleaved
  std::int64_t headerBytes = 0;

  /// Takes the fields of frames, "Seq_Frame0012_Timestamp = 1.5" as (12, "Timestamp", "1.5"), in the order of the file.
  std::function<void(std::int64_t frame, std::string_view key, std::string_view value)> field;
};

/// Reads the header of a sequence: as ReadImageHeader, but the geometry is that of one frame, whose size may be 0 x 0, and
/// fields of frames go to \a axis alone. A MetaImage that does not say Kinds has its frames along the last of its axes.
/// \throws what ReadImageHeader throws; Error(BadFile) also for a field "Seq_Frame..." that is not one of a frame.
ImageHeader ReadSequenceHeader(const std::string& path, FrameAxis& axis);

/// Whether a field is one of a frame of a sequence: "Seq_Frame0012_Timestamp".
bool IsFrameField(std::string_view key);

/// The name of a type of numbers in headers of each format.
const char* MetaImageTypeName(VoxelType type);
std::string NrrdTypeName(VoxelType type);

/// Millimetres of a unit of length as files name it, "" being mm, or nothing when it is not known.
std::optional<double> Millimetres(const std::string& unit);

/// Numbers with blanks between them.
std::string JoinedNumbers(const double* numbers, int count);

/// The header of a file with these voxels, up to and including the last byte before them.
/// \param dataFile the detached data file as it shall be named, or empty when the voxels follow in the same file
/// \param compressedSizeAt where the size of the compressed voxels is to be put (20 characters), 0 when nowhere
std::string MetaImageHeaderText(const ImageHeader& header, const std::string& dataFile, std::size_t& compressedSizeAt);
std::string NrrdHeaderText(const ImageHeader& header, const std::string& dataFile);

/// How the names of our fields begin in a header.
inline const std::string OurFields = "Echorama_";

/// Origin, spacing and direction, row by row; and back, or nothing when that is not what a text holds.
std::string GeometryText(const ImageGeometry& geometry);
std::optional<ImageGeometry> GeometryOfText(std::string_view text, const std::array<int, 3>& dimensions);

/// The fields of a header as files hold them: where a pose is among them, the geometry that it belongs to is another, by which a
/// reader notices that a program has changed the geometry and kept the pose (VolumeSource::LeaveOldPoses).
std::vector<HeaderField> FieldsInFile(const ImageHeader& header);
inline const std::string GeometryField = OurFields + "Geometry";
bool IsPose(const HeaderField& field);

/// Whether headers of both formats can hold a field so that it comes back the same: a key of letters, digits and _ . -
/// that the formats do not use themselves, and a value of one line without blanks at its ends.
bool CanHold(const HeaderField& field);

} // namespace echorama
