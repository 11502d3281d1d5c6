// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Geometry/ToolPose.h"
#include "Core/Base/Utf8.h"
#include <string_view>

namespace echorama {

namespace {

// What the key of a line "key = value" cannot hold becomes "_". Letters beyond ASCII stay: else two tools could become one.
std::string PlainName(std::string_view name)
{
  std::string clean;
  while (!name.empty()) {
    const std::size_t size = PrintableUtf8(name);
    const char c = name[0];
    const bool plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '.' || c == '-';
    if (size > 1 || plain)
      clean += name.substr(0, size);
    else
      clean += '_';
    name.remove_prefix(size == 0 ? 1 : size);
  }
  return clean;
}

// As the name of a frame, at which FramesOf cuts nothing: a "To" that no small letter follows becomes "TO".
std::string Uncut(std::string frame)
{
  if (!frame.empty() && frame[0] >= 'a' && frame[0] <= 'z')
    frame[0] = static_cast<char>(frame[0] - 'a' + 'A');
  for (std::size_t at = frame.find("To"); at != std::string::npos; at = frame.find("To", at + 2))
    if (at + 2 == frame.size() || frame[at + 2] < 'a' || frame[at + 2] > 'z')
      frame[at + 1] = 'O';
  return frame;
}

} // namespace

std::string ToolTransformName(const std::string& name)
{
  const std::string clean = PlainName(name);
  if (const auto frames = FramesOf(clean)) {
    const std::string whole = frames->first + "To" + frames->second;
    return FramesOf(whole) == frames ? whole : Uncut(frames->first) + "To" + Uncut(frames->second);
  }
  return clean.empty() ? "ToolToTracker" : Uncut(clean) + "ToTracker";
}

bool NearestPose(const Eigen::Matrix4d& matrix, Pose& pose)
{
  if (!matrix.allFinite() || (matrix.row(3) - Eigen::RowVector4d(0, 0, 0, 1)).cwiseAbs().maxCoeff() > 1e-6)
    return false;
  const Eigen::Matrix3d turn = matrix.topLeftCorner<3, 3>();
  if (!IsRotation(turn, 1e-3))
    return false;
  // One already stays so to the last bit however often it is written and read.
  pose.linear() = IsRotation(turn, 1e-13) ? turn : NearestRotation(turn);
  pose.translation() = matrix.topRightCorner<3, 1>();
  pose.makeAffine();
  return true;
}

} // namespace echorama
