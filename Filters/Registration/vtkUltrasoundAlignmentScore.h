// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class vtkUltrasoundAlignmentScore
 * @brief tells how far aligned volumes are from where they belong
 *
 * Input 0: the volumes as aligned. Input 1: the same volumes, in the same order, with their true geometry. Both are
 * repeatable and take vtkImageData as well as the image leaves of vtkDataObjectTree. Dimensions and spacing must agree;
 * voxels and valid regions are read from input 0. The truth is first moved as a whole so that the volume number
 * FixedVolume lies where the alignment has it: only how volumes lie relative to each other counts.
 *
 * Output: vtkPolyData with a vertex at each of the points that were drawn in the valid regions, where the alignment put
 * it. The same seed draws the same points of a volume, so that scores are comparable.
 *
 * | array (point data)      | values                                                                            |
 * | ----------------------- | --------------------------------------------------------------------------------- |
 * | Error                   | 3 doubles, mm: from where the point belongs to where it is                         |
 * | Volume                  | int: the volume of the point, counted from 0                                       |
 *
 * | array (field data)      | values                                                                            |
 * | ----------------------- | --------------------------------------------------------------------------------- |
 * | Score                   | 1 double, mm: the mean of the volumes' scores, the fixed one not counted           |
 * | VolumeScore             | mm, one per volume: the mean length of its error vectors                           |
 * | VolumeRms, VolumeMedian, VolumePercentile95, VolumeMax | mm, one per volume: further figures of the same lengths |
 * | VolumeName              | strings, one per volume                                                            |
 *
 * Source: dissertation 4.4.2. The whole of every volume is needed; under MPI the first rank puts out the points.
 *
 * @sa vtkUltrasoundAligner
 */
#ifndef vtkUltrasoundAlignmentScore_h
#define vtkUltrasoundAlignmentScore_h

#include "EchoramaFiltersRegistrationModule.h"
#include "vtkPolyDataAlgorithm.h"
#include "vtkUltrasoundParameters.h"

#ifndef __VTK_WRAP__
#include "Filters/Registration/AlignmentScore.h"
#endif

class ECHORAMAFILTERSREGISTRATION_EXPORT vtkUltrasoundAlignmentScore : public vtkPolyDataAlgorithm {
public:
  static vtkUltrasoundAlignmentScore* New();
  vtkTypeMacro(vtkUltrasoundAlignmentScore, vtkPolyDataAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  // BEGIN parameters
  /** The volume that alignment and truth are taken to agree on, counted from 0. At least 0; default 0. */
  vtkUltrasoundIntegerMacro(FixedVolume);

  /** Points of each volume that are scored. In [1, 10000000]; default 2000. */
  vtkUltrasoundIntegerMacro(Points);

  /** The same seed draws the same points. At least 0; default 1. */
  vtkUltrasoundInteger64Macro(Seed);

  /**
   * Any parameter by its name: as a number (of a switch 0 or 1, of a choice its place from 0), as text ("1.5", "on", the name of
   * a choice, "1 0 0"), integers and vectors without a loss. Setting returns false, after an error event, when there is no such
   * parameter or value. GetParameterDescriptions tells what parameters there are, as JSON: an array of objects with name, type,
   * value, unit, low, high, choices, help ...
   */
  vtkUltrasoundAnyParameterMacro();
  // END parameters

  ///@{
  /** The true volumes: adds one to input 1, or sets it. */
  void AddTruthConnection(vtkAlgorithmOutput* output) { this->AddInputConnection(1, output); }
  void AddTruthData(vtkDataObject* data) { this->AddInputDataObject(1, data); }
  void RemoveAllTruths() { this->SetInputConnection(1, nullptr); }
  ///@}

  /** The score of the last update, mm: 0 is perfect. NaN when it failed. */
  double GetScore() const { return this->Score; }

  /** How many volumes were scored; 0 when it failed. */
  int GetNumberOfVolumes() const;

  /** The score of one volume, mm; NaN when there is no such volume. */
  double GetVolumeScore(int volume) const;

#ifndef __VTK_WRAP__
  echorama::ParameterList Parameters(); ///< for C++: they point into this object
#endif

protected:
  vtkUltrasoundAlignmentScore();
  ~vtkUltrasoundAlignmentScore() override;

  int FillInputPortInformation(int port, vtkInformation* info) override;
  int RequestUpdateExtent(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs) override;
  int RequestData(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs) override;

private:
  vtkUltrasoundAlignmentScore(const vtkUltrasoundAlignmentScore&) = delete;
  void operator=(const vtkUltrasoundAlignmentScore&) = delete;

#ifndef __VTK_WRAP__
  echorama::ScoreParameters Values;
  double Score;
  std::vector<double> VolumeScores;
#endif
};

#endif
