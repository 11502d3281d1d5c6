// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class vtkUltrasoundFeather
 * @brief overlays a volume on a background, into which its border fades; every voxel says which of the two it is
 *
 * Input 0: a volume; its `ValidRegion` is what is laid over (no array: all of it). Input 1: the background, a volume on the same
 * grid. Output: the first volume (type, pose, arrays and field data kept) with the background around it, and one more point array
 * `Embedding` (unsigned char): 0 nothing, 1 data (unchanged to the last bit), 2 data mixed with background, 3 background alone.
 * `ValidRegion` stays that of the data: what was seen.
 *
 * Fails when nothing of the volume is valid, when it was embedded before, and when the grids differ.
 *
 * Source: dissertation 6.5.
 *
 * @sa echorama::Feather, vtkUltrasoundEmbedder
 */
#ifndef vtkUltrasoundFeather_h
#define vtkUltrasoundFeather_h

#include "EchoramaFiltersEmbeddingModule.h"
#include "vtkUltrasoundImageAlgorithm.h"
#include "vtkUltrasoundParameters.h"

#ifndef __VTK_WRAP__
#include "Filters/Embedding/Feather.h"
#endif

class ECHORAMAFILTERSEMBEDDING_EXPORT vtkUltrasoundFeather : public vtkUltrasoundImageAlgorithm {
public:
  static vtkUltrasoundFeather* New();
  vtkTypeMacro(vtkUltrasoundFeather, vtkUltrasoundImageAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  // BEGIN parameters
  /**
   * The depth in the data at which no background shows any more; from the border to there their share grows linearly. 0: a hard
   * border. At least 0 mm; default 3.
   */
  vtkUltrasoundNumberMacro(FeatherMm);

  /**
   * Give back what a mean of two textures loses: that of two independent speckle patterns has 0.71 of their deviation. Default
   * on.
   */
  vtkUltrasoundSwitchMacro(KeepTexture);

  /** Standard deviation of the blur that parts local brightness and contrast from texture. Above 0 mm; default 3. */
  vtkUltrasoundNumberMacro(SmoothMm);

  /**
   * Any parameter by its name: as a number (of a switch 0 or 1, of a choice its place from 0), as text ("1.5", "on", the name of
   * a choice, "1 0 0"), integers and vectors without a loss. Setting returns false, after an error event, when there is no such
   * parameter or value. GetParameterDescriptions tells what parameters there are, as JSON: an array of objects with name, type,
   * value, unit, low, high, choices, help ...
   */
  vtkUltrasoundAnyParameterMacro();
  // END parameters

  /** Sets the background (input port 1). */
  void SetBackgroundConnection(vtkAlgorithmOutput* output) { this->SetInputConnection(1, output); }

#ifndef __VTK_WRAP__
  /**
   * Throws echorama::Error(BadInput) for a volume that was embedded before: its mixed and invented voxels would pass as data.
   */
  static void RefuseEmbedded(vtkImageData* volume);

  echorama::ParameterList Parameters(); ///< for C++: they point into this object
#endif

protected:
  vtkUltrasoundFeather();
  ~vtkUltrasoundFeather() override = default;

#ifndef __VTK_WRAP__
  void Execute(vtkInformationVector** inputs, vtkImageData* output, const echorama::Progress& progress) override;
#endif

private:
  vtkUltrasoundFeather(const vtkUltrasoundFeather&) = delete;
  void operator=(const vtkUltrasoundFeather&) = delete;

#ifndef __VTK_WRAP__
  echorama::FeatherParameters Values;
#endif
};

#endif
