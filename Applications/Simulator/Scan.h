// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Filters/Live/SkinWalk.h"
#include "LiveScanner.h"
#include "Message.h"
#include <memory>
#include <optional>
#include <QElapsedTimer>
#include <QObject>
#include <QPointer>
#include <QStringList>
#include <vtkImageData.h>
#include <vtkPolyData.h>
#include <vtkSmartPointer.h>

namespace echorama {

class Job;
class Redraw;

/// What is scanned: volumes or the tissue of a scene, and the skin that the probe is on.
struct Subject {
  QStringList files;
  std::vector<vtkSmartPointer<vtkImageData>> volumes; ///< where several are real, the first counts
  vtkSmartPointer<vtkPolyData> tissue;                ///< nullptr: volumes
  std::vector<vtkSmartPointer<vtkImageData>> pressed; ///< states of it under a probe that presses (ReadPressedStates)
  vtkSmartPointer<vtkPolyData> skin;                  ///< nullptr: there is none
  std::shared_ptr<const SkinMesh> mesh;               ///< of the skin, to walk on
  QString whyNoSkin;
  std::optional<Pose> start;                    ///< where it was scanned from, if that is known
  Eigen::Vector3d up = Eigen::Vector3d::Zero(); ///< from where it is scanned instead; zero: nobody says
  QByteArray sum;                               ///< of what was read (ScanLog.h): a recording says what it is of

  bool IsEmpty() const { return volumes.empty() && !tissue; }
};

/// Reads volumes, or one scene (.json), and makes the skin of the first volume or takes the outermost body; or reads \a skin when
/// it names a mesh. For a Job. A volume without a skin can be scanned by a tracker all the same. \throws Error that names file
/// and reason; Error(Cancelled).
Subject ReadSubject(const QStringList& files, const QString& skin, const Progress& progress);

/// A probe on a body: where it is, what it sees, and what is the matter. The window's parts share one; it knows no widget.
class Scan : public QObject {
  Q_OBJECT

public:
  explicit Scan(QObject* parent = nullptr);
  ~Scan() override;

  void SetSubject(Subject subject);
  /// From now on the body gives way to a probe that is pressed in, as these states of it say; none: it does not.
  void SetPressed(std::vector<vtkSmartPointer<vtkImageData>> states);
  const Subject& Body() const { return subject_; }
  bool HasSkin() const { return walk_ != nullptr; }

  ///@{ The probe on the skin. Keys and mouse; nothing while a tracker leads.
  void Slide(double alongMm, double acrossMm);
  void SlideInWorld(const Eigen::Vector3d& by);
  void PlaceWhereHit(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction);
  void Hold(double tiltDegrees, double rockDegrees); ///< adds
  void Rotate(double degrees);
  void Press(double mm); ///< adds; below 0 the probe is lifted off
  /// Upright, without pressure.
  void Straighten();
  /// Back to the middle of the top. One that is turned from outside stays turned.
  void PlaceAtTop();
  /// As it was at first: nothing is left of where the probe has been. One that a tracker moves stays where it is held, one that
  /// is turned from outside as it is turned.
  void Restart();
  /// Where Restart() puts the probe, or where a tracked one had to be.
  Pose StartPose() const;
  const ProbeHold& Held() const { return hold_; }
  ///@}

  ///@{ A pose that comes from outside. What is not a finite rigid pose is refused, and shown as a state.
  void Follow(const Eigen::Matrix4d& probeToWorld);
  /// An orientation that comes from outside: the probe stays where keys and mouse put it on the skin, and is turned like this.
  void Turn(const Eigen::Matrix3d& probeToWorld);
  /// Neither pose nor orientation comes any more.
  void StopFollowing();
  bool IsFollowing() const { return isFollowing_; }
  bool IsTurned() const { return turned_.has_value(); }
  /// No pose has come for so many seconds, and why ("": the tracker has stopped): the image is of then. Below 0: poses come.
  void SetStopped(double seconds, const QString& why = {});
  ///@}

  /// A needle in the image, from now on; none: there is none.
  void SetNeedle(const std::optional<Needle>& needle);

  const Pose& ProbeToWorld() const { return probeToWorld_; }
  /// Where keys and mouse have, or had, the probe.
  Pose PoseOnSkin() const { return walk_ ? walk_->PoseOf(hold_) : probeToWorld_; }
  /// Unit, out of the body, at the top of the skin.
  Eigen::Vector3d Up() const { return up_; }
  /// Unit, out of the body, where the probe is.
  Eigen::Vector3d SkinNormal() const { return walk_ ? walk_->Normal() : up_; }

  ///@{ Controls.
  LiveScanner& Scanner() { return scanner_; }
  void SetControl(const char* name, const std::string& text);
  /// Exchanges left and right, also of an image that is frozen.
  void SetFlipped(bool flipped);
  bool IsFlipped() const { return isFlipped_; }
  ///@}

  ///@{ Freeze, and what was seen in the last seconds.
  void SetFrozen(bool frozen);
  bool IsFrozen() const { return isFrozen_; }
  /// Whether a picture is made in the background: what is asked of the scanner ends that.
  bool IsMaking() const;
  /// Whether the newest image could not be made: what is shown is the one before.
  bool HasFailed() const { return !failure_.isEmpty(); }
  const CineLoop& Cine() const { return cine_; }
  /// Frozen: shows this one.
  void ShowCine(int index);
  int CineIndex() const { return cineIndex_; }
  /// Puts other frames of this body in place of what was seen, and freezes.
  void Replay(const std::vector<ScanFrame>& frames);
  ///@}

  /// The frame that is shown.
  const ScanFrame& Frame() const { return frame_; }
  const PlanePicture& Picture() const { return picture_; }
  /// What would be seen from elsewhere, with the controls of the frame that is shown.
  /// \throws as LiveScanner::Make
  PlanePicture PictureFrom(const Pose& probeToWorld);
  /// What is the matter, a sentence; "" when nothing is.
  QString State() const;
  bool IsStale() const;
  double FramesPerSecond() const;
  /// From the newest motion to the image, ms. NaN before the first.
  double LatencyMs() const { return latencyMs_; }
  /// Makes what waits to be made, now; a picture by the acoustic model is begun.
  void MakeNow();

signals:
  void SubjectChanged();
  void PoseWanted(); ///< an image is about to be made: whoever leads the probe says where it is by now
  void ProbeMoved();
  void ControlsChanged();
  void FrameMade(); ///< whoever shows it does so at once: the time until then is the latency
  void StateChanged();
  void FrozenChanged(bool frozen);
  void Said(const Message& message);

private:
  void PutAtTop();
  void ChooseDepth();
  void TakeTop();
  void Moved();
  void TakePose(const Pose& pose);
  void Ask();
  void MakeSlowly(ScanFrame frame);
  void StopSlow();
  void Make(const ScanFrame& frame, bool isNew);
  void Show(const ScanFrame& frame, bool isNew, const QString& failure, double askedAt);
  double Now() const { return 1e-9 * static_cast<double>(clock_.nsecsElapsed()); } ///< seconds
  bool IsInAir() const;
  void PressTissue();
  bool CanWalk() const { return walk_ && !isFollowing_; }

  Subject subject_;
  LiveScanner scanner_;
  std::unique_ptr<SkinWalk> walk_;
  ProbeHold hold_;
  Pose probeToWorld_ = Pose::Identity();
  std::optional<Eigen::Matrix3d> turned_; ///< from outside
  Eigen::Vector3d up_ = -Eigen::Vector3d::UnitY();
  std::optional<Needle> needle_;
  double chosenDepthMm_ = 0.0; ///< for the body; 0: as usual for the probe
  bool isFollowing_ = false, isFrozen_ = false, isFlipped_ = false;
  double stoppedSeconds_ = -1.0, jumpMm_ = 0.0, jumpAt_ = -1e9, followedAt_ = -1e9;
  QString whyStopped_, badPose_, failure_, shownState_;

  Redraw* redraw_;
  QElapsedTimer clock_;
  double askedAt_ = 0.0, triedAt_ = 0.0, latencyMs_;
  ScanFrame frame_;
  std::int64_t number_ = 0;
  PlanePicture picture_;
  CineLoop cine_;
  int cineIndex_ = -1;
  std::shared_ptr<const ScanSettings> settingsBefore_; ///< the freeze
  bool isReplay_ = false;

  // The acoustic model: a picture that is made in the background.
  QPointer<Job> slow_;
  int refinement_ = 0;       ///< of the next one; 0 since something changed
  bool slowIsCoarse_ = true; ///< the first since then
  bool isAskedAgain_ = false;

  std::deque<double> madeAt_;
};

} // namespace echorama
