// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class vtkUltrasoundTrackerSource
 * @brief where the tools of a tracker are: live, replayed or simulated
 *
 * No input. A device, named by one line (see Device), puts timed poses into a stream from a thread of its own; each update shows
 * what the stream holds at that moment.
 *
 * Output 0: a vtkPolyData with one point per tool, the origin of its frame of coordinates in the world (mm). A tool whose pose is
 * valid has a vertex; any other has a point without a cell, so that it is not drawn. Arrays as in the track of
 * vtkUltrasoundSequenceReader:
 *
 * | array               | values                                                                                |
 * | ------------------- | ------------------------------------------------------------------------------------- |
 * | Tool                | point: an index into the field data ToolNames                                         |
 * | TimeStamp           | point: seconds on the sender's clock (NaN: none)                                      |
 * | ToolToWorld         | point: 16 numbers, row by row; identity when nothing is known                         |
 * | Status              | point: 0 valid, 1 missing, 2 out of range: not to be trusted                          |
 * | XAxis, YAxis, ZAxis | point: where the tool's axes point in the world, unit vectors                         |
 * | ToolNames           | field: strings, "Probe" of ProbeToTracker; in the order of bytes                      |
 * | WorldFrame          | field: a string                                                                       |
 *
 * Output 1: the newest image of the device, with `Intensity`, `ValidRegion`, `TimeStamp` and `ImageToWorld` where transforms lead
 * from the image to the world; otherwise it lies where the sender puts it. Colours become grey. Empty when there is none.
 *
 * Output 2: the axes of the tools that are valid, to be looked at: a vtkPolyData with three lines of AxisLengthMm per tool, from
 * the origin of its frame along x, y and z, with the cell arrays Tool (as above) and Axis (0, 1, 2).
 *
 * A live pose that is older than FreshSeconds is missing: what stands still is not shown as if it were live. When a device cannot
 * be opened there is an error that names it and the reason, and all outputs are empty; what goes wrong later is told by
 * GetState() and GetMessage().
 *
 * As a live source of ParaView it is asked by GetNeedsUpdate() every 40 ms. In a script, call that (or Modified()) before
 * Update(), and WaitForPoses() to wait for what is to come.
 *
 * @sa vtkUltrasoundSequenceReader, echorama::PoseStream, echorama::LiveTransforms
 */
#ifndef vtkUltrasoundTrackerSource_h
#define vtkUltrasoundTrackerSource_h

#include "EchoramaTrackingModule.h"
#include "vtkPolyDataAlgorithm.h"
#include "vtkUltrasoundParameters.h"

#include "vtkSmartPointer.h"

#include <memory> // for what is open
#include <string> // for texts

#ifndef __VTK_WRAP__
#include "Tracking/Devices/FusedTracker.h"
#include "Tracking/Stream/LiveTransforms.h"
#include "Tracking/Stream/StreamRecorder.h"
#include <functional>
#endif

class vtkMatrix4x4;
class vtkPolyData;

class ECHORAMATRACKING_EXPORT vtkUltrasoundTrackerSource : public vtkPolyDataAlgorithm {
public:
  static vtkUltrasoundTrackerSource* New();
  vtkTypeMacro(vtkUltrasoundTrackerSource, vtkPolyDataAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  ///@{
  /**
   * The tracker, in one line: "igtl://localhost:18944", "replay:log.igs.mha?speed=2", "simulated:?rate=100&noiseMm=0.5" ...;
   * GetDeviceKinds() lists what there is. Another one closes the present one. Default: none.
   */
  void SetDevice(const char* device);
  const char* GetDevice() const { return this->Device.c_str(); }
  static std::string GetDeviceKinds();
  ///@}

  ///@{
  /**
   * Whether the device is opened with the next update. Off closes it; what has come stays. Start() opens it at once and
   * returns whether that went well. Default: on.
   */
  void SetActive(bool active);
  vtkGetMacro(Active, bool);
  vtkBooleanMacro(Active, bool);
  bool Start();
  void Stop() { this->SetActive(false); }
  ///@}

  ///@{
  /**
   * Fixed transforms, such as ImageToProbe: a configuration of the Plus toolkit (XML) or our JSON. One that the device sends
   * too is that of the device. Default: none.
   */
  void SetTransformFile(VTK_FILEPATH const char* fileName);
  VTK_FILEPATH const char* GetTransformFile() const { return this->TransformFile.c_str(); }
  ///@}

  ///@{
  /**
   * The moment that is shown, seconds on the sender's clock: poses are interpolated, between neighbours that are not further
   * apart than LongestGapSeconds. NaN: the newest. Default NaN.
   */
  void SetTime(double time);
  vtkGetMacro(Time, double);
  ///@}

  ///@{
  /**
   * Whether a recording (replay:) is shown at the time that the pipeline asks for, as by the animation of ParaView, instead of
   * being played: it is read at once, its times are the time steps of this source, and Time is ignored. Of no meaning for other
   * devices. Default: off.
   */
  void SetFollowTime(bool follow);
  vtkGetMacro(FollowTime, bool);
  vtkBooleanMacro(FollowTime, bool);
  ///@}

  /**
   * Whether something has come (or has become too old) since the last update; then this is Modified() too. What ParaView calls.
   */
  bool GetNeedsUpdate();

  /**
   * Opens the device if it is not open, and waits until so many poses, of all tools together, have come since then, or for
   * \a seconds. Returns false when they have not: also at once when the device is at its end or has failed.
   */
  bool WaitForPoses(int count, double seconds);

  /** The next poses of a recording that is to be stepped (replay:FILE?step=1). Returns false when there are no more. */
  bool Step();

  ///@{
  /**
   * What the device is doing: "idle", "connecting", "running", "lost", "ended" or "failed"; and a sentence about it.
   */
  std::string GetState() const;
  std::string GetMessage() const;
  ///@}

  /** All statistics, as JSON (echorama::StreamReport). Empty when nothing was opened. */
  std::string GetReport() const;

  ///@{
  /**
   * Tools that have been heard of, by the names of their transforms ("ProbeToTracker"); "" beyond.
   */
  int GetNumberOfTools() const;
  std::string GetToolName(int index) const;
  ///@}

  ///@{
  /**
   * Statistics of a tool, by its name or that of its frame ("Probe"): poses taken, rate in Hz, standard deviation of the
   * intervals in seconds, median latency in seconds (of meaning when both clocks agree; NaN in recordings and of senders without
   * times), share of poses that were not valid, and seconds since the last one. See echorama::ToolStatistics. 0 poses, and NaN,
   * of a tool that is not there.
   */
  vtkIdType GetNumberOfPoses(const char* tool) const
  {
    return static_cast<vtkIdType>(this->StatisticOf(tool, &echorama::ToolStatistics::Taken, 0.0));
  }
  double GetRate(const char* tool) const { return this->StatisticOf(tool, &echorama::ToolStatistics::rateHz); }
  double GetJitter(const char* tool) const { return this->StatisticOf(tool, &echorama::ToolStatistics::jitterSeconds); }
  double GetLatency(const char* tool) const { return this->StatisticOf(tool, &echorama::ToolStatistics::medianLatencySeconds); }
  double GetDropoutShare(const char* tool) const { return this->StatisticOf(tool, &echorama::ToolStatistics::DropoutShare); }
  double GetSecondsSinceLast(const char* tool) const
  {
    return this->StatisticOf(tool, &echorama::ToolStatistics::secondsSinceLast);
  }
  ///@}

  ///@{
  /**
   * Records every pose from now on to a sequence (.igs.mha) that a crash leaves whole up to the last half second; opens the
   * device if it is not open. A file that is there already is refused. No name, or an empty one, ends the recording, as
   * StopRecording() does. Ends when another device is set or this one is opened anew, which GetRecordingProblem() says, and with
   * the next StartRecording(): the new one begins first, so that nothing is lost between the two, and what is wrong with the
   * earlier one is an error, but does not stop it.
   * Returns false, with an error that names the reason, when it cannot be; StopRecording also when nothing was recorded. See
   * echorama::StreamRecorder.
   */
  bool StartRecording(VTK_FILEPATH const char* fileName);
  bool StopRecording();
  ///@}

  ///@{
  /**
   * Of the present recording, or of one that ended with its device: poses written, poses that came faster than that and were
   * lost, and what is wrong; empty: nothing.
   */
  vtkIdType GetNumberOfRecordedPoses() const { return static_cast<vtkIdType>(this->Recording().poses); }
  vtkIdType GetNumberOfUnrecordedPoses() const { return static_cast<vtkIdType>(this->Recording().lost); }
  std::string GetRecordingProblem() const { return this->Recording().problem; }
  ///@}

  /** How much came that was not taken: garbage, duplicates, poses that are none. GetReport() says why. */
  vtkIdType GetNumberOfRejected() const;

  ///@{
  /**
   * Any transform by its name, "ImageToReference", out of what the device sends and the fixed ones, at Time (with FollowTime,
   * at the time that is shown), with its status: 0 valid, 1 missing (the matrix is identity then), 2 out of range.
   * GetTransformError is its stated error in mm, -1 when none is stated; GetTransformMessage says why it is not valid.
   */
  int GetTransform(const char* name, vtkMatrix4x4* matrix);
  double GetTransformError(const char* name) { return this->Found(name).transform.errorMm.value_or(-1.0); }
  std::string GetTransformMessage(const char* name) { return this->Found(name).message; }
  ///@}

  ///@{
  /**
   * A fused tracker ("fused:POSITION-LINE|ORIENTATION-LINE") knows its heading by what somebody says. Align: the array, x of the
   * tool, points along a direction of the positions' world now, known to so many degrees (standard deviation). AlignBySlide: it
   * was slid along its array, towards x, in the last seconds. Both return false, with an error that names the reason, when that
   * tells nothing, or the device is none of that kind. See echorama::SurfacePoseFilter.
   */
  bool Align(double x, double y, double z, double sigmaDegrees);
  bool Align(double x, double y, double z) { return this->Align(x, y, z, 3.0); }
  bool AlignBySlide(double seconds, double sigmaDegrees);
  bool AlignBySlide(double seconds) { return this->AlignBySlide(seconds, 5.0); }
  ///@}

  /** Standard deviation of that heading, degrees; 180 before any alignment, NaN of other devices. */
  double GetHeadingSigma() const;

  ///@{
  /**
   * Of a fused tracker without a line of positions ("fused:|ORIENTATION-LINE"): where the probe is from now on, and the normal of
   * the surface there, outwards. Returns false, after an error, as Align.
   */
  bool SetPlace(double x, double y, double z, double normalX, double normalY, double normalZ);
  bool SetPlace(double x, double y, double z) { return this->SetPlace(x, y, z, 0.0, 0.0, 0.0); }
  ///@}

  ///@{
  /**
   * The surface that positions of a fused tracker lie on, triangles that are turned outwards (as by vtkUltrasoundSkin): its
   * normals correct the heading. Of its points' normals where it has them. Default: none.
   */
  void SetSkin(vtkPolyData* skin);
  vtkPolyData* GetSkin() const;
  ///@}
#ifndef __VTK_WRAP__
  void SetNormals(echorama::FusedTracker::NormalOf normals); ///< the same, for C++ that has a faster way
#endif

  // BEGIN parameters
  /**
   * The frame of coordinates that is the world. Tools that no transforms lead from to it are missing. Empty takes the frame that
   * most tools are seen in, usually Tracker. Default none.
   */
  vtkUltrasoundTextMacro(WorldFrame);

  /** The frame of coordinates that counts pixels of the image. Default Image. */
  vtkUltrasoundTextMacro(ImageFrame);

  /** Poses that lie further apart in time are not interpolated. Counts when the device is opened. In (0, 600] s; default 0.5. */
  vtkUltrasoundNumberMacro(LongestGapSeconds);

  /** A tool whose newest pose, of a live device, came longer ago is missing. In (0, 3600] s; default 1. */
  vtkUltrasoundNumberMacro(FreshSeconds);

  /** Length of the axes in output 2. At least 0 mm; default 50. */
  vtkUltrasoundNumberMacro(AxisLengthMm);

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

protected:
  vtkUltrasoundTrackerSource();
  ~vtkUltrasoundTrackerSource() override;

  int FillOutputPortInformation(int port, vtkInformation* information) override;
  int RequestInformation(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs) override;
  int RequestData(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs) override;

  bool Active = true;
  double Time;
  bool FollowTime = false;

private:
  vtkUltrasoundTrackerSource(const vtkUltrasoundTrackerSource&) = delete;
  void operator=(const vtkUltrasoundTrackerSource&) = delete;

#ifndef __VTK_WRAP__
  struct Session;
  void Open(std::shared_ptr<echorama::PoseSubscription>* subscription = nullptr);
  void Close();
  Session* Updated();
  std::string World() const;
  using Statistic = std::function<double(const echorama::ToolStatistics&)>;
  double StatisticOf(const char* name, const Statistic& value, double otherwise = std::numeric_limits<double>::quiet_NaN()) const;
  echorama::RecordingState Recording() const;
  echorama::LiveTransform Found(const char* name);
  void ReadImage(double time);
  void ChooseImage(double time);
  void ShowTools(vtkPolyData* tools, vtkPolyData* axes, double time);
  echorama::FusedTracker* Fused() const;
  bool Tell(const std::function<void(echorama::FusedTracker&)>& what);

  std::string Device, TransformFile, WorldFrame, ImageFrame = "Image";
  echorama::StreamLimits Limits;
  double FreshSeconds = echorama::LiveTransforms::defaultFreshSeconds, AxisLengthMm = 50.0;
  std::unique_ptr<Session> Opened;
  echorama::RecordingState Ended; // the recording that its device ended
  std::string Failure;            // why it could not be opened
  vtkSmartPointer<vtkPolyData> Skin;
  echorama::FusedTracker::NormalOf Normals;
#endif
};

#endif
