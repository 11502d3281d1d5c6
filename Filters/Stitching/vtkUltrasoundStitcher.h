// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class vtkUltrasoundStitcher
 * @brief many overlapping volumes into one, without seams
 *
 * Input 0 (repeatable): two or more vtkImageData, or vtkDataObjectTree whose leaves are (multi-block, partitioned
 * collection), each with `Intensity` and optionally `ValidRegion`. Their geometry is their pose. 2D images are volumes of
 * one slice. Voxels that are not finite count as not real. Types may differ: the output has the smallest type that holds all.
 *
 * Input 1 (optional, repeatable): displacement images (vtkUltrasoundDisplacement), one per volume in the same order; blocks with
 * names must have those of their volumes. Volumes are then read through them. The grid stays that of the geometries alone.
 *
 * Output: one vtkImageData that covers all of them (echorama::StitchGrid says how it lies), with
 * - `Intensity`: the blend, 0 where no volume is;
 * - `ValidRegion`: 1 where any volume is;
 * - `Coverage` (unsigned char): how many volumes are there;
 * - `Spread` (float), if asked for: the largest minus the smallest of the volumes' values, 0 where one is alone: where volumes
 *   disagree;
 * - `Weight0`, `Weight1` ... (float), if asked for: the share of each volume;
 * - field data `StitchedVolumes`: the names of the volumes, in order. What a volume's own field data says of its acquisition
 *   is not true of the whole, and is dropped.
 *
 * Where volumes overlap each is weighted by s^b / sum s^b. By default s is the smoothest surface that is 1 where the volume
 * is alone and 0 where only others are (dissertation 5.3), and the weights blend what is smooth in the volumes; speckle and
 * edges change over in a narrow transition, because a mean of two speckle patterns has less texture than either (see
 * Texture). A volume that others cover wholly counts as alone where it lies deepest inside its border. A volume with the point
 * array `Reliability` (vtkUltrasoundReliabilityMap: shadows, saturation) is weighted by it as well.
 *
 * The filter makes the extent that is asked for and no more: what is global (how volumes share the overlaps, gains) is found
 * once and kept until the inputs or a parameter change, so slabs or pieces are those of the whole to the last bit. Where overlaps
 * are thick (PlanStep), and when the memory that is allowed does not suffice, the global part is found on a coarser grid
 * (GetPlanFactor).
 *
 * Refuses, with a message: fewer than two volumes, a volume that overlaps no other (see AllowDisjoint), one with no real
 * voxels, a bad geometry or type, and a result that needs more memory than allowed.
 *
 * Under MPI each rank reads all volumes, finds the global part for itself (the same everywhere), and makes its own piece.
 */
#ifndef vtkUltrasoundStitcher_h
#define vtkUltrasoundStitcher_h

#include "EchoramaFiltersStitchingModule.h"
#include "vtkUltrasoundImageAlgorithm.h"
#include "vtkUltrasoundParameters.h"

#include <string> // for what it costs

#ifndef __VTK_WRAP__
#include "Filters/Stitching/Stitch.h"
#include "Filters/Stitching/StitchMemory.h"
#include <memory>   // for what is kept
#include <optional> // for what it costs
#include <vector>   // for gains
#endif

class ECHORAMAFILTERSSTITCHING_EXPORT vtkUltrasoundStitcher : public vtkUltrasoundImageAlgorithm {
public:
  static vtkUltrasoundStitcher* New();
  vtkTypeMacro(vtkUltrasoundStitcher, vtkUltrasoundImageAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  // BEGIN parameters
  enum Methods { DISTANCE = 0, FEATHER = 1, AVERAGE = 2, MAXIMUM = 3, MEMBRANE = 4 };

  ///@{
  /**
   * What decides how much each volume counts. Membrane: the smoothest surface from where it is alone to where only others are;
   * distance: the distances to these; feather: the distance to its own border; average: nothing, so that the plain mean is shown;
   * maximum: the largest value is shown. Default membrane. There are DISTANCE, FEATHER, AVERAGE, MAXIMUM, MEMBRANE.
   */
  vtkUltrasoundChoiceMacro(Method);
  void SetMethodToDistance() { this->SetMethod(DISTANCE); }
  void SetMethodToFeather() { this->SetMethod(FEATHER); }
  void SetMethodToAverage() { this->SetMethod(AVERAGE); }
  void SetMethodToMaximum() { this->SetMethod(MAXIMUM); }
  void SetMethodToMembrane() { this->SetMethod(MEMBRANE); }
  ///@}

  enum Textures { MIX = 0, SPLIT = 1 };

  ///@{
  /**
   * What becomes of speckle and edges where volumes overlap. Mix: their weighted mean, which washes them out; split: they change
   * over in a narrow transition, amplified by what mixtures lose. Used when Method is distance or feather or membrane. Default
   * split. There are MIX, SPLIT.
   */
  vtkUltrasoundChoiceMacro(Texture);
  void SetTextureToMix() { this->SetTexture(MIX); }
  void SetTextureToSplit() { this->SetTexture(SPLIT); }
  ///@}

  /**
   * Exponent of the weights: 0 is the plain average, 1 a ramp across the whole overlap, 50 nearly a hard edge half-way. Used when
   * Method is distance or membrane. In [0, 1000]; default 1.5.
   */
  vtkUltrasoundNumberMacro(Sharpness);

  /**
   * The same exponent for speckle and edges. With 32 about a sixteenth of the overlap is transition. Used when Texture is split.
   * In [0, 1000]; default 32.
   */
  vtkUltrasoundNumberMacro(DetailSharpness);

  /**
   * What counts as smooth: the standard deviation of the filter that parts it from details. In [1, 100] voxels of the output;
   * default 2.
   */
  vtkUltrasoundNumberMacro(DetailScale);

  /** Find a gain and an offset for each volume where volumes overlap, and apply them. Default off. */
  vtkUltrasoundSwitchMacro(EqualizeGain);

  /**
   * What cannot be trusted at all still counts by this: where nothing better is there it is shown. Used when UseReliability is
   * on. In (0, 1]; default 0.01.
   */
  vtkUltrasoundNumberMacro(ReliabilityFloor);

  /** Accept volumes that overlap no other, and put them in their place. Off, that is an error. Default off. */
  vtkUltrasoundSwitchMacro(AllowDisjoint);

  /**
   * Refuse what needs more memory beside the volumes, in 10^9 bytes. 0: three quarters of the machine's memory. At least 0 GB;
   * default 0.
   */
  vtkUltrasoundNumberMacro(MaximumMemoryGb);

  /**
   * Membranes are found on a grid whose voxels are so much larger, and interpolated. 1: at every voxel; 0: 2 where overlaps are
   * 12 voxels thick or more, where it makes no difference that can be seen, else 1. Used when Method is membrane. In [0, 64]
   * voxels of the output; default 0.
   */
  vtkUltrasoundIntegerMacro(PlanStep);

  /**
   * Edge of the cubic voxels of the output. 0: the smallest spacing of the volumes, axis by axis where they all share their
   * directions. At least 0 mm; default 0.
   */
  vtkUltrasoundNumberMacro(SpacingMm);

  /**
   * Weigh volumes that have the array Reliability by it, so that a shadow in one is filled by another. Not for the method
   * maximum. Default on.
   */
  vtkUltrasoundSwitchMacro(UseReliability);

  /** Also put out the share of each volume, as arrays Weight0, Weight1 ... Default off. */
  vtkUltrasoundSwitchMacro(OutputWeights);

  /**
   * Also put out how far the volumes are apart at each voxel, as the array Spread: the largest minus the smallest of their
   * values, 0 where one is alone. Default off.
   */
  vtkUltrasoundSwitchMacro(OutputSpread);

  /**
   * Any parameter by its name: as a number (of a switch 0 or 1, of a choice its place from 0), as text ("1.5", "on", the name of
   * a choice, "1 0 0"), integers and vectors without a loss. Setting returns false, after an error event, when there is no such
   * parameter or value. GetParameterDescriptions tells what parameters there are, as JSON: an array of objects with name, type,
   * value, unit, low, high, choices, help ...
   */
  vtkUltrasoundAnyParameterMacro();
  // END parameters

  ///@{
  /** Displacements go to input 1, in the order of the volumes. */
  void AddDisplacementConnection(vtkAlgorithmOutput* output) { this->AddInputConnection(1, output); }
  void AddDisplacementData(vtkDataObject* data) { this->AddInputDataObject(1, data); }
  void RemoveAllDisplacements() { this->SetInputConnection(1, nullptr); }
  ///@}

  ///@{
  /** Of the last update: the factor of the grid on which what is global was found (1: the output's own), and how far the
   * scales of the membranes can be from the exact ones of that grid (certified; 0 without membranes). */
  int GetPlanFactor() const { return this->PlanFactor; }
  double GetMembraneBound() const { return this->MembraneBound; }
  ///@}

  ///@{
  /** What was applied to a volume in the last update: gain * value + offset; 1 and 0 for a number that is none. */
  double GetGain(int volume) const;
  double GetOffset(int volume) const;
  ///@}

  /**
   * What stitching the inputs with these parameters needs, without doing it (inputs are updated): a JSON object with dimensions,
   * spacing, volumes, plan_factor, plan_bytes, output_bytes, allowed_bytes and slabs (of the output, so many that one fits; 0:
   * none does). Empty after an error.
   */
  std::string EstimateCost();

  ///@{
  /** Names of the output's own arrays. */
  static const char* CoverageName() { return "Coverage"; }
  static const char* SpreadName() { return "Spread"; }
  static const char* StitchedVolumesName() { return "StitchedVolumes"; }
  ///@}

#ifndef __VTK_WRAP__
  echorama::ParameterList Parameters();       ///< for C++: they point into this object
  std::optional<echorama::StitchCost> Cost(); ///< EstimateCost() for C++
  /** How far the voxels of a volume can be trusted, empty when it does not say. Throws echorama::Error(BadInput). */
  static echorama::VolumeView<const float> ReliabilityOf(const vtkUltrasoundVolume::Input& volume);
#endif

protected:
  vtkUltrasoundStitcher();
  ~vtkUltrasoundStitcher() override;

  int FillInputPortInformation(int port, vtkInformation* information) override;
  int RequestInformation(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs) override;
#ifndef __VTK_WRAP__
  void Execute(vtkInformationVector** inputs, vtkImageData* output, const echorama::Progress& progress) override;
#endif

private:
  vtkUltrasoundStitcher(const vtkUltrasoundStitcher&) = delete;
  void operator=(const vtkUltrasoundStitcher&) = delete;

#ifndef __VTK_WRAP__
  struct Scene; // what came in, and the plan for it
  std::unique_ptr<Scene> Collect(vtkInformationVector** inputs);

  std::unique_ptr<Scene> Kept; // between pieces of one output
#endif

  int PlanFactor = 0;
  double MembraneBound = 0.0;
#ifndef __VTK_WRAP__
  echorama::StitchParameters Values;
  echorama::StitchOutputs Wanted;
  bool UseReliability = true;
  double SpacingMm = 0.0;
  std::vector<double> Gains, Offsets;
#endif
};

#endif
