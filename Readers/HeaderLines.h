// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/NumberText.h"
#include "Core/Base/Words.h"
#include "Readers/ImageHeader.h"
#include <cstdint>
#include <fstream>
#include <string>
#include <string_view>
#include <vector>

namespace echorama {

/// The lines of a text header and the numbers in them, for the parsers of the two formats. Every complaint names the file.
class HeaderLines {
public:
  /// \throws Error(FileSystem) when the file cannot be opened.
  explicit HeaderLines(const std::string& path);

  /// The next line without its end. \returns false at the end of the file.
  /// \throws Error(BadFile) when the line holds control characters (binary data) or is longer than a million bytes.
  bool Next(std::string& line);

  /// Bytes read so far: where the voxels begin, after the last line of a header.
  std::int64_t Position() const { return position_; }

  /// Error(BadFile): the file and the reason.
  [[noreturn]] void Fail(const std::string& reason) const;
  /// The same, with the number of the line that was read last, or of a \a line that was read before.
  [[noreturn]] void FailHere(const std::string& reason) const { FailAt(line_, reason); }
  [[noreturn]] void FailAt(std::int64_t line, const std::string& reason) const;
  std::int64_t Line() const { return line_; } ///< from 1

  /// \a text as \a count finite numbers that are separated by blanks.
  template <class T>
  std::vector<T> Numbers(const std::string& key, std::string_view text, std::size_t count) const
  {
    const std::vector<std::string_view> words = SplitWords(text);
    if (words.size() != count)
      Fail(key + " holds " + std::to_string(words.size()) + " values; " + std::to_string(count) + " are needed");
    std::vector<T> numbers(count);
    for (std::size_t i = 0; i < count; ++i)
      if (!ParseNumber(words[i], numbers[i]) || numbers[i] - numbers[i] != T(0)) // the difference is NaN unless finite
        Fail(key + " holds \"" + std::string(words[i]) + "\", which is not a " +
             (std::is_integral_v<T> ? "whole number that fits" : "finite number"));
    return numbers;
  }

  /// As Numbers, for sizes: whole numbers from 0 to 2^31 - 1.
  std::vector<int> Sizes(const std::string& key, std::string_view text, std::size_t count) const;

private:
  std::string path_;
  std::ifstream stream_;
  std::int64_t position_ = 0;
  std::int64_t line_ = 0;
};

/// Makes a header's geometry from what a file says of its \a axes (2 or 3) axes: a third axis for images, and slices in
/// reverse where the axes are left-handed.
void PlaceAxes(ImageHeader& header, int axes);

/// \a file as named by the header at \a path: relative to its folder.
std::string DetachedPath(const std::string& path, const std::string& file);

/// The name of the file of voxels beside the header \a path: its own, with \a extension.
/// \throws Error(InvalidParameter) when no reader of headers would find that name again.
std::string DetachedName(const std::string& path, const std::string& extension);

/// What readers of volumes say of a sequence.
constexpr const char* NotAVolume = "it is a tracked sequence of frames, not a volume; vtkUltrasoundSequenceReader reads it";

/// Hands a field of a frame to \a axis. \returns false, having done nothing, when the key is that of no frame.
bool TakeFrameField(const HeaderLines& lines, FrameAxis& axis, std::string_view key, std::string_view value);

/// \param axis nullptr: the file is a volume, else a sequence
void ParseMetaImage(ImageHeader& header, FrameAxis* axis);
void ParseNrrd(ImageHeader& header, FrameAxis* axis);

/// (x,y,z), as NRRD wants it.
std::string VectorText(const Eigen::Vector3d& v);

/// A value without line breaks, as NRRD wants it.
std::string EscapedNrrd(const std::string& text);

} // namespace echorama
