// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class vtkUltrasoundTrackerPlacement
 * @brief moves volumes to where a tracker says they belong
 *
 * With S the poses of the sensor on the probe when the volumes were made, and C the calibration (VolumeToSensor), the probe of a
 * volume lies at C^-1 S_fixed^-1 S C of the fixed volume's (dissertation eq. 4.4); see echorama::PlaceByTracker.
 *
 * Input 0 (repeatable): volumes (vtkImageData, or the image leaves of vtkDataObjectTree). Input 1 (optional): the track, a
 * vtkPolyData with one point per pose as output 1 of vtkUltrasoundSequenceReader: the point array PoseArray (16 numbers, row by
 * row), TimeStamp, optionally Status (0: valid), and Tool with the field data ToolNames. Without it, Recording names a file.
 *
 * Output: a vtkMultiBlockDataSet with the same volumes in the same order, one block each, with the same NAME(). Voxels are shared
 * with the input; only geometry, `ProbeToWorld` and `ImageToWorld` are new. Field data of each block: VolumeToWorld, 16 doubles,
 * row by row: from where the input was to where the output is.
 *
 * Volumes and poses belong together by time: those of AddTime, else the volumes' `TimeStamp`; volumes without any are matched
 * with the poses one by one, when there are as many. Poses are averaged over WindowSeconds.
 *
 * Refused, with a message that names volume and reason: some volumes without a time; a volume that was made before or after the
 * recording, or in a gap of it; one without `ProbeToWorld` where the calibration is that of the probe; a calibration that does
 * not hold the transform from the volume to this tool. Under MPI each rank computes and holds the whole result.
 *
 * @sa vtkUltrasoundHandEyeCalibration, vtkUltrasoundSequenceReader, vtkUltrasoundAligner
 */
#ifndef vtkUltrasoundTrackerPlacement_h
#define vtkUltrasoundTrackerPlacement_h

#include "EchoramaFiltersCalibrationModule.h"
#include "vtkUltrasoundMultiBlockAlgorithm.h"
#include "vtkUltrasoundParameters.h"

#ifndef __VTK_WRAP__
#include "Filters/Calibration/TrackerPlacement.h"
#endif
#include <string>

class vtkAlgorithmOutput;
class vtkImageData;
class vtkMatrix4x4;

class ECHORAMAFILTERSCALIBRATION_EXPORT vtkUltrasoundTrackerPlacement : public vtkUltrasoundMultiBlockAlgorithm {
public:
  static vtkUltrasoundTrackerPlacement* New();
  vtkTypeMacro(vtkUltrasoundTrackerPlacement, vtkUltrasoundMultiBlockAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  /** Connects the track, input 1. */
  void SetTrackConnection(vtkAlgorithmOutput* track) { this->SetInputConnection(1, track); }

  ///@{
  /**
   * A recording to take the poses from where no track is connected: a tracked sequence or a table. A tool that it does not hold
   * is composed of those it holds.
   */
  vtkSetFilePathMacro(Recording);
  vtkGetFilePathMacro(Recording);
  ///@}

  ///@{
  /**
   * The calibration, a file as echorama calibrate hand-eye writes it; default none. Without one, VolumeToSensor is taken: 16
   * numbers, row by row, mm; default the identity.
   */
  vtkSetFilePathMacro(CalibrationFile);
  vtkGetFilePathMacro(CalibrationFile);
  vtkSetVectorMacro(VolumeToSensor, double, 16);
  vtkGetVectorMacro(VolumeToSensor, double, 16);
  void SetVolumeToSensor(vtkMatrix4x4* matrix);
  ///@}

  ///@{
  /** When each volume was made, seconds on the clock of the track, in their order. Default none: as the volumes say. */
  void AddTime(double seconds);
  void RemoveAllTimes();
  int GetNumberOfTimes() const { return static_cast<int>(this->Values.times.size()); }
  ///@}

  /** How many volumes the last update placed; 0 when it failed. */
  int GetNumberOfVolumes() const { return static_cast<int>(this->Poses.size()); }

  /** The motion of a volume, mm. Returns false, and leaves \a pose alone, when there is no such volume. */
  bool GetPose(int volume, vtkMatrix4x4* pose) const;

  /** The error of the calibration at the middle of the volumes, mm, as its file states it; NaN when it does not. */
  vtkGetMacro(ErrorMm, double);

  /** By what volumes and poses were matched, and what was noticed: one sentence per line. Empty when it failed. */
  std::string GetNotes() const { return this->Notes; }

  /** Name of the field data. */
  static const char* VolumeToWorldName() { return "VolumeToWorld"; }

  // BEGIN parameters
  /**
   * The tool that is fixed to the probe: ProbeToTracker, or by its name in ToolNames. Of a recording also one that is composed,
   * such as ProbeToReference. Empty takes the only one. Default none.
   */
  vtkUltrasoundTextMacro(Tool);

  /** Standard deviation of the window over which poses are averaged. 0: they stay as they are. In [0, 60] s; default 0.2. */
  vtkUltrasoundNumberMacro(WindowSeconds);

  /** Poses that lie further apart are not connected: no pose is known between them. In (0, 600] s; default 0.5. */
  vtkUltrasoundNumberMacro(LongestGapSeconds);

  /** The volume that stays where it is, counted from 0. At least 0; default 0. */
  vtkUltrasoundIntegerMacro(FixedVolume);

  enum VolumeFrames { AUTOMATIC = 0, PROBE = 1, FILE_FRAME = 2 };

  ///@{
  /**
   * What the calibration calls the volume: the frame of its probe (ProbeToWorld), or that of the file, for volumes that lie as
   * they were acquired. Automatic: as the file of the calibration says, else the probe's where all volumes know it. Default
   * automatic. There are AUTOMATIC, PROBE, FILE_FRAME.
   */
  vtkUltrasoundChoiceMacro(VolumeFrame);
  void SetVolumeFrameToAutomatic() { this->SetVolumeFrame(AUTOMATIC); }
  void SetVolumeFrameToProbe() { this->SetVolumeFrame(PROBE); }
  void SetVolumeFrameToFileFrame() { this->SetVolumeFrame(FILE_FRAME); }
  ///@}

  /** The point array of 16 numbers that holds the poses of the track, from the tool to the world. Default ToolToWorld. */
  vtkUltrasoundTextMacro(PoseArray);

  /** Unit of the recording's lengths; 1000: metres. 0: as the file says. In [0, 1000000] mm; default 0. */
  vtkUltrasoundNumberMacro(RecordingUnitMm);

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
  /** What the kernel has to know of a volume. */
  static echorama::TrackedVolume TrackedVolumeOf(vtkImageData* image, const std::string& name);
#endif

protected:
  vtkUltrasoundTrackerPlacement();
  ~vtkUltrasoundTrackerPlacement() override;

  int FillInputPortInformation(int port, vtkInformation* info) override;
#ifndef __VTK_WRAP__
  void Execute(vtkInformationVector** inputs, vtkInformationVector* outputs, const echorama::Progress& progress) override;
#endif

  char* Recording = nullptr;
  char* CalibrationFile = nullptr;
  double VolumeToSensor[16];
  double ErrorMm;

private:
  vtkUltrasoundTrackerPlacement(const vtkUltrasoundTrackerPlacement&) = delete;
  void operator=(const vtkUltrasoundTrackerPlacement&) = delete;

  void Forget();

  std::string Notes;
#ifndef __VTK_WRAP__
  echorama::ToolTrack Track(vtkInformationVector* input) const;
  echorama::VolumeCalibration Calibration(const std::string& sensor) const;

  enum class Frame { Automatic, Probe, File };
  Frame VolumeFrame = Frame::Automatic;
  std::string Tool, PoseArray = "ToolToWorld";
  echorama::PoseLogOptions RecordingOptions;
  echorama::TrackerPlacementParameters Values;
  std::vector<echorama::Pose> Poses;
#endif
};

#endif
