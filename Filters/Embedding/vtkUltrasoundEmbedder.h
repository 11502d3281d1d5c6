// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class vtkUltrasoundEmbedder
 * @brief puts a stitched volume into a background of noise, so that it looks as one scan of a real machine
 *
 * Input 0: a volume; its `ValidRegion` is what was seen (no array: all of it). Input 1 (optional, repeatable): real noise
 * volumes, which are placed side by side and fill the background; without them the noise is made (see vtkUltrasoundNoiseSource).
 * Input 2 (optional): a volume whose fan (its `ProbeGeometry`, else fitted to its valid region) gives the outline; it grows until
 * it holds all data. Without it the fan is found from the data.
 *
 * Output: a volume on the lattice of the first, grown by whole voxels to hold the fan (no voxel is resampled), of the same type,
 * with all its arrays and field data, the fan as its probe, and one more point array `Embedding` (unsigned char): 0 nothing, 1
 * data (unchanged to the last bit), 2 data mixed with background, 3 invented background. `ValidRegion` stays that of the data, so
 * that nothing invented passes as seen.
 *
 * Local mean and deviation of the data at their surface spread into the background (vtkUltrasoundSurfaceDiffuser), whose grain
 * gets them (vtkUltrasoundToneMapper); the border of the data fades into it (vtkUltrasoundFeather).
 *
 * Fails when nothing of the volume is valid, when it was embedded before (mixed voxels would pass as data), when no fan is known
 * of a noise volume, and when memory does not suffice.
 *
 * Source: dissertation, chapter 6.
 *
 * @sa echorama::Embed, echorama::EncloseRegion, echorama::MakeBeamNoise
 */
#ifndef vtkUltrasoundEmbedder_h
#define vtkUltrasoundEmbedder_h

#include "EchoramaFiltersEmbeddingModule.h"
#include "vtkUltrasoundImageAlgorithm.h"

#ifndef __VTK_WRAP__
#include "Core/Geometry/ProbeGeometry.h"
#include "EmbedGrid.h"
#include <array>
#include <optional>
#include <utility>
#endif

#include <string>

class ECHORAMAFILTERSEMBEDDING_EXPORT vtkUltrasoundEmbedder : public vtkUltrasoundImageAlgorithm {
public:
  static vtkUltrasoundEmbedder* New();
  vtkTypeMacro(vtkUltrasoundEmbedder, vtkUltrasoundImageAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  /** Adds a real noise volume (input port 1), and removes all. */
  void AddNoiseConnection(vtkAlgorithmOutput* output) { this->AddInputConnection(1, output); }
  void RemoveAllNoise() { this->SetInputConnection(1, nullptr); }

  /** Sets the volume whose fan gives the outline (input port 2). */
  void SetFormConnection(vtkAlgorithmOutput* output) { this->SetInputConnection(2, output); }

  ///@{
  /** The depth in the data, in mm, at which no background shows any more, from 0. Default 3. */
  vtkSetClampMacro(FeatherMm, double, 0.0, VTK_DOUBLE_MAX);
  vtkGetMacro(FeatherMm, double);
  ///@}

  ///@{
  /** Whether what the mean of two textures loses in the feather band is given back. Default on. */
  vtkSetMacro(KeepTexture, bool);
  vtkGetMacro(KeepTexture, bool);
  vtkBooleanMacro(KeepTexture, bool);
  ///@}

  ///@{
  /** How far the fan reaches beyond the data, at least, in mm, in [0, 1000]. Default 5. */
  vtkSetClampMacro(MarginMm, double, 0.0, 1000.0);
  vtkGetMacro(MarginMm, double);
  ///@}

  ///@{
  /** Standard deviation of the blur that parts local mean and contrast from grain, in mm, above 0. Default 3. */
  vtkSetClampMacro(SmoothMm, double, 1e-3, VTK_DOUBLE_MAX);
  vtkGetMacro(SmoothMm, double);
  ///@}

  ///@{
  /** The exponents of distance by which values at the surface spread into the data and out of them, in [1, 64]. Default 6 and 4.
   */
  vtkSetClampMacro(InsideExponent, double, 1.0, 64.0);
  vtkGetMacro(InsideExponent, double);
  vtkSetClampMacro(OutsideExponent, double, 1.0, 64.0);
  vtkGetMacro(OutsideExponent, double);
  ///@}

  ///@{
  /** Whether the background gets the local deviation of the data too, not their local mean alone. Default on. */
  vtkSetMacro(MatchContrast, bool);
  vtkGetMacro(MatchContrast, bool);
  vtkBooleanMacro(MatchContrast, bool);
  ///@}

  ///@{
  /**
   * Whether noise that is made gets the grain of the data: its size along depth, fan and sweep and its distribution, measured in
   * beam space. Where the data have too little texture to tell, the grain is that of vtkUltrasoundNoiseSource. Default on.
   */
  vtkSetMacro(MatchGrain, bool);
  vtkGetMacro(MatchGrain, bool);
  vtkBooleanMacro(MatchGrain, bool);
  ///@}

  ///@{
  /** The angle by which real noise volumes overlap their neighbours, in degrees, [0, 90]. Default 10. */
  vtkSetClampMacro(OverlapDegrees, double, 0.0, 90.0);
  vtkGetMacro(OverlapDegrees, double);
  ///@}

  ///@{
  /** Seed of the noise that is made, at least 0. Default 1. */
  vtkSetClampMacro(Seed, vtkTypeInt64, 0, VTK_TYPE_INT64_MAX);
  vtkGetMacro(Seed, vtkTypeInt64);
  ///@}

  ///@{
  /** For a quick look: only every so many voxels along each axis, in [1, 64]. Default 1: all. */
  vtkSetClampMacro(PreviewFactor, int, 1, 64);
  vtkGetMacro(PreviewFactor, int);
  ///@}

  /** Of the last volume: where the noise and the fan came from, sentences, one per line. */
  std::string GetNotes() const { return this->Notes; }

protected:
  vtkUltrasoundEmbedder();
  ~vtkUltrasoundEmbedder() override = default;

  int FillInputPortInformation(int port, vtkInformation* info) override;
  int RequestInformation(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs) override;
#ifndef __VTK_WRAP__
  void Execute(vtkInformationVector** inputs, vtkImageData* output, const echorama::Progress& progress) override;
#endif

private:
  vtkUltrasoundEmbedder(const vtkUltrasoundEmbedder&) = delete;
  void operator=(const vtkUltrasoundEmbedder&) = delete;

#ifndef __VTK_WRAP__
  // What the grid depends on, worked out once for information and data.
  struct Plan {
    echorama::PlacedProbe Form;
    echorama::EmbedGrid Grid;
    std::string Note;
  };
  const Plan& Prepare(vtkInformationVector** inputs, const echorama::Progress& progress);
  void MakeNoise(vtkInformationVector** inputs, const Plan& plan, echorama::VolumeView<float> noise,
                 echorama::VolumeView<unsigned char> form, const echorama::Progress& progress);

  // What a plan was made of: this filter's parameters, the volume and the form, which pipelines exchange at will.
  using PlanKey = std::array<std::pair<const void*, vtkMTimeType>, 3>;
  std::optional<Plan> Planned;
  PlanKey PlannedFor{};
#endif
  double FeatherMm;
  bool KeepTexture;
  double MarginMm = 5.0;
  double SmoothMm;
  double InsideExponent;
  double OutsideExponent;
  bool MatchContrast;
  bool MatchGrain = true;
  double OverlapDegrees = 10.0;
  vtkTypeInt64 Seed = 1;
  int PreviewFactor = 1;
  std::string Notes;
};

#endif
