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
 * A volume whose verdict is `failed` stays where it was. What is made of volumes for their pairs is kept as long as MemoryGb
 * lasts; with FinishedPairs a run that was stopped goes on where it was.
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
 * Landmarks that volumes carry (vtkUltrasoundLandmarks) count as those that are given here.
 *
 * Fails with a message when there are fewer than two volumes, or one is not three-dimensional, constant or nearly empty.
 * The whole of every volume is needed: each rank of Controller holds all of them, aligns its share of the pairs and gets the
 * whole result, the same as one rank's. What fails on one rank fails on all, with its message.
 *
 * @sa vtkUltrasoundAlignmentScore, vtkUltrasoundLandmarkError, vtkUltrasoundLandmarks
 */
#ifndef vtkUltrasoundAligner_h
#define vtkUltrasoundAligner_h

#include "EchoramaFiltersRegistrationModule.h"
#include "vtkUltrasoundMultiBlockAlgorithm.h"
#include "vtkUltrasoundParameters.h"

#ifndef __VTK_WRAP__
#include "Filters/Registration/AlignVolumes.h"
#include "Filters/Registration/LandmarkInput.h"
#endif

class vtkMatrix4x4;
class vtkMultiProcessController;

class ECHORAMAFILTERSREGISTRATION_EXPORT vtkUltrasoundAligner : public vtkUltrasoundMultiBlockAlgorithm {
public:
  static vtkUltrasoundAligner* New();
  vtkTypeMacro(vtkUltrasoundAligner, vtkUltrasoundMultiBlockAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  // BEGIN parameters
  /** The volume that stays where it is, counted from 0. At least 0; default 0. */
  vtkUltrasoundIntegerMacro(FixedVolume);

  /** Whether shadowed and saturated voxels count less. Default on. */
  vtkUltrasoundSwitchMacro(UseReliability);

  /**
   * What is known about where the volumes belong: tracked, within some 12 degrees and 20 mm; hand-made, within some 35 degrees
   * and a third of a volume; unknown, nothing; automatic, one after the other while there is no clear answer. Default automatic.
   * There are "automatic", "tracked", "hand-made", "unknown".
   */
  vtkUltrasoundTextMacro(Start);

  /**
   * The likeness that refines poses: normalised cross-correlation, local or over the whole overlap, the mean absolute difference,
   * self-similarity descriptors, or local linear correlation of intensity and gradient. Default local-ncc. There are "local-ncc",
   * "ncc", "mad", "mind-ssc", "lc2".
   */
  vtkUltrasoundTextMacro(Metric);

  /** The share of the smaller volume of a pair that must lie in the other for a pose to count. In [0.01, 1]; default 0.1. */
  vtkUltrasoundNumberMacro(MinimumOverlap);

  /**
   * Refinement ends at voxels not smaller than this; larger is faster and less exact. 0: at the volumes' own. In [0, 1000] mm;
   * default 0.
   */
  vtkUltrasoundNumberMacro(FinestMm);

  /**
   * Poses of the global search that are refined; four times as many when every rotation is tried, and where fewer give no clear
   * answer. In [1, 1000]; default 16.
   */
  vtkUltrasoundIntegerMacro(Candidates);

  /** Less similarity in the overlap (1 identical, 0 chance) is failed. In [0, 1]; default 0.06. */
  vtkUltrasoundNumberMacro(MinimumSimilarity);

  /** A smaller ratio of the best evidence to that of the next different pose is ambiguous. In [1, 99]; default 1.25. */
  vtkUltrasoundNumberMacro(MinimumPeakRatio);

  /**
   * A larger predicted error is ambiguous; where volumes are hardly alike (similarity below 0.15), in proportion less. In [0.001,
   * 1000] voxels; default 1.
   */
  vtkUltrasoundNumberMacro(MaximumErrorVoxels);

  /**
   * A larger predicted error is ambiguous, too, whatever the size of the voxels: what your use can bear. In [0.001, 1000] mm;
   * default 2.5.
   */
  vtkUltrasoundNumberMacro(MaximumErrorMm);

  /**
   * How far the speed of sound in the tissue may be from what the scanner takes it for, as a share. A volume may be off by this
   * share of its distance from the fixed one although both show the same: that is added to its error. In [0, 0.2]; default 0.025.
   */
  vtkUltrasoundNumberMacro(SoundSpeedError);

  /** Poses found from two halves of the voxels that lie further apart are failed. In [0.001, 1000] voxels; default 2. */
  vtkUltrasoundNumberMacro(MaximumSplitVoxels);

  /**
   * How exactly landmarks were found: the standard deviation of the difference between the two points of one, along each axis.
   * Poses in which they differ by more than chance would have it are no answers. In [0.001, 1000] mm; default 2.
   */
  vtkUltrasoundNumberMacro(LandmarkSigmaMm);

  /** Random points of each volume that are compared on each level. In [100, 10000000]; default 200000. */
  vtkUltrasoundIntegerMacro(Points);

  /** The same seed draws the same points. At least 0; default 1. */
  vtkUltrasoundInteger64Macro(Seed);

  /**
   * How much memory may hold what is made of volumes for their pairs. Where it does not last, volumes are prepared again: that
   * takes longer and finds the same. 0: half of what is free. In [0, 1000000] GB; default 0.
   */
  vtkUltrasoundNumberMacro(MemoryGb);

  /**
   * A file in which aligned pairs are kept. A run that was stopped goes on from there, and pairs of which nothing has changed are
   * not aligned again. Default none.
   */
  vtkUltrasoundTextMacro(FinishedPairs);

  /** Whether it is only told what would be done: pairs, memory and time. No volume is moved. Default off. */
  vtkUltrasoundSwitchMacro(DryRun);

  /**
   * Any parameter by its name: as a number (of a switch 0 or 1, of a choice its place from 0), as text ("1.5", "on", the name of
   * a choice, "1 0 0"), integers and vectors without a loss. Setting returns false, after an error event, when there is no such
   * parameter or value. GetParameterDescriptions tells what parameters there are, as JSON: an array of objects with name, type,
   * value, unit, low, high, choices, help ...
   */
  vtkUltrasoundAnyParameterMacro();
  // END parameters

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
   * Landmarks: places with labels that were found in the volumes, mm, LPS, where the input has these. Those with one label in two
   * volumes belong together to LandmarkSigmaMm: they say where to begin, tell poses apart that the images cannot, and a pose
   * that contradicts them is none. From a file (.mrk.json, .fcsv or .csv; "": none) for the next volume, or one by one.
   */
  void AddLandmarkFile(const char* file);
  void ClearLandmarkFiles();
  void AddLandmark(int volume, const char* label, double x, double y, double z);
  void ClearLandmarks();
  ///@}

  ///@{
  /**
   * Whose ranks share the pairs; all of them have to update. nullptr: this process aligns all by itself. Default: the global
   * controller.
   */
  void SetController(vtkMultiProcessController* controller);
  vtkMultiProcessController* GetController() const { return this->Controller; }
  ///@}

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
   * What the last update did, as JSON: {"volumes": [{"name", "verdict", "reason", "error_mm", "similarity",
   * "overlap", "centre", "covariance"}, ...], "pairs": [{"fixed", "moving" (from 0), "verdict", "reason", "score", "similarity",
   * "overlap", "peak_ratio", "split_mm", "error_mm", "voted_down", "stands", "attempts", "residual_mm", "anywhere", "seconds":
   * {"global", "local", "confidence"}}, ...], "seconds": {"prepare", "pairs", "graph"}, "pairs_finished_before",
   * "times_prepared", "prepared_bytes", "ranks", "messages", "message_bytes"}: these two are what this rank has sent to others,
   * each by itself. Empty when it failed.
   */
  std::string GetReport() const;

  /**
   * After a dry run what one rank would do, on the first rank, as JSON: {"pairs": [[fixed, moving (from 0)], ...],
   * "pairs_finished_before", "times_prepared", "bytes_per_volume", "bytes_of_all", "budget_bytes", "seconds_per_pair",
   * "seconds_per_volume", "seconds"}. Pairs that are tried again come on top of it. Otherwise empty.
   */
  std::string GetPlan() const;

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

#ifndef __VTK_WRAP__
  echorama::ParameterList Parameters(); ///< for C++: they point into this object
  /// Of the last update, for C++; without volumes when it failed.
  const echorama::AlignVolumesResult& Result() const
  {
    return this->Found;
  }
  /// Of the last dry run, for C++.
  const echorama::AlignVolumesPlan& Plan() const
  {
    return this->Planned;
  }
#endif

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
  const echorama::VolumeAlignment* ResultOf(int volume) const;
  void Align(vtkInformationVector** inputs, vtkInformationVector* outputs, echorama::SharedWork& shared,
             const echorama::Progress& progress);

  struct Settings {
    int fixedVolume = 0;
    bool useReliability = true, dryRun = false;
    echorama::AlignVolumesParameters align;
  };
  Settings Values;
  vtkMultiProcessController* Controller = nullptr;
  echorama::LandmarkInput Landmarks;
  echorama::AlignVolumesResult Found;
  echorama::AlignVolumesPlan Planned;
#endif
};

#endif
