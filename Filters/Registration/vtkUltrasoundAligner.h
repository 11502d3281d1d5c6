// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class vtkUltrasoundAligner
 * @brief moves overlapping volumes to where their contents agree
 *
 * Input 0 (repeatable): two or more volumes (vtkImageData, or the image leaves of vtkDataObjectTree), where they are
 * thought to be. Output: a vtkMultiBlockDataSet with the same volumes in the same order, one block each, with the same
 * NAME(). Voxels are shared with the input; only geometry and `ProbeToWorld` are new. The volume number FixedVolume stays
 * where it is; the others follow in turn, the one that overlaps the placed ones most first, each aligned with all that are
 * placed.
 *
 * Field data of each block:
 *
 * | field            | values                                                                                  |
 * | ---------------- | --------------------------------------------------------------------------------------- |
 * | VolumeToWorld    | 16 doubles, row by row: the motion found, from where the input was to where the output is |
 * | AlignmentError   | 1 double: mean absolute difference in the overlap, grey levels (not on the fixed volume) |
 * | AlignmentOverlap | 1 double: the share of the volume that lies in placed volumes (not on the fixed volume)  |
 *
 * The method `search` is the coarse-to-fine search over six dimensions of dissertation 4.2 with the error of eq. 4.13; see
 * echorama::AlignSearch, whose parameters these are. It compares intensities as they are: volumes of different gain
 * should be matched first.
 *
 * Fails with a message when there are fewer than two volumes, one is not three-dimensional, constant or nearly empty, or
 * volumes do not overlap by MinimumOverlap. The whole of every volume is needed: under MPI each rank computes and holds
 * the whole result.
 *
 * @sa vtkUltrasoundAlignmentScore
 */
#ifndef vtkUltrasoundAligner_h
#define vtkUltrasoundAligner_h

#include "EchoramaFiltersRegistrationModule.h"
#include "vtkMultiBlockDataSetAlgorithm.h"

#ifndef __VTK_WRAP__
#include "Filters/Registration/AlignSearch.h" // for the defaults
#include <string>
#include <vector>
#endif

class vtkMatrix4x4;

class ECHORAMAFILTERSREGISTRATION_EXPORT vtkUltrasoundAligner : public vtkMultiBlockDataSetAlgorithm {
public:
  static vtkUltrasoundAligner* New();
  vtkTypeMacro(vtkUltrasoundAligner, vtkMultiBlockDataSetAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  ///@{
  /** The volume that stays where it is, counted from 0. Default 0. */
  vtkSetClampMacro(FixedVolume, int, 0, VTK_INT_MAX);
  vtkGetMacro(FixedVolume, int);
  ///@}

  ///@{
  /** How volumes are aligned. Default and only choice: "search". Another name is an error and changes nothing. */
  void SetMethod(const char* name);
  const char* GetMethod() const { return "search"; }
  ///@}

  ///@{
  /** The share of a volume that must lie in placed volumes for a pose to count, in [0.01, 1]. Default 0.4. */
  vtkSetClampMacro(MinimumOverlap, double, 0.01, 1.0);
  vtkGetMacro(MinimumOverlap, double);
  ///@}

  ///@{
  /** Poses tried along each of the six dimensions: 3, 5 or 7 (n^6 poses per round). Default 3. */
  vtkSetMacro(Samples, int);
  vtkGetMacro(Samples, int);
  ///@}

  ///@{
  /** Levels of the search, each with half the steps of the one before, in [1, 20]. Default 8. */
  vtkSetClampMacro(Levels, int, 1, 20);
  vtkGetMacro(Levels, int);
  ///@}

  ///@{
  /** Step between poses on the first level, mm, in (0, 1000]. Default 8. */
  vtkSetClampMacro(FirstStepMm, double, 1e-6, 1000.0);
  vtkGetMacro(FirstStepMm, double);
  ///@}

  ///@{
  /** Step between poses on the first level, degrees, in (0, 60]. Default 6. */
  vtkSetClampMacro(FirstStepDegrees, double, 1e-6, 60.0);
  vtkGetMacro(FirstStepDegrees, double);
  ///@}

  ///@{
  /** How often a level starts again from a better pose, in [0, 100]. 0 is the search of the dissertation. Default 3. */
  vtkSetClampMacro(Repeats, int, 0, 100);
  vtkGetMacro(Repeats, int);
  ///@}

  ///@{
  /** Random points of each volume that are compared, in [100, 10000000]. Default 20000. */
  vtkSetClampMacro(Points, int, 100, 10000000);
  vtkGetMacro(Points, int);
  ///@}

  ///@{
  /** Seed of the random points, >= 0. Default 1. */
  vtkSetClampMacro(Seed, int, 0, VTK_INT_MAX);
  vtkGetMacro(Seed, int);
  ///@}

  ///@{
  /** Whether averaged volumes are compared while steps are larger than voxels. Default on. */
  vtkSetMacro(Pyramid, bool);
  vtkGetMacro(Pyramid, bool);
  vtkBooleanMacro(Pyramid, bool);
  ///@}

  /**
   * Sets a number of the method by its name: MinimumOverlap, Samples, Levels, FirstStepMm, FirstStepDegrees, Repeats,
   * Points, Seed, Pyramid. Unlike the setters it does not clamp: an unknown name or a value out of range is an error that
   * says what is allowed, changes nothing, and returns false.
   */
  bool SetParameter(const char* name, double value);

  /** How many volumes the last update aligned; 0 when it failed. */
  int GetNumberOfVolumes() const;

  /**
   * The motion found for a volume: from where the input was to where the output is, mm. Returns false, and leaves \a pose
   * alone, when there is no such volume.
   */
  bool GetPose(int volume, vtkMatrix4x4* pose) const;

  ///@{
  /**
   * Mean absolute difference (grey levels) and overlap (share of the volume) of a volume in its final pose; 0 for the
   * fixed volume and for one that is not there.
   */
  double GetError(int volume) const;
  double GetOverlap(int volume) const;
  ///@}

  ///@{
  /** Names of the field data. */
  static const char* VolumeToWorldName() { return "VolumeToWorld"; }
  static const char* AlignmentErrorName() { return "AlignmentError"; }
  static const char* AlignmentOverlapName() { return "AlignmentOverlap"; }
  ///@}

protected:
  vtkUltrasoundAligner();
  ~vtkUltrasoundAligner() override;

  int FillInputPortInformation(int port, vtkInformation* info) override;
  int RequestInformation(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs) override;
  int RequestUpdateExtent(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs) override;
  int RequestData(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs) override;

private:
  vtkUltrasoundAligner(const vtkUltrasoundAligner&) = delete;
  void operator=(const vtkUltrasoundAligner&) = delete;

#ifndef __VTK_WRAP__
  echorama::AlignSearchParameters Parameters() const;
  const echorama::AlignSearchResult* ResultOf(int volume) const;

  int FixedVolume = 0;
  double MinimumOverlap;
  int Samples;
  int Levels;
  double FirstStepMm;
  double FirstStepDegrees;
  int Repeats;
  int Points;
  int Seed;
  bool Pyramid;
  std::vector<echorama::AlignSearchResult> Results;
#endif
};

#endif
