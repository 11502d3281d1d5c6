// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Progress.h"
#include "ImageView.h"
#include "ScanFrame.h"
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

  ///@{ The same in three steps, for an image that takes longer than a window may wait. The second may run on another thread;
  /// until it has ended nothing may be set or made, and all below still tells of the image before.
  void Prepare(const ScanFrame& frame);
  /// \throws also Error(Cancelled)
  void Work(const Progress& progress);
  void Keep();
  ///@}

  ///@{ Of the last one.
  vtkImageData* Output() const { return image_; }
  int State() const { return state_; }
  double ContactShare() const { return contactShare_; }
  /// What the probe stands in, if no probe can be there: bone and its like.
  const std::string& HardMaterial() const { return hardMaterial_; }
  /// Grey, with the labels of what embedding invented in colour if \a showInvented; transparent where nothing is seen.
  PlanePicture Picture(bool showInvented) const;
  ///@}
  /// The probe as it images: of the last image.
  ProbeGeometry Probe() const;
  double FocusMm() const { return live_->GetFocusMm(); }

private:
  QPolygonF Fan() const;

  vtkNew<vtkUltrasoundLiveImage> live_;
  vtkNew<vtkImageData> image_;
  int state_ = vtkUltrasoundLiveImage::NO_VOLUME;
  double contactShare_ = 1.0;
  std::string hardMaterial_;
  std::shared_ptr<const ScanSettings> settings_;
};

} // namespace echorama
