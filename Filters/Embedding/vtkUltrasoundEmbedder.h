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
 * gets them (vtkUltrasoundToneMapper); the border of the data fades into it (vtkUltrasoundFeather). Grain is measured in
 * developed speckle alone; where there is too little of it a warning says so.
 *
 * A volume that needs more memory than is allowed (MaximumMemoryGb) is embedded slab by slab, as its output is asked for, from
 * an input that makes its slices as they are asked for (vtkUltrasoundReader, vtkUltrasoundStitcher): the outline, the grain and
 * the levels of the background are found from a coarse copy. Only intensities and their valid region are kept then.
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
#include "vtkUltrasoundParameters.h"

#ifndef __VTK_WRAP__
#include "Core/Geometry/ProbeGeometry.h"
#include "EmbedGrid.h"
#include <array>
#include <functional>
#include <memory> // for what is set
#include <optional>
#include <utility>
namespace echorama {
class EmbedSlabs;
struct BackgroundNoise;
} // namespace echorama
#endif

#include <string>
#include <vtkSmartPointer.h>

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

  // BEGIN parameters
  /**
   * How far the fan reaches beyond the centres of the voxels at least, in depth and to all sides. Below 0: by a fortieth of the
   * longest side of the data, at most 5 mm. At least -1 mm; default -1.
   */
  vtkUltrasoundNumberMacro(MarginMm);

  enum Outlines { AUTOMATIC = 0, LINEAR = 1, PHASED = 2, CURVED = 3 };

  ///@{
  /**
   * The kind of probe whose beams give the outline, where no fan is given: linear makes a box, phased a fan from a single point,
   * curved one that bends as it must. Automatic: the simplest that is at most 5% larger than the smallest, phased only where the
   * data begin at a point. Default automatic. There are AUTOMATIC, LINEAR, PHASED, CURVED.
   */
  vtkUltrasoundChoiceMacro(Outline);
  void SetOutlineToAutomatic() { this->SetOutline(AUTOMATIC); }
  void SetOutlineToLinear() { this->SetOutline(LINEAR); }
  void SetOutlineToPhased() { this->SetOutline(PHASED); }
  void SetOutlineToCurved() { this->SetOutline(CURVED); }
  ///@}

  /**
   * The depth in the data at which no background shows any more; from the border to there their share grows linearly. 0: a hard
   * border. Below 0: twice the length of the grain of the data (where it is not known, four voxels), at most 3 mm. At least -1
   * mm; default -1.
   */
  vtkUltrasoundNumberMacro(FeatherMm);

  /**
   * Give back what a mean of two textures loses: that of two independent speckle patterns has 0.71 of their deviation. Default
   * on.
   */
  vtkUltrasoundSwitchMacro(KeepTexture);

  /** Standard deviation of the blur that parts local brightness and contrast from texture. Above 0 mm; default 3. */
  vtkUltrasoundNumberMacro(SmoothMm);

  /** Give the background the local deviation of the data too, not their local mean alone. Default on. */
  vtkUltrasoundSwitchMacro(MatchContrast);

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

  /**
   * Give noise that is made the grain of the data: its size along depth, fan and sweep, and its distribution. Where the data have
   * too little speckle to tell, grains are two voxels long and three wide. Default on.
   */
  vtkUltrasoundSwitchMacro(MatchGrain);

  /**
   * By how much neighbouring noise volumes overlap where fan or sweep turn. It sets the angle of the whole. In [0, 360] degrees;
   * default 10.
   */
  vtkUltrasoundNumberMacro(OverlapDegrees);

  /** The same seed makes the same noise. At least 0; default 1. */
  vtkUltrasoundInteger64Macro(Seed);

  /** For a quick look: only every so many voxels along each axis. In [1, 64]; default 1. */
  vtkUltrasoundIntegerMacro(PreviewFactor);

  /**
   * What may be used, in 10^9 bytes. A volume that needs more is embedded slab by slab, as its output is asked for. 0: the memory
   * that is free. At least 0 GB; default 0.
   */
  vtkUltrasoundNumberMacro(MaximumMemoryGb);

  /**
   * Any parameter by its name: as a number (of a switch 0 or 1, of a choice its place from 0), as text ("1.5", "on", the name of
   * a choice, "1 0 0"), integers and vectors without a loss. Setting returns false, after an error event, when there is no such
   * parameter or value. GetParameterDescriptions tells what parameters there are, as JSON: an array of objects with name, type,
   * value, unit, low, high, choices, help ...
   */
  vtkUltrasoundAnyParameterMacro();
  // END parameters

  /** Of the last volume: where the noise and the fan came from, sentences, one per line. */
  std::string GetNotes() const { return this->Notes; }

  ///@{
  /**
   * Of the last volume whose grain was measured, else -1: how many independent grains of developed speckle it has, and in which
   * part of it, [0, 1]. Water, walls, wires and shadows are none.
   */
  double GetSpeckleGrains() const { return this->SpeckleGrains; }
  double GetSpeckleShare() const { return this->SpeckleShare; }
  ///@}

  /**
   * False when that were too few grains to rely on (below 400): then there was a warning, and the background is a guess. True
   * when nothing had to be measured.
   */
  bool GetEnoughSpeckle() const;

  /**
   * In how many slabs, along z, the output has to be asked for (NumberOfSlabs of the writer), as known after UpdateInformation: 1
   * for a volume that fits into the memory as a whole.
   */
  int GetSlabs() const;

  /** Whether the volume will be embedded slab by slab; it is not read for that, but for its header. */
  bool IsLargerThanMemory();

  /** The depth of the feather of the last volume, mm: FeatherMm, or what took its place. */
  double GetUsedFeatherMm() const { return this->UsedFeatherMm; }

#ifndef __VTK_WRAP__
  echorama::ParameterList Parameters(); ///< for C++: they point into this object
#endif

protected:
  vtkUltrasoundEmbedder();
  ~vtkUltrasoundEmbedder() override;

  int FillInputPortInformation(int port, vtkInformation* info) override;
  int RequestInformation(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs) override;
  int RequestUpdateExtent(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs) override;
#ifndef __VTK_WRAP__
  void Execute(vtkInformationVector** inputs, vtkImageData* output, const echorama::Progress& progress) override;
#endif

private:
  vtkUltrasoundEmbedder(const vtkUltrasoundEmbedder&) = delete;
  void operator=(const vtkUltrasoundEmbedder&) = delete;

  struct Settings;
#ifndef __VTK_WRAP__
  std::unique_ptr<Settings> Values;

  // What the grid depends on, worked out once for information and data.
  struct Plan {
    echorama::PlacedProbe Form;
    echorama::EmbedGrid Grid;
    std::string Note;
  };
  const Plan& Prepare(vtkInformationVector** inputs, const echorama::Progress& progress);
  std::string NoteOfNoise(const echorama::BackgroundNoise& behind);
  void MakeNoise(vtkInformationVector** inputs, const Plan& plan, echorama::VolumeView<float> noise,
                 echorama::VolumeView<unsigned char> form, const echorama::Progress& progress);

  // What a plan was made of: this filter's parameters, the volume and the form, which pipelines exchange at will.
  using PlanKey = std::array<std::pair<const void*, vtkMTimeType>, 3>;
  std::optional<Plan> Planned;
  PlanKey PlannedFor{};

  // What is larger than the memory.
  using SlicesUse = std::function<void(const void* intensity, const unsigned char* region)>;
  double AllowedBytes() const;
  double BytesOn(const echorama::ImageGeometry& grid, vtkImageData* image) const;
  bool CanBeCut(); // into slabs: one volume, with noise that is made
  bool IsLarge();
  vtkSmartPointer<vtkImageData> InputSlices(int first, int count);
  void ShowSlices(vtkImageData* slices, const SlicesUse& use);
  echorama::EmbedSlabs& PrepareSlabs(vtkInformationVector** inputs, const echorama::Progress& progress);
  void ExecuteSlab(vtkInformationVector** inputs, vtkImageData* output, const echorama::Progress& progress);
  std::unique_ptr<echorama::EmbedSlabs> Slabs;
  std::string SlabName;
  int SlabType = 0;
  bool Warned = false;
#endif
  std::string Notes, Warning;
  double SpeckleGrains = -1.0, SpeckleShare = -1.0;
  double GrainMm = 0.0; // 0: not measured
  double UsedFeatherMm = 0.0;
};

#endif
