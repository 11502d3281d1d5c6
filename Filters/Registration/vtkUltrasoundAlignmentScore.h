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

#ifndef __VTK_WRAP__
#include <vector>
#endif

class ECHORAMAFILTERSREGISTRATION_EXPORT vtkUltrasoundAlignmentScore : public vtkPolyDataAlgorithm {
public:
  static vtkUltrasoundAlignmentScore* New();
  vtkTypeMacro(vtkUltrasoundAlignmentScore, vtkPolyDataAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  ///@{
  /** The volume that alignment and truth are taken to agree on, counted from 0. Default 0. */
  vtkSetClampMacro(FixedVolume, int, 0, VTK_INT_MAX);
  vtkGetMacro(FixedVolume, int);
  ///@}

  ///@{
  /** Points drawn in each volume, in [1, 10000000]. Default 2000. */
  vtkSetClampMacro(Points, int, 1, 10000000);
  vtkGetMacro(Points, int);
  ///@}

  ///@{
  /** Seed of the points, >= 0. Default 1. */
  vtkSetClampMacro(Seed, int, 0, VTK_INT_MAX);
  vtkGetMacro(Seed, int);
  ///@}

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
  int FixedVolume = 0;
  int Points = 2000;
  int Seed = 1;
  double Score;
  std::vector<double> VolumeScores;
#endif
};

#endif
