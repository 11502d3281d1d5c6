// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Progress.h"
#include "Readers/DicomHeader.h"
#include <string>
#include <vector>

namespace echorama {

/// The photometric interpretation of an encapsulated file: what the first picture's lossy JPEG says of itself (by its marks of
/// JFIF or Adobe, or its sampling), else what the header says, which may be that of the pixels before they were compressed.
/// \throws Error(BadFile) when the fragments are damaged.
std::string ColoursOfDicomStream(const DicomHeader& header);

/// The compressed pixels of an encapsulated file, as gdcm's codecs take them: one fragment per picture.
/// What does not begin as its transfer syntax says, or says other than the header what its pixels are, is kept from the codecs.
/// \throws Error(BadFile) when the fragments are damaged, or of a syntax that is not known.
std::vector<std::string> ReadDicomFragments(const DicomHeader& header);

/// The pixels of all pictures of a file that are not plain, as they were before compression, one after the other.
/// Colours stay in the file's space, but YBR_RCT and YBR_ICT, which become RGB.
/// \param progress asked, with \a fraction, whether to go on while they are decoded
/// \throws Error(BadFile) when they cannot be decoded or are not as many as the header says; Error(Cancelled).
std::vector<char> DecodeDicomPixels(const DicomHeader& header, const Progress& progress = {}, double fraction = 0.0);

} // namespace echorama
