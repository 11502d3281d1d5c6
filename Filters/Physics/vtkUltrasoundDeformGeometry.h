// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class vtkUltrasoundDeformGeometry
 * @brief surfaces, meshes, landmarks and images follow the deformation of a lattice
 *
 * Input 0: any vtkPointSet (polydata, unstructured grids) or vtkImageData, or blocks of them. Input 1: a displacement image,
 * which is a vtkImageData with the point array `Displacement`, three numbers per point, mm, along the axes of the world; a
 * lattice of at least two points along each axis. Its `ValidRegion`, if there is one, says where the displacement is known. Input
 * 2, optional: an image on whose grid an image comes out, instead of that of input 0.
 *
 * As everywhere, u leads from rest to now: what lies at x at rest is now at x + u(x). Here u is linear in each of the six
 * tetrahedra of a cell of the lattice (echorama::LatticeMap): what a finite-element solver computed there is followed exactly,
 * and the inverse, which images need, is exact too. (vtkUltrasoundDisplacement says of the same image that it is a smooth field;
 * both agree at the points of the lattice.)
 *
 * Output: what came in, deformed.
 *
 * - Points move, in the precision that they have; cells stay. The active normals of points turn as surfaces do, in unit length;
 * the active normals of cells are dropped. All other arrays are carried as they are, with MoveVectors but for the active vectors.
 * - Images are read where a voxel's content lay (forward) or went (backward). `Intensity` (without it: the active scalars) and
 * arrays of floating numbers are mixed linearly of real voxels, others taken from the nearest voxel; `ValidRegion` says where
 * there is something. Arrays of cells, of texts and of bits are dropped.
 *
 * | array (field data)      | values                                                                              |
 * | ----------------------- | ----------------------------------------------------------------------------------- |
 * | DeformationJacobian     | 1 double: the smallest ratio of the volumes of a tetrahedron now and at rest         |
 * | DeformationFolded       | 2 doubles: tetrahedra that fold; points or voxels of the output that lie there       |
 * | DeformationOutside      | 1 double: points or voxels of the output that the lattice says nothing about         |
 *
 * With Outside at mask, or MaskFolds, point sets come with the point array `ValidRegion` too. Fails for a displacement that is
 * none or is not finite where it is known, for points that are not finite, and as Outside and MaskFolds say. Under MPI each rank
 * computes the whole.
 *
 * @sa echorama::DeformPoints, echorama::DeformImage, vtkUltrasoundDisplacement
 */
#ifndef vtkUltrasoundDeformGeometry_h
#define vtkUltrasoundDeformGeometry_h

#include "EchoramaFiltersPhysicsModule.h"
#include "vtkDataSetAlgorithm.h"
#include "vtkUltrasoundParameters.h"

#ifndef __VTK_WRAP__
#include "Filters/Physics/DeformGeometry.h"
#include <string>
#endif

class vtkImageData;
class vtkPointSet;

class ECHORAMAFILTERSPHYSICS_EXPORT vtkUltrasoundDeformGeometry : public vtkDataSetAlgorithm {
public:
  static vtkUltrasoundDeformGeometry* New();
  vtkTypeMacro(vtkUltrasoundDeformGeometry, vtkDataSetAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  ///@{
  /** The displacement image, and the optional image on whose grid images come out. */
  void SetDisplacementConnection(vtkAlgorithmOutput* displacement) { this->SetInputConnection(1, displacement); }
  void SetDisplacementData(vtkImageData* displacement);
  void SetGridConnection(vtkAlgorithmOutput* grid) { this->SetInputConnection(2, grid); }
  void SetGridData(vtkImageData* grid);
  ///@}

  // BEGIN parameters
  enum Directions { FORWARD = 0, BACKWARD = 1 };

  ///@{
  /**
   * Forward: what lies at x at rest goes to x + u(x), to where it is now. Backward: what is at x + u(x) now goes back to x.
   * Default forward. There are FORWARD, BACKWARD.
   */
  vtkUltrasoundChoiceMacro(Direction);
  void SetDirectionToForward() { this->SetDirection(FORWARD); }
  void SetDirectionToBackward() { this->SetDirection(BACKWARD); }
  ///@}

  enum Outsides { REFUSE = 0, MASK = 1, KEEP = 2, NEAREST = 3 };

  ///@{
  /**
   * What lies outside of the lattice is refused with a message, is marked as not real, stays where it is, or moves as the nearest
   * point of the lattice does. Default refuse. There are REFUSE, MASK, KEEP, NEAREST.
   */
  vtkUltrasoundChoiceMacro(Outside);
  void SetOutsideToRefuse() { this->SetOutside(REFUSE); }
  void SetOutsideToMask() { this->SetOutside(MASK); }
  void SetOutsideToKeep() { this->SetOutside(KEEP); }
  void SetOutsideToNearest() { this->SetOutside(NEAREST); }
  ///@}

  /**
   * A displacement that turns tetrahedra inside out, or brings several places to one, is refused with a message. When on, what
   * lies there is marked as not real instead. Default off.
   */
  vtkUltrasoundSwitchMacro(MaskFolds);

  /** Images are read linearly between their voxels. When on, at the nearest voxel, as labels always are. Default off. */
  vtkUltrasoundSwitchMacro(NearestVoxel);

  enum Results { DEFORMED = 0, DISPLACEMENT = 1 };

  ///@{
  /**
   * Deformed: what came in, deformed. Displacement: of an image only its grid counts, and a displacement image comes out there:
   * where each voxel is read, less where it is. Forward that is the inverse displacement, backward the displacement itself.
   * Default deformed. There are DEFORMED, DISPLACEMENT.
   */
  vtkUltrasoundChoiceMacro(Result);
  void SetResultToDeformed() { this->SetResult(DEFORMED); }
  void SetResultToDisplacement() { this->SetResult(DISPLACEMENT); }
  ///@}

  /** Whether the active vectors of points turn and stretch with what they lie in. Default off. */
  vtkUltrasoundSwitchMacro(MoveVectors);

  /**
   * Any parameter by its name: as a number (of a switch 0 or 1, of a choice its place from 0), as text ("1.5", "on", the name of
   * a choice, "1 0 0"), integers and vectors without a loss. Setting returns false, after an error event, when there is no such
   * parameter or value. GetParameterDescriptions tells what parameters there are, as JSON: an array of objects with name, type,
   * value, unit, low, high, choices, help ...
   */
  vtkUltrasoundAnyParameterMacro();
  // END parameters
#ifndef __VTK_WRAP__
  echorama::ParameterList Parameters(); ///< for C++: they point into this object
  /** The map that a displacement image says. Throws Error(BadInput) for one that is none; \a name is for the message. */
  static echorama::LatticeMap MapOf(vtkImageData* image, const std::string& name = "the displacement");
#endif

protected:
  vtkUltrasoundDeformGeometry();
  ~vtkUltrasoundDeformGeometry() override = default;

  int FillInputPortInformation(int port, vtkInformation* info) override;
  int RequestInformation(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs) override;
  int RequestUpdateExtent(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs) override;
  int RequestData(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs) override;

private:
  vtkUltrasoundDeformGeometry(const vtkUltrasoundDeformGeometry&) = delete;
  void operator=(const vtkUltrasoundDeformGeometry&) = delete;

#ifndef __VTK_WRAP__
  echorama::DeformReport Deform(vtkPointSet* input, const echorama::LatticeMap& map, vtkPointSet* output,
                                const echorama::Progress& progress);
  echorama::DeformReport Deform(vtkImageData* input, const echorama::LatticeMap& map, vtkImageData* grid, vtkImageData* output,
                                const echorama::Progress& progress);

  echorama::DeformGeometryParameters Values;
  int ResultChosen = 0; // of Results
  bool MovesVectors = false;
#endif
};

#endif
