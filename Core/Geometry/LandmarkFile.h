// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Geometry/Landmark.h"
#include <string>
#include <vector>

namespace echorama {

/// Reads a list of landmarks, in one of three formats that are told apart by their content, and brings it to LPS and mm:
///
/// * Markups of 3D Slicer in JSON (`.mrk.json`): the control points of all markups in the file. coordinateSystem is LPS (also
///   when it is missing) or RAS, coordinateUnits mm; points whose positionStatus is other than "defined" are left out.
/// * Fiducials of 3D Slicer (`.fcsv`): `# CoordinateSystem =` 0 or RAS (also when it is missing), 1 or LPS; the columns x, y,
///   z and label of `# columns =`, by default id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label.
/// * CSV: label,x,y,z in LPS; or a first line that names the columns: label (or name), and x,y,z or l,p,s (both LPS) or r,a,s;
///   others are skipped, but points with 0 in a column `defined` are left out. This is what Slicer's table of control points
///   looks like. Lines that begin with # are comments.
///
/// Texts in double quotes may hold commas; blanks around a label are not part of it. Labels may be empty or the same.
/// \throws Error(FileSystem) when the file cannot be read, Error(BadFile) that names file and line or point: another unit or
/// coordinate system (voxel indices among them), a column or number that is missing, not a number, or beyond 1e7 mm, a text that
/// is no such list, more than a million landmarks, or not one.
std::vector<Landmark> ReadLandmarks(const std::string& path);

} // namespace echorama
