// SPDX-License-Identifier: BSD-3-Clause
// Arrows from where points of the volumes are to where they belong, coloured by their length, with a scale in mm.
#ifndef vtkUltrasoundErrorArrows_h
#define vtkUltrasoundErrorArrows_h

#include "vtkNew.h"

class vtkActor;
class vtkLookupTable;
class vtkPolyData;
class vtkRenderer;
class vtkScalarBarActor;
class vtkUltrasoundAlignmentSession;

namespace echorama {

class ErrorArrows {
public:
  explicit ErrorArrows(vtkRenderer* renderer);
  ~ErrorArrows();

  /** To where the visible volumes of a session with a truth lie now. nullptr: none are shown. */
  void Update(vtkUltrasoundAlignmentSession* session);

private:
  vtkNew<vtkPolyData> Errors;
  vtkNew<vtkActor> Actor;
  vtkNew<vtkScalarBarActor> Scale;
  vtkNew<vtkLookupTable> Colours;
};

} // namespace echorama

#endif
