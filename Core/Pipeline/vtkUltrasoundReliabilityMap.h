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
#endif

#include <string>

class ECHORAMACORE_EXPORT vtkUltrasoundReliabilityMap : public vtkUltrasoundImageAlgorithm {
public:
  static vtkUltrasoundReliabilityMap* New();
  vtkTypeMacro(vtkUltrasoundReliabilityMap, vtkUltrasoundImageAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  ///@{
  /**
   * Whether a probe is fitted to the valid region of a volume that brings none. Where none fits, beams are lines of voxels along
   * the depth axis. Default on.
   */
  vtkSetMacro(FitProbe, bool);
  vtkGetMacro(FitProbe, bool);
  vtkBooleanMacro(FitProbe, bool);
  ///@}

  ///@{
  /** Without a probe: the index axis along which depth grows, 0 to 2; -1 (default): the last one with several voxels. */
  vtkSetClampMacro(DepthAxis, int, -1, 2);
  vtkGetMacro(DepthAxis, int);
  ///@}

  ///@{
  /** Without a probe: whether depth grows towards smaller indices. Default off. */
  vtkSetMacro(DepthReversed, bool);
  vtkGetMacro(DepthReversed, bool);
  vtkBooleanMacro(DepthReversed, bool);
  ///@}

  ///@{
  /** Cells along the longest side of the volume, in which shadows are sought, in [16, 512]. Default 96. */
  vtkSetClampMacro(Resolution, int, 16, 512);
  vtkGetMacro(Resolution, int);
  ///@}

  ///@{
  /**
   * The end of a beam that gets no brighter than this is in shadow (reliability 0): a part of the way from black to ordinary
   * tissue at its depth, in [0, 0.99]. Default 0.3.
   */
  vtkSetClampMacro(ShadowLevel, double, 0.0, 0.99);
  vtkGetMacro(ShadowLevel, double);
  ///@}

  ///@{
  /** One that gets as bright as this is not (reliability 1): above ShadowLevel, in [0.01, 1]. Default 0.7. */
  vtkSetClampMacro(TissueLevel, double, 0.01, 1.0);
  vtkGetMacro(TissueLevel, double);
  ///@}

  ///@{
  /** What is bright over less than this part of a beam is a speck and no proof of sound, in [0, 0.25]. Default 0.03. */
  vtkSetClampMacro(LeastEcho, double, 0.0, 0.25);
  vtkGetMacro(LeastEcho, double);
  ///@}

  ///@{
  /**
   * Dark ends shorter than half of this part of a beam are left alone, those longer than it count in full, in [0, 1].
   * Default 0.2.
   */
  vtkSetClampMacro(LeastShadow, double, 0.0, 1.0);
  vtkGetMacro(LeastShadow, double);
  ///@}

  ///@{
  /**
   * Where more than this part of a neighbourhood (3 x 3 x 3 cells) has the largest value of the volume, reliability falls, to 0
   * where all of it has; in [0, 0.99]. Default 0.5.
   */
  vtkSetClampMacro(SaturatedShare, double, 0.0, 0.99);
  vtkGetMacro(SaturatedShare, double);
  ///@}

  ///@{
  /** Of the last volume: which part of the real voxels lies in shadow, and in saturated areas (reliability below one half). */
  double GetShadowFraction() const { return this->ShadowFraction; }
  double GetSaturatedFraction() const { return this->SaturatedFraction; }
  ///@}

  /** What the last map rests on, and what is odd about the volume: sentences, one per line. */
  std::string GetNote() const { return this->Note; }

protected:
  vtkUltrasoundReliabilityMap();
  ~vtkUltrasoundReliabilityMap() override = default;

#ifndef __VTK_WRAP__
  void Execute(vtkInformationVector** inputs, vtkImageData* output, const echorama::Progress& progress) override;
#endif

private:
  vtkUltrasoundReliabilityMap(const vtkUltrasoundReliabilityMap&) = delete;
  void operator=(const vtkUltrasoundReliabilityMap&) = delete;

  bool FitProbe = true;
  int DepthAxis;
  bool DepthReversed;
  int Resolution;
  double ShadowLevel;
  double TissueLevel;
  double LeastEcho;
  double LeastShadow;
  double SaturatedShare;
  double ShadowFraction = 0.0;
  double SaturatedFraction = 0.0;
  std::string Note;
};

#endif
