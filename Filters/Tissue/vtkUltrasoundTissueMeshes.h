// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class vtkUltrasoundTissueMeshes
 * @brief closed surfaces of any make, with materials, as tissue
 *
 * Input 0, repeatable: vtkPolyData, or multi-blocks of them, such as vtkGLTFReader puts out. Each polydata with polygons becomes
 * a body, of the material that Materials names for its input. Where bodies overlap or nest the later one counts, so an organ is
 * connected before its vessels. An input that is tissue already keeps its bodies and materials, as it lies.
 *
 * Output 0: tissue (see vtkUltrasoundTissue), in mm and LPS, with more field data per body:
 *
 * - SurfaceFaults, 6 ints: open edges, edges of more than two triangles, edges whose triangles face different sides, components
 *   inside out, self-intersections, triangles without area
 * - SurfaceVolume, double: mm^3 within
 * - SurfaceReport, text: what was found and mended, empty when nothing
 *
 * Output 1: where the faults are: a point each (the first hundred of a kind and body), with the point arrays `Fault` (0 to 5, in
 * the order above) and `Body`.
 *
 * A surface with faults is no error: points that files repeat are welded and triangles turned, and the rest is reported.
 * Fails when a material or a block does not exist, or no input has polygons.
 *
 * @sa echorama::SurfaceReport, vtkUltrasoundTissue
 */
#ifndef vtkUltrasoundTissueMeshes_h
#define vtkUltrasoundTissueMeshes_h

#include "EchoramaFiltersTissueModule.h"
#include "vtkPolyDataAlgorithm.h"
#include "vtkUltrasoundParameters.h"

#ifndef __VTK_WRAP__
#include <memory> // for what is set
#include <string>
#endif

class ECHORAMAFILTERSTISSUE_EXPORT vtkUltrasoundTissueMeshes : public vtkPolyDataAlgorithm {
public:
  static vtkUltrasoundTissueMeshes* New();
  vtkTypeMacro(vtkUltrasoundTissueMeshes, vtkPolyDataAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  // BEGIN parameters
  /**
   * What each input is made of, in their order, separated by commas; the last holds for all further inputs. Either the name of a
   * standard material: each block of polygons is a body. Or bodies of chosen blocks, joined by plus signs: liver[10-19], or
   * kidney[0] + lesion-dark[2], or spleen[*] for all; blocks are counted from 0. The blocks of one body are welded into one
   * surface: organs often come in patches. Default tissue.
   */
  vtkUltrasoundTextMacro(Materials);

  /** The standard material around all bodies. Default tissue. */
  vtkUltrasoundTextMacro(Background);

  /** One unit of the inputs: 1000 for metres, as in GLTF. In [1e-06, 1000000] mm; default 1. */
  vtkUltrasoundNumberMacro(Scale);

  enum Axes { LPS = 0, Y_UP = 1, RAS = 2 };

  ///@{
  /**
   * The axes of the inputs. LPS: as they are. Y up: x left, y up, z to the front, of a patient who stands upright, as in GLTF.
   * RAS: as in 3D Slicer's world. Default LPS. There are LPS, Y_UP, RAS.
   */
  vtkUltrasoundChoiceMacro(Axes);
  void SetAxesToLPS() { this->SetAxes(LPS); }
  void SetAxesToYUp() { this->SetAxes(Y_UP); }
  void SetAxesToRAS() { this->SetAxes(RAS); }
  ///@}

  /** Points nearer than that become one; 0: those that are equal. In [0, 10] mm; default 0.001. */
  vtkUltrasoundNumberMacro(WeldMm);

  /** Whether triangles are turned so that bodies face outwards, and cavities inwards. Default on. */
  vtkUltrasoundSwitchMacro(Orient);

  /**
   * Whether holes are closed by triangles about the middle of their border. Those whose border branches stay open. Default off.
   */
  vtkUltrasoundSwitchMacro(CloseHoles);

  /** Whether self-intersections are looked for: by far the longest of the checks. Default on. */
  vtkUltrasoundSwitchMacro(SelfIntersections);

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
#endif

  ///@{
  /** What the last update found and mended, a line per body; and how many bodies came with faults. */
  const char* GetReport() const
  {
    return this->Report.c_str();
  }
  int GetNumberOfFaultyBodies() const
  {
    return this->NumberOfFaultyBodies;
  }
  ///@}

protected:
  vtkUltrasoundTissueMeshes();
  ~vtkUltrasoundTissueMeshes() override;

  int FillInputPortInformation(int port, vtkInformation* info) override;
  int RequestUpdateExtent(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs) override;
  int RequestData(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs) override;

private:
  vtkUltrasoundTissueMeshes(const vtkUltrasoundTissueMeshes&) = delete;
  void operator=(const vtkUltrasoundTissueMeshes&) = delete;

  struct Settings;
#ifndef __VTK_WRAP__
  std::unique_ptr<Settings> Values;
  std::string Report;
  int NumberOfFaultyBodies = 0;
#endif
};

#endif
