// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Progress.h"
#include "ImageView.h"
#include "ScanFrame.h"
#include <functional>
#include <optional>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkSmartPointer.h>
#include <vtkUltrasoundLiveImage.h>

class vtkPolyData;

namespace echorama {

/// Makes the image of a frame, and keeps the controls.
class LiveScanner {
public:
  LiveScanner();

  /// Volumes; or tissue (vtkUltrasoundTissue), which is drawn live unless the acoustic model is asked for.
  void SetInputs(const std::vector<vtkSmartPointer<vtkImageData>>& volumes, vtkPolyData* tissue);
  /// States of tissue that a probe presses, see vtkUltrasoundLiveImage; none: it does not give way.
  void SetPressed(const std::vector<vtkSmartPointer<vtkImageData>>& states);
  bool IsAcoustic() const { return live_->GetSource() == vtkUltrasoundLiveImage::ACOUSTIC; }
  static constexpr int Refinements = ProgressiveSlice::levels; ///< of the acoustic model
  ParameterList Parameters() { return live_->Parameters(); }
  /// \throws Error(InvalidParameter)
  void Set(const char* name, const std::string& text);
  /// \throws Error(InvalidParameter) that names the control; those before it are set
  void Take(const ScanSettings& settings);
  /// The controls as they are now; the same object until one changes.
  std::shared_ptr<const ScanSettings> Settings();

  /// Makes the image of \a frame, with its settings if it has some.
  /// \throws Error(InvalidParameter) for a pose that is not rigid and finite, Error(BadInput) for a volume that cannot be used
  void Make(const ScanFrame& frame);

  /// How far a needle can go on along its axis, at most \a mm, until bone stops it, if NeedleStops is on. Below 0: back out.
  /// What is thinner than \a stepMm may be missed. \throws Error(BadInput) when it cannot be told
  double AdvanceNeedle(const Needle& needle, double mm, double stepMm = 0.25);

  ///@{ The same in three steps, for an image that takes longer than a window may wait. The second may run on another thread;
  /// until it has ended nothing may be set or made, and all below still tells of the image before.
  void Prepare(const ScanFrame& frame);
  /// \throws also Error(Cancelled)
  void Work(const Progress& progress);
  void Keep();
  /// Called before anything is set or asked that must not meet with Work().
  void BeforeUse(std::function<void()> call) { beforeUse_ = std::move(call); }
  ///@}

  ///@{ Of the last one.
  vtkImageData* Output() const { return image_; }
  int State() const { return state_; }
  int NeedleState() const { return needleState_; }
  bool TipInPlane() const { return isTipInPlane_; }
  double TipOffPlaneMm() const { return tipOffPlaneMm_; }
  bool ShowsTip() const { return OfNeedle().showsTip; }
  double NeedleLengthMm() const { return OfNeedle().lengthMm; }
  double ContactShare() const { return contactShare_; }
  /// What the probe stands in, if no probe can be there: bone and its like.
  const std::string& HardMaterial() const { return hardMaterial_; }
  /// Where the needle's tip is marked, if it may be, and is in the image: mm in the plane.
  const std::optional<QPointF>& MarkedTip() const { return markedTip_; }
  /// Grey, with what embedding invented in colour; transparent where nothing is seen.
  PlanePicture Picture() const;
  ///@}
  /// The probe as it images: of the last image.
  ProbeGeometry Probe() const;
  double FocusMm() const { return live_->GetFocusMm(); }

private:
  /// Controls that are asked for with each pose, as each question to the image lists all of its parameters.
  struct NeedleControls {
    bool stops, showsTip;
    double lengthMm;
  };
  const NeedleControls& OfNeedle() const;
  void SetNeedle(const std::optional<Needle>& needle);
  QPolygonF Fan() const;

  vtkNew<vtkUltrasoundLiveImage> live_;
  vtkNew<vtkImageData> image_;
  int state_ = vtkUltrasoundLiveImage::NO_VOLUME;
  double contactShare_ = 1.0;
  std::string hardMaterial_;
  int needleState_ = vtkUltrasoundLiveImage::NO_NEEDLE;
  bool isTipInPlane_ = false;
  double tipOffPlaneMm_ = 0.0;
  std::optional<QPointF> markedTip_;
  std::function<void()> beforeUse_;
  std::shared_ptr<const ScanSettings> settings_;
  mutable std::optional<NeedleControls> needleControls_; ///< nothing: since one was set, nobody has asked
};

} // namespace echorama
