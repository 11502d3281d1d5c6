// SPDX-License-Identifier: BSD-3-Clause
#ifndef vtkUltrasoundNewDataArray_h
#define vtkUltrasoundNewDataArray_h

#include "vtkFieldData.h"
#include "vtkSmartPointer.h"

namespace echorama {

/// An array of that name, empty, in \a data.
template <class Array>
vtkSmartPointer<Array> NewDataArray(vtkFieldData* data, const char* name, int components = 1)
{
  auto array = vtkSmartPointer<Array>::New();
  array->SetName(name);
  array->SetNumberOfComponents(components);
  data->AddArray(array);
  return array;
}

} // namespace echorama

#endif
