// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The echo of one point, ours and that of an independent integral: for the tests and for the benchmark's picture.
#include "SpeckleTools.h"

namespace echorama::testing {

// The echo of a point by Rayleigh's integral: both ways over the rectangular aperture with its apodisation, which ends at
// its edges, exact distances and delays, for every frequency of the pulse. Nothing of it is Gaussian optics.
class RayleighPulseEcho {
public:
  RayleighPulseEcho(const Transducer& transducer, double depth) : transducer_(transducer), depth_(depth)
  {
    constexpr int along = 56, over = 40;
    for (int i = 0; i < along; ++i)
      for (int j = 0; j < over; ++j) {
        Piece piece;
        const double a = (i + 0.5) / along - 0.5, b = (j + 0.5) / over - 0.5;
        piece.u = a * transducer.lateralApertureMm;
        piece.v = b * transducer.elevationApertureMm;
        piece.weight = std::exp(-0.5 * 25.0 * (a * a + b * b));
        const auto early = [](double focus, double offset) { return std::hypot(focus, offset) - focus; };
        const double lens = early(transducer.elevationFocusMm, piece.v);
        piece.sendEarly = lens + early(transducer.lateralFocusMm, piece.u);
        piece.listenEarly = lens + early(depth, piece.u);
        pieces_.push_back(piece);
      }
    const double sigma = std::sqrt(2.0 * std::log(2.0)) / (pi * transducer.bandwidth * transducer.frequencyMHz); // us
    for (double f = -1.05; f <= 1.05001; f += 0.1) {
      const double frequency = transducer.frequencyMHz * (1.0 + f * transducer.bandwidth);
      frequencies_.push_back({frequency, std::exp(-2.0 * std::pow(pi * sigma * (frequency - transducer.frequencyMHz), 2))});
    }
  }

  // Envelope at delays (mm of depth beyond the point's own) in steps, of a point beside the axis.
  std::vector<double> Envelope(double x, double y, double from, double step, int count) const
  {
    std::vector<std::complex<double>> spectrum;
    for (const auto& [frequency, weight] : frequencies_) {
      const double k = 2e3 * pi * frequency / transducer_.assumedSoundSpeed; // 1/mm
      std::complex<double> send, listen;
      for (const Piece& piece : pieces_) {
        const double r = std::sqrt(std::pow(x - piece.u, 2) + std::pow(y - piece.v, 2) + depth_ * depth_);
        const double a = k * (r - depth_ - piece.sendEarly), b = k * (r - depth_ - piece.listenEarly);
        send += piece.weight / r * std::complex<double>(std::cos(a), -std::sin(a));
        listen += piece.weight / r * std::complex<double>(std::cos(b), -std::sin(b));
      }
      spectrum.push_back(weight * send * listen);
    }
    std::vector<double> envelope;
    for (int i = 0; i < count; ++i) {
      std::complex<double> sum;
      for (std::size_t n = 0; n < spectrum.size(); ++n)
        sum += spectrum[n] * std::exp(std::complex<double>(0.0, 4e3 * pi * frequencies_[n].first / transducer_.assumedSoundSpeed *
                                                                    (from + i * step)));
      envelope.push_back(std::abs(sum));
    }
    return envelope;
  }

  double Peak(double x, double y) const
  {
    const std::vector<double> envelope = Envelope(x, y, -0.6, 0.06, 41); // late ones as well
    return *std::max_element(envelope.begin(), envelope.end());
  }

private:
  struct Piece {
    double u, v, weight, sendEarly, listenEarly;
  };
  const Transducer& transducer_;
  double depth_;
  std::vector<Piece> pieces_;
  std::vector<std::pair<double, double>> frequencies_;
};

// The same from the synthesiser: one scatterer, a beam of parallel axis beside it.
class OurPulseEcho {
public:
  OurPulseEcho(const Transducer& transducer, double depth)
    : transducer_(transducer), depth_(depth), point_(Scatterers::At({{0.0, 0.0, depth}}, {1.0f}))
  {
  }

  std::vector<double> Envelope(double x, double y, double from, double step, int count) const
  {
    const DepthAxis axis{depth_ + from, step, count};
    std::vector<double> envelope;
    for (const auto& value : RowOf(Beam({x, y, 0.0}, {0.0, 0.0, 1.0}, 0.0, 2.0 * depth_), point_, transducer_, axis))
      envelope.push_back(static_cast<double>(std::abs(value)));
    return envelope;
  }

  double Peak(double x, double y) const
  {
    const std::vector<double> envelope = Envelope(x, y, -0.6, 0.06, 41);
    return *std::max_element(envelope.begin(), envelope.end());
  }

private:
  const Transducer& transducer_;
  double depth_;
  Scatterers point_;
};

struct Widths {
  double depth, lateral, elevation; // -6 dB widths, mm; across, half of them
};

template <class PulseEcho>
Widths WidthsOf(const PulseEcho& echo, const BeamWidth& scale)
{
  Widths widths{};
  widths.depth = FullWidth(echo.Envelope(0.0, 0.0, -0.6, 0.01, 121), 0.01);
  std::vector<double> lateral, elevation;
  for (int i = 0; i < 12; ++i) {
    lateral.push_back(echo.Peak(0.15 * i * scale.lateralSigma, 0.0));
    elevation.push_back(echo.Peak(0.0, 0.15 * i * scale.elevationSigma));
  }
  widths.lateral = HalfWidth(lateral, 0.15 * scale.lateralSigma);
  widths.elevation = HalfWidth(elevation, 0.15 * scale.elevationSigma);
  return widths;
}

} // namespace echorama::testing
