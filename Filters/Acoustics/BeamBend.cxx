// SPDX-License-Identifier: BSD-3-Clause
// Trilinear; the fan comes first, once for a beam, so that a sample costs four nodes.
#include "BeamBend.h"
#include "Core/Base/Error.h"
#include <algorithm>
#include <cmath>

namespace echorama {

BeamBend::BeamBend(const ProbeGeometry& probe, int depths, int beams, double acrossMm)
  : probe_(probe), depths_(depths), beams_(beams), acrossMm_(acrossMm)
{
  probe.Check();
  if (!probe.IsPlane() || depths < 2 || beams < 2 || !(acrossMm > 0.0))
    throw Error(Error::Kind::InvalidParameter,
                "the nodes of pressed tissue need a probe that does not sweep, two depths, two beams and a distance above 0");
  moves_.assign(3 * static_cast<std::size_t>(depths) * static_cast<std::size_t>(beams), Eigen::Vector3f::Zero());
}

Eigen::Vector3d BeamBend::NodePoint(std::size_t node) const
{
  const auto across = static_cast<double>(node % 3) - 1.0;
  const auto depth = static_cast<double>(node / 3 % static_cast<std::size_t>(depths_)) / (depths_ - 1);
  const auto fan = static_cast<double>(node / 3 / static_cast<std::size_t>(depths_)) / (beams_ - 1);
  Eigen::Vector3d point = PointOf(probe_, {probe_.depthMin + depth * (probe_.depthMax - probe_.depthMin), fan - 0.5, 0.0});
  point.y() += across * acrossMm_;
  return point;
}

BeamBend BeamBend::Mixed(const BeamBend& other, float part) const
{
  BeamBend mixed = *this;
  for (std::size_t i = 0; i < moves_.size(); ++i)
    mixed.moves_[i] += part * (other.moves_[i] - moves_[i]);
  return mixed;
}

Eigen::Vector3d BeamBend::At(double depthMm, double fan, double acrossMm) const
{
  const auto split = [](double place, int count, double& part) {
    place = std::clamp(place, 0.0, count - 1.0);
    const int before = std::min(static_cast<int>(place), count - 2);
    part = place - before;
    return static_cast<std::size_t>(before);
  };
  double ofBeam, ofDepth, ofAcross;
  const std::size_t beam = split((fan + 0.5) * (beams_ - 1), beams_, ofBeam);
  const std::size_t depth =
      split((depthMm - probe_.depthMin) / (probe_.depthMax - probe_.depthMin) * (depths_ - 1), depths_, ofDepth);
  const std::size_t across = split(acrossMm / acrossMm_ + 1.0, 3, ofAcross);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t corner = 0; corner < 8; ++corner) {
    const std::size_t b = corner & 1, d = corner >> 1 & 1, a = corner >> 2;
    const double weight = (b ? ofBeam : 1.0 - ofBeam) * (d ? ofDepth : 1.0 - ofDepth) * (a ? ofAcross : 1.0 - ofAcross);
    sum += weight * moves_[((beam + b) * static_cast<std::size_t>(depths_) + depth + d) * 3 + across + a].cast<double>();
  }
  return sum;
}

BeamBend::Line BeamBend::Along(double fan) const
{
  const double place = std::clamp(fan + 0.5, 0.0, 1.0) * (beams_ - 1);
  const int before = std::min(static_cast<int>(place), beams_ - 2);
  const auto part = static_cast<float>(place - before);
  const std::size_t n = 3 * static_cast<std::size_t>(depths_);
  const Eigen::Vector3f* a = moves_.data() + n * static_cast<std::size_t>(before);
  Line line;
  line.depthMin_ = static_cast<float>(probe_.depthMin);
  line.perMm_ = static_cast<float>((depths_ - 1) / (probe_.depthMax - probe_.depthMin));
  line.perAcross_ = static_cast<float>(1.0 / acrossMm_);
  line.moves_.resize(n);
  for (std::size_t i = 0; i < n; ++i)
    line.moves_[i] = a[i] + part * (a[n + i] - a[i]);
  return line;
}

Eigen::Vector3f BeamBend::Line::At(float depthMm, float acrossMm) const
{
  const int last = static_cast<int>(moves_.size() / 3) - 1;
  const float place = std::clamp((depthMm - depthMin_) * perMm_, 0.0f, static_cast<float>(last));
  const int before = std::min(static_cast<int>(place), last - 1);
  const float part = place - static_cast<float>(before), across = std::clamp(acrossMm * perAcross_, -1.0f, 1.0f);
  const Eigen::Vector3f* at = moves_.data() + 3 * before;
  const auto atDepth = [&](int node) -> Eigen::Vector3f { return at[node] + part * (at[node + 3] - at[node]); };
  const Eigen::Vector3f middle = atDepth(1);
  return middle + std::fabs(across) * (atDepth(across < 0.0f ? 0 : 2) - middle);
}

} // namespace echorama
