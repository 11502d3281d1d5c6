// SPDX-License-Identifier: BSD-3-Clause
// The pulse is the same at every depth, so no scatterer needs its own: each adds one complex number to a fine row (10
// samples per standard deviation of the pulse, shared out linearly between two), and the fine row meets the pulse once, at the
// end. What remains per scatterer is where it lies, a Gaussian and a phase.
//
// 1. Bricks. Of every brick beside the segment the place beside it is worked out in double precision; its box is tested against
//    the elliptic tube of the beam. The width of the beam, its curvature and all that enters the size of an echo are linear
//    over a brick (to 0.1% of the echoes at a depth of 30 mm, 3% within the first 5 mm). While one brick is summed, the next
//    comes from memory: a beam passes more than the caches hold.
// 2. Sieve: depth, distance and exponent of the scatterers of the brick, a vector at a time; those in the tube (a third) are
//    moved together, eight lanes at a time by a table of what to move where: at the edge of the tube a branch would be guessed
//    wrong.
// 3. Echo: exponential and sine by polynomials (relative 1e-6), in vectors, relative to the middle of the brick: so single
//    precision holds phases to 1e-5 of a turn, whatever the depth and wherever the world is.
// 4. Pulse: the fine row is split into its phases, so that the sum over the pulse is a sum of whole rows. Once for all segments
//    of a beam: a beam through small bodies has some twenty.
#include "EchoSum.h"
#include "Core/Base/Angles.h"
#include "Core/Base/Error.h"
#include "Core/Base/NumberText.h"
#include "VectorMath.h"
#include <algorithm>
#include <cmath>
#include <cstring>

namespace echorama {
namespace {

constexpr double pulseReach = 4.0;    // standard deviations in depth: 70 dB down
constexpr double finePerSigma = 10.0; // samples of the fine row
constexpr double nodeMm = 1.0;        // between the widths that are worked out
constexpr int lanes = Scatterers::lanes;
constexpr int batch = 512; // scatterers at once, a multiple of the lanes

// How the scatterers of one brick are seen; places relative to its centre, s along the segment.
struct BrickView {
  float along[3], across[3], up[3];
  float x, y;                             // of the centre
  float first, last;                      // s that count
  float reachSquared;                     // distance from the axis, in standard deviations
  float lateral[2], elevation[2];         // 1 / sigma^2 and its change per mm of s
  float lateralBend[2], elevationBend[2]; // half the curvature and its change
  float exponent[2];                      // of the size of the echo on the axis
  float turn, turnsPerMm;                 // phase, in whole turns
  float fine, finePerMm;                  // place in the fine row, from fineBase
  int fineBase, fineLast;                 // the last place that has a successor
};

// Scatterers that are heard: how much deeper than the centre of the brick they seem, the exponent of the size of their echo,
// and their own amplitude. What follows the last one, up to whole lanes, is worked out too and dropped.
struct Sieved {
  alignas(64) float late[batch], exponent[batch], amplitude[batch];
};

using Four = float __attribute__((vector_size(16)));
using Eight = float __attribute__((vector_size(32)));
using EightPlaces = std::int32_t __attribute__((vector_size(32)));

// For each set of eight lanes (a bit each) those lanes in their order, then any.
struct Packings {
  alignas(32) EightPlaces of[256];
  unsigned char count[256];

  Packings()
  {
    for (unsigned int set = 0; set < 256; ++set) {
      of[set] = EightPlaces{};
      count[set] = 0;
      for (int lane = 0; lane < 8; ++lane)
        if (set >> lane & 1)
          of[set][count[set]++] = lane;
    }
  }
};
const Packings packings;

// The lanes of eight bytes that are 1, a bit each.
inline std::size_t BitsOf(const unsigned char* bytes)
{
  std::uint64_t all;
  std::memcpy(&all, bytes, sizeof all);
  static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__);
  return static_cast<std::size_t>(all * 0x0102040810204080u >> 56);
}

// Depth and exponent of those scatterers that are in the tube, in their order. \returns how many.
int Sieve(const BrickView& v, const float* __restrict px, const float* __restrict py, const float* __restrict pz,
          const float* __restrict amplitudes, int count, Sieved& out)
{
  const BrickView w = v;
  int kept = 0;
  for (int begin = 0; begin < count; begin += lanes) {
    alignas(64) float late[lanes], exponent[lanes];
    alignas(64) int inside[lanes]; // as wide as the numbers: with bytes the whole loop becomes one of short vectors
    unsigned char flags[lanes];
    for (int i = 0; i < lanes; ++i) {
      const float x0 = px[begin + i], y0 = py[begin + i], z0 = pz[begin + i];
      const float s = w.along[0] * x0 + w.along[1] * y0 + w.along[2] * z0;
      const float x = w.x + (w.across[0] * x0 + w.across[1] * y0 + w.across[2] * z0);
      const float y = w.y + (w.up[0] * x0 + w.up[1] * y0 + w.up[2] * z0);
      const float xx = x * x, yy = y * y;
      const float u = xx * (w.lateral[0] + w.lateral[1] * s) + yy * (w.elevation[0] + w.elevation[1] * s);
      late[i] = s + xx * (w.lateralBend[0] + w.lateralBend[1] * s) + yy * (w.elevationBend[0] + w.elevationBend[1] * s);
      exponent[i] = w.exponent[0] + w.exponent[1] * s - 0.5f * u;
      inside[i] = (s >= w.first) & (s < w.last) & (u < w.reachSquared) ? 1 : 0;
    }
    for (int i = 0; i < lanes; ++i)
      flags[i] = static_cast<unsigned char>(inside[i]);
    for (int half = 0; half < lanes; half += 8) {
      const std::size_t bits = BitsOf(flags + half);
      const EightPlaces these = packings.of[bits];
      const auto pack = [&](const float* from, float* to) {
        Eight all;
        std::memcpy(&all, from + half, sizeof all);
#if defined(__clang__)
        Eight packed{};
        for (int lane = 0; lane < 8; ++lane)
          packed[lane] = all[these[lane]];
        all = packed;
#else
        all = __builtin_shuffle(all, these);
#endif
        std::memcpy(to + kept, &all, sizeof all);
      };
      pack(late, out.late);
      pack(exponent, out.exponent);
      pack(amplitudes + begin, out.amplitude);
      kept += packings.count[bits];
    }
  }
  return kept;
}

// Adds echoes to the fine row.
void AddEchoes(const BrickView& v, const Sieved& in, int count, float* __restrict fineRow)
{
  const float startTurn = v.turn, turnsPerMm = v.turnsPerMm, startFine = v.fine, finePerMm = v.finePerMm;
  const int base = v.fineBase;
  const auto last = static_cast<unsigned int>(v.fineLast);
  for (int begin = 0; begin < count; begin += lanes) {
    alignas(64) float echo[lanes][4]; // what goes to two places of the row
    alignas(64) int place[lanes];
    for (int i = 0; i < lanes; ++i) {
      const float late = in.late[begin + i];
      const float size = in.amplitude[begin + i] * Exponential(std::min(80.0f, std::max(-80.0f, in.exponent[begin + i])));
      float cosine, sine;
      CosineAndSine(startTurn + turnsPerMm * late, cosine, sine);
      const float re = size * cosine, im = size * -sine;
      const float fine = startFine + finePerMm * late;
      const float whole = std::floor(std::min(1e9f, std::max(-1e9f, fine))); // lanes beyond the count hold anything
      const float f = fine - whole, g = 1.0f - f;
      place[i] = base + static_cast<int>(whole);
      echo[i][0] = g * re;
      echo[i][1] = g * im;
      echo[i][2] = f * re;
      echo[i][3] = f * im;
    }
    const int these = std::min(lanes, count - begin);
    for (int i = 0; i < these; ++i) {
      if (static_cast<unsigned int>(place[i]) > last)
        continue;
      float* const at = fineRow + 2 * static_cast<std::ptrdiff_t>(place[i]);
      Four sum, more;
      std::memcpy(&sum, at, sizeof sum);
      std::memcpy(&more, echo[i], sizeof more);
      sum += more;
      std::memcpy(at, &sum, sizeof sum);
    }
  }
}

// row += weight * samples
void AddWeighted(float weight, const float* samples, std::ptrdiff_t count, float* row)
{
  for (std::ptrdiff_t i = 0; i < count; ++i)
    row[i] += weight * samples[i];
}

// A finer row between the samples of a row, and how the one becomes the other.
class FineRow {
public:
  FineRow(const DepthAxis& depthAxis, double sigma) : axis(depthAxis)
  {
    perSample = std::max(1, static_cast<int>(std::ceil(axis.step * finePerSigma / sigma)));
    fineStep = axis.step / perSample;
    reach = static_cast<int>(std::ceil(pulseReach * sigma / axis.step));
    fineFirst = axis.first - reach * axis.step;
    if (axis.count > 0)
      values.assign(2 * static_cast<std::size_t>(axis.count + 2 * reach) * static_cast<std::size_t>(perSample), 0.0f);
    for (int p = 0; p < perSample; ++p)
      for (int q = 0; q <= 2 * reach; ++q) { // sample i takes the fine place (i + q) perSample + p
        const double away = ((q - reach) * axis.step + p * fineStep) / sigma;
        pulse_.push_back(std::abs(away) <= pulseReach ? static_cast<float>(std::exp(-0.5 * away * away)) : 0.0f);
      }
  }

  // Of an interval of scan depths that echoes come from. \returns whether any sample hears them.
  bool Use(double from, double to)
  {
    const double last = axis.count - 1.0;
    const int first = static_cast<int>(std::clamp(std::floor((from - axis.first) / axis.step) - reach, 0.0, last + 1.0));
    const int end = static_cast<int>(std::clamp(std::ceil((to - axis.first) / axis.step) + reach, -1.0, last)) + 1;
    if (first >= end)
      return false;
    if (first_ >= end_) {
      first_ = first;
      end_ = end;
    }
    first_ = std::min(first_, first);
    end_ = std::max(end_, end);
    return true;
  }

  int FineLast() const { return static_cast<int>(values.size() / 2) - 2; }

  // row += the fine row convolved with the pulse, and the fine row is empty again.
  void MoveTo(std::complex<float>* row)
  {
    if (first_ >= end_)
      return;
    const std::ptrdiff_t count = end_ - first_, covered = count + 2 * reach;
    float* const fine = values.data() + 2 * static_cast<std::ptrdiff_t>(first_) * perSample;
    sum_.assign(2 * static_cast<std::size_t>(count), 0.0f);
    phase_.resize(2 * static_cast<std::size_t>(covered));
    for (int p = 0; p < perSample; ++p) {
      for (std::ptrdiff_t i = 0; i < covered; ++i) {
        phase_[static_cast<std::size_t>(2 * i)] = fine[2 * (i * perSample + p)];
        phase_[static_cast<std::size_t>(2 * i + 1)] = fine[2 * (i * perSample + p) + 1];
      }
      for (int q = 0; q <= 2 * reach; ++q) {
        const float weight = pulse_[static_cast<std::size_t>(p * (2 * reach + 1) + q)];
        if (weight != 0.0f)
          AddWeighted(weight, phase_.data() + 2 * q, 2 * count, sum_.data());
      }
    }
    for (std::ptrdiff_t i = 0; i < count; ++i)
      row[first_ + i] += std::complex<float>(sum_[static_cast<std::size_t>(2 * i)], sum_[static_cast<std::size_t>(2 * i + 1)]);
    std::fill(fine, fine + 2 * covered * perSample, 0.0f);
    first_ = end_ = 0;
  }

  DepthAxis axis;
  int perSample = 1;
  double fineStep = 1.0, fineFirst = 0.0; // mm
  int reach = 1;                          // of the pulse, in samples
  std::vector<float> values;              // re, im

private:
  std::vector<float> pulse_;       // by phase and sample
  int first_ = 0, end_ = 0;        // samples that hear something
  std::vector<float> sum_, phase_; // buffers
};

// The beam along a segment: what is linear between nodes.
class BeamNodes {
public:
  struct Node {
    double values[5]; // 1 / sigma^2 and half the curvature along fan and sweep, logarithm of the gain
    double slopes[5]; // to the next, per mm
  };

  void Set(const SoundSegment& segment, const Transducer& transducer)
  {
    nodes_.clear();
    const int pieces = static_cast<int>(std::ceil(std::max(1.0, std::min(1e6, segment.length / nodeMm))));
    step_ = std::max(segment.length / pieces, 0.1); // differences over less would be rounding
    const double pulse = transducer.PulseSigmaMm() / segment.scanDepthPerMm;
    for (int i = 0; i <= pieces; ++i) {
      const BeamWidth width = WidthAt(transducer, segment.way + i * step_);
      // Mean power of speckle is the integral of the squared response.
      const double volume = std::pow(Pi, 1.5) * pulse * width.lateralSigma * width.elevationSigma;
      nodes_.push_back({{std::pow(width.lateralSigma, -2), std::pow(width.elevationSigma, -2), 0.5 * width.lateralCurvature,
                         0.5 * width.elevationCurvature, -0.5 * std::log(volume)},
                        {}});
    }
    for (std::size_t i = 1; i < nodes_.size(); ++i)
      for (int n = 0; n < 5; ++n)
        nodes_[i - 1].slopes[n] = (nodes_[i].values[n] - nodes_[i - 1].values[n]) / step_;
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

class EchoSum::Row {
public:
  Row(const Scatterers& scatterers, const Transducer& transducer, const DepthAxis& axis, double reach)
    : scatterers_(scatterers), transducer_(transducer), reach_(reach), fine_(axis, transducer.PulseSigmaMm())
  {
    for (BrickView& view : views_) {
      view.reachSquared = static_cast<float>(reach * reach);
      view.fineLast = fine_.FineLast();
    }
  }

  void Add(const SoundSegment& segment)
  {
    const double end = segment.scanDepth + segment.scanDepthPerMm * segment.length;
    if (segment.amplitude == 0.0 || !(segment.length > 0.0) || !(segment.scanDepthPerMm > 0.0) || fine_.axis.count < 1 ||
        scatterers_.Count() == 0)
      return;
    nodes_.Set(segment, transducer_);
    const double late = segment.scanDepthPerMm * nodes_.LargestDelay(reach_);
    if (!fine_.Use(segment.scanDepth - late, end + late))
      return;
    segment_ = segment;
    up_ = segment.direction.cross(segment.across);
    turnsPerMm_ = transducer_.PhasePerMm() / (2.0 * Pi);
    logAmplitude_ = std::log(std::abs(segment.amplitude));
    for (BrickView& view : views_) {
      for (int axis = 0; axis < 3; ++axis) {
        view.along[axis] = static_cast<float>(segment.direction[axis]);
        view.across[axis] = static_cast<float>(segment.across[axis]);
        view.up[axis] = static_cast<float>(up_[axis]);
      }
      view.turnsPerMm = static_cast<float>(turnsPerMm_ * segment.scanDepthPerMm);
      view.finePerMm = static_cast<float>(segment.scanDepthPerMm / fine_.fineStep);
    }

    const auto radius = [this](double from, double to) {
      // Bricks reach a little further along than their centres.
      const int first = static_cast<int>(from / nodes_.Step()) - 2, last = static_cast<int>(to / nodes_.Step()) + 3;
      return 1.02 * reach_ * nodes_.Widest(std::max(0, first), std::min(nodes_.Pieces(), last));
    };
    near_.clear();
    scatterers_.FindBeside(segment.from, segment.direction, segment.length, radius, near_);
    // While one brick is summed the next one comes from memory.
    const Scatterers::Brick* const bricks = scatterers_.Bricks().data();
    const Scatterers::Brick* waiting = nullptr;
    int current = 0;
    for (std::size_t i = 0; i < near_.size(); ++i) {
      __builtin_prefetch(bricks + near_[std::min(i + 3, near_.size() - 1)]);
      const Scatterers::Brick& brick = bricks[near_[i]];
      if (!View(brick, views_[1 - current]))
        continue;
      const char* const list = reinterpret_cast<const char*>(scatterers_.X(brick));
      for (std::size_t line = 0; line < 4 * sizeof(float) * brick.stride; line += 64)
        __builtin_prefetch(list + line);
      if (waiting)
        AddBrick(*waiting, views_[current]);
      waiting = &brick;
      current = 1 - current;
    }
    if (waiting)
      AddBrick(*waiting, views_[current]);
  }

  void MoveTo(std::complex<float>* row) { fine_.MoveTo(row); }

private:
  // How a brick is seen. \returns false for one that is not heard.
  bool View(const Scatterers::Brick& brick, BrickView& view) const
  {
    const Eigen::Vector3d place = brick.centre - segment_.from;
    const double s = place.dot(segment_.direction);
    const Eigen::Vector3d half = brick.halfSize.cast<double>();
    const double halfAlong = half.dot(segment_.direction.cwiseAbs());
    if (s + halfAlong < 0.0 || s - halfAlong >= segment_.length)
      return false;
    const int index = static_cast<int>(std::clamp(s / nodes_.Step(), 0.0, nodes_.Pieces() - 1.0));
    const double t = s - index * nodes_.Step();
    const BeamNodes::Node& node = nodes_[index];
    double value[5];
    for (int i = 0; i < 5; ++i)
      value[i] = node.values[i] + t * node.slopes[i];
    const double x = place.dot(segment_.across), y = place.dot(up_);
    const double halfAcross = half.dot(segment_.across.cwiseAbs()), halfUp = half.dot(up_.cwiseAbs());
    const double beside = std::max(0.0, std::abs(x) - halfAcross), above = std::max(0.0, std::abs(y) - halfUp);
    if (beside * beside * (value[0] - std::abs(node.slopes[0]) * halfAlong) +
            above * above * (value[1] - std::abs(node.slopes[1]) * halfAlong) >=
        reach_ * reach_)
      return false;
    const double exponent = logAmplitude_ - segment_.attenuation * s + value[4];
    if (exponent < -70.0) // nothing of single precision would be left
      return false;

    view.x = static_cast<float>(x);
    view.y = static_cast<float>(y);
    view.first = static_cast<float>(-s);
    view.last = static_cast<float>(segment_.length - s);
    const auto set = [&](float* to, int i) {
      to[0] = static_cast<float>(value[i]);
      to[1] = static_cast<float>(node.slopes[i]);
    };
    set(view.lateral, 0);
    set(view.elevation, 1);
    set(view.lateralBend, 2);
    set(view.elevationBend, 3);
    view.exponent[0] = static_cast<float>(exponent);
    view.exponent[1] = static_cast<float>(node.slopes[4] - segment_.attenuation);
    const double depth = segment_.scanDepth + segment_.scanDepthPerMm * s;
    const double turn = turnsPerMm_ * depth + (segment_.amplitude < 0.0 ? 0.5 : 0.0);
    view.turn = static_cast<float>(turn - std::floor(turn));
    const double fine = (depth - fine_.fineFirst) / fine_.fineStep, base = std::floor(fine);
    if (!(std::abs(base) < 1e9))
      return false;
    view.fine = static_cast<float>(fine - base);
    view.fineBase = static_cast<int>(base);
    return true;
  }

  void AddBrick(const Scatterers::Brick& brick, const BrickView& view)
  {
    const float* list = scatterers_.X(brick);
    const std::size_t stride = brick.stride;
    for (std::size_t begin = 0; begin < stride; begin += batch) {
      const int count = static_cast<int>(std::min<std::size_t>(batch, stride - begin));
      const int kept =
          Sieve(view, list + begin, list + stride + begin, list + 2 * stride + begin, list + 3 * stride + begin, count, sieved_);
      AddEchoes(view, sieved_, kept, fine_.values.data());
    }
  }

  const Scatterers& scatterers_;
  const Transducer& transducer_;
  double reach_;
  FineRow fine_;
  // Of the segment:
  SoundSegment segment_;
  BeamNodes nodes_;
  std::vector<std::uint32_t> near_; // bricks
  Eigen::Vector3d up_ = Eigen::Vector3d::Zero();
  double turnsPerMm_ = 0.0, logAmplitude_ = 0.0;
  BrickView views_[2] = {};
  Sieved sieved_{};
};

EchoSum::EchoSum(const Scatterers& scatterers, const Transducer& transducer, const DepthAxis& axis, double reach)
{
  CheckAxis(axis, transducer);
  if (!(reach > 0.0 && reach <= 6.0))
    throw Error(Error::Kind::InvalidParameter, "echoes: the reach is " + NumberText(reach) + " sigma; it must be in (0, 6]");
  row_ = std::make_unique<Row>(scatterers, transducer, axis, reach);
}

EchoSum::~EchoSum() = default;
EchoSum::EchoSum(EchoSum&&) noexcept = default;

void EchoSum::Add(const SoundSegment& segment)
{
  CheckSegment(segment);
  row_->Add(segment);
}

void EchoSum::MoveTo(std::complex<float>* row)
{
  row_->MoveTo(row);
}

void AddSegmentEchoes(const SoundSegment& segment, const Scatterers& scatterers, const Transducer& transducer,
                      const DepthAxis& axis, std::complex<float>* row, double reach)
{
  EchoSum sum(scatterers, transducer, axis, reach);
  sum.Add(segment);
  sum.MoveTo(row);
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
