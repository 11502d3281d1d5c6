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

#ifndef __VTK_WRAP__
#include <string>
#endif

class ECHORAMAFILTERSTISSUE_EXPORT vtkUltrasoundTissueMeshes : public vtkPolyDataAlgorithm {
public:
  static vtkUltrasoundTissueMeshes* New();
  vtkTypeMacro(vtkUltrasoundTissueMeshes, vtkPolyDataAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  enum AxesKinds { LPS, Y_UP, RAS };

  ///@{
  /**
   * What each input is made of, in their order, separated by commas; the last holds for all further inputs. Either the name of a
   * standard material: each block of polygons is a body. Or bodies of chosen blocks, joined by plus signs: liver[10-19],
   * or kidney[0] + lesion-dark[2] + lesion-dark[3], or spleen[*] for all; blocks are counted from 0. The blocks of one body
   * are welded into one surface: organs often come in patches. Default tissue.
   */
  vtkSetStringMacro(Materials);
  vtkGetStringMacro(Materials);
  ///@}

  ///@{
  /** The standard material around all bodies. Default tissue. */
  vtkSetStringMacro(Background);
  vtkGetStringMacro(Background);
  ///@}

  ///@{
  /** Millimetres per unit of the inputs, in [1e-6, 1e6]: 1000 for metres, as in GLTF. Default 1. */
  vtkSetClampMacro(Scale, double, 1e-6, 1e6);
  vtkGetMacro(Scale, double);
  ///@}

  ///@{
  /**
   * The axes of the inputs: LPS (default) as they are; Y_UP as in GLTF: x left, y up, z to the front, of a patient who stands
   * upright; RAS as in 3D Slicer's world.
   */
  vtkSetClampMacro(Axes, int, LPS, RAS);
  vtkGetMacro(Axes, int);
  ///@}

  ///@{
  /** Points nearer than that become one, in mm, in [0, 10]; 0: those that are equal. Default 0.001. */
  vtkSetClampMacro(WeldMm, double, 0.0, 10.0);
  vtkGetMacro(WeldMm, double);
  ///@}

  ///@{
  /** Whether triangles are turned so that bodies face outwards, and cavities inwards. Default on. */
  vtkSetMacro(Orient, bool);
  vtkGetMacro(Orient, bool);
  vtkBooleanMacro(Orient, bool);
  ///@}

  ///@{
  /** Whether holes are closed by triangles about their middle. Default off: they are reported. */
  vtkSetMacro(CloseHoles, bool);
  vtkGetMacro(CloseHoles, bool);
  vtkBooleanMacro(CloseHoles, bool);
  ///@}

  ///@{
  /** Whether self-intersections are looked for: the longest of the checks. Default on. */
  vtkSetMacro(SelfIntersections, bool);
  vtkGetMacro(SelfIntersections, bool);
  vtkBooleanMacro(SelfIntersections, bool);
  ///@}

  ///@{
  /** What the last update found and mended, a line per body; and how many bodies came with faults. */
  const char* GetReport() const { return this->Report.c_str(); }
  int GetNumberOfFaultyBodies() const { return this->NumberOfFaultyBodies; }
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

#ifndef __VTK_WRAP__
  char* Materials = nullptr;
  char* Background = nullptr;
  double Scale = 1.0;
  int Axes = LPS;
  double WeldMm;
  bool Orient;
  bool CloseHoles;
  bool SelfIntersections;
  std::string Report;
  int NumberOfFaultyBodies = 0;
#endif
};

#endif
