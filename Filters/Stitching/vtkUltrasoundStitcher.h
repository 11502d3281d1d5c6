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
 * - `Weight0`, `Weight1` ... (float), if asked for: the share of each volume;
 * - field data `StitchedVolumes`: the names of the volumes, in order. What a volume's own field data says of its acquisition
 *   is not true of the whole, and is dropped.
 *
 * Where volumes overlap each is weighted by s^b / sum s^b, s = e / (p + e), with p and e the distances to the region where
 * it is alone and to the region where only others are (dissertation 5.1, 5.2, 5.4). A volume that others cover wholly counts
 * as alone where it lies deepest inside its border. A volume with the point array `Reliability` (vtkUltrasoundReliabilityMap:
 * shadows, saturation) is weighted by it as well.
 *
 * Refuses, with a message: fewer than two volumes, a volume that overlaps no other (see AllowDisjoint), one with no real
 * voxels, a bad geometry or type, and a result that needs more memory than allowed.
 *
 * Under MPI each rank computes the whole and keeps its piece.
 */
#ifndef vtkUltrasoundStitcher_h
#define vtkUltrasoundStitcher_h

#include "EchoramaFiltersStitchingModule.h"
#include "vtkUltrasoundImageAlgorithm.h"

#ifndef __VTK_WRAP__
#include "Filters/Stitching/Stitch.h"
#endif

class ECHORAMAFILTERSSTITCHING_EXPORT vtkUltrasoundStitcher : public vtkUltrasoundImageAlgorithm {
public:
  static vtkUltrasoundStitcher* New();
  vtkTypeMacro(vtkUltrasoundStitcher, vtkUltrasoundImageAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  enum Methods { DISTANCE = 0, FEATHER = 1, AVERAGE = 2, MAXIMUM = 3 };

  ///@{
  /**
   * How overlapping volumes are blended: by the distances to pure and empty regions (default), by the distance to the own
   * border (Szeliski 1996), by their plain mean, or the largest value.
   */
  vtkSetClampMacro(Method, int, DISTANCE, MAXIMUM);
  vtkGetMacro(Method, int);
  void SetMethodToDistance() { this->SetMethod(DISTANCE); }
  void SetMethodToFeather() { this->SetMethod(FEATHER); }
  void SetMethodToAverage() { this->SetMethod(AVERAGE); }
  void SetMethodToMaximum() { this->SetMethod(MAXIMUM); }
  const char* GetMethodAsString() { return GetMethodName(this->Method); }
  ///@}

  /** "distance", "feather", "average" or "maximum"; nullptr for another number. */
  static const char* GetMethodName(int method);

  /** The number of a method by its name, or -1. */
  static int GetMethodFromName(const char* name);

  ///@{
  /**
   * The exponent b of the weights of the distance method, in [0, 1000]. 0 is the plain average, 1 a linear ramp across the
   * whole overlap, large values a hard edge half-way. Default 1.5.
   */
  vtkSetClampMacro(Sharpness, double, 0.0, 1000.0);
  vtkGetMacro(Sharpness, double);
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
  /** Names of the output's own arrays. */
  static const char* CoverageName() { return "Coverage"; }
  static const char* StitchedVolumesName() { return "StitchedVolumes"; }
  ///@}

protected:
  vtkUltrasoundStitcher();
  ~vtkUltrasoundStitcher() override = default;

  int FillInputPortInformation(int port, vtkInformation* information) override;
  int RequestInformation(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs) override;
#ifndef __VTK_WRAP__
  void Execute(vtkInformationVector** inputs, vtkImageData* output, const echorama::Progress& progress) override;
#endif

private:
  vtkUltrasoundStitcher(const vtkUltrasoundStitcher&) = delete;
  void operator=(const vtkUltrasoundStitcher&) = delete;

#ifndef __VTK_WRAP__
  echorama::VolumeView<const float> ReliabilityOf(const vtkUltrasoundVolume::Input& volume) const;
  std::vector<echorama::DisplacementField> DisplacementsOf(vtkInformationVector* port,
                                                           const std::vector<vtkUltrasoundVolume::Input>& volumes) const;
#endif

  int Method = DISTANCE;
  bool OutputWeights = false;
  bool UseReliability = true;
  double SpacingMm = 0.0;
#ifndef __VTK_WRAP__
  double Sharpness = echorama::StitchParameters().sharpness;
  double ReliabilityFloor = echorama::StitchParameters().reliabilityFloor;
  bool AllowDisjoint = echorama::StitchParameters().allowDisjoint;
  double MaximumMemoryGb = echorama::StitchParameters().maximumMemoryGb;
#endif
};

#endif
