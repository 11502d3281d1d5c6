// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class vtkUltrasoundBrush
 * @brief paints or carves one stroke, or many, as a step of the pipeline that stays editable
 *
 * Input 0: one volume. Output: the same volume (pose, arrays and field data kept) with a new `Intensity` and `ValidRegion`; the
 * input stays as it is, so that without this filter nothing is painted. The stroke goes along straight lines through the points
 * (AddPoint), which are in the world, where the input lies: put the filter before what moves the volume, and strokes go with it.
 * It is the very stroke of vtkUltrasoundAlignmentSession: a ball in mm, what counts for a voxel is its least distance from the
 * whole path.
 *
 * Input 1 (optional): vtkPolyData. Each of its lines is a stroke, in their order, and each vertex one of a single point; the
 * filter's own points are not used then.
 *
 * Without points nothing is painted. Fails with a message for a point that is not finite. Of a composite data set each volume is
 * painted. Under MPI each rank computes the whole.
 *
 * @sa vtkUltrasoundCarver, vtkUltrasoundAlignmentSession
 */
#ifndef vtkUltrasoundBrush_h
#define vtkUltrasoundBrush_h

#include "EchoramaWidgetsPaintingModule.h"
#include "vtkUltrasoundImageAlgorithm.h"
#include "vtkUltrasoundParameters.h"

#ifndef __VTK_WRAP__
#include "Widgets/Painting/Stroke.h"
#include <vector>
#endif

class ECHORAMAWIDGETSPAINTING_EXPORT vtkUltrasoundBrush : public vtkUltrasoundImageAlgorithm {
public:
  static vtkUltrasoundBrush* New();
  vtkTypeMacro(vtkUltrasoundBrush, vtkUltrasoundImageAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  // BEGIN parameters
  enum Modes { PAINT = 0, CARVE = 1 };

  ///@{
  /** Whether voxels get the intensity of the brush, or leave the valid region. Default paint. There are PAINT, CARVE. */
  vtkUltrasoundChoiceMacro(Mode);
  void SetModeToPaint() { this->SetMode(PAINT); }
  void SetModeToCarve() { this->SetMode(CARVE); }
  ///@}

  /** Radius of the brush. In (0, 1000] mm; default 3. */
  vtkUltrasoundNumberMacro(RadiusMm);

  /** What is painted, as far as the volume's type can hold it. Used when Mode is paint. In grey levels; default 0. */
  vtkUltrasoundNumberMacro(Intensity);

  /** How far paint changes intensities at the middle of the brush. Used when Mode is paint. In [0, 1]; default 1. */
  vtkUltrasoundNumberMacro(Opacity);

  /**
   * Share of the radius that is painted in full; from there it falls off smoothly. Used when Mode is paint. In [0, 1]; default
   * 0.5.
   */
  vtkUltrasoundNumberMacro(Hardness);

  /** Whether paint leaves voxels alone that are not real; otherwise it makes them real. Used when Mode is paint. Default on. */
  vtkUltrasoundSwitchMacro(InsideValid);

  /**
   * Any parameter by its name: as a number (of a switch 0 or 1, of a choice its place from 0), as text ("1.5", "on", the name of
   * a choice, "1 0 0"), integers and vectors without a loss. Setting returns false, after an error event, when there is no such
   * parameter or value. GetParameterDescriptions tells what parameters there are, as JSON: an array of objects with name, type,
   * value, unit, low, high, choices, help ...
   */
  vtkUltrasoundAnyParameterMacro();
  // END parameters

  ///@{
  /** The points of the stroke, mm, in the world. */
  void AddPoint(double x, double y, double z);
  void ClearPoints();
  int GetNumberOfPoints() const { return static_cast<int>(this->Points.size()); }
  ///@}

  ///@{
  /** Strokes as lines and vertices: sets input 1, or takes it away. */
  void SetPathConnection(vtkAlgorithmOutput* output) { this->SetInputConnection(1, output); }
  void SetPathData(vtkDataObject* data) { this->SetInputDataObject(1, data); }
  void RemovePath() { this->RemoveAllInputConnections(1); }
  ///@}

#ifndef __VTK_WRAP__
  echorama::ParameterList Parameters(); ///< for C++: they point into this object
#endif

protected:
  vtkUltrasoundBrush();
  ~vtkUltrasoundBrush() override;

  int FillInputPortInformation(int port, vtkInformation* info) override;
#ifndef __VTK_WRAP__
  void Execute(vtkInformationVector** inputs, vtkImageData* output, const echorama::Progress& progress) override;
#endif

private:
  vtkUltrasoundBrush(const vtkUltrasoundBrush&) = delete;
  void operator=(const vtkUltrasoundBrush&) = delete;

#ifndef __VTK_WRAP__
  std::vector<echorama::Stroke> Strokes(vtkInformationVector* paths) const;

  echorama::Brush Values;
  std::vector<Eigen::Vector3d> Points;
#endif
};

#endif
