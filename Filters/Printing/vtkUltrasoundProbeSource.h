// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class vtkUltrasoundProbeSource
 * @brief a probe as a closed surface in the world, and the poses of its elements
 *
 * No input. Output 0: a vtkPolyData, closed and outward: the face that meets the skin, its housing and a handle, with the cell
 * array `Part` (0 face, 1 housing, 2 handle). Output 1: the elements, one point per beam and plane of the sweep, fan fastest,
 * with the point arrays
 *
 * | array          | values                                                                                |
 * | -------------- | ------------------------------------------------------------------------------------- |
 * | Direction      | normals: unit vector along the beam, world                                            |
 * | Fan, Sweep     | position of the element, -0.5 ... 0.5                                                 |
 * | ElementToWorld | 16 numbers, row by row: origin on the face, +x along the array, +z along the beam     |
 *
 * Both have the field data `ProbeGeometry` and `ProbeToWorld`. All of it follows from the same geometry that images: head
 * parameters of dissertation 3.1.1 (fan angle, fan radius, sweep radius), or one of the presets.
 *
 * Fails, with a message that names the reason, for a number that is out of its range and for heads that cannot be built: a fan
 * that reaches the axis of the sweep, where the face would cut itself, or faces that bend by more than half a turn.
 *
 * @sa echorama::ProbePresets, echorama::MakeProbeMesh
 */
#ifndef vtkUltrasoundProbeSource_h
#define vtkUltrasoundProbeSource_h

#include "EchoramaFiltersPrintingModule.h"
#include "vtkPolyDataAlgorithm.h"
#include "vtkUltrasoundParameters.h"

#ifndef __VTK_WRAP__
#include "Filters/Printing/ProbeMesh.h"
#include <memory> // for what is set
#endif

class vtkMatrix4x4;

class ECHORAMAFILTERSPRINTING_EXPORT vtkUltrasoundProbeSource : public vtkPolyDataAlgorithm {
public:
  static vtkUltrasoundProbeSource* New();
  vtkTypeMacro(vtkUltrasoundProbeSource, vtkPolyDataAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  /** Where the figures of the present preset come from; empty for Custom. */
  const char* GetPresetSource();

  // BEGIN parameters
  enum Presets { CUSTOM = 0, CURVILINEAR = 1, LINEAR = 2, PHASED = 3, ENDOCAVITY_3D = 4, MECHANICAL_3D = 5 };

  ///@{
  /**
   * The kind of probe. Custom: the head that the following parameters describe. Default mechanical-3d. There are CUSTOM,
   * CURVILINEAR, LINEAR, PHASED, ENDOCAVITY_3D, MECHANICAL_3D.
   */
  vtkUltrasoundChoiceMacro(Preset);
  void SetPresetToCustom() { this->SetPreset(CUSTOM); }
  void SetPresetToCurvilinear() { this->SetPreset(CURVILINEAR); }
  void SetPresetToLinear() { this->SetPreset(LINEAR); }
  void SetPresetToPhased() { this->SetPreset(PHASED); }
  void SetPresetToEndocavity3D() { this->SetPreset(ENDOCAVITY_3D); }
  void SetPresetToMechanical3D() { this->SetPreset(MECHANICAL_3D); }
  ///@}

  /** Angle between the first and the last beam of a fan. Used when Preset is custom. In [0, 359.999] degrees; default 70. */
  vtkUltrasoundNumberMacro(FanAngle);

  /** Radius of the array's arc; of no meaning where FanAngle is 0. Used when Preset is custom. In [0, 10000] mm; default 40. */
  vtkUltrasoundNumberMacro(FanRadius);

  /** Length of a flat array: where FanAngle is 0. Used when Preset is custom. In [0, 10000] mm; default 40. */
  vtkUltrasoundNumberMacro(FanWidth);

  /**
   * Angle that the array sweeps. With an angle and a width of 0 the sweep is a single plane. Used when Preset is custom. In [0,
   * 359.999] degrees; default 65.
   */
  vtkUltrasoundNumberMacro(SweepAngle);

  /**
   * From the axis of the sweep to the face; of no meaning where SweepAngle is 0. Used when Preset is custom. In [0, 10000] mm;
   * default 30.
   */
  vtkUltrasoundNumberMacro(SweepRadius);

  /**
   * How far the array moves along a line where SweepAngle is 0. 0: a single plane. Used when Preset is custom. In [0, 10000] mm;
   * default 0.
   */
  vtkUltrasoundNumberMacro(SweepWidth);

  /** First depth along the beams, from the face. Used when Preset is custom. In [-10000, 10000] mm; default 0. */
  vtkUltrasoundNumberMacro(DepthMin);

  /** Last depth along the beams, from the face. Used when Preset is custom. In [-10000, 10000] mm; default 150. */
  vtkUltrasoundNumberMacro(DepthMax);

  /** Beams across the fan. Used when Preset is custom. In [1, 65536]; default 128. */
  vtkUltrasoundIntegerMacro(Elements);

  /** Planes of the sweep; a single plane has one. Used when Preset is custom. In [1, 65536]; default 128. */
  vtkUltrasoundIntegerMacro(SweepSteps);

  /** Radius of the edge between face and wall. In [0.1, 50] mm; default 4. */
  vtkUltrasoundNumberMacro(RimMm);

  /** Straight wall below the lowest point of that edge. In [0.1, 200] mm; default 10. */
  vtkUltrasoundNumberMacro(SkirtMm);

  /** From the wall to the handle. In [1, 500] mm; default 30. */
  vtkUltrasoundNumberMacro(NeckMm);

  /** Length of the handle. In [1, 1000] mm; default 80. */
  vtkUltrasoundNumberMacro(HandleMm);

  /** The handle along the fan. In [1, 500] mm; default 30. */
  vtkUltrasoundNumberMacro(HandleWidthMm);

  /** The handle along the sweep. In [1, 500] mm; default 22. */
  vtkUltrasoundNumberMacro(HandleThicknessMm);

  /** The face of a phased array along the fan: its beams start in one point, which has no size. In [1, 300] mm; default 22. */
  vtkUltrasoundNumberMacro(FaceWidthMm);

  /** The face of a single plane, or of a sweep about a line in the face, along the sweep. In [1, 300] mm; default 13. */
  vtkUltrasoundNumberMacro(FaceThicknessMm);

  /** Edge of the triangles, about. In [0.1, 50] mm; default 1.5. */
  vtkUltrasoundNumberMacro(ResolutionMm);

  /** Where the middle of the probe's face lies in the world. In mm; default (0, 0, 0). */
  vtkUltrasoundVectorMacro(Position);

  /** How the probe is turned: axis times angle. (0, 0, 0): it looks along +z, the fan along x. In degrees; default (0, 0, 0). */
  vtkUltrasoundVectorMacro(Orientation);

  /**
   * Any parameter by its name: as a number (of a switch 0 or 1, of a choice its place from 0), as text ("1.5", "on", the name of
   * a choice, "1 0 0"), integers and vectors without a loss. Setting returns false, after an error event, when there is no such
   * parameter or value. GetParameterDescriptions tells what parameters there are, as JSON: an array of objects with name, type,
   * value, unit, low, high, choices, help ...
   */
  vtkUltrasoundAnyParameterMacro();
  // END parameters

  ///@{
  /** The pose that Position and Orientation make. A matrix that is not rigid is refused with an error, and nothing changes. */
  void SetProbeToWorld(vtkMatrix4x4* probeToWorld);
  void GetProbeToWorld(vtkMatrix4x4* probeToWorld);
  ///@}

  ///@{
  /** Names of the arrays. */
  static const char* PartName() { return "Part"; }
  static const char* DirectionName() { return "Direction"; }
  static const char* FanName() { return "Fan"; }
  static const char* SweepName() { return "Sweep"; }
  static const char* ElementToWorldName() { return "ElementToWorld"; }
  ///@}

#ifndef __VTK_WRAP__
  echorama::ParameterList Parameters(); ///< for C++: they point into this object

  /** The present head, by preset or by its own numbers. */
  echorama::ProbeGeometry Geometry() const;
  echorama::Pose ProbeToWorld() const;
#endif

protected:
  vtkUltrasoundProbeSource();
  ~vtkUltrasoundProbeSource() override;

  int RequestData(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs) override;

private:
  struct Settings;
#ifndef __VTK_WRAP__
  std::unique_ptr<Settings> Values;
#endif

  vtkUltrasoundProbeSource(const vtkUltrasoundProbeSource&) = delete;
  void operator=(const vtkUltrasoundProbeSource&) = delete;
};

#endif
