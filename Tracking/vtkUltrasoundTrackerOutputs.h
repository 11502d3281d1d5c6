// SPDX-License-Identifier: BSD-3-Clause
// What a tracker shows as data of VTK: the outputs of vtkUltrasoundTrackerSource.
#ifndef vtkUltrasoundTrackerOutputs_h
#define vtkUltrasoundTrackerOutputs_h

#include "Core/Geometry/MatrixRows.h"
#include "Tracking/Stream/ShownImage.h"
#include "Tracking/Stream/ShownTools.h"

#include "vtkCellArray.h"
#include "vtkCellData.h"
#include "vtkDoubleArray.h"
#include "vtkImageData.h"
#include "vtkIntArray.h"
#include "vtkNew.h"
#include "vtkPointData.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"
#include "vtkSmartPointer.h"
#include "vtkStringArray.h"
#include "vtkUltrasoundAcquisition.h"
#include "vtkUltrasoundNewDataArray.h"
#include "vtkUltrasoundVolume.h"
#include "vtkUltrasoundVoxelTypes.h"
#include "vtkUnsignedCharArray.h"

#include <cmath>
#include <cstring>
#include <string>
#include <vector>

namespace echorama {

/// A point per tool, with a vertex where it is valid; of those the axes, as lines of that length.
inline void PutTools(const std::vector<ShownTool>& shown, const std::string& world, double axisLengthMm, vtkPolyData* output,
                     vtkPolyData* axesOutput)
{
  const vtkNew<vtkPoints> points, ends;
  points->SetDataTypeToDouble();
  ends->SetDataTypeToDouble();
  const vtkNew<vtkCellArray> vertices, lines;
  vtkPointData* arrays = output->GetPointData();
  const auto tools = NewDataArray<vtkIntArray>(arrays, "Tool");
  const auto times = NewDataArray<vtkDoubleArray>(arrays, "TimeStamp");
  const auto toWorld = NewDataArray<vtkDoubleArray>(arrays, "ToolToWorld", 16);
  const auto statuses = NewDataArray<vtkUnsignedCharArray>(arrays, "Status");
  const vtkSmartPointer<vtkDoubleArray> axes[3] = {NewDataArray<vtkDoubleArray>(arrays, "XAxis", 3),
                                                   NewDataArray<vtkDoubleArray>(arrays, "YAxis", 3),
                                                   NewDataArray<vtkDoubleArray>(arrays, "ZAxis", 3)};
  const auto toolOfLine = NewDataArray<vtkIntArray>(axesOutput->GetCellData(), "Tool");
  const auto axisOfLine = NewDataArray<vtkIntArray>(axesOutput->GetCellData(), "Axis");
  const auto names = NewDataArray<vtkStringArray>(output->GetFieldData(), "ToolNames");
  for (const ShownTool& tool : shown) {
    const Eigen::Vector3d origin = tool.toWorld.translation();
    const bool valid = tool.status == TransformStatus::Valid;
    const vtkIdType point = points->InsertNextPoint(origin.data());
    if (valid) {
      vertices->InsertNextCell(1, &point);
    }
    const int number = static_cast<int>(names->InsertNextValue(tool.frame));
    tools->InsertNextValue(number);
    times->InsertNextValue(tool.time);
    statuses->InsertNextValue(static_cast<unsigned char>(tool.status));
    toWorld->InsertNextTuple(MatrixRows(tool.toWorld.matrix()).data());
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::Vector3d direction = tool.toWorld.linear().col(axis).normalized();
      axes[axis]->InsertNextTuple(direction.data());
      if (valid) {
        const Eigen::Vector3d end = origin + axisLengthMm * direction;
        const vtkIdType line[2] = {ends->InsertNextPoint(origin.data()), ends->InsertNextPoint(end.data())};
        lines->InsertNextCell(2, line);
        toolOfLine->InsertNextValue(number);
        axisOfLine->InsertNextValue(axis);
      }
    }
  }
  output->SetPoints(points);
  output->SetVerts(vertices);
  axesOutput->SetPoints(ends);
  axesOutput->SetLines(lines);
  axesOutput->GetFieldData()->AddArray(names);
  for (vtkPolyData* data : {output, axesOutput}) {
    vtkUltrasoundVolume::AddField(data, "WorldFrame", world);
  }
}

/// The image where it lies; colours become grey.
inline void PutImage(const ShownImage& shown, vtkImageData* output)
{
  const StreamedImage& image = shown.image;
  vtkUltrasoundVolume::SetGeometry(output, shown.geometry);
  const auto intensity = vtkSmartPointer<vtkDataArray>::Take(vtkDataArray::CreateDataArray(VtkTypeOf(image.type)));
  intensity->SetName(vtkUltrasoundVolume::IntensityName());
  intensity->SetNumberOfTuples(output->GetNumberOfPoints());
  if (image.components == 1) {
    std::memcpy(intensity->GetVoidPointer(0), image.voxels->data(), image.voxels->size());
  } else {
    DispatchVoxelType(image.type, [&](auto zero) {
      using T = decltype(zero);
      MakeGrey(reinterpret_cast<const T*>(image.voxels->data()), static_cast<std::uint64_t>(image.components),
               static_cast<T*>(intensity->GetVoidPointer(0)), intensity->GetNumberOfTuples());
    });
  }
  output->GetPointData()->SetScalars(intensity);
  const auto valid = NewDataArray<vtkUnsignedCharArray>(output->GetPointData(), vtkUltrasoundVolume::ValidRegionName());
  valid->SetNumberOfTuples(output->GetNumberOfPoints());
  valid->Fill(1.0);
  if (shown.imageToWorld) {
    vtkUltrasoundAcquisition::SetImageToWorld(output, *shown.imageToWorld);
  }
  if (std::isfinite(image.time)) {
    vtkUltrasoundAcquisition::SetTimeStamp(output, image.time);
  }
}

} // namespace echorama

#endif
