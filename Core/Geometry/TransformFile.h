// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Geometry/TransformGraph.h"
#include <string>
#include <string_view>
#include <vector>

namespace echorama {

/// Named transforms on disk, in two formats that are told apart by their content:
///
/// * Configurations of the Plus toolkit (XML): each element Transform in CoordinateDefinitions, with From, To, Matrix (16
///   numbers, row by row) and, optionally, Error (negative: not known), Date and Status. Frames are made to begin with a capital.
/// * {"schema": "echorama-transforms-1", "unit": "mm", "transforms": [{"from": .., "to": .., "matrix": [[4 numbers] x 4],
///   "status": "OK", "error_mm": .., "date": ..}, ...]}; the last three may be missing; older files say errorMm. Other keys are
///   ignored.
///
/// An edge that is given twice counts once when its matrix is the same. Status is that of TransformStatusOf. A matrix may be
/// singular (it leads one way only), its last row must be 0 0 0 1.
/// \throws Error(FileSystem) when the file cannot be read, Error(BadFile) that names file and transform: neither format,
/// no CoordinateDefinitions, another schema or unit, a missing name or matrix, numbers that are too few, too many or not
/// finite, a transform from a frame to itself, an edge given twice with different matrices, more than 1000 transforms, or a
/// cycle that does not close within \a tolerance.
std::vector<NamedTransform> ReadTransforms(const std::string& path, const CycleTolerance& tolerance = {});

/// Writes the JSON format under a temporary name and renames. Numbers come back to the last bit. \a report, the text of a JSON
/// object, is kept under the key "report": how the transforms were found. Empty: none.
/// \throws Error(InvalidParameter) when an edge has a NamedTransform::Complaint(), a matrix that is not finite, is given twice,
/// or has a text that is not UTF-8, or when the report is no JSON object, Error(FileSystem). Cycles are not checked.
void WriteTransforms(const std::string& path, const std::vector<NamedTransform>& transforms, const std::string& report = "");

/// The report of a file that WriteTransforms wrote, or an empty text. \throws as ReadTransforms, for a file that is not JSON.
std::string ReadTransformReport(const std::string& path);

/// Whether a file that begins with \a bytes holds transforms: XML whose root is PlusConfiguration, or JSON that names our schema.
bool LooksLikeTransforms(std::string_view bytes);

} // namespace echorama
