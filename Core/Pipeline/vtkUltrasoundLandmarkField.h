// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Landmarks that a volume carries, as field data: `Landmarks` (3 doubles each, mm, in the world, where the volume lies) and
// `LandmarkLabels` (a string each). They go where the volume goes (vtkUltrasoundVolume::Move). Nobody else spells these names.
#include "Core/Geometry/Landmark.h"
#include "Core/Geometry/RigidTransform.h"
#include "EchoramaCoreModule.h"
#include <vector>

class vtkDataObject;

class ECHORAMACORE_EXPORT vtkUltrasoundLandmarkField {
public:
  static const char* PlacesName() { return "Landmarks"; }
  static const char* LabelsName() { return "LandmarkLabels"; }

  /** Those that \a data carries, in the world; none when it has no such fields. Throws echorama::Error(BadInput) when the fields
   * do not belong together, or a number is not finite. */
  static std::vector<echorama::Landmark> Of(vtkDataObject* data);
  static void Set(vtkDataObject* data, const std::vector<echorama::Landmark>& landmarks);
  /** Leaves data without such fields, or with others under their names, alone. */
  static void Move(vtkDataObject* data, const echorama::Pose& pose);
};
