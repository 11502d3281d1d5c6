// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/JsonPlace.h"
#include "Core/Geometry/ImageGeometry.h"

namespace echorama {

/// Geometries and poses as JSON, for all files that hold some. JSON prints the shortest digits that give a double back, so they
/// survive any number of rounds unchanged. To be named in .cxx files only.
namespace PoseJson {

/// {"origin": [3], "spacing": [3], "direction": [[3] x 3], "dimensions": [3]}.
JsonPlace::Json Of(const ImageGeometry& geometry);
/// \throws Error(BadFile) that names \a place and the field, also for a geometry that is none (ImageGeometry::Check).
ImageGeometry ToGeometry(const JsonPlace::Json& value, const JsonPlace& place);

/// Four rows of four numbers. \throws Error(BadFile) also for a matrix that is not rigid.
Pose ToPose(const JsonPlace::Json& value, const JsonPlace& place);

} // namespace PoseJson
} // namespace echorama
