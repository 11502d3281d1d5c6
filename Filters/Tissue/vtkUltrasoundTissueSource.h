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

#ifndef __VTK_WRAP__
#include "Filters/Tissue/PackedTissue.h"
#include <string>
#endif

class ECHORAMAFILTERSTISSUE_EXPORT vtkUltrasoundTissueSource : public vtkPolyDataAlgorithm {
public:
  static vtkUltrasoundTissueSource* New();
  vtkTypeMacro(vtkUltrasoundTissueSource, vtkPolyDataAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  enum Methods { RANDOM, EMPTY_SPACE };
  enum Regions { BOX, BALL };
  enum Distributions { UNIFORM, LOG_UNIFORM, POWER_LAW };

  ///@{
  /**
   * How spheres find their places. RANDOM (default): sizes are drawn first, and each is tried at random places, large ones first.
   * EMPTY_SPACE: at random places of the empty space, each with the largest sphere that fits (Manna 1992).
   */
  vtkSetClampMacro(Method, int, RANDOM, EMPTY_SPACE);
  vtkGetMacro(Method, int);
  ///@}

  ///@{
  /** What is filled: the BOX (default), or the largest BALL about its middle. */
  vtkSetClampMacro(Region, int, BOX, BALL);
  vtkGetMacro(Region, int);
  ///@}

  ///@{
  /** The box: least and greatest x, y and z, mm. Default -50, 50, -50, 50, 0, 100. */
  vtkSetVector6Macro(Box, double);
  vtkGetVector6Macro(Box, double);
  ///@}

  ///@{
  /**
   * How radii are distributed, with RANDOM: UNIFORM, LOG_UNIFORM (default: all factors alike), or POWER_LAW: density
   * r^-Exponent.
   */
  vtkSetClampMacro(Distribution, int, UNIFORM, POWER_LAW);
  vtkGetMacro(Distribution, int);
  ///@}

  ///@{
  /** Of the power law, in [-10, 10]. Default 3. */
  vtkSetClampMacro(Exponent, double, -10.0, 10.0);
  vtkGetMacro(Exponent, double);
  ///@}

  ///@{
  /** The smallest and the largest radius, mm. Spheres of the largest must fit into the box. Default 1 and 8. */
  vtkSetMacro(RadiusMin, double);
  vtkGetMacro(RadiusMin, double);
  vtkSetMacro(RadiusMax, double);
  vtkGetMacro(RadiusMax, double);
  ///@}

  ///@{
  /** The least way between two surfaces in mm, in [0, 1000]. Default 0: they may touch. */
  vtkSetClampMacro(GapMm, double, 0.0, 1000.0);
  vtkGetMacro(GapMm, double);
  ///@}

  ///@{
  /** Wanted share of the region within spheres, in [0, 1]. Default 0.3. See PackedFillFraction for what came of it. */
  vtkSetClampMacro(FillFraction, double, 0.0, 1.0);
  vtkGetMacro(FillFraction, double);
  ///@}

  ///@{
  /** It ends at so many spheres, in [0, 5000000]. Default 5000000: the fill fraction decides. */
  vtkSetClampMacro(Count, int, 0, 5000000);
  vtkGetMacro(Count, int);
  ///@}

  ///@{
  /** So many misses in a row mean that there is no more room, in [1, 1000000000]. Default 20000. */
  vtkSetClampMacro(Misses, int, 1, 1000000000);
  vtkGetMacro(Misses, int);
  ///@}

  ///@{
  /** Seed of sizes, places, materials and turns, at least 0. Default 1. */
  vtkSetClampMacro(Seed, vtkTypeInt64, 0, VTK_TYPE_INT64_MAX);
  vtkGetMacro(Seed, vtkTypeInt64);
  ///@}

  ///@{
  /** The resolution cell of the scan at the probe's face in mm, in [0.01, 100]. Default 1. */
  vtkSetClampMacro(CellMm, double, 0.01, 100.0);
  vtkGetMacro(CellMm, double);
  ///@}

  ///@{
  /** How much the cell grows per mm of way from the probe, in [0, 1]. Default 0. */
  vtkSetClampMacro(CellGrowth, double, 0.0, 1.0);
  vtkGetMacro(CellGrowth, double);
  ///@}

  ///@{
  /** Where the face of the probe is, mm. It matters when the cell grows. Default 0, 0, 0. */
  vtkSetVector3Macro(ProbePosition, double);
  vtkGetVector3Macro(ProbePosition, double);
  ///@}

  ///@{
  /** How far triangles may leave their sphere, as a part of the cell there, in [0.001, 10]. Default 0.25. */
  vtkSetClampMacro(Deviation, double, 0.001, 10.0);
  vtkGetMacro(Deviation, double);
  ///@}

  ///@{
  /**
   * Whether meshes have the volume of their spheres; their corners then lie a bit outside, and those of spheres that touch
   * overlap. Default off: corners lie on the spheres.
   */
  vtkSetMacro(TrueVolume, bool);
  vtkGetMacro(TrueVolume, bool);
  vtkBooleanMacro(TrueVolume, bool);
  ///@}

  ///@{
  /** Whether each mesh is turned at random, so that not all have a triangle that faces the probe. Default on. */
  vtkSetMacro(Turned, bool);
  vtkGetMacro(Turned, bool);
  vtkBooleanMacro(Turned, bool);
  ///@}

  ///@{
  /** More triangles are refused, in [20, 100000000]. Default 10000000. */
  vtkSetClampMacro(MaxTriangles, int, 20, 100000000);
  vtkGetMacro(MaxTriangles, int);
  ///@}

  ///@{
  /** The standard material between the spheres. Default tissue. */
  vtkSetStringMacro(Background);
  vtkGetStringMacro(Background);
  ///@}

  ///@{
  /**
   * The standard materials of the spheres, separated by commas, each with its share beside the others' (1 when left out).
   * Default "lesion-dark 1, liver 1, lesion-bright 1, cyst 0.5".
   */
  vtkSetStringMacro(Materials);
  vtkGetStringMacro(Materials);
  ///@}

  ///@{
  /** What the last update made: share of the region within spheres, their count, and whether no more found room. */
  double GetPackedFillFraction() const { return this->PackedFillFraction; }
  int GetSphereCount() const { return this->SphereCount; }
  bool GetSaturated() const { return this->Saturated; }
  ///@}

#ifndef __VTK_WRAP__
  /** The properties as the kernel takes them. Throws echorama::Error for a material that does not exist. */
  echorama::PackedTissueParameters Parameters() const;
#endif

protected:
  vtkUltrasoundTissueSource();
  ~vtkUltrasoundTissueSource() override;

  int RequestData(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs) override;

private:
  vtkUltrasoundTissueSource(const vtkUltrasoundTissueSource&) = delete;
  void operator=(const vtkUltrasoundTissueSource&) = delete;

  int Method;
  int Region;
  double Box[6];
  int Distribution;
  double Exponent;
  double RadiusMin;
  double RadiusMax;
  double GapMm;
  double FillFraction;
  int Count;
  int Misses;
  vtkTypeInt64 Seed;
  double CellMm;
  double CellGrowth;
  double ProbePosition[3];
  double Deviation;
  bool TrueVolume;
  bool Turned;
  int MaxTriangles;
  char* Background = nullptr;
  char* Materials = nullptr;
  double PackedFillFraction = 0.0;
  int SphereCount = 0;
  bool Saturated = false;
};

#endif
