// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Readers/SequenceFile.h"
#include <string>
#include <vector>

namespace echorama {

/// How the headers of sequences are worded, for the writer and the recorder. Messages begin with \a path.

/// What both need of \a content: possible dimensions, a geometry (identity where there are no images), and fields that a header
/// can hold. \throws Error(BadInput)
void CheckSequence(const std::string& path, SequenceContent& content);

/// The header of a MetaImage before the fields of its frames, in order. "DimSize" holds the dimensions of a frame and ends in a
/// blank: the number of frames is to follow.
std::vector<HeaderField> MetaImageSequenceFields(const SequenceContent& content, bool compressed);

/// Whether a sequence can hold a transform of this name, so that it is read again as what it was.
bool CanNameTransform(const std::string& name);

/// The fields of frame \a number, without "Seq_Frame0000_". \a statusKey: that of its image, whose name differs between formats;
/// the image is valid when the frame says so and \a hasPixels.
/// \throws Error(BadInput) when the names of its transforms and fields cannot be held or are given twice, when a matrix is not
/// finite though its status is Valid, or the time is infinite.
std::vector<HeaderField> SequenceFrameFields(const std::string& path, const SequenceFrame& frame, int number,
                                             const std::string& statusKey, bool hasPixels);

/// What a recorder writes into its headers, so that readers know that a file of pixels may hold more than the header counts: the
/// recorder was killed in between.
inline const HeaderField RecorderField{"Recorder", "Echorama"};

/// "Seq_Frame0012_"
std::string SequenceFramePrefix(int number);

} // namespace echorama
