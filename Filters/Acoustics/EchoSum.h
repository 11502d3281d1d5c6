// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Geometry/Transducer.h"
#include "Scatterers.h"
#include "SoundPath.h"
#include <complex>
#include <memory>

namespace echorama {

/// Samples along a beam.
struct DepthAxis {
  double first = 0.0; ///< scan depth of the first, mm
  /// mm, in [0.001, 10] times Transducer::PulseSigmaMm(). Above one, samples miss parts of the pulse.
  double step = 0.1;
  int count = 0;
};

/// Scatterers further from the axis of the beam than this many standard deviations of its two-way profile are left out
/// (their amplitude would be below 0.011).
constexpr double beamReach = 3.0;

/// Sums the echoes of all scatterers around the segments of a beam to a row of complex baseband samples, beam after beam.
///
/// A scatterer at s mm of the segment, x and y mm beside it (along `across` and at right angles) echoes from the scan depth
/// d = scanDepth + scanDepthPerMm (s + curvature x^2 / 2 + curvature y^2 / 2) with the phase exp(-i PhasePerMm d) and a
/// Gaussian pulse about d. Its size is amplitude exp(-attenuation s) times the profile of the beam at way + s times the
/// scatterer's own amplitude. Only those with s in [0, length) count, so that consecutive segments of a way share them out.
///
/// Levels are relative: fully developed speckle of a material with backscatter 0 dB has mean power 1 at every depth without
/// attenuation; that focusing makes the echoes of some depths louder is left to the scanner's gain, as is spreading.
/// A row depends on its segments and their order alone, and for each only on the bricks beside it. Not thread safe: each thread
/// has its own.
class EchoSum {
public:
  /// Scatterers and transducer must outlive it.
  /// \param reach standard deviations across, in (0, 6]
  /// \throws Error(InvalidParameter) for a step or a reach that is out of its range.
  EchoSum(const Scatterers& scatterers, const Transducer& transducer, const DepthAxis& axis, double reach = beamReach);
  ~EchoSum();
  EchoSum(EchoSum&&) noexcept;

  /// \throws Error(BadInput) for a segment that is not finite.
  void Add(const SoundSegment& segment);

  /// Adds what was summed since the last call to a row, and begins anew.
  void MoveTo(std::complex<float>* row);

private:
  class Row;
  std::unique_ptr<Row> row_;
};

/// The echoes of a single segment, added to a row: see EchoSum.
void AddSegmentEchoes(const SoundSegment& segment, const Scatterers& scatterers, const Transducer& transducer,
                      const DepthAxis& axis, std::complex<float>* row, double reach = beamReach);

/// Adds the echo of a surface, \a weight times its amplitude at the peak: the pulse about its depth, and its phase.
void AddSurfaceEcho(const SurfaceEcho& echo, const Transducer& transducer, const DepthAxis& axis, std::complex<float>* row,
                    double weight = 1.0);

} // namespace echorama
