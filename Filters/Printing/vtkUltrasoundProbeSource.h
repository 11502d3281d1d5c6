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

#ifndef __VTK_WRAP__
#include "Filters/Printing/ProbeMesh.h"
#endif

class vtkMatrix4x4;

class ECHORAMAFILTERSPRINTING_EXPORT vtkUltrasoundProbeSource : public vtkPolyDataAlgorithm {
public:
  static vtkUltrasoundProbeSource* New();
  vtkTypeMacro(vtkUltrasoundProbeSource, vtkPolyDataAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  enum Presets { Custom = 0, Curvilinear, Linear, Phased, Endocavity3D, Mechanical3D };

  ///@{
  /** The kind of probe; Custom takes the head below instead. Default Mechanical3D. */
  vtkSetClampMacro(Preset, int, Custom, Mechanical3D);
  vtkGetMacro(Preset, int);
  void SetPresetToCustom() { this->SetPreset(Custom); }
  void SetPresetToCurvilinear() { this->SetPreset(Curvilinear); }
  void SetPresetToLinear() { this->SetPreset(Linear); }
  void SetPresetToPhased() { this->SetPreset(Phased); }
  void SetPresetToEndocavity3D() { this->SetPreset(Endocavity3D); }
  void SetPresetToMechanical3D() { this->SetPreset(Mechanical3D); }
  ///@}

  /** Where the figures of the present preset come from; empty for Custom. */
  const char* GetPresetSource();

  // The head, of Custom alone.

  ///@{
  /** Whole fan in degrees, in [0, 180]; 0: a flat array. Default 70. */
  vtkSetMacro(FanAngle, double);
  vtkGetMacro(FanAngle, double);
  ///@}

  ///@{
  /** Radius of the array's arc in mm, at least 0; of no meaning when FanAngle is 0. Default 40. */
  vtkSetMacro(FanRadius, double);
  vtkGetMacro(FanRadius, double);
  ///@}

  ///@{
  /** Length of a flat array in mm, at least 0: when FanAngle is 0. Default 40. */
  vtkSetMacro(FanWidth, double);
  vtkGetMacro(FanWidth, double);
  ///@}

  ///@{
  /** Whole sweep in degrees, in [0, 178); 0: the array moves along a line, or not at all. Default 65. */
  vtkSetMacro(SweepAngle, double);
  vtkGetMacro(SweepAngle, double);
  ///@}

  ///@{
  /** From the axis of the sweep to the face in mm, at least 0; of no meaning when SweepAngle is 0. Default 30. */
  vtkSetMacro(SweepRadius, double);
  vtkGetMacro(SweepRadius, double);
  ///@}

  ///@{
  /** How far the array moves along a line in mm, at least 0: when SweepAngle is 0; 0: a single plane. Default 0. */
  vtkSetMacro(SweepWidth, double);
  vtkGetMacro(SweepWidth, double);
  ///@}

  ///@{
  /** First depth along the beams, mm from the face. Default 0. */
  vtkSetMacro(DepthMin, double);
  vtkGetMacro(DepthMin, double);
  ///@}

  ///@{
  /** Last depth along the beams, mm from the face. Default 150. */
  vtkSetMacro(DepthMax, double);
  vtkGetMacro(DepthMax, double);
  ///@}

  ///@{
  /** Beams across the fan, and planes of the sweep (1 of a single plane), in [1, 65536]: the points of output 1. Default 128,
   * 128. */
  vtkSetMacro(Elements, int);
  vtkGetMacro(Elements, int);
  vtkSetMacro(SweepSteps, int);
  vtkGetMacro(SweepSteps, int);
  ///@}

  // What is around the face.

  ///@{
  /** Radius of the edge between face and wall in mm, in [0.1, 50]. Default 4. */
  vtkSetMacro(RimMm, double);
  vtkGetMacro(RimMm, double);
  ///@}

  ///@{
  /** Straight wall below that edge in mm, in [0.1, 200]. Default 10. */
  vtkSetMacro(SkirtMm, double);
  vtkGetMacro(SkirtMm, double);
  ///@}

  ///@{
  /** From the wall to the handle in mm, in [1, 500]. Default 30. */
  vtkSetMacro(NeckMm, double);
  vtkGetMacro(NeckMm, double);
  ///@}

  ///@{
  /** Length of the handle in mm, in [1, 1000]. Default 80. */
  vtkSetMacro(HandleMm, double);
  vtkGetMacro(HandleMm, double);
  ///@}

  ///@{
  /** The handle along the fan in mm, in [1, 500]. Default 30. */
  vtkSetMacro(HandleWidthMm, double);
  vtkGetMacro(HandleWidthMm, double);
  ///@}

  ///@{
  /** The handle along the sweep in mm, in [1, 500]. Default 22. */
  vtkSetMacro(HandleThicknessMm, double);
  vtkGetMacro(HandleThicknessMm, double);
  ///@}

  ///@{
  /** The face of a phased array along the fan in mm, in [1, 300]: its beams start in one point, which has no size. Default 22. */
  vtkSetMacro(FaceWidthMm, double);
  vtkGetMacro(FaceWidthMm, double);
  ///@}

  ///@{
  /** The face of a single plane, or of a sweep about a line in the face, along the sweep in mm, in [1, 300]. Default 13. */
  vtkSetMacro(FaceThicknessMm, double);
  vtkGetMacro(FaceThicknessMm, double);
  ///@}

  ///@{
  /** Edge of the triangles in mm, about; in [0.1, 50]. Default 1.5. */
  vtkSetMacro(ResolutionMm, double);
  vtkGetMacro(ResolutionMm, double);
  ///@}

  ///@{
  /** Where the middle of the probe's face lies in the world, mm. Default (0, 0, 0). */
  vtkSetVector3Macro(Position, double);
  vtkGetVector3Macro(Position, double);
  ///@}

  ///@{
  /** How the probe is turned: axis times angle, in degrees. Default (0, 0, 0): it looks along +z, its fan along x. */
  vtkSetVector3Macro(Orientation, double);
  vtkGetVector3Macro(Orientation, double);
  ///@}

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
  /** The present head, by preset or by its own numbers. */
  echorama::ProbeGeometry Geometry() const;
  echorama::ProbeHousing Housing() const;
  echorama::Pose ProbeToWorld() const;
#endif

protected:
  vtkUltrasoundProbeSource();
  ~vtkUltrasoundProbeSource() override = default;

  int RequestData(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs) override;

private:
  int Preset;
  double FanAngle;
  double FanRadius;
  double FanWidth;
  double SweepAngle;
  double SweepRadius;
  double SweepWidth;
  double DepthMin;
  double DepthMax;
  int Elements;
  int SweepSteps;
  double RimMm;
  double SkirtMm;
  double NeckMm;
  double HandleMm;
  double HandleWidthMm;
  double HandleThicknessMm;
  double FaceWidthMm;
  double FaceThicknessMm;
  double ResolutionMm;
  double Position[3];
  double Orientation[3];

  vtkUltrasoundProbeSource(const vtkUltrasoundProbeSource&) = delete;
  void operator=(const vtkUltrasoundProbeSource&) = delete;
};

#endif
