// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class vtkUltrasoundDisagreement
 * @brief tells how far overlapping volumes are from agreeing, block by block, without a truth
 *
 * Input 0 (repeatable): two or more volumes where they are taken to be (vtkImageData, or the image leaves of vtkDataObjectTree).
 * Output: vtkImageData along the axes of the world, a point in the middle of each block in which two of them may overlap. It is
 * a map, and no volume.
 *
 * | array (point data)        | values                                                                                    |
 * | ------------------------- | ----------------------------------------------------------------------------------------- |
 * | Disagreement              | float, mm, the active scalars: length of the known part of the shift, less what noise adds  |
 * |                           | to it in the mean; NaN where nothing is known                                               |
 * | Shift                     | 3 floats, mm: what the first volume shows at x is shown by the second at x + shift          |
 * | Deviation                 | float, mm: standard deviation in the least sure of the known directions                     |
 * | Correlation               | float: of the block at that shift                                                           |
 * | KnownDirections           | unsigned char: in how many directions the shift is known, 3 all; 0 nothing                  |
 * | FirstVolume, SecondVolume | short: the pair that disagrees most there, counted from 0; -1 where nothing is known        |
 *
 * Field data: Median and Percentile95 of the disagreement, mm (NaN when nothing is known), and Blocks, two numbers: how many were
 * compared, counted for each pair, and how many of these tell something.
 *
 * Fails with a message for fewer than two volumes, for one that is constant or has fewer than 100 real voxels, and for steps that
 * are too small beside search or blocks. The volumes are made when the pipeline asks what comes out, which their geometry says.
 * Under MPI each rank computes the whole.
 *
 * @sa echorama::Disagreement, vtkUltrasoundAligner, vtkUltrasoundAlignmentScore
 */
#ifndef vtkUltrasoundDisagreement_h
#define vtkUltrasoundDisagreement_h

#include "EchoramaFiltersRegistrationModule.h"
#include "vtkUltrasoundImageAlgorithm.h"
#include "vtkUltrasoundParameters.h"

#ifndef __VTK_WRAP__
#include "Filters/Registration/Disagreement.h"
#include <vector>
#endif

class ECHORAMAFILTERSREGISTRATION_EXPORT vtkUltrasoundDisagreement : public vtkUltrasoundImageAlgorithm {
public:
  static vtkUltrasoundDisagreement* New();
  vtkTypeMacro(vtkUltrasoundDisagreement, vtkUltrasoundImageAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  // BEGIN parameters
  /**
   * Side of the blocks that are compared, each for itself; they overlap by half. Larger blocks know more, and tell less of where.
   * In [1, 1000] mm; default 12.
   */
  vtkUltrasoundNumberMacro(BlockMm);

  /** Shifts are looked for so far along each axis. In [0.1, 100] mm; default 5. */
  vtkUltrasoundNumberMacro(SearchMm);

  /**
   * Spacing of the lattice on which volumes are compared; shifts are found to a small part of it. 0: the coarsest volume's
   * voxels, but no finer than a sixth of the search. In [0, 100] mm; default 0.
   */
  vtkUltrasoundNumberMacro(StepMm);

  /** Directions in which the standard deviation of the shift is larger are not known. In [0.001, 1000] mm; default 0.5. */
  vtkUltrasoundNumberMacro(MaximumErrorMm);

  /** A correlation that is not so many standard deviations above what chance gives says nothing. In [0, 100]; default 4. */
  vtkUltrasoundNumberMacro(MinimumSignificance);

  /**
   * Any parameter by its name: as a number (of a switch 0 or 1, of a choice its place from 0), as text ("1.5", "on", the name of
   * a choice, "1 0 0"), integers and vectors without a loss. Setting returns false, after an error event, when there is no such
   * parameter or value. GetParameterDescriptions tells what parameters there are, as JSON: an array of objects with name, type,
   * value, unit, low, high, choices, help ...
   */
  vtkUltrasoundAnyParameterMacro();
  // END parameters

  ///@{
  /** Of the last update: blocks that were compared, those of every pair counted, and how many of them tell something. */
  vtkTypeInt64 GetNumberOfBlocks() const { return this->Blocks; }
  vtkTypeInt64 GetNumberOfKnownBlocks() const { return this->KnownBlocks; }
  ///@}

  ///@{
  /** Of the disagreement in the blocks that tell something, at the last update, mm; NaN when there are none. */
  double GetMedian() const { return this->Median; }
  double GetPercentile95() const { return this->Percentile95; }
  ///@}

#ifndef __VTK_WRAP__
  echorama::ParameterList Parameters(); ///< for C++: they point into this object

  ///@{
  /**
   * The same without a pipeline, for programs that compare in a thread of their own: the map of volumes, and that map as an image
   * on \a grid, which holds map.geometry at whole blocks.
   */
  static echorama::DisagreementMap Compare(const std::vector<vtkUltrasoundVolume::Input>& volumes,
                                           const echorama::DisagreementParameters& parameters,
                                           const echorama::Progress& progress);
  static void PutOut(const echorama::DisagreementMap& map, const echorama::ImageGeometry& grid, vtkImageData* output);
  ///@}
#endif

protected:
  vtkUltrasoundDisagreement();
  ~vtkUltrasoundDisagreement() override = default;

  int FillInputPortInformation(int port, vtkInformation* info) override;
  int RequestInformation(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs) override;
#ifndef __VTK_WRAP__
  void Execute(vtkInformationVector** inputs, vtkImageData* output, const echorama::Progress& progress) override;
#endif

private:
  vtkUltrasoundDisagreement(const vtkUltrasoundDisagreement&) = delete;
  void operator=(const vtkUltrasoundDisagreement&) = delete;

#ifndef __VTK_WRAP__
  void Forget();
  echorama::ImageGeometry GridOf(const std::vector<vtkUltrasoundVolume::Input>& volumes) const;

  echorama::DisagreementParameters Values;
#endif
  vtkTypeInt64 Blocks = 0, KnownBlocks = 0;
  double Median, Percentile95;
};

#endif
