// SPDX-License-Identifier: BSD-3-Clause
// The room's light through the skin is some ten grey levels, so what is left of rounding matters: the mean is stretched before it
// is read. That changes no contrast but by the camera's own grey of darkness, which is in both cells of a pair.
#include "Tracking/Devices/MountedShell.h"
#include "Core/Base/Error.h"
#include "Core/Base/FormatText.h"
#include <algorithm>
#include <cctype>
#include <cmath>
#include <utility>

namespace echorama {
namespace {

constexpr int LeastFrames = 32; // of a try
constexpr double BrightShare = 0.99, BrightLevel = 220.0;

} // namespace

MountedShell::MountedShell(const FisheyeLens& lens, int turnFrames)
  : lens_(lens), turnFrames_(turnFrames), turns_((LeastFrames + turnFrames - 1) / std::max(turnFrames, 1))
{
  lens_.Check();
  if (turnFrames < 1)
    throw Error(Error::Kind::InvalidParameter, "a turn of the lights' code has no frame");
  Begin();
}

int MountedShell::TurnFrames(const BlinkCode& code, double slotMs, double frameMs)
{
  return std::max(1, static_cast<int>(std::ceil(code.Length() * slotMs / frameMs - 1e-6)));
}

void MountedShell::Begin()
{
  const std::size_t size = static_cast<std::size_t>(lens_.width) * static_cast<std::size_t>(lens_.height);
  frames_ = 0;
  darkest_.assign(size, 255);
  sum_.assign(size, 0);
}

std::optional<ShellMarkerReading> MountedShell::Add(const GreyFrame& frame)
{
  if (tries_ == Tries)
    return std::nullopt;
  if (frame.width != lens_.width || frame.height != lens_.height) {
    Begin();
    return std::nullopt;
  }
  std::size_t i = 0;
  for (int y = 0; y < frame.height; ++y)
    for (int x = 0; x < frame.width; ++x, ++i)
      darkest_[i] = std::min(darkest_[i], frame(x, y));
  if (++frames_ % turnFrames_ != 0)
    return std::nullopt;
  for (i = 0; i < sum_.size(); ++i)
    sum_[i] += std::exchange(darkest_[i], std::uint8_t{255});
  if (frames_ < turns_ * turnFrames_)
    return std::nullopt;
  ShellMarkerReading reading = Read();
  isUnclear_ = isUnclear_ || reading.status == ShellMarkerReading::Status::Unclear;
  ++tries_;
  if (reading.status == ShellMarkerReading::Status::Read) {
    tries_ = Tries;
    return reading;
  }
  Begin();
  if (tries_ < Tries)
    return std::nullopt;
  reading.status = isUnclear_ ? ShellMarkerReading::Status::Unclear : ShellMarkerReading::Status::Absent;
  return reading;
}

ShellMarkerReading MountedShell::Read() const
{
  std::vector<std::uint32_t> sorted = sum_; // a share that hot pixels do not reach
  const auto bright = sorted.begin() + static_cast<std::ptrdiff_t>(BrightShare * static_cast<double>(sorted.size() - 1));
  std::nth_element(sorted.begin(), bright, sorted.end());
  const double gain = BrightLevel / std::max<double>(*bright, turns_);
  std::vector<std::uint8_t> mean(sum_.size());
  std::transform(sum_.begin(), sum_.end(), mean.begin(),
                 [gain](std::uint32_t sum) { return static_cast<std::uint8_t>(std::min(gain * sum + 0.5, 255.0)); });
  return ReadShellMarker(GreyFrame::Mono(mean.data(), lens_.width, lens_.height), lens_);
}

std::string ShellNameOf(const ShellMarkerReading& marker)
{
  return Format("%06X", marker.id);
}

bool IsNameOf(const std::string& name, const ShellMarkerReading& marker)
{
  const std::string its = ShellNameOf(marker);
  return std::equal(name.begin(), name.end(), its.begin(), its.end(),
                    [](unsigned char a, unsigned char b) { return std::toupper(a) == b; });
}

} // namespace echorama
