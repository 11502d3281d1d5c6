// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class vtkUltrasoundAligner
 * @brief moves overlapping volumes to where their contents agree
 *
 * Input 0 (repeatable): two or more volumes (vtkImageData, or the image leaves of vtkDataObjectTree), where they are
 * thought to be. Output: a vtkMultiBlockDataSet with the same volumes in the same order, one block each, with the same
 * NAME(). Voxels are shared with the input; only geometry and `ProbeToWorld` are new. The volume number FixedVolume stays
 * where it is.
 *
 * It needs no start: pairs of volumes are aligned by a global search over rotations and translations, local refinement and a
 * verdict (echorama::AlignPair); a pose graph over all pairs places the volumes and names wrong pairs (echorama::AlignVolumes).
 * A volume whose verdict is `failed` stays where it was.
 *
 * Field data of each block:
 *
 * | field                 | values                                                                                        |
 * | --------------------- | --------------------------------------------------------------------------------------------- |
 * | VolumeToWorld         | 16 doubles, row by row: the motion found, from where the input was to where the output is       |
 * | AlignmentOverlap      | 1 double: the share of the volume that overlaps others, [0, 1] (not on the fixed volume)         |
 * | AlignmentVerdict      | a string: aligned, ambiguous or failed                                                         |
 * | AlignmentReason       | a string: why it is not aligned; else empty                                                    |
 * | AlignmentSimilarity   | 1 double: 1 identical, 0 chance                                                                |
 * | AlignmentCovariance   | 36 doubles, row by row: covariance of (translation mm, rotation vector radians), relative to     |
 * |                       | the fixed volume                                                                              |
 * | AlignmentCentre       | 3 doubles: the point of the world about which that rotation turns, mm                            |
 *
 * Fails with a message when there are fewer than two volumes, or one is not three-dimensional, constant or nearly empty.
 * The whole of every volume is needed: under MPI each rank computes and holds the whole result.
 *
 * @sa vtkUltrasoundAlignmentScore
 */
#ifndef vtkUltrasoundAligner_h
#define vtkUltrasoundAligner_h

#include "EchoramaFiltersRegistrationModule.h"
#include "vtkUltrasoundMultiBlockAlgorithm.h"

#ifndef __VTK_WRAP__
#include "Filters/Registration/AlignVolumes.h" // for the defaults
#include <string>
#include <vector>
#endif

class vtkMatrix4x4;

class ECHORAMAFILTERSREGISTRATION_EXPORT vtkUltrasoundAligner : public vtkUltrasoundMultiBlockAlgorithm {
public:
  static vtkUltrasoundAligner* New();
  vtkTypeMacro(vtkUltrasoundAligner, vtkUltrasoundMultiBlockAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  ///@{
  /** The volume that stays where it is, counted from 0. Default 0. */
  vtkSetClampMacro(FixedVolume, int, 0, VTK_INT_MAX);
  vtkGetMacro(FixedVolume, int);
  ///@}

  ///@{
  /**
   * Volumes, counted from 0, that stay where they are beside the fixed one: the others are aligned with all of
   * them, and their own pairs are not looked at. Default none.
   */
  void AddHeldVolume(int volume);
  void ClearHeldVolumes();
  int GetNumberOfHeldVolumes() const;
  ///@}

  ///@{
  /**
   * What is known about where the volumes belong: "tracked" (within some 12 degrees and 20 mm), "hand-made"
   * (within some 35 degrees and a third of a volume's size), "unknown" (nothing: every rotation and translation is tried), or
   * "automatic" (default: tracked, then hand-made, then unknown, while there is no clear answer). Another name is an error and
   * changes nothing.
   */
  void SetStart(const char* name);
  const char* GetStart() const;
  ///@}

  ///@{
  /**
   * The measure of likeness that refines poses: "local-ncc" (default), "ncc", "mind-ssc" or "lc2". Another name is an error and
   * changes nothing.
   */
  void SetMetric(const char* name);
  const char* GetMetric() const;
  ///@}

  ///@{
  /** Whether shadowed and saturated voxels count less (echorama::ReliabilityMap). Default on. */
  vtkSetMacro(UseReliability, bool);
  vtkGetMacro(UseReliability, bool);
  vtkBooleanMacro(UseReliability, bool);
  ///@}

  ///@{
  /**
   * The share of the smaller volume of a pair that must lie in the other for a pose to count, in [0.01, 1]. 0 (default): 0.1.
   */
  vtkSetClampMacro(MinimumOverlap, double, 0.0, 1.0);
  vtkGetMacro(MinimumOverlap, double);
  ///@}

  ///@{
  /** Poses of the global search that are refined, in [1, 1000]. Default 16. */
  vtkSetClampMacro(Candidates, int, 1, 1000);
  vtkGetMacro(Candidates, int);
  ///@}

  ///@{
  /**
   * Refinement ends at voxels not smaller than this, mm, in [0, 1000]: larger is faster and less accurate. 0 (default): at the
   * volumes' own.
   */
  vtkSetClampMacro(FinestMm, double, 0.0, 1000.0);
  vtkGetMacro(FinestMm, double);
  ///@}

  ///@{
  /**
   * When an answer is trusted: least similarity in the overlap, [0, 1]; least ratio of the best evidence to that
   * of the next different pose, [1, 99]; largest predicted error and largest distance of the poses that two halves of the voxels
   * find, voxels, (0, 1000]. Defaults as echorama::AlignPairParameters.
   */
  vtkSetClampMacro(MinimumSimilarity, double, 0.0, 1.0);
  vtkGetMacro(MinimumSimilarity, double);
  vtkSetClampMacro(MinimumPeakRatio, double, 1.0, 99.0);
  vtkGetMacro(MinimumPeakRatio, double);
  vtkSetClampMacro(MaximumErrorVoxels, double, 1e-3, 1000.0);
  vtkGetMacro(MaximumErrorVoxels, double);
  vtkSetClampMacro(MaximumSplitVoxels, double, 1e-3, 1000.0);
  vtkGetMacro(MaximumSplitVoxels, double);
  ///@}

  ///@{
  /**
   * Random points of each volume that are compared on each level, in [1000, 10000000]; fewer become 1000. 0 (default): 200000.
   */
  void SetPoints(int points);
  vtkGetMacro(Points, int);
  ///@}

  ///@{
  /** Seed of the random points, >= 0. Default 1. */
  vtkSetClampMacro(Seed, int, 0, VTK_INT_MAX);
  vtkGetMacro(Seed, int);
  ///@}

  /**
   * Sets a number by its name. Unlike the setters it does not clamp: a name that is none, or a value out of range, is an error
   * that says what is allowed, changes nothing, and returns false.
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
   * Similarity and overlap of a volume in its final pose: the mean similarity of its pairs that stand, and the largest of their
   * overlaps (share of the smaller volume). 0 without such a pair.
   */
  double GetSimilarity(int volume) const;
  double GetOverlap(int volume) const;
  ///@}

  ///@{
  /**
   * "aligned", "ambiguous" or "failed", and why it is not aligned (empty when it is). The
   * fixed volume is aligned. Empty when there is no such volume.
   */
  std::string GetVerdict(int volume) const;
  std::string GetReason(int volume) const;
  ///@}

  /** Whether every verdict is "aligned"; not before the first update. */
  bool GetAllAligned() const;

  /**
   * What the last update did, as JSON: {"volumes": [{"name", "verdict", "reason", "similarity", "overlap",
   * "centre", "covariance"}, ...], "pairs": [{"fixed", "moving" (from 0), "verdict", "reason", "score", "similarity", "overlap",
   * "peak_ratio", "split_mm", "error_mm", "voted_down", "stands", "attempts", "residual_mm", "anywhere", "seconds": {"global",
   * "local", "confidence"}},
   * ...], "seconds":
   * {"prepare", "pairs", "graph"}}. Empty when it failed.
   */
  std::string GetReport() const { return this->Report; }

  ///@{
  /** Names of the field data. */
  static const char* VolumeToWorldName() { return "VolumeToWorld"; }
  static const char* AlignmentOverlapName() { return "AlignmentOverlap"; }
  static const char* AlignmentSimilarityName() { return "AlignmentSimilarity"; }
  static const char* AlignmentVerdictName() { return "AlignmentVerdict"; }
  static const char* AlignmentReasonName() { return "AlignmentReason"; }
  static const char* AlignmentCovarianceName() { return "AlignmentCovariance"; }
  static const char* AlignmentCentreName() { return "AlignmentCentre"; }
  ///@}

protected:
  vtkUltrasoundAligner();
  ~vtkUltrasoundAligner() override;

#ifndef __VTK_WRAP__
  void Execute(vtkInformationVector** inputs, vtkInformationVector* outputs, const echorama::Progress& progress) override;
#endif

private:
  vtkUltrasoundAligner(const vtkUltrasoundAligner&) = delete;
  void operator=(const vtkUltrasoundAligner&) = delete;

#ifndef __VTK_WRAP__
  // What is told of a volume.
  struct Result {
    echorama::Pose VolumeToWorld = echorama::Pose::Identity();
    double Similarity = 0.0, Overlap = 0.0;
    std::string Verdict, Reason;
    echorama::Information Covariance = echorama::Information::Zero();
    Eigen::Vector3d Centre = Eigen::Vector3d::Zero();
  };
  bool Choose(std::string& choice, const char* name, const char* what, const std::vector<std::string>& names);
  echorama::AlignVolumesParameters Parameters() const;
  std::vector<Result> AlignAll(const std::vector<echorama::PlacedVolume>& volumes, double prepareSeconds,
                               const echorama::Progress& progress);
  const Result* ResultOf(int volume) const;

  int FixedVolume = 0;
  std::vector<int> HeldVolumes;
  std::string Start;
  std::string Metric;
  bool UseReliability = true;
  double MinimumOverlap = 0.0;
  int Points = 0;
  int Seed;
  int Candidates;
  double FinestMm;
  double MinimumSimilarity;
  double MinimumPeakRatio;
  double MaximumErrorVoxels;
  double MaximumSplitVoxels;
  std::vector<Result> Results;
  std::string Report;
#endif
};

#endif
