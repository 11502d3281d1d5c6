// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Tracking/Optical/FisheyeLens.h"
#include "Tracking/Optical/GreyFrame.h"
#include <cstdint>
#include <string>

namespace echorama {

/// What a picture from inside a shell says of which shell it is (dissertation 8.2.1).
struct ShellMarkerReading {
  enum class Status {
    Read,
    Absent, ///< nothing that looks like a marker
    Unclear ///< its ends are seen, but what is between them has no right checksum: covered, blurred, or too dark
  };

  Status status = Status::Absent;
  std::uint32_t id = 0;          ///< when read: vtkUltrasoundShell's MarkerId
  double contrast = 0.0;         ///< of the weakest pair of cells, difference over sum
  double azimuthDegrees = 0.0;   ///< where its first column begins: how the camera is turned in its base
  double elevationDegrees = 0.0; ///< how much higher than it should its lowest row is seen

  std::string Text() const; ///< "shell 0A1B2C (contrast 0.21)"
};

/// Looks for a marker (Tracking/Optical/MarkerPattern.h) all around the picture's edge, up to 3 degrees higher or lower than it
/// should be, and leaning by up to 1.2 degrees from end to end. The lights of tools should be off; the mean of several frames is
/// better than one where it is dark. The camera's lens need be known to a few percent only.
///
/// \throws Error(InvalidParameter) for a lens that is none, or whose size is not that of the picture
ShellMarkerReading ReadShellMarker(const GreyFrame& frame, const FisheyeLens& lens);

} // namespace echorama
