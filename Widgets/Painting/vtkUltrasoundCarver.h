// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class vtkUltrasoundCarver
 * @brief takes what lies inside a shape, or outside of it, out of the valid region
 *
 * Input: one volume. Output: the same volume (pose, arrays and field data kept) with a new `ValidRegion`: voxels whose middle
 * lies on the side that is taken away are not real any more; their intensities stay. The shape is any vtkImplicitFunction
 * (vtkSphere, vtkBox, vtkPlane, vtkCylinder, ...), in the world, where the input lies; inside is where it is 0 or below. Where it
 * is not a number nothing is taken away.
 *
 * Without a shape nothing is taken away. Of a composite data set each volume is carved. Under MPI each rank computes the whole.
 *
 * @sa vtkUltrasoundBrush
 */
#ifndef vtkUltrasoundCarver_h
#define vtkUltrasoundCarver_h

#include "EchoramaWidgetsPaintingModule.h"
#include "vtkSmartPointer.h" // for the shape
#include "vtkUltrasoundImageAlgorithm.h"
#include "vtkUltrasoundParameters.h"

class vtkImplicitFunction;

class ECHORAMAWIDGETSPAINTING_EXPORT vtkUltrasoundCarver : public vtkUltrasoundImageAlgorithm {
public:
  static vtkUltrasoundCarver* New();
  vtkTypeMacro(vtkUltrasoundCarver, vtkUltrasoundImageAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  // BEGIN parameters
  enum TakeAwaies { INSIDE = 0, OUTSIDE = 1 };

  ///@{
  /**
   * Which side of the shape leaves the valid region. The inside of a plane is the side that its normal points away from. Default
   * inside. There are INSIDE, OUTSIDE.
   */
  vtkUltrasoundChoiceMacro(TakeAway);
  void SetTakeAwayToInside() { this->SetTakeAway(INSIDE); }
  void SetTakeAwayToOutside() { this->SetTakeAway(OUTSIDE); }
  ///@}

  /**
   * Any parameter by its name: as a number (of a switch 0 or 1, of a choice its place from 0), as text ("1.5", "on", the name of
   * a choice, "1 0 0"), integers and vectors without a loss. Setting returns false, after an error event, when there is no such
   * parameter or value. GetParameterDescriptions tells what parameters there are, as JSON: an array of objects with name, type,
   * value, unit, low, high, choices, help ...
   */
  vtkUltrasoundAnyParameterMacro();
  // END parameters

  ///@{
  /** What is carved with. Default nullptr: nothing. */
  void SetShape(vtkImplicitFunction* shape);
  vtkImplicitFunction* GetShape() const;
  ///@}

  /** Also that of the shape. */
  vtkMTimeType GetMTime() override;

#ifndef __VTK_WRAP__
  echorama::ParameterList Parameters(); ///< for C++: they point into this object
#endif

protected:
  vtkUltrasoundCarver();
  ~vtkUltrasoundCarver() override;

#ifndef __VTK_WRAP__
  void Execute(vtkInformationVector** inputs, vtkImageData* output, const echorama::Progress& progress) override;
#endif

private:
  vtkUltrasoundCarver(const vtkUltrasoundCarver&) = delete;
  void operator=(const vtkUltrasoundCarver&) = delete;

  vtkSmartPointer<vtkImplicitFunction> Shape;
  int Taken = 0; // of TakeAways
};

#endif
