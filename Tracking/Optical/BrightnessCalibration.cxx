// SPDX-License-Identifier: BSD-3-Clause
// Brightness varies by ratios (falloff of the lens, distance), so logarithms are averaged.
#include "BrightnessCalibration.h"
#include <algorithm>
#include <cmath>

namespace echorama {

namespace {

// Over the brightness and size of a touching light: below the low peak or above the high size it hovers; above the high peak and
// below the low size it touches again.
constexpr double LowPeak = 0.55, HighPeak = 0.7;
constexpr double LowSize = 1.25, HighSize = 1.4;

} // namespace

BrightnessCalibration BrightnessCalibration::Fit(const std::vector<ContactSample>& samples, int width, int height, int columns,
                                                 int rows)
{
  if (samples.empty())
    throw Error(Error::Kind::BadInput, "a brightness calibration needs lights that touched the skin; there are none");
  if (width < 2 || height < 2 || columns < 2 || rows < 2 || columns > 1000 || rows > 1000)
    throw Error(Error::Kind::InvalidParameter, "a brightness calibration needs 2 x 2 pixels and 2 x 2 nodes at least");
  for (const ContactSample& s : samples)
    if (!(s.peak > 0.0 && s.size > 0.0 && s.position.allFinite() && std::isfinite(s.peak) && std::isfinite(s.size)))
      throw Error(Error::Kind::BadInput, "a light of a brightness calibration has no brightness, size or place");
  BrightnessCalibration result;
  result.columns = columns;
  result.rows = rows;
  result.width = width;
  result.height = height;
  const Eigen::Vector2d cell((width - 1.0) / (columns - 1), (height - 1.0) / (rows - 1));
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column) {
      const Eigen::Vector2d node(column * cell.x(), row * cell.y());
      double nearest = HUGE_VAL;
      for (const ContactSample& s : samples)
        nearest = std::min(nearest, (s.position - node).norm());
      const double radius = std::max(0.5 * cell.mean(), nearest);
      double sum = 0.0, peak = 0.0, size = 0.0;
      for (const ContactSample& s : samples) {
        const double weight = std::exp(-0.5 * (s.position - node).squaredNorm() / (radius * radius));
        sum += weight;
        peak += weight * std::log(s.peak);
        size += weight * std::log(s.size);
      }
      result.peak.push_back(std::exp(peak / sum));
      result.size.push_back(std::exp(size / sum));
    }
  return result;
}

ContactSample BrightnessCalibration::At(const Eigen::Vector2d& position) const
{
  ContactSample at;
  at.position = position;
  if (Empty())
    return at;
  const double x = std::clamp(position.x() / (width - 1.0), 0.0, 1.0) * (columns - 1),
               y = std::clamp(position.y() / (height - 1.0), 0.0, 1.0) * (rows - 1);
  const int left = std::min(static_cast<int>(x), columns - 2), top = std::min(static_cast<int>(y), rows - 2);
  const double ofRight = x - left, ofBottom = y - top;
  const auto between = [&](const std::vector<double>& values) {
    const auto node = [&](int column, int row) { return values[static_cast<std::size_t>(row * columns + column)]; };
    return (1.0 - ofBottom) * ((1.0 - ofRight) * node(left, top) + ofRight * node(left + 1, top)) +
           ofBottom * ((1.0 - ofRight) * node(left, top + 1) + ofRight * node(left + 1, top + 1));
  };
  at.peak = between(peak);
  at.size = between(size);
  return at;
}

Touch JudgeTouch(const Spot& spot, const BrightnessCalibration& calibration, Touch before)
{
  if (calibration.Empty())
    return Touch::Unknown;
  const ContactSample touching = calibration.At(spot.position);
  const double peak = spot.peak / touching.peak, size = spot.size / touching.size;
  if (before == Touch::Contact)
    return peak < LowPeak || size > HighSize ? Touch::Hover : Touch::Contact;
  return peak > HighPeak && size < LowSize ? Touch::Contact : Touch::Hover;
}

} // namespace echorama
