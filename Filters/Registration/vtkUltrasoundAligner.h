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
 * The method `global` (default) needs no start: pairs of volumes are aligned by a global search over rotations and translations,
 * local refinement and a verdict (echorama::AlignPair); a pose graph over all pairs places the volumes and names wrong pairs
 * (echorama::AlignVolumes). A volume whose verdict is `failed` stays where it was. The method `search` is the coarse-to-fine
 * search over six dimensions of dissertation 4.2 with the error of eq. 4.13, from a start that is near (echorama::AlignSearch);
 * it does not judge its answer, and compares intensities as they are.
 *
 * Field data of each block, * where the method is `global`, ** where it is `search` (not on the fixed volume):
 *
 * | field                 | values                                                                                        |
 * | --------------------- | --------------------------------------------------------------------------------------------- |
 * | VolumeToWorld         | 16 doubles, row by row: the motion found, from where the input was to where the output is       |
 * | AlignmentOverlap      | 1 double: the share of the volume that overlaps others, [0, 1] (not on the fixed volume)         |
 * | AlignmentVerdict      | a string: aligned, ambiguous or failed; of `search` unjudged                                    |
 * | AlignmentReason       | a string: why it is not aligned; else empty                                                    |
 * | AlignmentSimilarity * | 1 double: 1 identical, 0 chance                                                                |
 * | AlignmentCovariance * | 36 doubles, row by row: covariance of (translation mm, rotation vector radians), relative to     |
 * |                       | the fixed volume                                                                              |
 * | AlignmentCentre *     | 3 doubles: the point of the world about which that rotation turns, mm                            |
 * | AlignmentError **     | 1 double: mean absolute difference in the overlap, grey levels                                  |
 *
 * Fails with a message when there are fewer than two volumes, or one is not three-dimensional, constant or nearly empty; the
 * method `search` also when volumes do not overlap by MinimumOverlap. The whole of every volume is needed: under MPI each rank
 * computes and holds the whole result.
 *
 * @sa vtkUltrasoundAlignmentScore
 */
#ifndef vtkUltrasoundAligner_h
#define vtkUltrasoundAligner_h

#include "EchoramaFiltersRegistrationModule.h"
#include "vtkMultiBlockDataSetAlgorithm.h"

#ifndef __VTK_WRAP__
#include "Filters/Registration/AlignSearch.h"  // for the defaults
#include "Filters/Registration/AlignVolumes.h" // for the defaults
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
  /**
   * Volumes, counted from 0, that stay where they are beside the fixed one, method `global`: the others are aligned with all of
   * them, and their own pairs are not looked at. Default none.
   */
  void AddHeldVolume(int volume);
  void ClearHeldVolumes();
  int GetNumberOfHeldVolumes() const;
  ///@}

  ///@{
  /** How volumes are aligned: "global" (default) or "search". Another name is an error and changes nothing. */
  void SetMethod(const char* name);
  const char* GetMethod() const;
  ///@}

  ///@{
  /**
   * What is known about where the volumes belong, method `global`: "tracked" (within some 12 degrees and 20 mm), "hand-made"
   * (within some 35 degrees and a third of a volume's size), "unknown" (nothing: every rotation and translation is tried), or
   * "automatic" (default: tracked, then hand-made, then unknown, while there is no clear answer). Another name is an error and
   * changes nothing.
   */
  void SetStart(const char* name);
  const char* GetStart() const;
  ///@}

  ///@{
  /**
   * The measure of likeness that refines poses, method `global`: "local-ncc" (default), "ncc", "mad", "mind-ssc" or "lc2".
   * Another name is an error and changes nothing.
   */
  void SetMetric(const char* name);
  const char* GetMetric() const;
  ///@}

  ///@{
  /** Whether shadowed and saturated voxels count less (echorama::ReliabilityMap), method `global`. Default on. */
  vtkSetMacro(UseReliability, bool);
  vtkGetMacro(UseReliability, bool);
  vtkBooleanMacro(UseReliability, bool);
  ///@}

  ///@{
  /**
   * The share of a volume that must lie in others for a pose to count, in [0.01, 1]: of the smaller one of a pair (global), of
   * the moving one (search). 0 (default) is the method's own: 0.1 and 0.4.
   */
  vtkSetClampMacro(MinimumOverlap, double, 0.0, 1.0);
  vtkGetMacro(MinimumOverlap, double);
  ///@}

  ///@{
  /** Poses of the global search that are refined, in [1, 1000]. Method `global`. Default 16. */
  vtkSetClampMacro(Candidates, int, 1, 1000);
  vtkGetMacro(Candidates, int);
  ///@}

  ///@{
  /**
   * Refinement ends at voxels not smaller than this, mm, in [0, 1000]: larger is faster and less accurate. 0 (default): at the
   * volumes' own. Method `global`.
   */
  vtkSetClampMacro(FinestMm, double, 0.0, 1000.0);
  vtkGetMacro(FinestMm, double);
  ///@}

  ///@{
  /**
   * When an answer is trusted, method `global`: least similarity in the overlap, [0, 1]; least ratio of the best evidence to that
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
  /** Poses tried along each of the six dimensions: 3, 5 or 7 (n^6 poses per round). Method `search`. Default 3. */
  vtkSetMacro(Samples, int);
  vtkGetMacro(Samples, int);
  ///@}

  ///@{
  /** Levels of the search, each with half the steps of the one before, in [1, 20]. Method `search`. Default 8. */
  vtkSetClampMacro(Levels, int, 1, 20);
  vtkGetMacro(Levels, int);
  ///@}

  ///@{
  /** Step between poses on the first level, mm, in (0, 1000]. Method `search`. Default 8. */
  vtkSetClampMacro(FirstStepMm, double, 1e-6, 1000.0);
  vtkGetMacro(FirstStepMm, double);
  ///@}

  ///@{
  /** Step between poses on the first level, degrees, in (0, 60]. Method `search`. Default 6. */
  vtkSetClampMacro(FirstStepDegrees, double, 1e-6, 60.0);
  vtkGetMacro(FirstStepDegrees, double);
  ///@}

  ///@{
  /**
   * How often a level starts again from a better pose, in [0, 100]. 0 is the search of the dissertation. Method `search`.
   * Default 3.
   */
  vtkSetClampMacro(Repeats, int, 0, 100);
  vtkGetMacro(Repeats, int);
  ///@}

  ///@{
  /**
   * Random points of each volume that are compared, in [1000, 10000000]; fewer become 1000. 0 (default) is the method's own:
   * 200000 on each level (global), 20000 (search).
   */
  void SetPoints(int points);
  vtkGetMacro(Points, int);
  ///@}

  ///@{
  /** Seed of the random points, >= 0. Default 1. */
  vtkSetClampMacro(Seed, int, 0, VTK_INT_MAX);
  vtkGetMacro(Seed, int);
  ///@}

  ///@{
  /** Whether averaged volumes are compared while steps are larger than voxels. Method `search`. Default on. */
  vtkSetMacro(Pyramid, bool);
  vtkGetMacro(Pyramid, bool);
  vtkBooleanMacro(Pyramid, bool);
  ///@}

  /**
   * Sets a number by its name: those above of the present method. Unlike the setters it does not clamp: a name that the method
   * does not have, or a value out of range, is an error that says what is allowed, changes nothing, and returns false.
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
   * Mean absolute difference (grey levels; 0 unless the method is `search`), similarity (0 unless it is `global`) and overlap
   * (share of the volume) of a volume in its final pose; 0 for the fixed volume and for one that is not there.
   */
  double GetError(int volume) const;
  double GetSimilarity(int volume) const;
  double GetOverlap(int volume) const;
  ///@}

  ///@{
  /**
   * "aligned", "ambiguous" or "failed", and why it is not aligned (empty when it is); of the method `search` "unjudged". The
   * fixed volume is aligned. Empty when there is no such volume.
   */
  std::string GetVerdict(int volume) const;
  std::string GetReason(int volume) const;
  ///@}

  /** Whether every verdict is "aligned": never after the method `search`, which does not judge its answer, nor before the first
   * update. */
  bool GetAllAligned() const;

  /**
   * What the last update did, as JSON: {"method", "volumes": [{"name", "verdict", "reason", "similarity", "overlap",
   * "centre", "covariance"}, ...], "pairs": [{"fixed", "moving" (from 0), "verdict", "reason", "score", "similarity", "overlap",
   * "peak_ratio", "split_mm", "error_mm", "voted_down", "stands", "attempts", "residual_mm", "anywhere", "seconds": {"global",
   * "local", "confidence"}},
   * ...], "seconds":
   * {"prepare", "pairs", "graph"}}; of the method `search`: {"method", "volumes": [{"name", "verdict", "reason", "error_grey",
   * "overlap"}, ...]}. Empty when it failed.
   */
  std::string GetReport() const { return this->Report; }

  ///@{
  /** Names of the field data. */
  static const char* VolumeToWorldName() { return "VolumeToWorld"; }
  static const char* AlignmentErrorName() { return "AlignmentError"; }
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

  int FillInputPortInformation(int port, vtkInformation* info) override;
  int RequestInformation(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs) override;
  int RequestUpdateExtent(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs) override;
  int RequestData(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs) override;

private:
  vtkUltrasoundAligner(const vtkUltrasoundAligner&) = delete;
  void operator=(const vtkUltrasoundAligner&) = delete;

#ifndef __VTK_WRAP__
  // What both methods tell of a volume.
  struct Result {
    echorama::Pose VolumeToWorld = echorama::Pose::Identity();
    double Error = 0.0, Similarity = 0.0, Overlap = 0.0;
    std::string Verdict, Reason;
    echorama::Information Covariance = echorama::Information::Zero();
    Eigen::Vector3d Centre = Eigen::Vector3d::Zero();
  };
  bool IsGlobal() const
  {
    return this->Method == "global";
  }
  bool Choose(std::string& choice, const char* name, const char* what, const std::vector<std::string>& names);
  echorama::AlignSearchParameters SearchParameters() const;
  echorama::AlignVolumesParameters GlobalParameters() const;
  std::vector<Result> AlignBySearch(const std::vector<echorama::PlacedVolume>& volumes, const echorama::Progress& progress);
  std::vector<Result> AlignGlobally(const std::vector<echorama::PlacedVolume>& volumes, double prepareSeconds,
                                    const echorama::Progress& progress);
  const Result* ResultOf(int volume) const;

  int FixedVolume = 0;
  std::vector<int> HeldVolumes;
  std::string Method = "global";
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
  int Samples;
  int Levels;
  double FirstStepMm;
  double FirstStepDegrees;
  int Repeats;
  bool Pyramid;
  std::vector<Result> Results;
  std::string Report;
#endif
};

#endif
