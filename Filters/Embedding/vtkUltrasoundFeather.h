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

class ECHORAMAFILTERSEMBEDDING_EXPORT vtkUltrasoundFeather : public vtkUltrasoundImageAlgorithm {
public:
  static vtkUltrasoundFeather* New();
  vtkTypeMacro(vtkUltrasoundFeather, vtkUltrasoundImageAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  ///@{
  /**
   * The depth in the data, in mm, from which on nothing of the background shows; the share of the data grows linearly from the
   * border to there. 0: a hard border. Default 3.
   */
  vtkSetClampMacro(FeatherMm, double, 0.0, VTK_DOUBLE_MAX);
  vtkGetMacro(FeatherMm, double);
  ///@}

  ///@{
  /**
   * Whether what a mean of two textures loses is given back: a plain mean of two independent speckle patterns has 0.71 of their
   * deviation. Default on.
   */
  vtkSetMacro(KeepTexture, bool);
  vtkGetMacro(KeepTexture, bool);
  vtkBooleanMacro(KeepTexture, bool);
  ///@}

  ///@{
  /** With KeepTexture: the standard deviation, in mm, that parts texture from the rest, above 0. Default 3. */
  vtkSetClampMacro(SmoothMm, double, 1e-3, VTK_DOUBLE_MAX);
  vtkGetMacro(SmoothMm, double);
  ///@}

#ifndef __VTK_WRAP__
  /**
   * Throws echorama::Error(BadInput) for a volume that was embedded before: its mixed and invented voxels would pass as data.
   */
  static void RefuseEmbedded(vtkImageData* volume);
#endif

  /** Sets the background (input port 1). */
  void SetBackgroundConnection(vtkAlgorithmOutput* output)
  {
    this->SetInputConnection(1, output);
  }

protected:
  vtkUltrasoundFeather();
  ~vtkUltrasoundFeather() override = default;

#ifndef __VTK_WRAP__
  void Execute(vtkInformationVector** inputs, vtkImageData* output, const echorama::Progress& progress) override;
#endif

private:
  vtkUltrasoundFeather(const vtkUltrasoundFeather&) = delete;
  void operator=(const vtkUltrasoundFeather&) = delete;

  double FeatherMm;
  bool KeepTexture;
  double SmoothMm;
};

#endif
