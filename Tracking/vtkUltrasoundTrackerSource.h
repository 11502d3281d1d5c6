// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class vtkUltrasoundTrackerSource
 * @brief where the tools of a tracker are: live, replayed or simulated
 */
#ifndef vtkUltrasoundTrackerSource_h
#define vtkUltrasoundTrackerSource_h

#include "EchoramaTrackingModule.h"
#include "vtkPolyDataAlgorithm.h"

class ECHORAMATRACKING_EXPORT vtkUltrasoundTrackerSource : public vtkPolyDataAlgorithm {
public:
  static vtkUltrasoundTrackerSource* New();
  vtkTypeMacro(vtkUltrasoundTrackerSource, vtkPolyDataAlgorithm);

protected:
  vtkUltrasoundTrackerSource();
  ~vtkUltrasoundTrackerSource() override;

private:
  vtkUltrasoundTrackerSource(const vtkUltrasoundTrackerSource&) = delete;
  void operator=(const vtkUltrasoundTrackerSource&) = delete;
};

#endif
