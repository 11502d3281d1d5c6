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

class ECHORAMAFILTERSEMBEDDING_EXPORT vtkUltrasoundSurfaceDiffuser : public vtkUltrasoundImageAlgorithm {
public:
  static vtkUltrasoundSurfaceDiffuser* New();
  vtkTypeMacro(vtkUltrasoundSurfaceDiffuser, vtkUltrasoundImageAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  ///@{
  /** The exponent d in the region, in [1, 64]: the larger, the more the nearest surface counts alone. Default 6. */
  vtkSetClampMacro(InsideExponent, double, 1.0, 64.0);
  vtkGetMacro(InsideExponent, double);
  ///@}

  ///@{
  /** The exponent d outside of the region, in [1, 64]. Default 4. */
  vtkSetClampMacro(OutsideExponent, double, 1.0, 64.0);
  vtkGetMacro(OutsideExponent, double);
  ///@}

  ///@{
  /**
   * Standard deviation, in mm, of the windows in which mean and deviation of the grain are taken at the surface; only the region
   * counts. 0: the voxels' own values, which deviate by 0. Default 3.
   */
  vtkSetClampMacro(SmoothMm, double, 0.0, VTK_DOUBLE_MAX);
  vtkGetMacro(SmoothMm, double);
  ///@}

  ///@{
  /** Whether every sum goes over the whole surface: slow, to compare with. Default off. */
  vtkSetMacro(Exact, bool);
  vtkGetMacro(Exact, bool);
  vtkBooleanMacro(Exact, bool);
  ///@}

  ///@{
  /** The largest error that is aimed at, as a share of the range of the values at the surface, in [0.0001, 0.1]. Default 0.002.
   */
  vtkSetClampMacro(Accuracy, double, 1e-4, 0.1);
  vtkGetMacro(Accuracy, double);
  ///@}

protected:
  vtkUltrasoundSurfaceDiffuser();
  ~vtkUltrasoundSurfaceDiffuser() override = default;

#ifndef __VTK_WRAP__
  void Execute(vtkInformationVector** inputs, vtkImageData* output, const echorama::Progress& progress) override;
#endif

private:
  vtkUltrasoundSurfaceDiffuser(const vtkUltrasoundSurfaceDiffuser&) = delete;
  void operator=(const vtkUltrasoundSurfaceDiffuser&) = delete;

  double InsideExponent;
  double OutsideExponent;
  double SmoothMm;
  bool Exact;
  double Accuracy;
};

#endif
