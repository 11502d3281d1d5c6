// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class vtkUltrasoundDeformableAligner
 * @brief what a rigid alignment leaves over: smooth displacements that make overlapping volumes agree
 *
 * Input 0 (repeatable): two or more volumes (vtkImageData, or the image leaves of vtkDataObjectTree) that lie where a rigid
 * alignment put them. A point array `Reliability` (vtkUltrasoundReliabilityMap) weighs their voxels.
 *
 * Output 0: a vtkMultiBlockDataSet with the same volumes, unchanged, in the same order and with the same NAME(), and this
 * field data:
 *
 * | field                 | values                                                                                      |
 * | --------------------- | ------------------------------------------------------------------------------------------- |
 * | DeformationApplied    | 1 double: 1 where a displacement was found, 0 where the volume stays rigid                    |
 * | DeformationSimilarity | 2 doubles: correlation of what is compared in the overlap, before and after; 1 is identical   |
 * | DeformationBending    | 1 double: bending energy, mm                                                                |
 * | DeformationLargest    | 1 double: the longest displacement in the overlap, mm                                       |
 * | DeformationJacobian   | 1 double: the smallest determinant of the Jacobian; at most 0 where space folds             |
 * | DeformationReason     | 1 string: why it was not applied; empty when it was                                          |
 *
 * Output 1: a vtkMultiBlockDataSet with one displacement image per volume (vtkUltrasoundDisplacement), in the same order and
 * with the same names: zero for the fixed volume and for those that stay rigid. vtkUltrasoundStitcher takes it on its port 1.
 *
 * The volume number FixedVolume is not bent. The others follow in turn, the one that overlaps the placed ones most first,
 * each compared by local correlation with all that came before, through their displacements (echorama::DeformInTurn). A
 * displacement that folds, or adds less than MinimumGain, is not applied; a volume without overlap stays as it is.
 * What the rigid alignment missed becomes part of the displacement.
 *
 * Fails with a message when there are fewer than two volumes, one is not three-dimensional, constant or nearly empty, or a
 * parameter is out of its range. Under MPI each rank computes and holds the whole result.
 *
 * @sa vtkUltrasoundAligner, vtkUltrasoundDisplacement, vtkUltrasoundStitcher
 */
#ifndef vtkUltrasoundDeformableAligner_h
#define vtkUltrasoundDeformableAligner_h

#include "EchoramaFiltersDeformationModule.h"
#include "vtkUltrasoundMultiBlockAlgorithm.h"
#include "vtkUltrasoundParameters.h"

#ifndef __VTK_WRAP__
#include "Filters/Deformation/DeformableAlign.h"
#endif

class ECHORAMAFILTERSDEFORMATION_EXPORT vtkUltrasoundDeformableAligner : public vtkUltrasoundMultiBlockAlgorithm {
public:
  static vtkUltrasoundDeformableAligner* New();
  vtkTypeMacro(vtkUltrasoundDeformableAligner, vtkUltrasoundMultiBlockAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  // BEGIN parameters
  /** The volume that is not bent, counted from 0. At least 0; default 0. */
  vtkUltrasoundIntegerMacro(FixedVolume);

  /** Distance of the control points: about the size of what can bend by itself. In [5, 500] mm; default 30. */
  vtkUltrasoundNumberMacro(ControlSpacingMm);

  /**
   * How stiff tissue is taken to be. A lower one follows larger deformations and more noise. In [1e-06, 1000000000000] per mm;
   * default 200.
   */
  vtkUltrasoundNumberMacro(BendingWeight);

  /**
   * The share of what volumes then say of each other that a displacement must add to be applied. Views of the same tissue under
   * different angles seem to differ by some 0.1. In [0, 1]; default 0.2.
   */
  vtkUltrasoundNumberMacro(MinimumGain);

  /** Resolutions, each half as fine as the next. In [1, 6]; default 2. */
  vtkUltrasoundIntegerMacro(Levels);

  /** Steps per resolution, at most. In [1, 1000]; default 15. */
  vtkUltrasoundIntegerMacro(Iterations);

  /** Voxels of the last resolution are about this large. Finer is slower and more exact. In [0.01, 100] mm; default 1. */
  vtkUltrasoundNumberMacro(FinestMm);

  /** The share of a volume that must lie in others for it to be bent. In [0.001, 1]; default 0.02. */
  vtkUltrasoundNumberMacro(MinimumOverlap);

  /**
   * Any parameter by its name: as a number (of a switch 0 or 1, of a choice its place from 0), as text ("1.5", "on", the name of
   * a choice, "1 0 0"), integers and vectors without a loss. Setting returns false, after an error event, when there is no such
   * parameter or value. GetParameterDescriptions tells what parameters there are, as JSON: an array of objects with name, type,
   * value, unit, low, high, choices, help ...
   */
  vtkUltrasoundAnyParameterMacro();
  // END parameters

  ///@{
  /** Names of the field data. */
  static const char* DeformationAppliedName() { return "DeformationApplied"; }
  static const char* DeformationSimilarityName() { return "DeformationSimilarity"; }
  static const char* DeformationBendingName() { return "DeformationBending"; }
  static const char* DeformationLargestName() { return "DeformationLargest"; }
  static const char* DeformationJacobianName() { return "DeformationJacobian"; }
  static const char* DeformationReasonName() { return "DeformationReason"; }
  ///@}

#ifndef __VTK_WRAP__
  echorama::ParameterList Parameters(); ///< for C++: they point into this object

  /** What the last update found of a volume. */
  const echorama::DeformableAlignResult& Result(std::size_t volume) const
  {
    return this->Found.at(volume);
  }
#endif

protected:
  vtkUltrasoundDeformableAligner();
  ~vtkUltrasoundDeformableAligner() override = default;

#ifndef __VTK_WRAP__
  void Execute(vtkInformationVector** inputs, vtkInformationVector* outputs, const echorama::Progress& progress) override;
#endif

private:
  vtkUltrasoundDeformableAligner(const vtkUltrasoundDeformableAligner&) = delete;
  void operator=(const vtkUltrasoundDeformableAligner&) = delete;

#ifndef __VTK_WRAP__
  struct Settings {
    int fixedVolume = 0;
    echorama::DeformableAlignParameters align;
  };
  Settings Values;
  std::vector<echorama::DeformableAlignResult> Found;
#endif
};

#endif
