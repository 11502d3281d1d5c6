// SPDX-License-Identifier: BSD-3-Clause
#include "vtkUltrasoundTrackerSource.h"

#include "vtkObjectFactory.h"

vtkStandardNewMacro(vtkUltrasoundTrackerSource);

vtkUltrasoundTrackerSource::vtkUltrasoundTrackerSource()
{
  this->SetNumberOfInputPorts(0);
}

vtkUltrasoundTrackerSource::~vtkUltrasoundTrackerSource() = default;
