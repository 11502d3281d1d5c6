// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <vtkSmartPointer.h>

class vtkImageData;
class vtkPolyData;

namespace echorama {

/// The skin of a volume: the outline of its valid region, smooth, as triangles in the world (mm). The largest piece alone.
/// \throws Error(BadInput) when no voxel is valid.
vtkSmartPointer<vtkPolyData> SkinOfVolume(vtkImageData* volume);

/// The same surface with normals at its points, outwards if it is closed.
vtkSmartPointer<vtkPolyData> WithNormals(vtkPolyData* surface);

} // namespace echorama
