// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Filters/Tissue/SurfaceCheck.h"

namespace echorama {

/// A closed body like an abdomen with child, 300 x 240 x 190 mm, front upwards, with a navel: smooth, so that its offsets are
/// known to be so. \param divisions of each edge of a cube whose faces it is drawn on: 12 * divisions^2 triangles \param foldMm
/// depth of a fold around the belly, 4 mm wide: its brinks are bent more tightly than a wall of 2 mm follows
TriangleSurface InventedAbdomen(int divisions, double foldMm = 0.0);

} // namespace echorama
