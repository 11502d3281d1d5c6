// SPDX-License-Identifier: BSD-3-Clause
#include "EchoSum.h"
#include "Core/Base/Error.h"
#include "Core/Base/NumberText.h"
#include <algorithm>
#include <cmath>

namespace echorama {
namespace {

constexpr double pi = 3.141592653589793;
constexpr double pulseReach = 3.5;

void AddPulse(std::complex<double> size, double depth, double sigma, const DepthAxis& axis, std::complex<float>* row)
{
  const int first =
      std::max(0, static_cast<int>(std::ceil(std::max(-1.0, (depth - pulseReach * sigma - axis.first) / axis.step))));
  const int last =
      static_cast<int>(std::floor(std::min(axis.count - 1.0, (depth + pulseReach * sigma - axis.first) / axis.step)));
  for (int i = first; i <= last; ++i) {
    const double away = (axis.first + i * axis.step - depth) / sigma;
    row[i] += std::complex<float>(size * std::exp(-0.5 * away * away));
  }
}

void CheckAxis(const DepthAxis& axis)
{
  if (!(axis.step > 0.0) || !std::isfinite(axis.step) || !std::isfinite(axis.first))
    throw Error(Error::Kind::InvalidParameter,
                "echoes: the step of the depth axis is " + NumberText(axis.step) + " mm; it must be positive and finite");
}

} // namespace

void AddSegmentEchoes(const SoundSegment& segment, const Scatterers& scatterers, const Transducer& transducer,
                      const DepthAxis& axis, std::complex<float>* row, double reach)
{
  CheckAxis(axis);
  if (!(reach > 0.0 && reach <= 6.0))
    throw Error(Error::Kind::InvalidParameter, "echoes: the reach is " + NumberText(reach) + " sigma; it must be in (0, 6]");
  const double pulse = transducer.PulseSigmaMm(), turn = transducer.PhasePerMm();
  double widest = 0.0;
  for (int i = 0; i <= 32; ++i) {
    const BeamWidth width = WidthAt(transducer, segment.way + segment.length * i / 32);
    widest = std::max({widest, width.lateralSigma, width.elevationSigma});
  }
  std::vector<std::uint32_t> near;
  scatterers.FindNear(segment.from, segment.direction, segment.length, 1.1 * reach * widest, near);
  const Eigen::Vector3d up = segment.direction.cross(segment.across);
  for (const std::uint32_t index : near) {
    const Scatterers::Brick& brick = scatterers.Bricks()[index];
    for (std::uint32_t i = 0; i < brick.count; ++i) {
      const Eigen::Vector3d place =
          brick.centre - segment.from + Eigen::Vector3d(scatterers.X(brick)[i], scatterers.Y(brick)[i], scatterers.Z(brick)[i]);
      const double s = place.dot(segment.direction), x = place.dot(segment.across), y = place.dot(up);
      if (!(s >= 0.0 && s < segment.length))
        continue;
      const BeamWidth width = WidthAt(transducer, segment.way + s);
      const double u = std::pow(x / width.lateralSigma, 2) + std::pow(y / width.elevationSigma, 2);
      if (!(u < reach * reach))
        continue;
      const double late = 0.5 * (width.lateralCurvature * x * x + width.elevationCurvature * y * y);
      const double depth = segment.scanDepth + segment.scanDepthPerMm * (s + late);
      const double volume = std::pow(pi, 1.5) * pulse / segment.scanDepthPerMm * width.lateralSigma * width.elevationSigma;
      const double size = segment.amplitude * std::exp(-segment.attenuation * s - 0.5 * u) / std::sqrt(volume) *
                          static_cast<double>(scatterers.Amplitude(brick)[i]);
      AddPulse(std::polar(size < 0.0 ? -size : size, -turn * depth + (size < 0.0 ? pi : 0.0)), depth, pulse, axis, row);
    }
  }
}

void AddSurfaceEcho(const SurfaceEcho& echo, const Transducer& transducer, const DepthAxis& axis, std::complex<float>* row,
                    double weight)
{
  CheckAxis(axis);
  const double phase = -transducer.PhasePerMm() * echo.scanDepth;
  AddPulse(weight * echo.amplitude * std::complex<double>(std::cos(phase), std::sin(phase)), echo.scanDepth,
           transducer.PulseSigmaMm(), axis, row);
}

} // namespace echorama
