// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class vtkUltrasoundTissueSource
 * @brief tissue of spheres of many sizes, packed at random without overlap
 *
 * No input. Output: a vtkPolyData that is tissue (see vtkUltrasoundTissue): one body per sphere, each of a random material of a
 * list, each meshed as finely as the resolution cell of a scan asks for. Field data, beside the tissue's:
 *
 * | field        | values                                                        |
 * | ------------ | ------------------------------------------------------------- |
 * | FillFraction | double: volume of the spheres over that of the region         |
 * | SphereCount  | int: how many there are                                       |
 * | Saturated    | int: 1 when no more found room, and it ended short            |
 * | Spheres      | 4 doubles per body: centre and radius, mm                     |
 *
 * Fails, with a message that names the number, for a box without volume, radii that do not fit into it, a material that does not
 * exist, or when it would take more triangles than allowed. A packing that ends for want of room is no failure.
 *
 * @sa echorama::PackedTissueParameters, vtkUltrasoundTissue
 */
#ifndef vtkUltrasoundTissueSource_h
#define vtkUltrasoundTissueSource_h

#include "EchoramaFiltersTissueModule.h"
#include "vtkPolyDataAlgorithm.h"
#include "vtkUltrasoundParameters.h"

#ifndef __VTK_WRAP__
#include <memory> // for what is set
#endif

class ECHORAMAFILTERSTISSUE_EXPORT vtkUltrasoundTissueSource : public vtkPolyDataAlgorithm {
public:
  static vtkUltrasoundTissueSource* New();
  vtkTypeMacro(vtkUltrasoundTissueSource, vtkPolyDataAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  // BEGIN parameters
  enum Methods { RANDOM = 0, EMPTY_SPACE = 1 };

  ///@{
  /**
   * How spheres find their places. Random: sizes are drawn first, and each is tried at random places, large ones first. Empty
   * space: at random places of the empty space, each with the largest sphere that fits (Manna 1992). Default random. There are
   * RANDOM, EMPTY_SPACE.
   */
  vtkUltrasoundChoiceMacro(Method);
  void SetMethodToRandom() { this->SetMethod(RANDOM); }
  void SetMethodToEmptySpace() { this->SetMethod(EMPTY_SPACE); }
  ///@}

  enum Regions { BOX = 0, BALL = 1 };

  ///@{
  /** What is filled: the box, or the largest ball about its middle. Default box. There are BOX, BALL. */
  vtkUltrasoundChoiceMacro(Region);
  void SetRegionToBox() { this->SetRegion(BOX); }
  void SetRegionToBall() { this->SetRegion(BALL); }
  ///@}

  /** Least x, y and z of the box. In [-1000000, 1000000] mm; default (-50, -50, 0). */
  vtkUltrasoundVectorMacro(BoxMin);

  /** Greatest x, y and z of the box. In [-1000000, 1000000] mm; default (50, 50, 100). */
  vtkUltrasoundVectorMacro(BoxMax);

  enum Distributions { UNIFORM = 0, LOG_UNIFORM = 1, POWER_LAW = 2 };

  ///@{
  /**
   * How radii are distributed: all alike, all factors alike (density 1 / r), or of density r^-Exponent. Used when Method is
   * random. Default log-uniform. There are UNIFORM, LOG_UNIFORM, POWER_LAW.
   */
  vtkUltrasoundChoiceMacro(Distribution);
  void SetDistributionToUniform() { this->SetDistribution(UNIFORM); }
  void SetDistributionToLogUniform() { this->SetDistribution(LOG_UNIFORM); }
  void SetDistributionToPowerLaw() { this->SetDistribution(POWER_LAW); }
  ///@}

  /** Exponent of the power law. Used when Distribution is power-law. In [-10, 10]; default 3. */
  vtkUltrasoundNumberMacro(Exponent);

  /** The smallest radius. In [1e-06, 1000000] mm; default 1. */
  vtkUltrasoundNumberMacro(RadiusMin);

  /** The largest radius; a sphere of it must fit into the region. In [1e-06, 1000000] mm; default 8. */
  vtkUltrasoundNumberMacro(RadiusMax);

  /** Least way between two surfaces; 0: they may touch. In [0, 1000] mm; default 0. */
  vtkUltrasoundNumberMacro(GapMm);

  /** Wanted share of the region within spheres. Above 0.6 few packings get there, and take seconds. In [0, 1]; default 0.3. */
  vtkUltrasoundNumberMacro(FillFraction);

  /** Packing ends at so many spheres, or at the fill fraction, whichever comes first. In [0, 5000000]; default 5000000. */
  vtkUltrasoundInteger64Macro(Count);

  /** So many misses in a row mean that there is no more room. In [1, 1000000000]; default 20000. */
  vtkUltrasoundIntegerMacro(Misses);

  /** Seed of sizes, places, materials and turns. At least 0; default 1. */
  vtkUltrasoundInteger64Macro(Seed);

  /**
   * The standard materials of the spheres, separated by commas, each with its share beside the others' (1 when left out). Default
   * lesion-dark 1, liver 1, lesion-bright 1, cyst 0.5.
   */
  vtkUltrasoundTextMacro(Materials);

  /** The standard material between the spheres. Default tissue. */
  vtkUltrasoundTextMacro(Background);

  /** Resolution cell of the scan at the probe's face: it decides how fine meshes are. In [0.01, 100] mm; default 1. */
  vtkUltrasoundNumberMacro(CellMm);

  /** How many mm the cell grows per mm of way from the probe. In [0, 1]; default 0. */
  vtkUltrasoundNumberMacro(CellGrowth);

  /** Where the face of the probe is. It matters when the cell grows. In mm; default (0, 0, 0). */
  vtkUltrasoundVectorMacro(ProbePosition);

  /** How far triangles may leave their sphere, as a part of the cell there. In [0.001, 10]; default 0.25. */
  vtkUltrasoundNumberMacro(Deviation);

  /**
   * Whether meshes have the volume of their spheres; corners then lie a bit outside, and spheres that touch overlap. Else corners
   * lie on the spheres. Default off.
   */
  vtkUltrasoundSwitchMacro(TrueVolume);

  /** Whether each mesh is turned at random, so that not all have a triangle that faces the probe. Default on. */
  vtkUltrasoundSwitchMacro(Turned);

  /** More triangles are refused, with the count that it would take. In [20, 100000000]; default 10000000. */
  vtkUltrasoundInteger64Macro(MaxTriangles);

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
  /** BoxMin and BoxMax as one: least and greatest x, y and z, mm. */
  void SetBox(double xMin, double xMax, double yMin, double yMax, double zMin, double zMax);
  void SetBox(const double box[6])
  {
    this->SetBox(box[0], box[1], box[2], box[3], box[4], box[5]);
  }
  void GetBox(double box[6]);
  ///@}

  ///@{
  /** What the last update made: share of the region within spheres, their count, and whether no more found room. */
  double GetPackedFillFraction() const
  {
    return this->PackedFillFraction;
  }
  int GetSphereCount() const
  {
    return this->SphereCount;
  }
  bool GetSaturated() const
  {
    return this->Saturated;
  }
  ///@}

protected:
  vtkUltrasoundTissueSource();
  ~vtkUltrasoundTissueSource() override;

  int RequestData(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs) override;

private:
  vtkUltrasoundTissueSource(const vtkUltrasoundTissueSource&) = delete;
  void operator=(const vtkUltrasoundTissueSource&) = delete;

  struct Settings;
#ifndef __VTK_WRAP__
  std::unique_ptr<Settings> Values;
#endif
  double PackedFillFraction = 0.0;
  int SphereCount = 0;
  bool Saturated = false;
};

#endif
