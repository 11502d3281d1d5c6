// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class vtkUltrasoundVolumeReconstructor
 * @brief tracked 2D frames into a volume, all of a sequence at once or live, one by one
 *
 * Input 0: tracked frames, one per time step: vtkImageData of one slice with `Intensity`, optionally `ValidRegion` (which pixels
 * are real), and the field data `ImageToWorld`. A frame without `ImageToWorld` has no valid pose, is not used, and is counted. An
 * input without time steps is a single frame. Input 1 (optional): a volume whose grid the output takes.
 *
 * Output: one vtkImageData with
 * - `Intensity` (of the frames' type): 0 where nothing was seen;
 * - `ValidRegion`: 1 where something was seen, or a hole was filled;
 * - `Coverage` (unsigned short): how many pixels a voxel got, those of frames in between included (65535: that or more). 0 where
 *   nothing was seen: a voxel that is valid and not covered was filled;
 * - field data `ReconstructionReport`: GetReport(), line by line.
 *
 * The filter goes through the time steps itself, in the order of time: once for poses and the sector when information is asked
 * for (not when the grid is given and no sector is to be found), once to splat. Frames are made one at a time by the input and
 * not kept. Both times it tells its progress and can be stopped. The output does not depend on time. Memory is stated
 * (GetMemoryMb) and checked before any is allocated.
 *
 * Live: BeginLive() with a grid, then AddFrame() for each frame; GetLiveOutput() is up to date after each. That needs no input.
 *
 * Refuses, with a message: a frame that its input fails to make, no frame that can be used (with the reasons), frames of
 * different sizes where a sector is to be found, a frame that is not one slice, parameters out of range, and a grid that takes
 * more memory than allowed (with a spacing that fits).
 *
 * Under MPI each rank computes the whole and keeps its piece.
 *
 * @sa echorama::VolumeReconstruction, echorama::FillHoles, echorama::FrameSector, echorama::ReconstructionGrid
 */
#ifndef vtkUltrasoundVolumeReconstructor_h
#define vtkUltrasoundVolumeReconstructor_h

#include "EchoramaFiltersReconstructionModule.h"
#include "vtkUltrasoundImageAlgorithm.h"
#include "vtkUltrasoundParameters.h"

#include <memory> // for the plan and the live volume
#include <string> // for the report

#ifndef __VTK_WRAP__
#include "Filters/Reconstruction/HoleFilling.h"
#include "Filters/Reconstruction/ReconstructionPlan.h"
#include "Filters/Reconstruction/VolumeReconstruction.h"
#endif

class vtkAlgorithmOutput;

class ECHORAMAFILTERSRECONSTRUCTION_EXPORT vtkUltrasoundVolumeReconstructor : public vtkUltrasoundImageAlgorithm {
public:
  static vtkUltrasoundVolumeReconstructor* New();
  vtkTypeMacro(vtkUltrasoundVolumeReconstructor, vtkUltrasoundImageAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  ///@{
  /** A volume whose grid the output takes: origin, spacing, direction and size. Its values are not used. */
  void SetReferenceConnection(vtkAlgorithmOutput* output);
  void SetReferenceData(vtkImageData* volume);
  ///@}

  // BEGIN parameters
  enum Splats { NEAREST = 0, LINEAR = 1 };

  ///@{
  /**
   * How a pixel goes into the volume: into its nearest voxel, or by linear weights into the eight around it. Default nearest.
   * There are NEAREST, LINEAR.
   */
  vtkUltrasoundChoiceMacro(Splat);
  void SetSplatToNearest() { this->SetSplat(NEAREST); }
  void SetSplatToLinear() { this->SetSplat(LINEAR); }
  ///@}

  enum Compoundings { MEAN = 0, MAXIMUM = 1, LATEST = 2, ALPHA = 3, RUNNING_MEAN = 4 };

  ///@{
  /**
   * What becomes of a voxel that several pixels reach: their mean, the maximum, the mean of the latest frame's, each frame laid
   * over the others, or the rounded mean that the Plus toolkit keeps, for comparison. Default mean. There are MEAN, MAXIMUM,
   * LATEST, ALPHA, RUNNING_MEAN.
   */
  vtkUltrasoundChoiceMacro(Compounding);
  void SetCompoundingToMean() { this->SetCompounding(MEAN); }
  void SetCompoundingToMaximum() { this->SetCompounding(MAXIMUM); }
  void SetCompoundingToLatest() { this->SetCompounding(LATEST); }
  void SetCompoundingToAlpha() { this->SetCompounding(ALPHA); }
  void SetCompoundingToRunningMean() { this->SetCompounding(RUNNING_MEAN); }
  ///@}

  /** Opacity of a frame that is laid over the others. Used when Compounding is alpha. In (0, 1]; default 0.5. */
  vtkUltrasoundNumberMacro(Alpha);

  enum Betweens { NOTHING = 0, FORWARD = 1, BACKWARD = 2 };

  ///@{
  /**
   * What lies between frames that follow each other: nothing; frames with pixels and matrices interpolated; or, backward, at each
   * voxel a blend of what both frames show at its perpendicular feet. Default forward. There are NOTHING, FORWARD, BACKWARD.
   */
  vtkUltrasoundChoiceMacro(Between);
  void SetBetweenToNothing() { this->SetBetween(NOTHING); }
  void SetBetweenToForward() { this->SetBetween(FORWARD); }
  void SetBetweenToBackward() { this->SetBetween(BACKWARD); }
  ///@}

  /**
   * No pixel moves further than this from one interpolated frame to the next. 0: 0.7 of the smallest spacing. Used when Between
   * is forward. At least 0 mm; default 0.
   */
  vtkUltrasoundNumberMacro(StepMm);

  /**
   * Frames between which a pixel moves further than this are not joined: the probe was lifted. Used when Between is forward or
   * backward. Above 0 mm; default 10.
   */
  vtkUltrasoundNumberMacro(MaximumGapMm);

  enum Holes { NONE = 0, MEAN_AROUND = 1, STICK = 2 };

  ///@{
  /**
   * How voxels are filled that were not seen but lie between others that were: not at all; by the mean of the smallest cube that
   * reaches across; or by linear interpolation along the shortest line across. Default mean-around. There are NONE, MEAN_AROUND,
   * STICK.
   */
  vtkUltrasoundChoiceMacro(Holes);
  void SetHolesToNone() { this->SetHoles(NONE); }
  void SetHolesToMeanAround() { this->SetHoles(MEAN_AROUND); }
  void SetHolesToStick() { this->SetHoles(STICK); }
  ///@}

  /**
   * The widest gap that is filled, along one of 13 lines. 1: single voxels. Used when Holes is mean-around or stick. In [1, 100]
   * voxels; default 1.
   */
  vtkUltrasoundIntegerMacro(HoleReach);

  enum Sectors { ALL = 0, DETECTED = 1, RECTANGLE = 2, FAN = 3 };

  ///@{
  /**
   * Which part of the images goes into the volume, of what their valid regions allow. Detected: the sector is found by what
   * changes from frame to frame, so that what a scanner prints stays out; all pixels, with a warning, where hardly anything
   * changes or frames come live. Default detected. There are ALL, DETECTED, RECTANGLE, FAN.
   */
  vtkUltrasoundChoiceMacro(Sector);
  void SetSectorToAll() { this->SetSector(ALL); }
  void SetSectorToDetected() { this->SetSector(DETECTED); }
  void SetSectorToRectangle() { this->SetSector(RECTANGLE); }
  void SetSectorToFan() { this->SetSector(FAN); }
  ///@}

  enum Grids { FITTED = 0, WORLD = 1 };

  ///@{
  /**
   * How the grid lies when none is given: fitted to the data's own directions, or along the axes of the world. Default fitted.
   * There are FITTED, WORLD.
   */
  vtkUltrasoundChoiceMacro(Grid);
  void SetGridToFitted() { this->SetGrid(FITTED); }
  void SetGridToWorld() { this->SetGrid(WORLD); }
  ///@}

  /** Edge of a voxel when no grid is given. 0: the longer edge of a pixel. At least 0 mm; default 0. */
  vtkUltrasoundNumberMacro(SpacingMm);

  /** The first frame to use, counted from 0 in the order of time. At least 0; default 0. */
  vtkUltrasoundIntegerMacro(FirstFrame);

  /** The last frame to use. -1: the last of the sequence. At least -1; default -1. */
  vtkUltrasoundIntegerMacro(LastFrame);

  /** Every n-th frame is used. At least 1; default 1. */
  vtkUltrasoundIntegerMacro(FrameStep);

  /** What takes more memory (in 10^6 bytes) is refused. 0: what is free on this machine. At least 0 MB; default 0. */
  vtkUltrasoundNumberMacro(MemoryLimitMb);

  /**
   * Any parameter by its name: as a number (of a switch 0 or 1, of a choice its place from 0), as text ("1.5", "on", the name of
   * a choice, "1 0 0"), integers and vectors without a loss. Setting returns false, after an error event, when there is no such
   * parameter or value. GetParameterDescriptions tells what parameters there are, as JSON: an array of objects with name, type,
   * value, unit, low, high, choices, help ...
   */
  vtkUltrasoundAnyParameterMacro();
  // END parameters

  enum { KEEP_HOLES = NONE }; ///< the same

  ///@{
  /** First and last column, first and last row of RECTANGLE, inclusive. Default: 0 to 2147483647. */
  vtkSetVector4Macro(Rectangle, int);
  vtkGetVector4Macro(Rectangle, int);
  ///@}

  ///@{
  /**
   * FAN: where its beams meet (pixels), the angles of its edges from straight down (degrees, positive towards higher columns,
   * default -30 and 30), and its first and last depth from there (mm, default 0 and 100).
   */
  vtkSetVector2Macro(FanApex, double);
  vtkGetVector2Macro(FanApex, double);
  vtkSetVector2Macro(FanAngles, double);
  vtkGetVector2Macro(FanAngles, double);
  vtkSetVector2Macro(FanDepths, double);
  vtkGetVector2Macro(FanDepths, double);
  ///@}

  ///@{
  /** What the last run, or the live volume, did. */
  int GetFramesUsed() { return this->Statistics.Used; }
  int GetFramesRefused() { return this->Statistics.Refused; }
  int GetFramesBetween() { return this->Statistics.Between; }
  vtkIdType GetVoxelsSeen() { return this->Statistics.Seen; }
  vtkIdType GetVoxelsFilled() { return this->Statistics.Filled; }
  double GetMemoryMb() { return this->Statistics.MemoryMb; }
  /** The same in sentences, one per line, with the reasons why frames were refused. */
  std::string GetReport();
  ///@}

  /**
   * Starts a live volume on the grid of \a grid (its arrays are not used; a vtkImageData without any will do), of the voxel type
   * \a vtkType. Returns false, with an error message, when that cannot be. The parameters are those of this moment.
   */
  bool BeginLive(vtkImageData* grid, int vtkType = VTK_UNSIGNED_CHAR);

  /**
   * Adds a frame as it would come on input 0, of the type of the live volume. Returns true when it was used. A frame that cannot
   * be used is counted and leaves the volume as it was; one that is no frame at all gives an error message.
   */
  bool AddFrame(vtkImageData* frame);

  /** The live volume, with its arrays as those of the output; nullptr before BeginLive(). Holes are open until FillLiveHoles().
   */
  vtkImageData* GetLiveOutput();

  /** Fills the holes of the live volume as it is now, by Holes and HoleReach. Frames may follow. Returns how many voxels. */
  vtkIdType FillLiveHoles();

  /** Ends the live volume; who holds its data keeps it. */
  void EndLive();

  ///@{
  /** Names of the output's own arrays. */
  static const char* CoverageName() { return "Coverage"; }
  static const char* ReportName() { return "ReconstructionReport"; }
  ///@}

#ifndef __VTK_WRAP__
  echorama::ParameterList Parameters(); ///< for C++: they point into this object
#endif

protected:
  vtkUltrasoundVolumeReconstructor();
  ~vtkUltrasoundVolumeReconstructor() override;

  int FillInputPortInformation(int port, vtkInformation* information) override;
  int RequestInformation(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs) override;
  int ComputePipelineMTime(vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs, int port,
                           vtkMTimeType* time) override;
#ifndef __VTK_WRAP__
  void Execute(vtkInformationVector** inputs, vtkImageData* output, const echorama::Progress& progress) override;
#endif

private:
#ifndef __VTK_WRAP__
  class Frames;
  struct Plan;
  struct Live;
  const Plan& Prepare(vtkInformationVector** inputs, const echorama::Progress& progress);
  echorama::SectorParameters GivenSector() const;
  void Begin(const echorama::ImageGeometry& grid, int type);
  void Refuse(const std::string& reason);

  struct Counts {
    int Used = 0, Refused = 0, Between = 0;
    vtkIdType Seen = 0, Filled = 0;
    double MemoryMb = 0.0;
    std::string Grid, SectorText;
    std::vector<std::pair<std::string, int>> Reasons;
  } Statistics;
#endif
  vtkUltrasoundVolumeReconstructor(const vtkUltrasoundVolumeReconstructor&) = delete;
  void operator=(const vtkUltrasoundVolumeReconstructor&) = delete;

#ifndef __VTK_WRAP__
  echorama::ReconstructionParameters Making;
  echorama::HoleFillingParameters Filling;
  echorama::SectorChoice Part = echorama::SectorParameters().choice;
  echorama::GridDirections Directions = echorama::GridDirections::Fitted;
  std::unique_ptr<Plan> Prepared;
  std::unique_ptr<Live> LiveVolume;
#endif
  int Rectangle[4] = {0, VTK_INT_MAX, 0, VTK_INT_MAX};
  double FanApex[2] = {0.0, 0.0};
  double FanAngles[2] = {-30.0, 30.0};
  double FanDepths[2] = {0.0, 100.0};
  double Spacing = 0.0;
  int From = 0, To = -1, EveryNth = 1; // frames
  double MostMemoryMb = 0.0;
  bool Stopped = false; // while information was made
};

#endif
