// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class vtkUltrasoundSurfaceDiffuser
 * @brief spreads the brightness and the contrast at the surface of a volume over its whole grid
 *
 * Input: a volume with a `ValidRegion`, whose surface is that of the data. Output: the same volume (pose, arrays and field data
 * kept), its `Intensity` a float: at every voxel, of the region and around it, the mean of the local means at the surface,
 * weighted by distance to the power -d. One more point array, `Deviation` (float), is the local standard deviation of the grain,
 * spread alike. Together they are what vtkUltrasoundToneMapper takes as levels.
 *
 * Fails without a valid region, when nothing of it is valid, and when a parameter is out of range.
 *
 * Source: dissertation 6.3.
 *
 * @sa echorama::Diffuse, vtkUltrasoundToneMapper, vtkUltrasoundEmbedder
 */
#ifndef vtkUltrasoundSurfaceDiffuser_h
#define vtkUltrasoundSurfaceDiffuser_h

#include "EchoramaFiltersEmbeddingModule.h"
#include "vtkUltrasoundImageAlgorithm.h"
#include "vtkUltrasoundParameters.h"

#ifndef __VTK_WRAP__
#include "Filters/Embedding/Diffusion.h"
#endif

class ECHORAMAFILTERSEMBEDDING_EXPORT vtkUltrasoundSurfaceDiffuser : public vtkUltrasoundImageAlgorithm {
public:
  static vtkUltrasoundSurfaceDiffuser* New();
  vtkTypeMacro(vtkUltrasoundSurfaceDiffuser, vtkUltrasoundImageAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  // BEGIN parameters
  /**
   * Exponent of distance by which values at the surface spread inside the data: the larger, the more the nearest surface counts
   * alone. In [1, 64]; default 6.
   */
  vtkUltrasoundNumberMacro(InsideExponent);

  /**
   * Exponent of distance by which values at the surface spread outside of the data: the larger, the more the nearest surface
   * counts alone. In [1, 64]; default 4.
   */
  vtkUltrasoundNumberMacro(OutsideExponent);

  /** Sum over the whole surface for every voxel: slow, to compare with. Default off. */
  vtkUltrasoundSwitchMacro(Exact);

  /**
   * The largest error that is aimed at, as a share of the range of the values at the surface. Used when Exact is off. In [0.0001,
   * 0.1]; default 0.002.
   */
  vtkUltrasoundNumberMacro(Accuracy);

  /**
   * Standard deviation of the windows in which mean and deviation of the grain are taken at the surface. 0: the voxels' own
   * values, which deviate by 0. At least 0 mm; default 3.
   */
  vtkUltrasoundNumberMacro(SmoothMm);

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
  vtkUltrasoundSurfaceDiffuser();
  ~vtkUltrasoundSurfaceDiffuser() override = default;

#ifndef __VTK_WRAP__
  void Execute(vtkInformationVector** inputs, vtkImageData* output, const echorama::Progress& progress) override;
#endif

private:
  vtkUltrasoundSurfaceDiffuser(const vtkUltrasoundSurfaceDiffuser&) = delete;
  void operator=(const vtkUltrasoundSurfaceDiffuser&) = delete;

#ifndef __VTK_WRAP__
  echorama::DiffusionParameters Values;
  double SmoothMm = 3.0;
#endif
};

#endif
