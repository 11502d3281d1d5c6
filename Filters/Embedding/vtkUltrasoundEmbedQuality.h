// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class vtkUltrasoundEmbedQuality
 * @brief tells how visible the border of an embedded volume is, and whether its data are untouched
 *
 * Input 0: the embedded volume, with the point array `Embedding` (0 nothing, 1 data, 2 blend, 3 invented). Its probe geometry, as
 * field data, is the fan that the crop is measured in. Input 1 (optional): the volume that was embedded, on voxels of the same
 * lattice and of the same type.
 *
 * Output: the embedded volume as it came. The numbers are asked for after the update; those that could not be measured, because
 * there is no border, no fan or no original, are NaN (voxel counts: -1). Fails when there is no array `Embedding`, and when
 * the original does not lie on the voxels of the embedded volume or has another type.
 *
 * echorama::MeasureEmbedding says how the numbers are defined. Under MPI every rank measures the whole.
 *
 * @sa vtkUltrasoundEmbedder, vtkUltrasoundFeather
 */
#ifndef vtkUltrasoundEmbedQuality_h
#define vtkUltrasoundEmbedQuality_h

#include "EchoramaFiltersEmbeddingModule.h"
#include "vtkUltrasoundImageAlgorithm.h"

#include <string> // GetReport is wrapped

#ifndef __VTK_WRAP__
#include "Filters/Embedding/EmbedQuality.h"
#endif

class ECHORAMAFILTERSEMBEDDING_EXPORT vtkUltrasoundEmbedQuality : public vtkUltrasoundImageAlgorithm {
public:
  static vtkUltrasoundEmbedQuality* New();
  vtkTypeMacro(vtkUltrasoundEmbedQuality, vtkUltrasoundImageAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  ///@{
  /** How thick the shells on either side of the border are, and how wide its patches, mm, in [0.1, 100]. Default 5. */
  vtkSetClampMacro(ShellMm, double, 0.1, 100.0);
  vtkGetMacro(ShellMm, double);
  ///@}

  ///@{
  /** Data deeper than this, in mm, must be shown as they are: the embedder's feather, at least 0. Default 3. */
  vtkSetClampMacro(FeatherMm, double, 0.0, VTK_DOUBLE_MAX);
  vtkGetMacro(FeatherMm, double);
  ///@}

  ///@{
  /** With how many surfaces inside the data the border is compared, in [0, 1000]. Default 24. */
  vtkSetClampMacro(RandomSurfaces, int, 0, 1000);
  vtkGetMacro(RandomSurfaces, int);
  ///@}

  ///@{
  /** Which surfaces these are, at least 0. Default 1. */
  vtkSetClampMacro(Seed, int, 0, VTK_INT_MAX);
  vtkGetMacro(Seed, int);
  ///@}

  ///@{
  /** The volume that was embedded goes to input 1; nullptr: not known. */
  void SetOriginalConnection(vtkAlgorithmOutput* output) { this->SetInputConnection(1, output); }
  void SetOriginalData(vtkDataObject* data) { this->SetInputDataObject(1, data); }
  ///@}

  ///@{
  /**
   * Of 95 % of the border the local mean jumps no more than this, grey levels; the same at surfaces inside the data; and what the
   * border is allowed: the larger of that and 2 grey levels.
   */
  double GetSeamJump() const;
  double GetReferenceJump() const;
  double GetJumpLimit() const;
  ///@}

  /** Local standard deviation outside the border over that inside: 1 is alike. */
  double GetDeviationRatio() const;

  /** Whether the jump is at most its limit and the ratio of deviations is within 15 % of 1. */
  bool GetSeamPasses() const;

  ///@{
  /** Voxels labelled as data, blend and invented. */
  vtkIdType GetDataVoxels() const;
  vtkIdType GetBlendVoxels() const;
  vtkIdType GetInventedVoxels() const;
  ///@}

  ///@{
  /**
   * Against the original, voxels: labelled as data but with another value; labelled as data or blend where there was nothing;
   * deeper than FeatherMm but not shown as they are. All 0 in a true embedding; -1 without an original.
   */
  vtkIdType GetAlteredVoxels() const;
  vtkIdType GetPretendedVoxels() const;
  vtkIdType GetLostVoxels() const;
  ///@}

  /** How much of the data the largest crop of the fan would have kept, [0, 1]. */
  double GetCropShare() const;

  /**
   * All numbers of the last update, as JSON: {"border": {"patches", "mean", "median", "percentile95", "bias", "deviation_ratio",
   * "deviation_ratio_5", "deviation_ratio_95"}, "reference": {the same}, "border_measured", "jump_limit", "jump_passes",
   * "deviation_passes", "voxels": {"data", "blend", "invented", "altered", "pretended", "lost"}, "crop": {"share", "depth_mm",
   * "fan", "sweep"}}. What could not be measured is null. Empty when it failed.
   */
  std::string GetReport() const { return this->Report; }

protected:
  vtkUltrasoundEmbedQuality();
  ~vtkUltrasoundEmbedQuality() override = default;

  int FillInputPortInformation(int port, vtkInformation* information) override;
#ifndef __VTK_WRAP__
  void Execute(vtkInformationVector** inputs, vtkImageData* output, const echorama::Progress& progress) override;
#endif

private:
  vtkUltrasoundEmbedQuality(const vtkUltrasoundEmbedQuality&) = delete;
  void operator=(const vtkUltrasoundEmbedQuality&) = delete;

#ifndef __VTK_WRAP__
  double ShellMm = echorama::EmbedQualityParameters().shellMm;
  double FeatherMm = echorama::EmbedQualityParameters().featherMm;
  int RandomSurfaces = echorama::EmbedQualityParameters().randomSurfaces;
  int Seed = static_cast<int>(echorama::EmbedQualityParameters().seed);
  echorama::EmbedQualityReport Quality;
  std::string Report;
#endif
};

#endif
