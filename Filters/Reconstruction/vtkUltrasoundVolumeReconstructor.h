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

  enum SplatMethods { NEAREST = 0, LINEAR = 1 };
  enum Compoundings { MEAN = 0, MAXIMUM = 1, LATEST = 2, ALPHA = 3, RUNNING_MEAN = 4 };
  enum BetweenMethods { NOTHING = 0, FORWARD = 1, BACKWARD = 2 };
  enum HoleMethods { KEEP_HOLES = 0, MEAN_AROUND = 1, STICK = 2 };
  enum Sectors { ALL = 0, DETECTED = 1, RECTANGLE = 2, FAN = 3 };
  enum Grids { FITTED = 0, WORLD = 1 };

  ///@{
  /** A volume whose grid the output takes: origin, spacing, direction and size. Its values are not used. */
  void SetReferenceConnection(vtkAlgorithmOutput* output);
  void SetReferenceData(vtkImageData* volume);
  ///@}

  ///@{
  /** How a pixel goes into the volume: into its NEAREST voxel (default), or by LINEAR weights into the eight around it. */
  vtkSetClampMacro(Splat, int, NEAREST, LINEAR);
  vtkGetMacro(Splat, int);
  ///@}

  ///@{
  /**
   * What becomes of a voxel that several pixels reach: their MEAN (default), the MAXIMUM, the LATEST frame's mean, each frame
   * laid over the others with the opacity ALPHA, or the RUNNING_MEAN, the rounded mean that the Plus toolkit keeps, for
   * comparison.
   */
  vtkSetClampMacro(Compounding, int, MEAN, RUNNING_MEAN);
  vtkGetMacro(Compounding, int);
  ///@}

  ///@{
  /** Opacity of a frame for ALPHA, in (0, 1]. Default 0.5. */
  vtkSetMacro(Alpha, double);
  vtkGetMacro(Alpha, double);
  ///@}

  ///@{
  /**
   * What lies between frames that follow each other: NOTHING; FORWARD (default), frames with pixels and matrices interpolated; or
   * BACKWARD, where each voxel between the two planes blends what both show at its perpendicular feet.
   */
  vtkSetClampMacro(Between, int, NOTHING, BACKWARD);
  vtkGetMacro(Between, int);
  ///@}

  ///@{
  /** FORWARD: no pixel moves further than this from frame to frame, mm. 0 (default): 0.7 of the smallest spacing. */
  vtkSetMacro(StepMm, double);
  vtkGetMacro(StepMm, double);
  ///@}

  ///@{
  /** Frames between which a pixel moves further than this, in mm, are not joined: the probe was lifted. Default 10. */
  vtkSetMacro(MaximumGapMm, double);
  vtkGetMacro(MaximumGapMm, double);
  ///@}

  ///@{
  /**
   * What becomes of holes, voxels that were not seen between others that were: KEEP_HOLES; MEAN_AROUND (default), the mean of the
   * smallest cube that reaches across; or STICK, linear interpolation along the shortest line across. See echorama::FillHoles.
   */
  vtkSetClampMacro(Holes, int, KEEP_HOLES, STICK);
  vtkGetMacro(Holes, int);
  ///@}

  ///@{
  /** The widest gap that is filled, in voxels along a line, in [1, 100]. Default 1: single voxels. */
  vtkSetClampMacro(HoleReach, int, 1, 100);
  vtkGetMacro(HoleReach, int);
  ///@}

  ///@{
  /**
   * Which part of the images goes into the volume, of what their ValidRegion allows: ALL; the sector that is DETECTED in the
   * sequence (default), by what changes from frame to frame, with a fan or rectangle fitted to it; a RECTANGLE; or a FAN. Where
   * what changes is too small for a sector (echorama::DetectSector), all pixels are taken, with a warning. Live there is nothing
   * to detect: DETECTED is then ALL.
   */
  vtkSetClampMacro(Sector, int, ALL, FAN);
  vtkGetMacro(Sector, int);
  ///@}

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
  /** How the grid lies when none is given: FITTED to the data's own directions (default), or along the axes of the WORLD. */
  vtkSetClampMacro(Grid, int, FITTED, WORLD);
  vtkGetMacro(Grid, int);
  ///@}

  ///@{
  /** Edge of a voxel, mm, when no grid is given. 0 (default): the longer edge of a pixel. */
  vtkSetMacro(SpacingMm, double);
  vtkGetMacro(SpacingMm, double);
  ///@}

  ///@{
  /** Frames to use, counted from 0 in the order of time: from the first to the last (-1, default: to the end), every n-th. */
  vtkSetClampMacro(FirstFrame, int, 0, VTK_INT_MAX);
  vtkGetMacro(FirstFrame, int);
  vtkSetClampMacro(LastFrame, int, -1, VTK_INT_MAX);
  vtkGetMacro(LastFrame, int);
  vtkSetClampMacro(FrameStep, int, 1, VTK_INT_MAX);
  vtkGetMacro(FrameStep, int);
  ///@}

  ///@{
  /** Refuse what takes more memory than this, in 10^6 bytes. 0 (default): what is free on this machine. */
  vtkSetMacro(MemoryLimitMb, double);
  vtkGetMacro(MemoryLimitMb, double);
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
  echorama::ReconstructionParameters Parameters() const;
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

  int Splat = NEAREST;
  int Compounding = MEAN;
  int Between = FORWARD;
  int Holes = MEAN_AROUND;
  int Sector = DETECTED;
  int Rectangle[4] = {0, VTK_INT_MAX, 0, VTK_INT_MAX};
  double FanApex[2] = {0.0, 0.0};
  double FanAngles[2] = {-30.0, 30.0};
  double FanDepths[2] = {0.0, 100.0};
  int Grid = FITTED;
  double SpacingMm = 0.0;
  int FirstFrame = 0;
  int LastFrame = -1;
  int FrameStep = 1;
  double MemoryLimitMb = 0.0;
  bool Stopped = false; // while information was made
#ifndef __VTK_WRAP__
  double Alpha = echorama::ReconstructionParameters().alpha;
  double StepMm = echorama::ReconstructionParameters().stepMm;
  double MaximumGapMm = echorama::ReconstructionParameters().maximumGapMm;
  int HoleReach = echorama::HoleFillingParameters().reach;
  std::unique_ptr<Plan> Prepared;
  std::unique_ptr<Live> LiveVolume;
#endif
};

#endif
