// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class vtkUltrasoundSkin
 * @brief the skin that a probe is put on: of a volume, of tissue, or of a mesh
 *
 * Input, one of
 *  * a volume: its skin is the outline of its `ValidRegion` (of the whole of it where it has none), holes filled, smoothed; the
 *    largest piece alone, and closed where the region ends with its grid;
 *  * tissue (see vtkUltrasoundTissue): the body that holds the others, as it is;
 *  * any other surface: itself, as triangles.
 *
 * Output: triangles in the world (mm) with Normals at their points, one per point; outwards where the surface is closed.
 *
 * Fails, with a message, for a volume without a valid voxel, tissue without a body, and a surface without a triangle. Under MPI
 * each rank computes the whole.
 *
 * @sa echorama::SkinMesh, echorama::OutlineRegion
 */
#ifndef vtkUltrasoundSkin_h
#define vtkUltrasoundSkin_h

#include "EchoramaFiltersLiveModule.h"
#include "vtkPolyDataAlgorithm.h"
#include "vtkSmartPointer.h"
#include "vtkUltrasoundParameters.h"

#ifndef __VTK_WRAP__
#include "Filters/Live/SkinShape.h"
#endif

class vtkImageData;
class vtkPolyData;

class ECHORAMAFILTERSLIVE_EXPORT vtkUltrasoundSkin : public vtkPolyDataAlgorithm {
public:
  static vtkUltrasoundSkin* New();
  vtkTypeMacro(vtkUltrasoundSkin, vtkPolyDataAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  // BEGIN parameters
  /**
   * In how many cells, at most, the valid region of a volume is looked at: more follow it closer, and take longer. In [1000,
   * 50000000]; default 300000.
   */
  vtkUltrasoundIntegerMacro(MostCells);

  /** How often its points are smoothed; 0: steps of cells stay. In [0, 200]; default 15. */
  vtkUltrasoundIntegerMacro(SmoothingSteps);

  /** Smaller values take more of what is rough away, and of what is fine. In [0.001, 2]; default 0.1. */
  vtkUltrasoundNumberMacro(PassBand);

  /**
   * Any parameter by its name: as a number (of a switch 0 or 1, of a choice its place from 0), as text ("1.5", "on", the name of
   * a choice, "1 0 0"), integers and vectors without a loss. Setting returns false, after an error event, when there is no such
   * parameter or value. GetParameterDescriptions tells what parameters there are, as JSON: an array of objects with name, type,
   * value, unit, low, high, choices, help ...
   */
  vtkUltrasoundAnyParameterMacro();
  // END parameters

#ifndef __VTK_WRAP__
  echorama::ParameterList Parameters(); ///< for C++: they point into this object
#endif

protected:
  vtkUltrasoundSkin() = default;
  ~vtkUltrasoundSkin() override = default;

  int FillInputPortInformation(int port, vtkInformation* information) override;
  int RequestUpdateExtent(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs) override;
  int RequestData(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs) override;

private:
  vtkUltrasoundSkin(const vtkUltrasoundSkin&) = delete;
  void operator=(const vtkUltrasoundSkin&) = delete;

#ifndef __VTK_WRAP__
  vtkSmartPointer<vtkPolyData> OutlineOf(vtkImageData* volume, const echorama::Progress& progress) const;

  echorama::SkinParameters Values;
#endif
};

#endif
