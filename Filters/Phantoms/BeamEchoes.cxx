// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Phantoms/BeamEchoes.h"
#include <algorithm>

namespace echorama {
namespace {

// Samples along one axis that surround a position, given as a fraction of the axis' length.
struct Between {
  Between(double fraction, int count)
  {
    const double position = std::clamp(fraction, 0.0, 1.0) * (count - 1);
    first = std::max(0, std::min(static_cast<int>(position), count - 2));
    t = position - first;
    next = count > 1 ? 1 : 0; // a single plane lies between itself
  }
  int first;
  int next; // how far on the other one lies
  double t;
};

// Trilinear interpolation in beam space.
std::complex<double> Interpolate(const VolumeView<const std::complex<float>>& samples, const Between& depth, const Between& fan,
                                 const Between& sweep)
{
  const auto along = [&](int beam, int plane) {
    const std::complex<float>* row = samples.Row(fan.first + beam, sweep.first + plane) + depth.first;
    const std::complex<double> a(row[0]), b(row[depth.next]);
    return a + depth.t * (b - a);
  };
  const auto across = [&](int plane) {
    const std::complex<double> a = along(0, plane);
    return a + fan.t * (along(fan.next, plane) - a);
  };
  const std::complex<double> a = across(0);
  return a + sweep.t * (across(sweep.next) - a);
}

} // namespace

std::optional<std::complex<double>> BeamEchoes::At(const Eigen::Vector3d& pointInProbe) const
{
  const auto beam = BeamPointAt(probe, pointInProbe);
  if (!beam)
    return {};
  const auto& n = baseband.Dimensions();
  return Interpolate(baseband.View(), Between((beam->depth - probe.depthMin) / (probe.depthMax - probe.depthMin), n[0]),
                     Between(beam->fan + 0.5, n[1]), Between(beam->sweep + 0.5, n[2]));
}

} // namespace echorama
