// SPDX-License-Identifier: BSD-3-Clause
#include "vtkSMUltrasoundSourceProxy.h"

#include "vtkObjectFactory.h"

vtkStandardNewMacro(vtkSMUltrasoundSourceProxy);

//----------------------------------------------------------------------------
void vtkSMUltrasoundSourceProxy::PostUpdateData(bool usingCache)
{
  this->Superclass::PostUpdateData(usingCache);
  this->UpdatePropertyInformation();
}
