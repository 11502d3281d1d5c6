// SPDX-License-Identifier: BSD-3-Clause
// What vtkUltrasoundAlignmentSession takes and tells in VTK's matrices and arrays.
#ifndef vtkUltrasoundSessionTables_h
#define vtkUltrasoundSessionTables_h

#include "Core/Base/Error.h"
#include "Core/Geometry/MatrixRows.h"
#include "Core/Geometry/RigidTransform.h"
#include "Widgets/Session/Backups.h"
#include "Widgets/Session/LiveScore.h"

#include "vtkDoubleArray.h"
#include "vtkIntArray.h"
#include "vtkMatrix4x4.h"
#include "vtkNew.h"
#include "vtkPointData.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"
#include "vtkStringArray.h"

#include <algorithm>
#include <string>
#include <vector>

namespace echorama {

/** Throws Error(InvalidParameter) when there is none. */
inline Pose PoseOf(vtkMatrix4x4* matrix, const char* what)
{
  if (!matrix) {
    throw Error(Error::Kind::InvalidParameter, std::string("there is no ") + what);
  }
  return FromRows<Pose>(matrix->GetData());
}

/** Returns whether there are both. */
inline bool Take(const Pose* pose, vtkMatrix4x4* matrix)
{
  if (pose && matrix) {
    Eigen::Map<MatrixRows>(matrix->GetData()) = pose->matrix();
    matrix->Modified();
  }
  return pose && matrix;
}

/** \returns how many. The array may be nullptr. */
inline int Tell(const std::vector<std::string>& texts, vtkStringArray* array)
{
  if (array) {
    array->Initialize();
    for (const std::string& text : texts) {
      array->InsertNextValue(text);
    }
  }
  return static_cast<int>(texts.size());
}

/** \returns how many. Arrays may be nullptr. */
inline int Tell(const std::vector<Backup>& backups, vtkStringArray* paths, vtkStringArray* labels, vtkDoubleArray* times)
{
  for (vtkAbstractArray* array :
       {static_cast<vtkAbstractArray*>(paths), static_cast<vtkAbstractArray*>(labels), static_cast<vtkAbstractArray*>(times)}) {
    if (array) {
      array->Initialize();
    }
  }
  for (const Backup& backup : backups) {
    if (paths) {
      paths->InsertNextValue(backup.path);
    }
    if (labels) {
      labels->InsertNextValue(backup.readable ? backup.label : "damaged");
    }
    if (times) {
      times->InsertNextValue(static_cast<double>(backup.time));
    }
  }
  return static_cast<int>(backups.size());
}

/** Points of the volumes, at most so many of each, with the arrays Error and Volume. \a score may be nullptr. */
inline void TellErrors(const LiveScoreResult* score, vtkPolyData* vectors, int pointsPerVolume)
{
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  vtkNew<vtkDoubleArray> errors;
  errors->SetName("Error");
  errors->SetNumberOfComponents(3);
  vtkNew<vtkIntArray> ids;
  ids->SetName("Volume");
  for (std::size_t i = 0; score && i < score->volumes.size(); ++i) {
    const VolumeScore& volume = score->volumes[i];
    const std::size_t count = std::min(volume.points.size(), static_cast<std::size_t>(std::max(pointsPerVolume, 0)));
    for (std::size_t k = 0; k < count; ++k) {
      const std::size_t at = k * volume.points.size() / count; // spread over all: they come in the order of their voxels
      points->InsertNextPoint(volume.points[at].data());
      errors->InsertNextTuple(volume.errors[at].data());
      ids->InsertNextValue(score->ids[i]);
    }
  }
  vectors->Initialize();
  vectors->SetPoints(points);
  vectors->GetPointData()->AddArray(errors);
  vectors->GetPointData()->AddArray(ids);
  vectors->GetPointData()->SetActiveVectors("Error");
}

} // namespace echorama

#endif
