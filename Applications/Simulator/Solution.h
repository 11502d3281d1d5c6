// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "ImageView.h"
#include "Widgets/Session/ScanTask.h"
#include <vtkPolyData.h>
#include <vtkSmartPointer.h>

namespace echorama {

class Scan;

/// What is shown of a solution after an answer.
struct ShownSolution {
  PlanePicture picture;               ///< beside one's own; none when a length or a place was asked for
  vtkSmartPointer<vtkPolyData> marks; ///< lines on the body, mm
  QString text;
};

/// \throws as Scan::PictureFrom
ShownSolution SolutionOf(const ScanTask& task, Scan& scan);

/// A ring about a pose's z, for where a probe is to be brought.
vtkSmartPointer<vtkPolyData> RingAt(const Pose& pose, double radiusMm);

} // namespace echorama
