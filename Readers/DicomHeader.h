// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Readers/ImageHeader.h"
#include <cstdint>
#include <Eigen/Core>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace echorama {

/// Where one picture lies: the centre of its first pixel, and its directions along a row (first column) and down a column.
struct DicomPlane {
  std::optional<Eigen::Vector3d> position; ///< mm
  std::optional<Eigen::Matrix<double, 3, 2>> directions;

  bool IsKnown() const { return position && directions; }
};

/// One picture of a DICOM file.
struct DicomPicture {
  DicomPlane patient;                                ///< in the patient's frame (LPS)
  DicomPlane volume;                                 ///< in the scanner's volume frame of reference
  Eigen::Vector2d spacing = Eigen::Vector2d::Zero(); ///< along x and y, mm; 0 where the file does not say
  double sliceSpacing = 0.0;                         ///< from picture to picture as the file says it, mm; 0: it does not
  double slope = 1.0, intercept = 0.0;               ///< from stored numbers to values
  std::optional<double> time;                        ///< seconds
  std::optional<int> timeIndex;                      ///< the number of the volume of a series in time
  std::string dataType;                              ///< TISSUE_INTENSITY, FLOW_VELOCITY, ...; empty: the file does not say
};

/// How the pixels lie in the file: as they are, in a deflated data set, or compressed, in fragments.
enum class DicomStorage { Plain, Deflated, Encapsulated };

/// What a DICOM file says, without its pixels. Nothing that names a person, an institution or a day is kept.
struct DicomHeader {
  std::string path;
  std::string series;      ///< SeriesInstanceUID
  std::string photometric; ///< MONOCHROME2, RGB, ...
  int columns = 0, rows = 0;
  int samples = 1; ///< numbers per pixel
  bool planar = false;
  int bitsAllocated = 8, bitsStored = 8;
  bool isSigned = false;
  bool grouped = false; ///< it has functional groups, one per picture (an enhanced object)
  std::vector<DicomPicture> pictures;
  std::string frameIncrement; ///< what pictures are counted by, "time" or "space", or empty
  double frameTime = 0.0;     ///< seconds from one picture to the next; 0: not said

  DicomStorage storage = DicomStorage::Plain;
  std::string transferSyntax;
  std::uint64_t pixelOffset = 0; ///< where the pixels begin in the file, or in its inflated data set
  std::uint64_t pixelBytes = 0;  ///< that many bytes are there, compressed or not

  /// The Cartesian volumes of Philips' QLAB: slices per volume and their spacing in mm; one "picture" is one volume.
  int volumeSlices = 0;
  Eigen::Vector3d volumeSpacing = Eigen::Vector3d::Zero();

  std::uint64_t kretzOffset = 0, kretzBytes = 0; ///< where a whole GE Kretz file lies inside this one; 0 bytes: nowhere
  bool holdsMovieGroup = false;                  ///< GE's private movies, whose format is not public
  bool burnedIn = false;                         ///< the file says that annotations are burned into its pixels
  std::optional<Eigen::Matrix4d> volumeToTransducer;
  std::vector<HeaderField> fields; ///< equipment only

  /// Bytes of one decoded picture.
  std::uint64_t PictureBytes() const;
};

/// Whether a file that begins with these bytes (132 are enough) is DICOM.
bool LooksLikeDicom(std::string_view start);

/// Reads all but the pixels. Every length is compared with the bytes that are there before anything is allocated for it.
/// \throws Error(FileSystem), Error(BadFile) that names the file and what is wrong.
DicomHeader ReadDicomHeader(const std::string& path);

} // namespace echorama
