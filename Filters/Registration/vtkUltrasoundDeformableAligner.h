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
 * displacement that folds, or does not make volumes more alike, is not applied; a volume without overlap stays as it is.
 * What the rigid alignment missed becomes part of the displacement.
 *
 * Fails with a message when there are fewer than two volumes, one is not three-dimensional, constant or nearly empty, or a
 * parameter is out of its range. Under MPI each rank computes and holds the whole result.
 *
 * @sa vtkUltrasoundAligner, vtkUltrasoundDisplacement, vtkUltrasoundStitcher
 */
#ifndef vtkUltrasoundDeformableAligner_h
#define vtkUltrasoundDeformableAligner_h

#include "EchoramaFiltersRegistrationModule.h"
#include "vtkUltrasoundMultiBlockAlgorithm.h"

#ifndef __VTK_WRAP__
#include "Filters/Registration/DeformableAlign.h" // for the defaults
#include <vector>
#endif

class ECHORAMAFILTERSREGISTRATION_EXPORT vtkUltrasoundDeformableAligner : public vtkUltrasoundMultiBlockAlgorithm {
public:
  static vtkUltrasoundDeformableAligner* New();
  vtkTypeMacro(vtkUltrasoundDeformableAligner, vtkUltrasoundMultiBlockAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  ///@{
  /** The volume that is not bent, counted from 0. Default 0. */
  vtkSetClampMacro(FixedVolume, int, 0, VTK_INT_MAX);
  vtkGetMacro(FixedVolume, int);
  ///@}

  ///@{
  /** Distance of the control points, mm, in [5, 500]: about the size of what can bend by itself. Default 30. */
  vtkSetClampMacro(ControlSpacingMm, double, 5.0, 500.0);
  vtkGetMacro(ControlSpacingMm, double);
  ///@}

  ///@{
  /**
   * How stiff tissue is taken to be, per mm, in [1e-6, 1e12]. A lower one follows larger deformations and more noise. Default
   * 2000.
   */
  vtkSetClampMacro(BendingWeight, double, 1e-6, 1e12);
  vtkGetMacro(BendingWeight, double);
  ///@}

  ///@{
  /** Resolutions, each half as fine as the next, in [1, 6]. Default 2. */
  vtkSetClampMacro(Levels, int, 1, 6);
  vtkGetMacro(Levels, int);
  ///@}

  ///@{
  /** Steps per resolution, at most, in [1, 1000]. Default 15. */
  vtkSetClampMacro(Iterations, int, 1, 1000);
  vtkGetMacro(Iterations, int);
  ///@}

  ///@{
  /** Voxels of the last resolution are about this large, mm, in [0.01, 100]. Default 1. */
  vtkSetClampMacro(FinestMm, double, 0.01, 100.0);
  vtkGetMacro(FinestMm, double);
  ///@}

  ///@{
  /** The share of a volume that must lie in others for it to be bent, in [0.001, 1]. Default 0.02. */
  vtkSetClampMacro(MinimumOverlap, double, 0.001, 1.0);
  vtkGetMacro(MinimumOverlap, double);
  ///@}

  ///@{
  /** Names of the field data. */
  static const char* DeformationAppliedName() { return "DeformationApplied"; }
  static const char* DeformationSimilarityName() { return "DeformationSimilarity"; }
  static const char* DeformationBendingName() { return "DeformationBending"; }
  static const char* DeformationLargestName() { return "DeformationLargest"; }
  static const char* DeformationJacobianName() { return "DeformationJacobian"; }
  static const char* DeformationReasonName() { return "DeformationReason"; }
  ///@}

protected:
  vtkUltrasoundDeformableAligner();
  ~vtkUltrasoundDeformableAligner() override = default;

#ifndef __VTK_WRAP__
  void Execute(vtkInformationVector** inputs, vtkInformationVector* outputs, const echorama::Progress& progress) override;
#endif

private:
  vtkUltrasoundDeformableAligner(const vtkUltrasoundDeformableAligner&) = delete;
  void operator=(const vtkUltrasoundDeformableAligner&) = delete;

  int FixedVolume = 0;
#ifndef __VTK_WRAP__
  double ControlSpacingMm = echorama::DeformableAlignParameters().controlSpacingMm;
  double BendingWeight = echorama::DeformableAlignParameters().bendingWeight;
  int Levels = echorama::DeformableAlignParameters().levels;
  int Iterations = echorama::DeformableAlignParameters().iterations;
  double FinestMm = echorama::DeformableAlignParameters().finestMm;
  double MinimumOverlap = echorama::DeformableAlignParameters().minimumOverlap;
#endif
};

#endif
