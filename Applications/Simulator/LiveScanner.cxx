// SPDX-License-Identifier: BSD-3-Clause
#include "LiveScanner.h"
#include "AlgorithmRun.h"
#include "Core/Base/Error.h"
#include "Messages.h"
#include <set>
#include <vtkDataArray.h>
#include <vtkImageData.h>
#include <vtkMatrix4x4.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkUltrasoundAcquisition.h>
#include <vtkUltrasoundVolume.h>

namespace echorama {

namespace {

// What belongs to the frame and not to the controls, and what is not to change under a window.
const std::set<std::string> OfFrame = {"Position",    "Orientation", "Frame",     "Flip",
                                       "BeamsOutput", "Needle",      "NeedleTip", "NeedleDirection"};

const unsigned char* BytesOf(vtkImageData* image, const char* name)
{
  vtkDataArray* array = image->GetPointData()->GetArray(name);
  return array ? static_cast<const unsigned char*>(array->GetVoidPointer(0)) : nullptr;
}

} // namespace

LiveScanner::LiveScanner() = default;

void LiveScanner::SetInputs(const std::vector<vtkSmartPointer<vtkImageData>>& volumes, vtkPolyData* tissue)
{
  live_->RemoveAllInputConnections(0);
  live_->RemoveAllInputConnections(1);
  for (const auto& volume : volumes)
    live_->AddInputDataObject(0, volume);
  if (tissue)
    live_->SetInputDataObject(1, tissue);
  live_->SetSource(tissue ? vtkUltrasoundLiveImage::SCENE : vtkUltrasoundLiveImage::VOLUMES);
  settings_.reset();
}

void LiveScanner::SetPressed(const std::vector<vtkSmartPointer<vtkImageData>>& states)
{
  if (beforeUse_)
    beforeUse_();
  live_->RemoveAllPressStates();
  for (const auto& state : states)
    live_->AddPressStateData(state);
}

void LiveScanner::Set(const char* name, const std::string& text)
{
  if (beforeUse_)
    beforeUse_();
  const Messages::OfThread messages;
  needleControls_.reset();
  live_->SetParameterAsText(name, text.c_str());
  messages.ThrowErrors();
  settings_.reset();
}

void LiveScanner::Take(const ScanSettings& settings)
{
  for (const auto& [name, text] : settings)
    Set(name.c_str(), text);
}

std::shared_ptr<const ScanSettings> LiveScanner::Settings()
{
  if (!settings_) {
    ScanSettings settings;
    for (const Parameter& parameter : live_->Parameters())
      if (OfFrame.count(parameter.name) == 0)
        settings.emplace_back(parameter.name, parameter.Text());
    settings_ = std::make_shared<const ScanSettings>(std::move(settings));
  }
  return settings_;
}

void LiveScanner::Prepare(const ScanFrame& frame)
{
  const Messages::OfThread messages;
  if (frame.settings && frame.settings != Settings()) {
    Take(*frame.settings);
    settings_ = frame.settings;
  }
  vtkNew<vtkMatrix4x4> pose;
  vtkUltrasoundVolume::SetMatrix(pose, frame.probeToWorld);
  live_->SetProbeToWorld(pose);
  live_->SetFrame(frame.number);
  live_->SetFlip(frame.isFlipped);
  SetNeedle(frame.needle);
  messages.ThrowErrors();
}

void LiveScanner::Work(const Progress& progress)
{
  Update(live_, progress);
}

void LiveScanner::Keep()
{
  image_->ShallowCopy(live_->GetOutput()); // whose arrays are new with each image
  state_ = live_->GetState();
  contactShare_ = live_->GetContactShare();
  hardMaterial_ = live_->GetHardMaterial();
  needleState_ = live_->GetNeedleState();
  isTipInPlane_ = live_->GetNeedleTipInPlane();
  tipOffPlaneMm_ = live_->GetNeedleTipOffPlaneMm();
  markedTip_.reset();
  const auto pose = vtkUltrasoundAcquisition::ProbeToWorldOf(image_);
  if (needleState_ != vtkUltrasoundLiveImage::NO_NEEDLE && ShowsTip() && isTipInPlane_ && pose) {
    const Eigen::Vector3d tip = pose->inverse() * Eigen::Map<const Eigen::Vector3d>(live_->GetNeedleTip());
    markedTip_ = QPointF(tip[0], tip[2]);
  }
}

void LiveScanner::Make(const ScanFrame& frame)
{
  Prepare(frame);
  Work({});
  Keep();
}

const LiveScanner::NeedleControls& LiveScanner::OfNeedle() const
{
  if (!needleControls_)
    needleControls_ = NeedleControls{live_->GetNeedleStops(), live_->GetNeedleShowTip(), live_->GetNeedleLengthMm()};
  return *needleControls_;
}

void LiveScanner::SetNeedle(const std::optional<Needle>& needle)
{
  live_->SetNeedle(needle.has_value());
  if (needle) {
    live_->SetNeedleTip(needle->tip[0], needle->tip[1], needle->tip[2]);
    live_->SetNeedleDirection(needle->direction[0], needle->direction[1], needle->direction[2]);
  }
}

double LiveScanner::AdvanceNeedle(const Needle& needle, double mm, double stepMm)
{
  if (!OfNeedle().stops)
    return mm; // and a picture in the background goes on
  if (beforeUse_)
    beforeUse_();
  const Messages::OfThread messages;
  SetNeedle(needle);
  const double moved = live_->AdvanceNeedle(mm, stepMm);
  messages.ThrowErrors();
  return moved;
}

ProbeGeometry LiveScanner::Probe() const
{
  return vtkUltrasoundAcquisition::ProbeGeometryOf(image_).value_or(ProbeGeometry());
}

QPolygonF LiveScanner::Fan() const
{
  constexpr int steps = 48;
  const ProbeGeometry probe = Probe();
  QPolygonF fan;
  const auto add = [&](double depth, double across) {
    const Eigen::Vector3d at = PointOf(probe, {depth, across, 0.0});
    fan.append({at[0], at[2]});
  };
  for (int i = 0; i <= steps; i++)
    add(probe.depthMin, static_cast<double>(i) / steps - 0.5);
  for (int i = steps; i >= 0; i--)
    add(probe.depthMax, static_cast<double>(i) / steps - 0.5);
  return fan;
}

PlanePicture LiveScanner::Picture() const
{
  PlanePicture picture;
  const auto pose = vtkUltrasoundAcquisition::ProbeToWorldOf(image_);
  const unsigned char *grey = BytesOf(image_, vtkUltrasoundVolume::IntensityName()),
                      *valid = BytesOf(image_, vtkUltrasoundVolume::ValidRegionName()),
                      *label = BytesOf(image_, vtkUltrasoundVolume::EmbeddingName());
  if (!grey || !valid || !pose)
    return picture;
  const ImageGeometry geometry = vtkUltrasoundVolume::GeometryOf(image_);
  const Eigen::Vector3d first = pose->inverse() * geometry.origin;
  picture.probeToWorld = *pose;
  picture.isFlipped = geometry.direction.col(0).dot(pose->linear().col(0)) < 0.0;
  picture.pixel = {geometry.spacing[0], geometry.spacing[1]};
  const double before = picture.isFlipped ? geometry.dimensions[0] - 0.5 : 0.5; // pixels from the left corner to the first
  picture.topLeft = {first[0] - before * geometry.spacing[0], first[2] - 0.5 * geometry.spacing[1]};
  picture.fan = Fan();
  picture.image = QImage(geometry.dimensions[0], geometry.dimensions[1], QImage::Format_ARGB32);
  std::ptrdiff_t i = 0;
  for (int y = 0; y < geometry.dimensions[1]; y++) {
    auto* row = reinterpret_cast<QRgb*>(picture.image.scanLine(y));
    for (int x = 0; x < geometry.dimensions[0]; x++, i++) {
      const int level = grey[i];
      if (valid[i] == 0)
        row[x] = 0;
      else if (label && label[i] >= 2) // both kinds that hold what nobody measured
        row[x] = qRgb(level, level * 3 / 4, level / 3);
      else
        row[x] = qRgb(level, level, level);
    }
  }
  return picture;
}

} // namespace echorama
