// SPDX-License-Identifier: BSD-3-Clause
// What a volume of speckle costs and how exact its sums are: the echoes of a whole volume, then those of some of its beams
// for several reaches across the beam, and the same as a plain loop in double precision over the same scatterers.
#include "Core/Base/Parallel.h"
#include "Core/Geometry/ProbeGeometry.h"
#include "Filters/Acoustics/EchoSum.h"
#include "Filters/Acoustics/Testing/PulseEcho.h"
#include "Testing/Benchmark.h"
#include <cmath>
#include <ctime>
#include <map>
#include <memory>

using namespace echorama;
using namespace echorama::testing;

namespace {

constexpr std::size_t firstCompared = 65, comparedApart = 1031;

using Sums = std::vector<std::complex<double>>;

// The exact sum: every scatterer by itself, the width of the beam at its place, one pulse each.
Sums PlainEchoes(const SoundSegment& segment, const Scatterers& scatterers, const Transducer& transducer, const DepthAxis& axis,
                 double reach, std::size_t& pairs)
{
  Sums row(static_cast<std::size_t>(axis.count));
  const double sigma = transducer.PulseSigmaMm();
  const Eigen::Vector3d up = segment.direction.cross(segment.across);
  std::vector<std::uint32_t> near;
  scatterers.FindBeside(
      segment.from, segment.direction, segment.length, [reach](double, double) { return 4.0 * reach; }, near);
  for (const std::uint32_t index : near) {
    const Scatterers::Brick& brick = scatterers.Bricks()[index];
    for (std::uint32_t n = 0; n < brick.count; ++n) {
      const Eigen::Vector3d place =
          brick.centre - segment.from + Eigen::Vector3d(scatterers.X(brick)[n], scatterers.Y(brick)[n], scatterers.Z(brick)[n]);
      const double s = place.dot(segment.direction), x = place.dot(segment.across), y = place.dot(up);
      if (!(s >= 0.0 && s < segment.length))
        continue;
      const BeamWidth width = WidthAt(transducer, segment.way + s);
      const double u = std::pow(x / width.lateralSigma, 2) + std::pow(y / width.elevationSigma, 2);
      if (u >= reach * reach)
        continue;
      ++pairs;
      const double depth =
          segment.scanDepth +
          segment.scanDepthPerMm * (s + 0.5 * (width.lateralCurvature * x * x + width.elevationCurvature * y * y));
      const double volume = std::pow(pi, 1.5) * sigma / segment.scanDepthPerMm * width.lateralSigma * width.elevationSigma;
      const double size = segment.amplitude * std::exp(-segment.attenuation * s - 0.5 * u) / std::sqrt(volume) *
                          static_cast<double>(scatterers.Amplitude(brick)[n]);
      const double phase = -transducer.PhasePerMm() * depth;
      const int first = std::max(0, static_cast<int>(std::ceil((depth - 6.0 * sigma - axis.first) / axis.step)));
      const int last = std::min(axis.count - 1, static_cast<int>(std::floor((depth + 6.0 * sigma - axis.first) / axis.step)));
      for (int i = first; i <= last; ++i) {
        const double away = (axis.first + i * axis.step - depth) / sigma;
        row[static_cast<std::size_t>(i)] +=
            size * std::exp(-0.5 * away * away) * std::complex<double>(std::cos(phase), std::sin(phase));
      }
    }
  }
  return row;
}

// Root mean square of the difference over that of the exact rows.
double RelativeError(const std::vector<Row>& rows, const std::vector<Sums>& exact)
{
  double difference = 0.0, all = 0.0;
  for (std::size_t b = 0; b < exact.size(); ++b)
    for (std::size_t i = 0; i < exact[b].size(); ++i) {
      difference += std::norm(std::complex<double>(rows[b][i]) - exact[b][i]);
      all += std::norm(exact[b][i]);
    }
  return std::sqrt(difference / all);
}

// Wall-clock and processor seconds of one call: on a shared machine the second is what counts.
template <class Function>
nlohmann::ordered_json Timed(const Function& function, double& seconds)
{
  const std::clock_t before = std::clock();
  seconds = benchmark::Seconds(function);
  return {{"cpu_seconds", static_cast<double>(std::clock() - before) / CLOCKS_PER_SEC}};
}

// Signal-to-noise ratio of the envelope at the focus against the number of scatterers in the resolution cell.
void ReportStatistics()
{
  const Transducer transducer;
  const double depth = transducer.lateralFocusMm, sigma = transducer.PulseSigmaMm();
  const BeamWidth width = WidthAt(transducer, depth);
  std::vector<SoundSegment> beams;
  for (int j = 0; j < 40; ++j)
    for (int i = 0; i < 40; ++i)
      beams.push_back(Beam({2.5 * width.lateralSigma * i, 2.5 * width.elevationSigma * j, 0.0}, Eigen::Vector3d::UnitZ(),
                           depth - 15.0, 30.0));
  const DepthAxis axis{depth - 11.0, 2.5 * sigma, 65};
  for (const double perCell : {0.3, 1.0, 2.0, 3.0, 5.0, 10.0, 20.0, 30.0, 60.0}) {
    const Scatterers scatterers = HeardBy(beams, transducer, Tissue(perCell / width.ResolutionCellMm3(sigma)));
    double n = 0.0, one = 0.0, two = 0.0;
    const double seconds = benchmark::Seconds([&] {
      for (const SoundSegment& beam : beams)
        for (const auto& value : RowOf(beam, scatterers, transducer, axis)) {
          n += 1.0;
          one += static_cast<double>(std::abs(value));
          two += static_cast<double>(std::norm(value));
        }
    });
    const double snr = one / n / std::sqrt(two / n - one * one / (n * n));
    benchmark::Report("echoes", "speckle statistics", "ours", seconds, std::abs(snr - 1.9131), "|speckle SNR - 1.91|",
                      {{"per_cell", perCell}, {"snr", snr}, {"samples", n}});
  }
}

// The point spread at several depths, ours and Rayleigh's integral.
void ReportPointSpread()
{
  const Transducer transducer;
  for (const double depth : {40.0, 70.0, 110.0}) {
    const BeamWidth scale = WidthAt(transducer, depth);
    const RayleighPulseEcho exact(transducer, depth);
    const OurPulseEcho ours(transducer, depth);
    Widths a{};
    const double seconds = benchmark::Seconds([&] { a = WidthsOf(ours, scale); });
    const Widths b = WidthsOf(exact, scale);
    const double worst = std::max(
        {std::abs(a.depth / b.depth - 1.0), std::abs(a.lateral / b.lateral - 1.0), std::abs(a.elevation / b.elevation - 1.0)});
    std::vector<double> across, lateral[2], along, pulse[2];
    for (int i = 0; i <= 24; ++i) {
      across.push_back(0.125 * i * scale.lateralSigma);
      lateral[0].push_back(ours.Peak(0.125 * i * scale.lateralSigma, 0.0));
      lateral[1].push_back(exact.Peak(0.125 * i * scale.lateralSigma, 0.0));
    }
    for (int i = 0; i < 61; ++i)
      along.push_back(-0.6 + 0.02 * i);
    pulse[0] = ours.Envelope(0.0, 0.0, -0.6, 0.02, 61);
    pulse[1] = exact.Envelope(0.0, 0.0, -0.6, 0.02, 61);
    benchmark::Report("echoes", "point spread", "ours", seconds, worst, "relative width",
                      {{"depth_mm", depth},
                       {"width_depth_mm", a.depth},
                       {"width_lateral_mm", 2.0 * a.lateral},
                       {"width_elevation_mm", 2.0 * a.elevation},
                       {"rayleigh_depth_mm", b.depth},
                       {"rayleigh_lateral_mm", 2.0 * b.lateral},
                       {"rayleigh_elevation_mm", 2.0 * b.elevation},
                       {"across_mm", across},
                       {"lateral", lateral[0]},
                       {"rayleigh_lateral", lateral[1]},
                       {"along_mm", along},
                       {"pulse", pulse[0]},
                       {"rayleigh_pulse", pulse[1]}});
  }
}

} // namespace

int main()
{
  ReportStatistics();
  ReportPointSpread();

  const ProbeGeometry probe = ProbeGeometry::Convex(65.0 * pi / 180.0, 40.0, 55.0 * pi / 180.0, 30.0, 0.0, 150.0);
  constexpr int beams = 128, planes = 128;
  Transducer transducer;
  const DepthAxis axis{0.0, 150.0 / 1100, 1101}; // one standard deviation of the pulse
  Material tissue = StandardMaterial("liver");
  tissue.scattererDensity = 30.0 / WidthAt(transducer, transducer.lateralFocusMm).ResolutionCellMm3(transducer.PulseSigmaMm());

  std::vector<SoundSegment> segments;
  for (int k = 0; k < planes; ++k)
    for (int j = 0; j < beams; ++j) {
      const BeamPoint start{0.0, j / (beams - 1.0) - 0.5, k / (planes - 1.0) - 0.5};
      SoundSegment segment;
      segment.from = PointOf(probe, start);
      segment.direction = DirectionOf(probe, start);
      segment.across = (Eigen::Vector3d::UnitX() - segment.direction.x() * segment.direction).normalized();
      segment.length = 150.0;
      segments.push_back(segment);
    }

  std::unique_ptr<VisitedSpace> space;
  const double regionSeconds = benchmark::Seconds([&] { space = std::make_unique<VisitedSpace>(SpaceOf(segments, transducer)); });
  Scatterers scatterers;
  double makeSeconds = 0.0;
  nlohmann::ordered_json made = Timed(
      [&] {
        scatterers = Scatterers::Make(
            {}, {tissue},
            [](const Eigen::Vector3f*, std::size_t count, std::int32_t* media) { std::fill(media, media + count, 0); },
            space->Box(), [&](const Eigen::AlignedBox3d& box) { return space->Touches(box); });
      },
      makeSeconds);
  space.reset();
  made.update({{"region_seconds", regionSeconds},
               {"scatterers", scatterers.Count()},
               {"per_second", static_cast<double>(scatterers.Count()) / makeSeconds},
               {"memory_mb", static_cast<double>(scatterers.MemoryBytes()) / 1e6},
               {"per_mm3", tissue.scattererDensity}});
  benchmark::ReportTime("echoes", "scatterers of a volume", "hashed lattice in bricks", makeSeconds, made);

  // Beams all over the volume for the comparison.
  std::vector<const SoundSegment*> some;
  for (std::size_t i = firstCompared; i < segments.size(); i += comparedApart)
    some.push_back(&segments[i]);
  const auto count = static_cast<double>(some.size());
  const ThreadLimit two(2);
  std::vector<Sums> exact(some.size());
  std::map<double, double> pairsOf; // by reach, of one beam
  for (const double reach : {6.0, 2.0, 2.5, 2.75, 3.0, 3.5, 4.0}) {
    std::size_t pairs = 0;
    std::vector<Sums> plain(some.size());
    double seconds = 0.0;
    nlohmann::ordered_json line = Timed(
        [&] {
          for (std::size_t b = 0; b < some.size(); ++b)
            plain[b] = PlainEchoes(*some[b], scatterers, transducer, axis, reach, pairs);
        },
        seconds);
    if (reach == 6.0)
      exact = plain;
    std::vector<Row> rows;
    for (const Sums& row : plain)
      rows.emplace_back(row.begin(), row.end());
    pairsOf[reach] = static_cast<double>(pairs) / count;
    const double cpu = line["cpu_seconds"].get<double>() / count;
    line.update({{"cpu_seconds", cpu},
                 {"reach", reach},
                 {"pairs", pairsOf[reach]},
                 {"pairs_per_cpu_second", pairsOf[reach] / cpu},
                 {"runs", 1},
                 {"threads", 1}});
    benchmark::Report("echoes", "one beam", "peer: plain loop in double precision", seconds / count, RelativeError(rows, exact),
                      "relative rms", line);
  }
  for (const auto& [reach, pairs] : pairsOf) {
    std::vector<Row> rows(some.size());
    const auto sum = [&, wide = reach] {
      for (std::size_t b = 0; b < some.size(); ++b)
        rows[b] = RowOf(*some[b], scatterers, transducer, axis, wide);
    };
    double seconds = 0.0;
    nlohmann::ordered_json line = Timed(sum, seconds);
    const double cpu = line["cpu_seconds"].get<double>() / count;
    line.update({{"cpu_seconds", cpu},
                 {"reach", reach},
                 {"pairs", pairs},
                 {"pairs_per_cpu_second", pairs / cpu},
                 {"runs", 1},
                 {"threads", 1}});
    benchmark::Report("echoes", "one beam", "ours", seconds / count, RelativeError(rows, exact), "relative rms", line);
  }

  std::vector<Row> rows(segments.size(), Row(static_cast<std::size_t>(axis.count)));
  double seconds = 0.0;
  nlohmann::ordered_json line = Timed(
      [&] {
        ParallelFor(static_cast<std::ptrdiff_t>(segments.size()), [&](std::ptrdiff_t i) {
          AddSegmentEchoes(segments[static_cast<std::size_t>(i)], scatterers, transducer, axis,
                           rows[static_cast<std::size_t>(i)].data());
        });
      },
      seconds);
  std::vector<Row> compared;
  for (std::size_t i = firstCompared; i < segments.size(); i += comparedApart)
    compared.push_back(rows[i]);
  line.update({{"runs", 1}, {"threads", 2}});
  benchmark::Report("echoes", "volume of 128 x 128 beams", "ours", seconds, RelativeError(compared, exact), "relative rms", line);
}
