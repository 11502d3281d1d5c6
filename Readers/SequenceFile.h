// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Progress.h"
#include "Core/Geometry/TransformGraph.h"
#include "Readers/ImageHeader.h"
#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace echorama {

/// One transform of one frame: maps coordinates of the first frame in its name to the second, "ProbeToTracker".
struct SequenceTransform {
  std::string name;                                     ///< without "Transform" at its end
  Eigen::Affine3d matrix = Eigen::Affine3d::Identity(); ///< of no meaning unless the status is Valid
  TransformStatus status = TransformStatus::Valid;      ///< TransformStatusOf(statusText)
  std::string statusText = "OK";                        ///< as the file says it: OK, INVALID, MISSING, OUT_OF_VIEW ...
};

/// What a sequence says of one frame, besides its pixels.
struct SequenceFrame {
  double time = std::numeric_limits<double>::quiet_NaN(); ///< seconds; NaN when the file has none
  bool imageValid = true;                                 ///< false: the pixels are not an image (its status is not OK)
  std::vector<SequenceTransform> transforms;              ///< in the order of the file
  std::vector<HeaderField> fields;                        ///< everything else, without "Seq_Frame0000_"

  /// The transform of this name (without "Transform"), or nullptr.
  const SequenceTransform* Find(std::string_view name) const;
};

/// What a sequence says of all its frames.
///
/// Frames come in MF orientation: x towards the marked side of the probe, y away from it, z ascending. A file in another
/// one is turned on reading; its transforms of the frame "Image" mean MF pixels already, as in the Plus toolkit.
struct SequenceContent {
  std::string path; ///< that was asked for
  FileFormat format = FileFormat::Unknown;
  std::array<int, 3> dimensions{0, 0, 1}; ///< of a frame in MF orientation; 0 x 0 when only trackers were recorded
  VoxelType type = VoxelType::UInt8;
  std::uint64_t components = 1; ///< numbers per pixel
  int frames = 0;
  std::string orientation; ///< the code in the file: MF, UN, FM ...; empty when there is none
  std::string imageType;   ///< BRIGHTNESS, RF_REAL ...; empty when there is none
  /// Where the header puts a frame, for sequences that have no transforms (volumes over time); mm, LPS.
  ImageGeometry geometry;
  std::vector<std::string> transforms; ///< every name that some frame has, as in SequenceTransform
  std::vector<HeaderField> fields;     ///< those of the whole file
  std::vector<std::string> notes;      ///< what was assumed, turned or is not usable: sentences for people

  bool HasImages() const { return dimensions[0] > 0 && dimensions[1] > 0; }
  std::uint64_t FrameBytes() const;
};

/// Reads tracked sequences: MetaImage (.igs.mha, .seq.mha, .mhd) and NRRD (.seq.nrrd, .igs.nrrd, .nhdr), compressed or not.
///
/// Opening reads the header: time and memory grow with its length alone. Pixels are read one frame at a time and never
/// all held. Of compressed files the decoder's state is kept every so often (about 10 MB in all), so that going back or
/// jumping costs little once a part has been passed. Frames that are interleaved (kinds: list domain domain) cost a pass over
/// the file for every 64 MB of frames.
///
/// A transform without a status is taken as OK. A matrix that is not 16 finite numbers, is singular or whose last row is
/// not 0 0 0 1 is taken as INVALID, with a note. Fields may come in any order.
///
/// Not safe for use by several threads at a time.
class SequenceFile {
public:
  /// \throws Error(FileSystem) when a file is missing or cannot be read, Error(BadFile) that names file and reason: another
  /// format, a truncated file, sizes that the file cannot hold, fields of frames that do not exist, a field that is given
  /// twice with different values, an unknown orientation.
  explicit SequenceFile(const std::string& path);
  ~SequenceFile();
  SequenceFile(const SequenceFile&) = delete;
  SequenceFile& operator=(const SequenceFile&) = delete;

  const SequenceContent& Content() const;

  /// What the header says of frame \a index, in [0, frames). \throws Error(InvalidParameter) for another.
  SequenceFrame Frame(int index) const;

  /// The time of a frame as Frame() gives it, without the rest.
  double Time(int index) const;

  /// Writes the FrameBytes() bytes of frame \a index to \a pixels, in MF orientation and this machine's byte order, also
  /// where the status of its image is not OK.
  /// \throws Error(InvalidParameter) for another index or a sequence without images, Error(BadFile) that names the file when
  /// the data end early, go on too long or are damaged, Error(Cancelled).
  void ReadFrame(int index, void* pixels, const Progress& progress = {});

private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

/// Whether the header at \a path is that of a tracked sequence: it has fields of frames (Seq_Frame...) or an axis of kind list or
/// time. Only its first 64 kB are looked at. Never throws.
bool LooksLikeSequence(const std::string& path);

/// Whether a name asks for a sequence: .igs or .seq before one of the extensions of MetaImage and NRRD, in any case.
bool NamesSequence(const std::string& path);

} // namespace echorama
