// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class vtkUltrasoundTissuePress
 * @brief tissue that a probe presses, at rest, as a displacement image
 *
 * Input 0: tissue (see vtkUltrasoundTissue), as it is without the probe and without gravity. Input 1, optional and repeatable:
 * data with the field data `ProbeGeometry` and, unless the probe lies at the origin, `ProbeToWorld` (see
 * vtkUltrasoundAcquisition), for instance of vtkUltrasoundProbeSource or of a volume. The probe comes from behind, out of clear
 * space, goes straight to the first of these poses, and on from each to the next.
 *
 * Output: a lattice along the axes of the world that covers the tissue, with these point arrays. What a displacement image says,
 * vtkUltrasoundDeformGeometry does to surfaces and landmarks, vtkUltrasoundSynthesizer to scatterers.
 *
 * | array        | values                                                                                             |
 * | ------------ | -------------------------------------------------------------------------------------------------- |
 * | Displacement | 3 doubles, mm, along the axes of the world: what lies at x at rest is now at x + u. Where there is no |
 * |              | tissue, what the nearest has                                                                         |
 * | Tissue       | unsigned char: 1 at nodes of tissue                                                                  |
 * | Contact      | unsigned char: 1 at nodes that the probe touches                                                     |
 *
 * | field data     | values                                                                                          |
 * | -------------- | ----------------------------------------------------------------------------------------------- |
 * | ProbeForce     | 3 doubles: of the probe on the tissue, N, in the world                                             |
 * | RelativeVolume | 2 doubles: of all tissue now and at rest, and the least of any cell                                |
 *
 * Poses may be appended one after the other, each followed by an Update(): the filter keeps where the tissue came to rest, and as
 * long as the tissue is the same data, unchanged, all parameters and the poses so far are the same, it goes on from there. What
 * comes out is the same to the last digit as with all poses at once. What is kept takes some 2 KB a node until the filter is
 * deleted, an Update() fails, or one starts anew.
 *
 * Pieces of tissue with empty cells between them may meet, without friction.
 *
 * Fails, with a message, for tissue that nothing holds, for a probe without geometry, and where the probe cannot go, with the
 * part of the way that it came. Under MPI each rank computes the whole.
 *
 * @sa echorama::TissuePress, echorama::TissueLatticeParameters
 */
#ifndef vtkUltrasoundTissuePress_h
#define vtkUltrasoundTissuePress_h

#include "EchoramaFiltersPhysicsModule.h"
#include "vtkUltrasoundImageAlgorithm.h"
#include "vtkUltrasoundParameters.h"

#ifndef __VTK_WRAP__
#include "Filters/Physics/ProbeShape.h"
#include "Filters/Physics/TissueLattice.h"
#include <memory>
#endif

class vtkDataObject;
class vtkPolyData;

class ECHORAMAFILTERSPHYSICS_EXPORT vtkUltrasoundTissuePress : public vtkUltrasoundImageAlgorithm {
public:
  static vtkUltrasoundTissuePress* New();
  vtkTypeMacro(vtkUltrasoundTissuePress, vtkUltrasoundImageAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  ///@{
  /** Names of the arrays and fields. */
  static const char* TissueName() { return "Tissue"; }
  static const char* ContactName() { return "Contact"; }
  static const char* ProbeForceName() { return "ProbeForce"; }
  static const char* RelativeVolumeName() { return "RelativeVolume"; }
  ///@}

  ///@{
  /** One more pose of the probe; those that there are already come before it. */
  void AddProbeConnection(vtkAlgorithmOutput* probe) { this->AddInputConnection(1, probe); }
  void AddProbeData(vtkDataObject* probe) { this->AddInputDataObject(1, probe); }
  void RemoveAllProbes() { this->RemoveAllInputConnections(1); }
  ///@}

  // BEGIN parameters
  /** Edge of the cells that tissue is divided into. Half of it makes eight times as many. In [0.1, 100] mm; default 4. */
  vtkUltrasoundNumberMacro(SpacingMm);

  /** Poisson's ratio of all tissue: 0.5 would keep its volume. In [0, 0.499]; default 0.45. */
  vtkUltrasoundNumberMacro(Poisson);

  /** Names of materials that do not move at all, with blanks between them. Default bone. */
  vtkUltrasoundTextMacro(HeldMaterials);

  /** The first layer of nodes along x does not move. Default off. */
  vtkUltrasoundSwitchMacro(FixXMin);

  /** The last layer of nodes along x does not move. Default off. */
  vtkUltrasoundSwitchMacro(FixXMax);

  /** The first layer of nodes along y does not move. Default off. */
  vtkUltrasoundSwitchMacro(FixYMin);

  /** The last layer of nodes along y does not move. Default off. */
  vtkUltrasoundSwitchMacro(FixYMax);

  /** The first layer of nodes along z does not move. Default off. */
  vtkUltrasoundSwitchMacro(FixZMin);

  /** The last layer of nodes along z does not move: the back. Default on. */
  vtkUltrasoundSwitchMacro(FixZMax);

  /** Coulomb's coefficient between probe and skin; gel makes it 0. In [0, 2]; default 0. */
  vtkUltrasoundNumberMacro(Friction);

  /** Acceleration in the world; the body is given without it. In [-100, 100] m/s^2; default (0, 0, 0). */
  vtkUltrasoundVectorMacro(Gravity);

  /** How far off the state of rest tissue may be. In [1e-06, 1] mm; default 0.01. */
  vtkUltrasoundNumberMacro(ToleranceMm);

  /** How far the head of the probe reaches beyond its outermost beams. In [0.1, 1000] mm; default 5. */
  vtkUltrasoundNumberMacro(HeadMarginMm);

  /** Radius of the head's edges, at most HeadMarginMm. In [0, 1000] mm; default 4. */
  vtkUltrasoundNumberMacro(HeadEdgeMm);

  /** How far the head reaches back. In [1, 1000] mm; default 80. */
  vtkUltrasoundNumberMacro(HeadLengthMm);

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
  /** Makes \a output what a run puts out. */
  static void SetOutput(const echorama::PressedTissue& pressed, vtkImageData* output);
#endif

protected:
  vtkUltrasoundTissuePress();
  ~vtkUltrasoundTissuePress() override;

  int FillInputPortInformation(int port, vtkInformation* info) override;
  int RequestInformation(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs) override;
#ifndef __VTK_WRAP__
  void Execute(vtkInformationVector** inputs, vtkImageData* output, const echorama::Progress& progress) override;
#endif

private:
  vtkUltrasoundTissuePress(const vtkUltrasoundTissuePress&) = delete;
  void operator=(const vtkUltrasoundTissuePress&) = delete;

#ifndef __VTK_WRAP__
  echorama::TissueLatticeParameters Lattice;
  echorama::TissuePressParameters Values;
  echorama::ProbeHead Head;
  struct State;
  std::unique_ptr<State> Kept; ///< after the last pose
#endif
};

#endif
