// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Imaging/VolumeView.h"
#include "Widgets/Pictures/SlicePicture.h"
#include <array>
#include <cstdint>

namespace echorama {

/// The colour of a share in [0, 1] of the longest shift of a scale, RGB in [0, 1]: from blue over purple and orange to yellow,
/// ever brighter, so that it can be told without telling red from green. What lies outside has the colour of its end.
std::array<double, 3> ShiftColour(double share);

/// Lays a map of lengths in mm over a picture that DrawSlice drew on the plane. Cells that are NaN are not known: there the
/// picture stays as it is, and so it does where it shows nothing. A square of 3 x 3 pixels is decided by the cell that its middle
/// falls in. \param mostMm has the last colour, > 0 \param opacity in [0, 1] \param rgba 4 width height bytes, changed.
void LayShifts(const PosedVolume<float>& map, double mostMm, double opacity, const SlicePlane& plane, std::uint8_t* rgba);

} // namespace echorama
