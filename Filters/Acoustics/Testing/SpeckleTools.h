// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// What the tests of speckle share.
#include "Filters/Acoustics/EchoSum.h"
#include "Filters/Acoustics/VisitedSpace.h"
#include <algorithm>
#include <cmath>
#include <iterator>

namespace echorama::testing {

constexpr double pi = 3.141592653589793;

inline void AllFirst(const Eigen::Vector3f*, std::size_t count, std::int32_t* materials)
{
  std::fill(materials, materials + count, 0);
}

/// Reference tissue with so many scatterers per mm^3.
inline Material Tissue(double density)
{
  Material tissue;
  tissue.name = "tissue";
  tissue.scattererDensity = density;
  tissue.attenuation = 0.0;
  return tissue;
}

/// A beam that begins at its element: its first `way` mm are left out.
inline SoundSegment Beam(const Eigen::Vector3d& element, const Eigen::Vector3d& direction, double way, double length)
{
  SoundSegment beam;
  beam.direction = direction.normalized();
  beam.across = (Eigen::Vector3d::UnitX() - beam.direction.x() * beam.direction).normalized();
  beam.from = element + way * beam.direction;
  beam.length = length;
  beam.way = way;
  beam.scanDepth = way;
  return beam;
}

using Row = std::vector<std::complex<float>>;

inline Row RowOf(const SoundSegment& segment, const Scatterers& scatterers, const Transducer& transducer, const DepthAxis& axis,
                 double reach = beamReach)
{
  Row row(static_cast<std::size_t>(axis.count));
  AddSegmentEchoes(segment, scatterers, transducer, axis, row.data(), reach);
  return row;
}

/// Where the tubes around segments pass.
inline VisitedSpace SpaceOf(const std::vector<SoundSegment>& segments, const Transducer& transducer, double reach = beamReach)
{
  constexpr double piece = 5.0; // mm
  const auto radiusOf = [&](const SoundSegment& segment, double from) {
    double widest = 0.0;
    for (const double s : {from, std::min(from + piece, segment.length)}) {
      const BeamWidth width = WidthAt(transducer, segment.way + s);
      widest = std::max({widest, width.lateralSigma, width.elevationSigma});
    }
    return 1.05 * reach * widest;
  };
  Eigen::AlignedBox3d box;
  for (const SoundSegment& segment : segments)
    for (const double s : {0.0, segment.length}) {
      const double radius = radiusOf(segment, s);
      const Eigen::Vector3d place = segment.from + s * segment.direction;
      box.extend(Eigen::Vector3d(place.array() - radius));
      box.extend(Eigen::Vector3d(place.array() + radius));
    }
  VisitedSpace space(box, 2.0);
  for (const SoundSegment& segment : segments)
    for (double s = 0.0; s < segment.length; s += piece)
      space.MarkLine(segment.from + s * segment.direction, segment.direction, std::min(piece, segment.length - s),
                     radiusOf(segment, s));
  return space;
}

/// All scatterers that the segments hear.
inline Scatterers HeardBy(const std::vector<SoundSegment>& segments, const Transducer& transducer, const Material& material,
                          const ScattererParameters& parameters = {}, double reach = beamReach)
{
  const VisitedSpace space = SpaceOf(segments, transducer, reach);
  return Scatterers::Make(parameters, {material}, AllFirst, space.Box(),
                          [&](const Eigen::AlignedBox3d& box) { return space.Touches(box); });
}

/// Where they lie in the world, and their amplitudes.
struct Listed {
  std::vector<Eigen::Vector3d> points;
  std::vector<float> amplitudes;
};
inline Listed ListOf(const Scatterers& scatterers)
{
  Listed list;
  for (const Scatterers::Brick& brick : scatterers.Bricks())
    for (std::uint32_t i = 0; i < brick.count; ++i) {
      list.points.push_back(brick.centre + Eigen::Vector3d(static_cast<double>(scatterers.X(brick)[i]),
                                                           static_cast<double>(scatterers.Y(brick)[i]),
                                                           static_cast<double>(scatterers.Z(brick)[i])));
      list.amplitudes.push_back(scatterers.Amplitude(brick)[i]);
    }
  return list;
}

/// The sum by its definition: every scatterer of a list in double precision, with the width of the beam at its own place.
inline std::vector<std::complex<double>> ExactRow(const SoundSegment& segment, const Listed& list, const Transducer& transducer,
                                                  const DepthAxis& axis, double reach)
{
  std::vector<std::complex<double>> row(static_cast<std::size_t>(axis.count));
  const double sigma = transducer.PulseSigmaMm();
  const Eigen::Vector3d up = segment.direction.cross(segment.across);
  for (std::size_t n = 0; n < list.points.size(); ++n) {
    const Eigen::Vector3d place = list.points[n] - segment.from;
    const double s = place.dot(segment.direction), x = place.dot(segment.across), y = place.dot(up);
    if (!(s >= 0.0 && s < segment.length))
      continue;
    const BeamWidth width = WidthAt(transducer, segment.way + s);
    const double u = std::pow(x / width.lateralSigma, 2) + std::pow(y / width.elevationSigma, 2);
    if (u >= reach * reach)
      continue;
    const double late = 0.5 * (width.lateralCurvature * x * x + width.elevationCurvature * y * y);
    const double depth = segment.scanDepth + segment.scanDepthPerMm * (s + late);
    const double volume = std::pow(pi, 1.5) * sigma / segment.scanDepthPerMm * width.lateralSigma * width.elevationSigma;
    const double size = segment.amplitude * std::exp(-segment.attenuation * s - 0.5 * u) / std::sqrt(volume) *
                        static_cast<double>(list.amplitudes[n]);
    const std::complex<double> echo = size * std::exp(std::complex<double>(0.0, -transducer.PhasePerMm() * depth));
    for (int i = 0; i < axis.count; ++i) {
      const double away = (axis.first + i * axis.step - depth) / sigma;
      if (std::abs(away) < 6.0)
        row[static_cast<std::size_t>(i)] += echo * std::exp(-0.5 * away * away);
    }
  }
  return row;
}

/// Where a curve of values at \a step, falling from its greatest value at 0, crosses half of it.
inline double HalfWidth(const std::vector<double>& values, double step)
{
  for (std::size_t i = 1; i < values.size(); ++i)
    if (values[i] < 0.5 * values[0])
      return step * (static_cast<double>(i) - (0.5 * values[0] - values[i]) / (values[i - 1] - values[i]));
  return std::nan("");
}

/// The width of a curve at half of its greatest value.
inline double FullWidth(const std::vector<double>& values, double step)
{
  const auto peak = std::max_element(values.begin(), values.end());
  return HalfWidth({peak, values.end()}, step) + HalfWidth({std::make_reverse_iterator(peak + 1), values.rend()}, step);
}

} // namespace echorama::testing
