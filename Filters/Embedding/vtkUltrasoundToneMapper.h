// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class vtkUltrasoundToneMapper
 * @brief takes from a volume what varies slowly and leaves its grain, or gives the grain another brightness and contrast
 *
 * Input 0: a volume, such as noise. Input 1 (optional): a volume on the same grid whose intensities are the local mean that the
 * result shall have (vtkUltrasoundSurfaceDiffuser), with a point array `Deviation` for the local deviation when MatchDeviation is
 * on. Output: the first volume (pose, all other arrays and field data kept) with float intensities. Without levels that is the
 * grain: of local mean 0 and deviation 1 with MatchDeviation, else of local mean 1. With levels it is mean + deviation * grain,
 * or mean * grain. Outside of the valid region the grain is 0, or 1.
 *
 * Fails when the grids differ, and when MatchDeviation is on and the levels have no `Deviation`.
 *
 * Source: dissertation 6.4 (I / B and its product with D).
 *
 * @sa echorama::ExtractGrain, vtkUltrasoundSurfaceDiffuser, vtkUltrasoundEmbedder
 */
#ifndef vtkUltrasoundToneMapper_h
#define vtkUltrasoundToneMapper_h

#include "EchoramaFiltersEmbeddingModule.h"
#include "vtkUltrasoundImageAlgorithm.h"
#include "vtkUltrasoundParameters.h"

#ifndef __VTK_WRAP__
#include "Filters/Embedding/ToneMapping.h"
#endif

class ECHORAMAFILTERSEMBEDDING_EXPORT vtkUltrasoundToneMapper : public vtkUltrasoundImageAlgorithm {
public:
  static vtkUltrasoundToneMapper* New();
  vtkTypeMacro(vtkUltrasoundToneMapper, vtkUltrasoundImageAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  // BEGIN parameters
  /** Standard deviation of the blur that parts grain from the rest. Above 0 mm; default 3. */
  vtkUltrasoundNumberMacro(SmoothMm);

  /** Match the local deviation too, not the local mean alone. Default on. */
  vtkUltrasoundSwitchMacro(MatchDeviation);

  /**
   * Any parameter by its name: as a number (of a switch 0 or 1, of a choice its place from 0), as text ("1.5", "on", the name of
   * a choice, "1 0 0"), integers and vectors without a loss. Setting returns false, after an error event, when there is no such
   * parameter or value. GetParameterDescriptions tells what parameters there are, as JSON: an array of objects with name, type,
   * value, unit, low, high, choices, help ...
   */
  vtkUltrasoundAnyParameterMacro();
  // END parameters

  /** Sets the levels that the result shall have (input port 1). */
  void SetLevelsConnection(vtkAlgorithmOutput* output) { this->SetInputConnection(1, output); }

  /** Name of the point array of the levels that holds the local deviation. */
  static const char* DeviationName() { return "Deviation"; }

#ifndef __VTK_WRAP__
  echorama::ParameterList Parameters(); ///< for C++: they point into this object
#endif

protected:
  vtkUltrasoundToneMapper();
  ~vtkUltrasoundToneMapper() override = default;

  int FillInputPortInformation(int port, vtkInformation* info) override;
#ifndef __VTK_WRAP__
  void Execute(vtkInformationVector** inputs, vtkImageData* output, const echorama::Progress& progress) override;
#endif

private:
  vtkUltrasoundToneMapper(const vtkUltrasoundToneMapper&) = delete;
  void operator=(const vtkUltrasoundToneMapper&) = delete;

#ifndef __VTK_WRAP__
  echorama::ToneMappingParameters Values;
#endif
};

#endif
