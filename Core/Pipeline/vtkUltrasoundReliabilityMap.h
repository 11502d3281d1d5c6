// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class vtkUltrasoundReliabilityMap
 * @brief how far each voxel can be trusted: low in acoustic shadow and where the image is saturated
 *
 * Input: one volume, or a 2D image (one slice). Output: the same volume (pose, arrays and field data kept) with one more point
 * array `Reliability` (float, 0 to 1; 0 where a voxel is not real).
 *
 * Beams are those of the probe in the field data (`ProbeGeometry`, `ProbeToWorld`), else of one that is fitted to the valid
 * region (see FitProbe), else the lines of voxels along the depth axis; GetNote() says which. A beam that ends in the dark is in
 * shadow from its last echo on; what is dark but has echoes behind it (a cyst, a vessel) is not.
 *
 * Fails when no voxel is real.
 *
 * @sa echorama::MeasureReliability, vtkUltrasoundProbeFit, vtkUltrasoundStitcher
 */
#ifndef vtkUltrasoundReliabilityMap_h
#define vtkUltrasoundReliabilityMap_h

#include "EchoramaCoreModule.h"
#include "vtkUltrasoundImageAlgorithm.h"
#include "vtkUltrasoundParameters.h"

#ifndef __VTK_WRAP__
#include "Core/Imaging/ShadowMap.h"
#endif

#include <string>

class ECHORAMACORE_EXPORT vtkUltrasoundReliabilityMap : public vtkUltrasoundImageAlgorithm {
public:
  static vtkUltrasoundReliabilityMap* New();
  vtkTypeMacro(vtkUltrasoundReliabilityMap, vtkUltrasoundImageAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  // BEGIN parameters
  /**
   * Whether a probe is fitted to the valid region of a volume that brings none. Where none fits, beams are lines of voxels along
   * the depth axis. Default on.
   */
  vtkUltrasoundSwitchMacro(FitProbe);

  /**
   * Where no probe is known: the index axis along which depth grows. -1: the last one with several voxels. In [-1, 2]; default
   * -1.
   */
  vtkUltrasoundIntegerMacro(DepthAxis);

  /** Whether, where no probe is known, depth grows towards smaller indices. Default off. */
  vtkUltrasoundSwitchMacro(DepthReversed);

  /**
   * How finely shadows are sought: cells along the longest side of the volume, at most one per voxel. More show narrower shadows,
   * and more noise. In [16, 512] cells; default 96.
   */
  vtkUltrasoundIntegerMacro(Resolution);

  /**
   * The end of a beam that gets no brighter than this is in shadow, reliability 0: a part of the way from black to ordinary
   * tissue at its depth. In [0, 1]; default 0.3.
   */
  vtkUltrasoundNumberMacro(ShadowLevel);

  /** The end of a beam that gets as bright as this is fully reliable; above ShadowLevel. In [0, 1]; default 0.7. */
  vtkUltrasoundNumberMacro(TissueLevel);

  /** What is bright over less than this part of a beam is a speck, and no proof of sound. In [0, 0.25]; default 0.03. */
  vtkUltrasoundNumberMacro(LeastEcho);

  /**
   * Dark ends shorter than half of this part of a beam are left alone, those longer than it count in full. In [0, 1]; default
   * 0.2.
   */
  vtkUltrasoundNumberMacro(LeastShadow);

  /**
   * Where more than this part of 3 x 3 x 3 cells has the largest value of the volume, reliability falls, to 0 where all of it
   * has. In [0, 0.999]; default 0.5.
   */
  vtkUltrasoundNumberMacro(SaturatedShare);

  /**
   * Any parameter by its name: as a number (of a switch 0 or 1, of a choice its place from 0), as text ("1.5", "on", the name of
   * a choice, "1 0 0"), integers and vectors without a loss. Setting returns false, after an error event, when there is no such
   * parameter or value. GetParameterDescriptions tells what parameters there are, as JSON: an array of objects with name, type,
   * value, unit, low, high, choices, help ...
   */
  vtkUltrasoundAnyParameterMacro();
  // END parameters

  ///@{
  /** Of the last volume: which part of the real voxels lies in shadow, and in saturated areas (reliability below one half). */
  double GetShadowFraction() const { return this->ShadowFraction; }
  double GetSaturatedFraction() const { return this->SaturatedFraction; }
  ///@}

  /** What the last map rests on, and what is odd about the volume: sentences, one per line. */
  std::string GetNote() const { return this->Note; }

#ifndef __VTK_WRAP__
  echorama::ParameterList Parameters(); ///< for C++: they point into this object
#endif

protected:
  vtkUltrasoundReliabilityMap() = default;
  ~vtkUltrasoundReliabilityMap() override = default;

#ifndef __VTK_WRAP__
  void Execute(vtkInformationVector** inputs, vtkImageData* output, const echorama::Progress& progress) override;
#endif

private:
  vtkUltrasoundReliabilityMap(const vtkUltrasoundReliabilityMap&) = delete;
  void operator=(const vtkUltrasoundReliabilityMap&) = delete;

#ifndef __VTK_WRAP__
  echorama::ReliabilityParameters Values;
#endif
  bool Fitted = true; // whether a probe is
  double ShadowFraction = 0.0;
  double SaturatedFraction = 0.0;
  std::string Note;
};

#endif
