// SPDX-License-Identifier: BSD-3-Clause
// The pulse is the same at every depth, so no scatterer needs its own: each adds one complex number to a fine row (10
// samples per standard deviation of the pulse, shared out linearly between two), and the fine row meets the pulse once, at the
// end. What remains per scatterer is where it lies, a Gaussian and a phase.
//
// 1. Bricks. Of every brick near the segment the place beside it is worked out in double precision; its box is tested against
//    the elliptic tube of the beam. The width of the beam, its curvature and all that enters the size of an echo are linear
//    over a brick (to 0.1% of the echoes at a depth of 30 mm, 3% within the first 5 mm).
// 2. Look and sieve: depth, distance and exponent of every scatterer of the brick, in vectors; those in the tube are moved
//    together, unless all are.
// 3. Echo: exponential and sine by polynomials (relative 1e-6), in vectors, relative to the middle of the brick: so single
//    precision holds phases to 1e-5 of a turn, whatever the depth and wherever the world is.
// 4. Pulse: the fine row is split into its phases, so that the sum over the pulse is a sum of whole rows.
#include "EchoSum.h"
#include "Core/Base/Angles.h"
#include "Core/Base/Error.h"
#include "Core/Base/Multiversion.h"
#include "Core/Base/NumberText.h"
#include <algorithm>
#include <cmath>
#include <cstring>

namespace echorama {
namespace {

constexpr double pulseReach = 4.0;    // standard deviations in depth: 70 dB down
constexpr double finePerSigma = 10.0; // samples of the fine row
constexpr double nodeMm = 1.0;        // between the widths that are worked out
constexpr int batch = 512;            // scatterers at once

// How the scatterers of one brick are seen; places relative to its centre, s along the segment.
struct BrickView {
  float along[3], across[3], up[3];
  float x, y;                             // of the centre
  float first, last;                      // s that count
  float lateral[2], elevation[2];         // 1 / sigma^2 and its change per mm of s
  float lateralBend[2], elevationBend[2]; // half the curvature and its change
  float exponent[2];                      // of the size of the echo on the axis
  float turn, turnsPerMm;                 // phase, in whole turns
  float fine, finePerMm;                  // place in the fine row, from fineBase
  int fineBase, fineLast;                 // the last place that has a successor
};

// Scatterers that are heard: how much deeper than the centre of the brick they seem, the exponent of the size of their echo,
// and their own amplitude.
struct Sieved {
  float late[batch], exponent[batch], amplitude[batch];
};

// e^x for x in [-80, 80], to 1e-7.
inline float Exponential(float x)
{
  const float y = x * 1.44269504f;
  const float whole = std::floor(y);
  const float f = y - whole;
  const float power =
      1.0f + f * (0.693147577f + f * (0.240206874f + f * (0.0556586641f + f * (0.0091968022f + f * 0.00178966497f))));
  const int bits = (static_cast<int>(whole) + 127) << 23;
  float scale;
  std::memcpy(&scale, &bits, sizeof scale);
  return power * scale;
}

// Depth, distance from the axis in standard deviations (squared; far when s does not count) and exponent of scatterers.
ECHORAMA_HOT void Look(const BrickView& v, const float* px, const float* py, const float* pz, int count, float* __restrict late,
                       float* __restrict exponent, float* __restrict distance)
{
  const BrickView w = v;
  for (int i = 0; i < count; ++i) {
    const float s = w.along[0] * px[i] + w.along[1] * py[i] + w.along[2] * pz[i];
    const float x = w.x + (w.across[0] * px[i] + w.across[1] * py[i] + w.across[2] * pz[i]);
    const float y = w.y + (w.up[0] * px[i] + w.up[1] * py[i] + w.up[2] * pz[i]);
    const float xx = x * x, yy = y * y;
    const float u = xx * (w.lateral[0] + w.lateral[1] * s) + yy * (w.elevation[0] + w.elevation[1] * s);
    late[i] = s + xx * (w.lateralBend[0] + w.lateralBend[1] * s) + yy * (w.elevationBend[0] + w.elevationBend[1] * s);
    exponent[i] = w.exponent[0] + w.exponent[1] * s - 0.5f * u;
    const bool inside = (s >= w.first) & (s < w.last);
    distance[i] = inside ? u : 1e30f;
  }
}

// Keeps those within the tube, in their order. \returns how many.
ECHORAMA_HOT int Sieve(const float* __restrict distance, const float* __restrict amplitudes, int count, float reachSquared,
                       Sieved& out)
{
  int kept = 0;
  for (int i = 0; i < count; ++i) {
    out.late[kept] = out.late[i];
    out.exponent[kept] = out.exponent[i];
    out.amplitude[kept] = amplitudes[i];
    kept += distance[i] < reachSquared;
  }
  return kept;
}

// Adds echoes to the fine row.
ECHORAMA_HOT void AddEchoes(const BrickView& v, const float* __restrict late, const float* __restrict exponent,
                            const float* __restrict amplitude, int count, float* __restrict fineRow)
{
  alignas(64) float re[batch], im[batch], fraction[batch];
  alignas(64) int place[batch];
  const float startTurn = v.turn, turnsPerMm = v.turnsPerMm, startFine = v.fine, finePerMm = v.finePerMm;
  const int base = v.fineBase, last = v.fineLast;
  for (int i = 0; i < count; ++i) {
    const float size = amplitude[i] * Exponential(std::min(std::max(exponent[i], -80.0f), 80.0f));
    // Sine and cosine of half the angle, then of the whole.
    const float turn = startTurn + turnsPerMm * late[i];
    const float half = turn - std::floor(turn + 0.5f);
    const float q = half * half;
    const float sine = half * (3.14159264f + q * (-5.16771008f + q * (2.55007752f + q * (-0.598291286f + q * 0.0776576603f))));
    const float cosine =
        1.0f + q * (-4.9348022f + q * (4.05871142f + q * (-1.33523998f + q * (0.235074509f + q * -0.0246274055f))));
    re[i] = size * (cosine * cosine - sine * sine);
    im[i] = size * (-2.0f * sine * cosine);
    const float fine = startFine + finePerMm * late[i];
    const float whole = std::floor(fine);
    fraction[i] = fine - whole;
    place[i] = base + static_cast<int>(whole);
  }
  for (int i = 0; i < count; ++i) {
    if (place[i] < 0 || place[i] > last)
      continue;
    float* at = fineRow + 2 * static_cast<std::ptrdiff_t>(place[i]);
    const float f = fraction[i], g = 1.0f - f;
    at[0] += g * re[i];
    at[1] += g * im[i];
    at[2] += f * re[i];
    at[3] += f * im[i];
  }
}

// row += weight * samples
ECHORAMA_HOT void AddWeighted(float weight, const float* samples, std::ptrdiff_t count, float* row)
{
  for (std::ptrdiff_t i = 0; i < count; ++i)
    row[i] += weight * samples[i];
}

// The samples of a row that an interval of scan depths reaches, and between them a finer row.
struct FineRow {
  FineRow(const DepthAxis& depthAxis, double sigma, double from, double to) : axis(depthAxis), pulseSigma(sigma)
  {
    perSample = std::max(1, static_cast<int>(std::ceil(axis.step * finePerSigma / sigma)));
    fineStep = axis.step / perSample;
    reach = static_cast<int>(std::ceil(pulseReach * sigma / axis.step));
    const double last = axis.count - 1.0;
    firstSample = static_cast<int>(std::clamp(std::floor((from - axis.first) / axis.step) - reach, 0.0, last + 1.0));
    lastSample = static_cast<int>(std::clamp(std::ceil((to - axis.first) / axis.step) + reach, -1.0, last));
    fineFirst = axis.first + (firstSample - reach) * axis.step;
    if (!Empty())
      values.assign(2 * static_cast<std::size_t>(Samples()) * static_cast<std::size_t>(perSample), 0.0f);
  }

  bool Empty() const { return firstSample > lastSample; }
  std::ptrdiff_t Samples() const { return lastSample - firstSample + 1 + 2 * reach; } // coarse ones that the fine row covers
  int FineLast() const { return static_cast<int>(Samples() * perSample - 2); }

  // row += the fine row convolved with the pulse.
  void AddTo(std::complex<float>* row) const
  {
    const std::ptrdiff_t covered = Samples(), count = lastSample - firstSample + 1;
    std::vector<float> sum(2 * static_cast<std::size_t>(count), 0.0f), phase(2 * static_cast<std::size_t>(covered));
    for (int p = 0; p < perSample; ++p) {
      for (std::ptrdiff_t i = 0; i < covered; ++i) {
        phase[static_cast<std::size_t>(2 * i)] = values[static_cast<std::size_t>(2 * (i * perSample + p))];
        phase[static_cast<std::size_t>(2 * i + 1)] = values[static_cast<std::size_t>(2 * (i * perSample + p) + 1)];
      }
      for (int q = 0; q <= 2 * reach; ++q) { // sample i takes the fine place (i + q) perSample + p
        const double away = ((q - reach) * axis.step + p * fineStep) / pulseSigma;
        if (std::abs(away) <= pulseReach)
          AddWeighted(static_cast<float>(std::exp(-0.5 * away * away)), phase.data() + 2 * q, 2 * count, sum.data());
      }
    }
    for (std::ptrdiff_t i = 0; i < count; ++i)
      row[firstSample + i] += std::complex<float>(sum[static_cast<std::size_t>(2 * i)], sum[static_cast<std::size_t>(2 * i + 1)]);
  }

  DepthAxis axis;
  double pulseSigma;
  int perSample = 1;
  double fineStep = 1.0, fineFirst = 0.0; // mm
  int reach = 1;                          // of the pulse, in samples
  int firstSample = 0, lastSample = -1;
  std::vector<float> values; // re, im
};

// The beam along a segment: what is linear between nodes.
class BeamNodes {
public:
  struct Node {
    double values[5]; // 1 / sigma^2 and half the curvature along fan and sweep, logarithm of the gain
  };

  BeamNodes(const SoundSegment& segment, const Transducer& transducer)
  {
    const int pieces = static_cast<int>(std::ceil(std::max(1.0, std::min(1e6, segment.length / nodeMm))));
    step_ = std::max(segment.length / pieces, 0.1); // differences over less would be rounding
    const double pulse = transducer.PulseSigmaMm() / segment.scanDepthPerMm;
    for (int i = 0; i <= pieces; ++i) {
      const BeamWidth width = WidthAt(transducer, segment.way + i * step_);
      // Mean power of speckle is the integral of the squared response.
      const double volume = std::pow(Pi, 1.5) * pulse * width.lateralSigma * width.elevationSigma;
      nodes_.push_back({{std::pow(width.lateralSigma, -2), std::pow(width.elevationSigma, -2), 0.5 * width.lateralCurvature,
                         0.5 * width.elevationCurvature, -0.5 * std::log(volume)}});
    }
  }

  int Pieces() const { return static_cast<int>(nodes_.size()) - 1; }
  double Step() const { return step_; }
  const Node& operator[](int i) const { return nodes_[static_cast<std::size_t>(i)]; }

  // The larger of the two standard deviations between two nodes, and the latest echo from within the tube.
  double Widest(int first, int last) const
  {
    double least = 1e300;
    for (int i = first; i <= last; ++i)
      least = std::min({least, (*this)[i].values[0], (*this)[i].values[1]});
    return 1.0 / std::sqrt(least);
  }
  double LargestDelay(double reach) const
  {
    double largest = 0.0;
    for (const Node& node : nodes_)
      largest =
          std::max(largest, reach * reach *
                                std::max(std::abs(node.values[2] / node.values[0]), std::abs(node.values[3] / node.values[1])));
    return largest;
  }

private:
  double step_ = 0.0;
  std::vector<Node> nodes_;
};

class SegmentSum {
public:
  SegmentSum(const SoundSegment& segment, const Scatterers& scatterers, const Transducer& transducer, double reach, FineRow& fine,
             const BeamNodes& nodes)
    : segment_(segment), scatterers_(scatterers), reach_(reach), fine_(fine), nodes_(nodes),
      up_(segment.direction.cross(segment.across)), turnsPerMm_(transducer.PhasePerMm() / (2.0 * Pi)),
      negative_(segment.amplitude < 0.0), logAmplitude_(std::log(std::abs(segment.amplitude)))
  {
    for (int axis = 0; axis < 3; ++axis) {
      view_.along[axis] = static_cast<float>(segment.direction[axis]);
      view_.across[axis] = static_cast<float>(segment.across[axis]);
      view_.up[axis] = static_cast<float>(up_[axis]);
    }
    view_.turnsPerMm = static_cast<float>(turnsPerMm_ * segment.scanDepthPerMm);
    view_.finePerMm = static_cast<float>(segment.scanDepthPerMm / fine.fineStep);
    view_.fineLast = fine.FineLast();
  }

  void Run()
  {
    const auto radius = [this](double begin, double end) {
      // Bricks reach a little further along than their centres.
      const int first = static_cast<int>(begin / nodes_.Step()) - 2, last = static_cast<int>(end / nodes_.Step()) + 3;
      return 1.02 * reach_ * nodes_.Widest(std::max(0, first), std::min(nodes_.Pieces(), last));
    };
    std::vector<std::uint32_t> near;
    scatterers_.FindNear(segment_.from, segment_.direction, segment_.length, radius, near);
    for (const std::uint32_t index : near)
      AddBrick(scatterers_.Bricks()[index]);
  }

private:
  void AddBrick(const Scatterers::Brick& brick)
  {
    const Eigen::Vector3d place = brick.centre - segment_.from;
    const double s = place.dot(segment_.direction);
    const Eigen::Vector3d half = brick.halfSize.cast<double>();
    const double halfAlong = half.dot(segment_.direction.cwiseAbs());
    if (s + halfAlong < 0.0 || s - halfAlong >= segment_.length)
      return;
    const int node = static_cast<int>(std::clamp(s / nodes_.Step(), 0.0, nodes_.Pieces() - 1.0));
    const double t = s - node * nodes_.Step();
    double value[5], slope[5];
    for (int i = 0; i < 5; ++i) {
      slope[i] = (nodes_[node + 1].values[i] - nodes_[node].values[i]) / nodes_.Step();
      value[i] = nodes_[node].values[i] + t * slope[i];
    }
    const double x = place.dot(segment_.across), y = place.dot(up_);
    const double halfAcross = half.dot(segment_.across.cwiseAbs()), halfUp = half.dot(up_.cwiseAbs());
    const double beside = std::max(0.0, std::abs(x) - halfAcross), above = std::max(0.0, std::abs(y) - halfUp);
    if (beside * beside * (value[0] - std::abs(slope[0]) * halfAlong) +
            above * above * (value[1] - std::abs(slope[1]) * halfAlong) >=
        reach_ * reach_)
      return;
    const double exponent = logAmplitude_ - segment_.attenuation * s + value[4];
    if (exponent < -70.0) // nothing of single precision would be left
      return;

    view_.x = static_cast<float>(x);
    view_.y = static_cast<float>(y);
    view_.first = static_cast<float>(-s);
    view_.last = static_cast<float>(segment_.length - s);
    const auto set = [&](float* to, int i) {
      to[0] = static_cast<float>(value[i]);
      to[1] = static_cast<float>(slope[i]);
    };
    set(view_.lateral, 0);
    set(view_.elevation, 1);
    set(view_.lateralBend, 2);
    set(view_.elevationBend, 3);
    view_.exponent[0] = static_cast<float>(exponent);
    view_.exponent[1] = static_cast<float>(slope[4] - segment_.attenuation);
    const double depth = segment_.scanDepth + segment_.scanDepthPerMm * s;
    const double turn = turnsPerMm_ * depth + (negative_ ? 0.5 : 0.0);
    view_.turn = static_cast<float>(turn - std::floor(turn));
    const double fine = (depth - fine_.fineFirst) / fine_.fineStep, base = std::floor(fine);
    if (!(std::abs(base) < 1e9))
      return;
    view_.fine = static_cast<float>(fine - base);
    view_.fineBase = static_cast<int>(base);

    const float *px = scatterers_.X(brick), *py = scatterers_.Y(brick), *pz = scatterers_.Z(brick),
                *amplitude = scatterers_.Amplitude(brick);
    // Of bricks that lie in the tube as a whole nothing needs to be sieved.
    const double outermost = std::pow(std::abs(x) + halfAcross, 2) * (value[0] + std::abs(slope[0]) * halfAlong) +
                             std::pow(std::abs(y) + halfUp, 2) * (value[1] + std::abs(slope[1]) * halfAlong);
    const bool whole = outermost < 0.999 * reach_ * reach_ && s - halfAlong > 0.0 && s + halfAlong < 0.999 * segment_.length;
    const std::uint32_t all = whole ? brick.count : brick.stride;
    for (std::uint32_t begin = 0; begin < all; begin += batch) {
      const int count = static_cast<int>(std::min<std::uint32_t>(batch, all - begin));
      Look(view_, px + begin, py + begin, pz + begin, count, sieved_.late, sieved_.exponent, distance_);
      if (whole) {
        AddEchoes(view_, sieved_.late, sieved_.exponent, amplitude + begin, count, fine_.values.data());
      } else {
        const int kept = Sieve(distance_, amplitude + begin, count, static_cast<float>(reach_ * reach_), sieved_);
        AddEchoes(view_, sieved_.late, sieved_.exponent, sieved_.amplitude, kept, fine_.values.data());
      }
    }
  }

  const SoundSegment& segment_;
  const Scatterers& scatterers_;
  double reach_;
  FineRow& fine_;
  const BeamNodes& nodes_;
  Eigen::Vector3d up_;
  double turnsPerMm_;
  bool negative_;
  double logAmplitude_;
  BrickView view_{};
  Sieved sieved_;
  float distance_[batch];
};

void CheckAxis(const DepthAxis& axis, const Transducer& transducer)
{
  const double sigma = transducer.PulseSigmaMm();
  if (!(axis.step >= 0.001 * sigma && axis.step <= 10.0 * sigma) || !std::isfinite(axis.first))
    throw Error(Error::Kind::InvalidParameter, "echoes: the depth axis begins at " + NumberText(axis.first) + " mm in steps of " +
                                                   NumberText(axis.step) + " mm; steps must be in [0.001, 10] times the " +
                                                   NumberText(sigma) + " mm of the pulse");
}

void CheckSegment(const SoundSegment& segment)
{
  if (!segment.from.allFinite() || !segment.direction.allFinite() || !segment.across.allFinite() ||
      !std::isfinite(segment.scanDepth + segment.scanDepthPerMm * segment.length) || !std::isfinite(segment.way) ||
      !std::isfinite(segment.amplitude) || !std::isfinite(segment.attenuation))
    throw Error(Error::Kind::BadInput, "echoes: a segment of the path of sound is not finite");
}

} // namespace

void AddSegmentEchoes(const SoundSegment& segment, const Scatterers& scatterers, const Transducer& transducer,
                      const DepthAxis& axis, std::complex<float>* row, double reach)
{
  CheckAxis(axis, transducer);
  CheckSegment(segment);
  if (!(reach > 0.0 && reach <= 6.0))
    throw Error(Error::Kind::InvalidParameter, "echoes: the reach is " + NumberText(reach) + " sigma; it must be in (0, 6]");
  const double end = segment.scanDepth + segment.scanDepthPerMm * segment.length;
  if (segment.amplitude == 0.0 || !(segment.length > 0.0) || !(segment.scanDepthPerMm > 0.0) || axis.count < 1 ||
      scatterers.Count() == 0)
    return;
  const BeamNodes nodes(segment, transducer);
  const double late = segment.scanDepthPerMm * nodes.LargestDelay(reach);
  FineRow fine(axis, transducer.PulseSigmaMm(), segment.scanDepth - late, end + late);
  if (fine.Empty())
    return;
  SegmentSum(segment, scatterers, transducer, reach, fine, nodes).Run();
  fine.AddTo(row);
}

void AddSurfaceEcho(const SurfaceEcho& echo, const Transducer& transducer, const DepthAxis& axis, std::complex<float>* row,
                    double weight)
{
  CheckAxis(axis, transducer);
  if (!std::isfinite(echo.scanDepth) || !std::isfinite(echo.amplitude) || !std::isfinite(weight))
    throw Error(Error::Kind::BadInput, "echoes: the echo of a surface is not finite");
  const double sigma = transducer.PulseSigmaMm(), phase = -transducer.PhasePerMm() * echo.scanDepth;
  const std::complex<double> size = weight * echo.amplitude * std::complex<double>(std::cos(phase), std::sin(phase));
  const double place = (echo.scanDepth - axis.first) / axis.step, reach = pulseReach * sigma / axis.step;
  const int first = static_cast<int>(std::clamp(std::ceil(place - reach), 0.0, static_cast<double>(axis.count)));
  const int last = static_cast<int>(std::clamp(std::floor(place + reach), -1.0, axis.count - 1.0));
  for (int i = first; i <= last; ++i) {
    const double away = (i - place) * axis.step / sigma;
    row[i] += std::complex<float>(size * std::exp(-0.5 * away * away));
  }
}

} // namespace echorama
