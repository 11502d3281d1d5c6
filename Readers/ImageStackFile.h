// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Readers/VolumeSource.h"
#include <string>
#include <string_view>

namespace echorama {

/// Whether a file begins like PNG, JPEG or TIFF.
bool LooksLikeImage(std::string_view start);

/// Whether a folder holds such a file.
bool HoldsImages(const std::string& folder);

/// Opens a stack of greyscale images as one volume: a folder, whose PNG, JPEG and TIFF files are the slices in the natural order
/// of their names (img2 before img10); one file of such a stack (those beside it that differ by their last number belong to it);
/// or a TIFF file of several pages. PNG of 8 and 16 bits (fewer become 8), JPEG, TIFF of 8 to 32 bits or float.
///
/// Such files hold no pose: the first pixel of the first slice is the origin, x runs along the rows, y down, z from slice to
/// slice. Spacing, for each axis: the parameters; what ImageJ or OME wrote into a TIFF; for x and y the resolution in the files,
/// unless it is one of the screens' defaults, 72 and 96 dpi; 1 mm. All but the first come with a note. Colours become grey
/// (luminance 0.299 R + 0.587 G + 0.114 B, which leaves equal channels as they are); transparency is dropped; other files in the
/// folder and gaps in the numbers are noted; turned images are refused. \throws Error as OpenVolume: names the image that is
/// broken, or whose size or type is not that of the first.
std::unique_ptr<VolumeSource> OpenImageStack(const std::string& path, const VolumeReadParameters& parameters = {});

} // namespace echorama
