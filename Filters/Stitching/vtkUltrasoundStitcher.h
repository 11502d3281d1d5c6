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
 * The filter makes the extent that is asked for and no more: what is global (how volumes share the overlaps, gains,
 * seams) is found once and kept until the inputs or a parameter change, so slabs or pieces are those of the whole to the last
 * bit. When the memory that is allowed does not suffice, the global part is found on a coarser grid (GetPlanFactor).
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

#include <string> // for what it costs

#ifndef __VTK_WRAP__
#include "Filters/Stitching/Stitch.h"
#include <memory> // for what is kept
#include <vector> // for gains
#endif

class ECHORAMAFILTERSSTITCHING_EXPORT vtkUltrasoundStitcher : public vtkUltrasoundImageAlgorithm {
public:
  static vtkUltrasoundStitcher* New();
  vtkTypeMacro(vtkUltrasoundStitcher, vtkUltrasoundImageAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  enum Methods { DISTANCE = 0, FEATHER = 1, AVERAGE = 2, MAXIMUM = 3, MEMBRANE = 4 };
  enum Textures { MIX = 0, SPLIT = 1, SEAM = 2 };

  ///@{
  /**
   * What decides how much each volume counts: the smoothest surface from pure to empty regions (MEMBRANE, default), the distances
   * to them (DISTANCE), the distance to the own border (FEATHER, Szeliski 1996), nothing (AVERAGE), or the largest value is shown
   * (MAXIMUM).
   */
  vtkSetClampMacro(Method, int, DISTANCE, MEMBRANE);
  vtkGetMacro(Method, int);
  void SetMethodToDistance() { this->SetMethod(DISTANCE); }
  void SetMethodToFeather() { this->SetMethod(FEATHER); }
  void SetMethodToAverage() { this->SetMethod(AVERAGE); }
  void SetMethodToMaximum() { this->SetMethod(MAXIMUM); }
  void SetMethodToMembrane() { this->SetMethod(MEMBRANE); }
  const char* GetMethodAsString() { return GetMethodName(this->Method); }
  ///@}

  ///@{
  /** The name of a method in small letters (nullptr for another number), and its number by name (or -1). */
  static const char* GetMethodName(int method);
  static int GetMethodFromName(const char* name);
  ///@}

  ///@{
  /**
   * What becomes of speckle and edges where volumes overlap (for DISTANCE, FEATHER, MEMBRANE): the weighted mean of all
   * (MIX), details that change over in a narrow transition, amplified by what their mixture has lost (SPLIT, default), or details
   * of one volume per voxel along a seam where the volumes differ least (SEAM, graph cut).
   */
  vtkSetClampMacro(Texture, int, MIX, SEAM);
  vtkGetMacro(Texture, int);
  void SetTextureToMix() { this->SetTexture(MIX); }
  void SetTextureToSplit() { this->SetTexture(SPLIT); }
  void SetTextureToSeam() { this->SetTexture(SEAM); }
  const char* GetTextureAsString() { return GetTextureName(this->Texture); }
  ///@}

  ///@{
  /** The name of a texture in small letters (nullptr for another number), and its number by name (or -1). */
  static const char* GetTextureName(int texture);
  static int GetTextureFromName(const char* name);
  ///@}

  ///@{
  /**
   * The exponent b of the weights of DISTANCE and MEMBRANE, in [0, 1000]. 0 is the plain average, 1 a ramp across the
   * whole overlap, large values a hard edge half-way. Default 1.5.
   */
  vtkSetClampMacro(Sharpness, double, 0.0, 1000.0);
  vtkGetMacro(Sharpness, double);
  ///@}

  ///@{
  /** The same exponent for the details of SPLIT, in [0, 1000]. Default 32: about a sixteenth of the overlap is transition. */
  vtkSetClampMacro(DetailSharpness, double, 0.0, 1000.0);
  vtkGetMacro(DetailSharpness, double);
  ///@}

  ///@{
  /** What counts as smooth: the standard deviation of the filter that parts it from details, in voxels of the output, [1, 100].
   * Default 2. */
  vtkSetClampMacro(DetailScale, double, 1.0, 100.0);
  vtkGetMacro(DetailScale, double);
  ///@}

  ///@{
  /**
   * Whether a gain and an offset per volume are found where volumes overlap (least squares over all pairs), and applied. For
   * volumes of different gain or depth compensation. Default off. What was applied: GetGain(), GetOffset().
   */
  vtkSetMacro(EqualizeGain, bool);
  vtkGetMacro(EqualizeGain, bool);
  vtkBooleanMacro(EqualizeGain, bool);
  ///@}

  ///@{
  /** Spacing of the output, mm. 0 (default): the smallest among the volumes. A negative one is refused. */
  vtkSetMacro(SpacingMm, double);
  vtkGetMacro(SpacingMm, double);
  ///@}

  ///@{
  /** Whether a volume may overlap no other; it is then just put in its place. Default off: that is an error. */
  vtkSetMacro(AllowDisjoint, bool);
  vtkGetMacro(AllowDisjoint, bool);
  vtkBooleanMacro(AllowDisjoint, bool);
  ///@}

  ///@{
  /** Whether the `Reliability` of volumes that have it multiplies their weights (but for MAXIMUM). Default on. */
  vtkSetMacro(UseReliability, bool);
  vtkGetMacro(UseReliability, bool);
  vtkBooleanMacro(UseReliability, bool);
  ///@}

  ///@{
  /** What cannot be trusted at all still counts by this, in [1e-6, 1]: enough where nothing else is there. Default 0.01. */
  vtkSetClampMacro(ReliabilityFloor, double, 1e-6, 1.0);
  vtkGetMacro(ReliabilityFloor, double);
  ///@}

  ///@{
  /** Whether the share of each volume is put out too (4 bytes per voxel and volume). Default off. */
  vtkSetMacro(OutputWeights, bool);
  vtkGetMacro(OutputWeights, bool);
  vtkBooleanMacro(OutputWeights, bool);
  ///@}

  ///@{
  /** Whether `Spread` is put out too (4 bytes per voxel). Default off. */
  vtkSetMacro(OutputSpread, bool);
  vtkGetMacro(OutputSpread, bool);
  vtkBooleanMacro(OutputSpread, bool);
  ///@}

  ///@{
  /** Refuse what needs more memory than this, in 10^9 bytes. 0 (default): three quarters of this machine's memory. */
  vtkSetClampMacro(MaximumMemoryGb, double, 0.0, VTK_DOUBLE_MAX);
  vtkGetMacro(MaximumMemoryGb, double);
  ///@}

  ///@{
  /** Displacements go to input 1, in the order of the volumes. */
  void AddDisplacementConnection(vtkAlgorithmOutput* output) { this->AddInputConnection(1, output); }
  void AddDisplacementData(vtkDataObject* data) { this->AddInputDataObject(1, data); }
  void RemoveAllDisplacements() { this->SetInputConnection(1, nullptr); }
  ///@}

  ///@{
  /** Of the last update: the factor of the grid on which what is global was found (1: the output's own), and how far the
   * scales of the membranes can be from the exact ones (certified; 0 without membranes). */
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
  echorama::StitchParameters Parameters() const;
  echorama::VolumeView<const float> ReliabilityOf(const vtkUltrasoundVolume::Input& volume) const;
  std::vector<echorama::DisplacementField> DisplacementsOf(vtkInformationVector* port,
                                                           const std::vector<vtkUltrasoundVolume::Input>& volumes) const;

  std::unique_ptr<Scene> Kept; // between pieces of one output
#endif

  int Method = MEMBRANE;
  int Texture = SPLIT;
  bool OutputWeights = false;
  bool OutputSpread = false;
  bool UseReliability = true;
  double SpacingMm = 0.0;
  int PlanFactor = 0;
  double MembraneBound = 0.0;
#ifndef __VTK_WRAP__
  double Sharpness = echorama::StitchParameters().sharpness;
  double DetailSharpness = echorama::StitchParameters().detailSharpness;
  double DetailScale = echorama::StitchParameters().detailScale;
  bool EqualizeGain = echorama::StitchParameters().equalizeGain;
  double ReliabilityFloor = echorama::StitchParameters().reliabilityFloor;
  bool AllowDisjoint = echorama::StitchParameters().allowDisjoint;
  double MaximumMemoryGb = echorama::StitchParameters().maximumMemoryGb;
  std::vector<double> Gains, Offsets;
#endif
};

#endif
