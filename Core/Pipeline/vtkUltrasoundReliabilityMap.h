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

#ifndef __VTK_WRAP__
#include "Core/Imaging/ShadowMap.h"
#include "vtkUltrasoundParameters.h"
#endif

#include <string>

class ECHORAMACORE_EXPORT vtkUltrasoundReliabilityMap : public vtkUltrasoundImageAlgorithm {
public:
  static vtkUltrasoundReliabilityMap* New();
  vtkTypeMacro(vtkUltrasoundReliabilityMap, vtkUltrasoundImageAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  // BEGIN parameters
  ///@{
  /**
   * Whether a probe is fitted to the valid region of a volume that brings none. Where none fits, beams are lines of voxels along
   * the depth axis. Default on.
   */
  void SetFitProbe(bool value) { this->SetParameter("FitProbe", value); }
  bool GetFitProbe() { return this->GetParameter("FitProbe") != 0.0; }
  void FitProbeOn() { this->SetFitProbe(true); }
  void FitProbeOff() { this->SetFitProbe(false); }
  ///@}

  ///@{
  /**
   * Where no probe is known: the index axis along which depth grows. -1: the last one with several voxels. In [-1, 2]; default
   * -1.
   */
  void SetDepthAxis(int value) { this->SetParameter("DepthAxis", value); }
  int GetDepthAxis() { return static_cast<int>(this->GetParameter("DepthAxis")); }
  ///@}

  ///@{
  /** Whether, where no probe is known, depth grows towards smaller indices. Default off. */
  void SetDepthReversed(bool value) { this->SetParameter("DepthReversed", value); }
  bool GetDepthReversed() { return this->GetParameter("DepthReversed") != 0.0; }
  void DepthReversedOn() { this->SetDepthReversed(true); }
  void DepthReversedOff() { this->SetDepthReversed(false); }
  ///@}

  ///@{
  /**
   * How finely shadows are sought: cells along the longest side of the volume, at most one per voxel. More show narrower shadows,
   * and more noise. In [16, 512] cells; default 96.
   */
  void SetResolution(int value) { this->SetParameter("Resolution", value); }
  int GetResolution() { return static_cast<int>(this->GetParameter("Resolution")); }
  ///@}

  ///@{
  /**
   * The end of a beam that gets no brighter than this is in shadow, reliability 0: a part of the way from black to ordinary
   * tissue at its depth. In [0, 1]; default 0.3.
   */
  void SetShadowLevel(double value) { this->SetParameter("ShadowLevel", value); }
  double GetShadowLevel() { return this->GetParameter("ShadowLevel"); }
  ///@}

  ///@{
  /** The end of a beam that gets as bright as this is fully reliable; above ShadowLevel. In [0, 1]; default 0.7. */
  void SetTissueLevel(double value) { this->SetParameter("TissueLevel", value); }
  double GetTissueLevel() { return this->GetParameter("TissueLevel"); }
  ///@}

  ///@{
  /** What is bright over less than this part of a beam is a speck, and no proof of sound. In [0, 0.25]; default 0.03. */
  void SetLeastEcho(double value) { this->SetParameter("LeastEcho", value); }
  double GetLeastEcho() { return this->GetParameter("LeastEcho"); }
  ///@}

  ///@{
  /**
   * Dark ends shorter than half of this part of a beam are left alone, those longer than it count in full. In [0, 1]; default
   * 0.2.
   */
  void SetLeastShadow(double value) { this->SetParameter("LeastShadow", value); }
  double GetLeastShadow() { return this->GetParameter("LeastShadow"); }
  ///@}

  ///@{
  /**
   * Where more than this part of 3 x 3 x 3 cells has the largest value of the volume, reliability falls, to 0 where all of it
   * has. In [0, 0.999]; default 0.5.
   */
  void SetSaturatedShare(double value) { this->SetParameter("SaturatedShare", value); }
  double GetSaturatedShare() { return this->GetParameter("SaturatedShare"); }
  ///@}

  ///@{
  /**
   * Any parameter by its name: as a number (of a switch 0 or 1, of a choice its place from 0), as text ("1.5", "on", the name of
   * a choice, "1 0 0"), integers and vectors without a loss. Setting returns false, after an error event, when there is no such
   * parameter or value.
   */
  bool SetParameter(const char* name, double value);
  bool SetParameterAsText(const char* name, const char* value);
  bool SetParameterAsInteger(const char* name, vtkTypeInt64 value);
  bool SetParameterAsVector(const char* name, const double value[3]);
  double GetParameter(const char* name);
  std::string GetParameterAsText(const char* name);
  vtkTypeInt64 GetParameterAsInteger(const char* name);
  double* GetParameterAsVector(const char* name) VTK_SIZEHINT(3);
  ///@}

  /** What parameters there are, as JSON: an array of objects with name, type, value, unit, low, high, choices, help ... */
  std::string GetParameterDescriptions();
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
