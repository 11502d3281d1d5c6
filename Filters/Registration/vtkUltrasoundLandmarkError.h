// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class vtkUltrasoundLandmarkError
 * @brief tells how far places that were found in several volumes lie apart once these are aligned
 *
 * Two or more lists of landmarks, one for each volume in their order: points with labels, from files (AddLandmarkFile) or one by
 * one (AddLandmark), each in the frame of its volume's file. Landmarks of one label in two lists are one place. The poses of the
 * volumes come from input 0 (optional, repeatable: the volumes as aligned, vtkImageData or the image leaves of
 * vtkDataObjectTree, with the field VolumeToWorld that vtkUltrasoundAligner gives them; without that field they are where their
 * files have them), or from SetPose, which goes before. Input 1 (optional, repeatable): displacement images
 * (vtkUltrasoundDisplacement) of what these poses leave over, one per volume in the same order; blocks with a name must be that
 * volume's. Landmarks are then compared where they belong at rest.
 *
 * Landmarks that the volumes of input 0 carry (vtkUltrasoundLandmarks) count, too.
 *
 * Output: vtkPolyData with a vertex for each label and pair of volumes, where the alignment put it in the first of them.
 *
 * | array (point data)         | values                                                                            |
 * | -------------------------- | --------------------------------------------------------------------------------- |
 * | Error                      | 3 doubles, mm: from there to where the alignment put it in the second              |
 * | Distance                   | 1 double, mm: its length                                                           |
 * | Label                      | a string                                                                          |
 * | FirstVolume, SecondVolume  | int: the volumes, counted from 0                                                    |
 *
 * | array (field data)         | values                                                                            |
 * | -------------------------- | --------------------------------------------------------------------------------- |
 * | Mean, Rms, Median, Percentile95, Max | 1 double each, mm: of the distances                                      |
 * | UnmatchedLabel             | strings: labels that only one list has                                              |
 * | UnmatchedVolume            | int, one for each of them: whose they are                                           |
 *
 * Fails with a message for fewer than two lists, a label that one list has twice or that is empty, when no label is in two
 * lists, for files that cannot be read, and where a displacement folds. Under MPI the first rank puts out the points.
 *
 * @sa vtkUltrasoundAligner, vtkUltrasoundAlignmentScore
 */
#ifndef vtkUltrasoundLandmarkError_h
#define vtkUltrasoundLandmarkError_h

#include "EchoramaFiltersRegistrationModule.h"
#include "vtkPolyDataAlgorithm.h"

#ifndef __VTK_WRAP__
#include "Filters/Registration/LandmarkError.h"
#include "Filters/Registration/LandmarkInput.h"
#endif
#include <string>

class vtkMatrix4x4;

class ECHORAMAFILTERSREGISTRATION_EXPORT vtkUltrasoundLandmarkError : public vtkPolyDataAlgorithm {
public:
  static vtkUltrasoundLandmarkError* New();
  vtkTypeMacro(vtkUltrasoundLandmarkError, vtkPolyDataAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  ///@{
  /**
   * A file of landmarks (.mrk.json, .fcsv or .csv) for the next volume; "": it has none. Read at each update.
   */
  void AddLandmarkFile(const char* file);
  void ClearLandmarkFiles();
  ///@}

  ///@{
  /** A landmark of a volume (counted from 0), mm, LPS, beside those of its file. */
  void AddLandmark(int volume, const char* label, double x, double y, double z);
  void ClearLandmarks();
  ///@}

  ///@{
  /**
   * Where the alignment puts a volume (counted from 0): the motion from where its file has it, mm, rigid. Returns false, after an
   * error event, when it is not.
   */
  bool SetPose(int volume, vtkMatrix4x4* volumeToWorld);
  void ClearPoses();
  ///@}

  ///@{
  /** Displacements go to input 1, in the order of the volumes. */
  void AddDisplacementConnection(vtkAlgorithmOutput* output) { this->AddInputConnection(1, output); }
  void AddDisplacementData(vtkDataObject* data) { this->AddInputDataObject(1, data); }
  void RemoveAllDisplacements() { this->RemoveAllInputConnections(1); }
  ///@}

  /** How many pairs of landmarks the last update compared; 0 when it failed. */
  int GetNumberOfPairs() const { return static_cast<int>(this->Found.distances.size()); }

  ///@{
  /** Of their distances, mm; 0 when there are none. */
  double GetMean() const { return this->Found.mean; }
  double GetRms() const { return this->Found.rms; }
  double GetMedian() const { return this->Found.median; }
  double GetPercentile95() const { return this->Found.percentile95; }
  double GetMax() const { return this->Found.max; }
  ///@}

  /** How many labels only one list has. */
  int GetNumberOfUnmatched() const { return static_cast<int>(this->Found.unmatched.size()); }

protected:
  vtkUltrasoundLandmarkError();
  ~vtkUltrasoundLandmarkError() override;

  int FillInputPortInformation(int port, vtkInformation* info) override;
  int RequestUpdateExtent(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs) override;
  int RequestData(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs) override;

private:
  vtkUltrasoundLandmarkError(const vtkUltrasoundLandmarkError&) = delete;
  void operator=(const vtkUltrasoundLandmarkError&) = delete;

#ifndef __VTK_WRAP__
  std::vector<echorama::LandmarkList> Lists(vtkInformationVector** inputs);
  void PutOut(vtkInformation* out) const;

  echorama::LandmarkInput Landmarks;
  std::map<int, echorama::Pose> Poses;
  echorama::LandmarkError Found;
#endif
};

#endif
