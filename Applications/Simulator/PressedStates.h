// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Progress.h"
#include <QStringList>
#include <vector>
#include <vtkImageData.h>
#include <vtkSmartPointer.h>

namespace echorama {

struct Subject;

/// Of \a files those that hold displacements, not greys: images (.vti) with a point array Displacement. Nothing else is read of
/// them, and a file that cannot be read is none.
QStringList PressedStatesAmong(const QStringList& files);

/// Reads states of tissue that a probe presses (displacement images to which vtkUltrasoundLiveImage::SetPressState told how deep
/// and where), the least deep first, and looks whether \a body was pressed. For a Job. \throws Error that names file and reason;
/// Error(Cancelled)
std::vector<vtkSmartPointer<vtkImageData>> ReadPressedStates(const QStringList& files, const Subject& body,
                                                             const Progress& progress);

/// How deep the probe was pressed in, mm. Of a state that was read.
double PressMmOf(vtkImageData* state);

} // namespace echorama
