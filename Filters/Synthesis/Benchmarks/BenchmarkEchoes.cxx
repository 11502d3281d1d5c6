// SPDX-License-Identifier: BSD-3-Clause
// What a volume of speckle costs and how exact its sums are: the echoes of a whole volume, then those of some of its beams
// for several reaches across the beam, and the same as a plain loop in double precision over the same scatterers.
#include "Core/Base/Parallel.h"
#include "Core/Geometry/ProbeGeometry.h"
#include "Filters/Synthesis/EchoSum.h"
#include "Testing/Benchmark.h"
#include <cmath>

using namespace echorama;

namespace {

constexpr double pi = 3.141592653589793;

using Row = std::vector<std::complex<float>>;
using ExactRow = std::vector<std::complex<double>>;

// The exact sum: every scatterer by itself, the width of the beam at its place, one pulse each.
ExactRow PlainEchoes(const SoundSegment& segment, const Scatterers& scatterers, const Transducer& transducer,
                     const DepthAxis& axis, double reach, std::size_t& pairs)
{
  ExactRow row(static_cast<std::size_t>(axis.count));
  const double sigma = transducer.PulseSigmaMm();
  const Eigen::Vector3d up = segment.direction.cross(segment.across);
  std::vector<std::uint32_t> near;
  scatterers.FindNear(
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
double RelativeError(const std::vector<Row>& rows, const std::vector<ExactRow>& exact)
{
  double difference = 0.0, all = 0.0;
  for (std::size_t b = 0; b < exact.size(); ++b)
    for (std::size_t i = 0; i < exact[b].size(); ++i) {
      difference += std::norm(std::complex<double>(rows[b][i]) - exact[b][i]);
      all += std::norm(exact[b][i]);
    }
  return std::sqrt(difference / all);
}

} // namespace

int main()
{
  const ProbeGeometry probe = ProbeGeometry::Convex(65.0 * pi / 180.0, 40.0, 55.0 * pi / 180.0, 30.0, 0.0, 150.0);
  constexpr int beams = 128, planes = 128;
  Transducer transducer;
  const DepthAxis axis{0.0, 150.0 / 1100, 1101}; // one standard deviation of the pulse
  Material tissue = StandardMaterial("liver");
  tissue.scattererDensity = 30.0 / WidthAt(transducer, transducer.lateralFocusMm).ResolutionCellMm3(transducer.PulseSigmaMm());

  std::vector<SoundPath> paths;
  for (int k = 0; k < planes; ++k)
    for (int j = 0; j < beams; ++j) {
      const BeamPoint start{0.0, j / (beams - 1.0) - 0.5, k / (planes - 1.0) - 0.5};
      SoundSegment segment;
      segment.from = PointOf(probe, start);
      segment.direction = DirectionOf(probe, start);
      segment.across = (Eigen::Vector3d::UnitX() - segment.direction.x() * segment.direction).normalized();
      segment.length = 150.0;
      segment.attenuation = 2.0 * tissue.AttenuationDbPerMm(transducer.frequencyMHz) * std::log(10.0) / 20.0;
      paths.push_back({{segment}, {}, 1});
    }

  const HeardRegion* heard = nullptr;
  const double regionSeconds = benchmark::Seconds([&] { heard = new HeardRegion(paths, transducer); });
  Scatterers scatterers;
  const double makeSeconds = benchmark::Seconds([&] {
    scatterers = Scatterers::Make(
        {}, {tissue}, [](const Eigen::Vector3f*, std::size_t count, std::int32_t* media) { std::fill(media, media + count, 0); },
        heard->Box(), [&](const Eigen::AlignedBox3d& box) { return heard->Meets(box); });
  });
  delete heard;
  benchmark::Report("echoes", "scatterers of a volume", "hashed lattice in bricks", makeSeconds, 0.0, "none",
                    {{"region_seconds", regionSeconds},
                     {"scatterers", scatterers.Count()},
                     {"per_second", static_cast<double>(scatterers.Count()) / makeSeconds},
                     {"memory_mb", static_cast<double>(scatterers.MemoryBytes()) / 1e6},
                     {"per_mm3", tissue.scattererDensity}});

  // Beams all over the volume for the comparison.
  std::vector<const SoundSegment*> some;
  for (std::size_t i = 65; i < paths.size(); i += 331)
    some.push_back(&paths[i].segments[0]);
  std::vector<ExactRow> exact(some.size());
  std::size_t widePairs = 0;
  for (std::size_t b = 0; b < some.size(); ++b)
    exact[b] = PlainEchoes(*some[b], scatterers, transducer, axis, 6.0, widePairs);
  for (const double reach : {2.0, 2.5, 2.75, 3.0, 3.5, 4.0, 5.0, 6.0}) {
    std::vector<Row> rows(some.size());
    std::vector<ExactRow> plain(some.size());
    std::size_t pairs = 0;
    const ThreadLimit one(1);
    const auto ours = [&] {
      for (std::size_t b = 0; b < some.size(); ++b) {
        rows[b].assign(static_cast<std::size_t>(axis.count), {});
        AddSegmentEchoes(*some[b], scatterers, transducer, axis, rows[b].data(), reach);
      }
    };
    const auto peer = [&] {
      pairs = 0;
      for (std::size_t b = 0; b < some.size(); ++b)
        plain[b] = PlainEchoes(*some[b], scatterers, transducer, axis, reach, pairs);
    };
    const auto [seconds, peerSeconds] = benchmark::Duel(ours, peer, 3);
    std::vector<Row> plainRows;
    for (const ExactRow& row : plain)
      plainRows.emplace_back(row.begin(), row.end());
    const double count = static_cast<double>(some.size());
    benchmark::Report("echoes", "one beam", "ours", seconds / count, RelativeError(rows, exact), "relative rms",
                      {{"reach", reach},
                       {"pairs", static_cast<double>(pairs) / count},
                       {"pairs_per_second", static_cast<double>(pairs) / seconds}});
    benchmark::Report("echoes", "one beam", "peer: plain loop in double precision", peerSeconds / count,
                      RelativeError(plainRows, exact), "relative rms",
                      {{"reach", reach},
                       {"pairs", static_cast<double>(pairs) / count},
                       {"pairs_per_second", static_cast<double>(pairs) / peerSeconds}});
  }

  for (const int threads : {2, 1}) {
    const ThreadLimit limit(threads);
    std::vector<Row> rows(paths.size(), Row(static_cast<std::size_t>(axis.count)));
    const double seconds = benchmark::Seconds([&] {
      ParallelFor(static_cast<std::ptrdiff_t>(paths.size()), [&](std::ptrdiff_t i) {
        AddSegmentEchoes(paths[static_cast<std::size_t>(i)].segments[0], scatterers, transducer, axis,
                         rows[static_cast<std::size_t>(i)].data());
      });
    });
    std::vector<Row> compared;
    for (std::size_t i = 65; i < paths.size(); i += 331)
      compared.push_back(rows[i]);
    benchmark::Report("echoes", "volume of 128 x 128 beams", "ours, " + std::to_string(threads) + " threads", seconds,
                      RelativeError(compared, exact), "relative rms", {{"threads", threads}});
  }
}
