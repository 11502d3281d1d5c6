// SPDX-License-Identifier: BSD-3-Clause
// 1. What the threshold is measured from: the background, or, without one, medians of squares of 32 pixels, interpolated.
// 2. One pass over the bytes of the frame: pieces of rows in which nothing exceeds the threshold are passed over by vector
// instructions;
//    the others become runs of lit pixels. The threshold grows with the noise that the background's brightness brings.
// 3. Runs that touch, also at corners, are joined (union-find) to candidates; one with two maxima and a dip between them is two.
// 4. Candidates near each other are fitted together, over one plane (SpotFit). A long spot that one Gaussian does not explain is
// tried
//    as two. Large ones are fitted to means of squares of pixels: their place is as well known, and time stays bounded.
//
// Nothing that is smaller than the lens can draw is a spot: hot pixels are refused by their size.
#include "SpotDetector.h"
#include "Core/Base/JoinedSets.h"
#include "Core/Base/NumberText.h"
#include <algorithm>
#include <array>
#include <cmath>
#include <Eigen/LU>

namespace echorama {

ParameterList Describe(SpotDetectorParameters& p)
{
  return {
      Parameter("Method", Choice(p.method, {"gaussian", "centroid"}),
                "How a spot's place is found: by a fit that knows background slopes and saturation, or as the centre of mass."),
      Parameter("Threshold", p.threshold, {1, 250}, "grey levels", "What exceeds the background by this is lit."),
      Parameter("Significance", p.significance, {0, 20}, "sigma", "And by this many standard deviations of the noise.")
          .Advanced(),
      Parameter("MinimumPixels", p.minimumPixels, {1, 1000}, "pixels", "Fewer lit ones that touch are noise.").Advanced(),
      Parameter("MinimumSize", p.minimumSize, {0, 10}, "pixels",
                "Standard deviation of the smallest spot; a hot pixel is smaller.")
          .Advanced(),
      Parameter("MaximumSize", p.maximumSize, {1, 100}, "pixels", "Standard deviation of the largest spot.").Advanced(),
      Parameter("ReadNoise", p.readNoise, {0, 50}, "grey levels", "Noise of the camera in the dark."),
      Parameter("GreyPerElectron", p.greyPerElectron, {0, 10}, "grey levels",
                "What one electron adds: the noise's variance grows by it with every grey level."),
      Parameter("Saturation", p.saturation, {32, 255}, "grey levels", "Pixels with this or more say nothing.").Advanced(),
      Parameter("MaximumSpots", p.maximumSpots, {1, 64}, "", "Of one frame; the brightest count.").Advanced(),
      Parameter("MaximumChange", p.maximumChange, {0.001, 1}, "",
                "With more of the picture above the threshold it is not lights that changed: nothing is found then.")
          .Advanced(),
  };
}

namespace {

constexpr int Block = 32;
constexpr double TooBrightShare = 0.5;
constexpr int GroupLimit = 4;
constexpr double WorstAlone = 8.0; // chi squared
constexpr double OwnLight = 0.15;  // of a spot's peak: what is weaker beside it is no other light

// The largest excess of the frame over the floor, and the largest value of the frame.
void Largest(const std::uint8_t* frame, const std::uint8_t* floor, int count, int& excess, int& value)
{
  std::uint8_t largest = 0, brightest = 0;
  for (int x = 0; x < count; ++x) {
    const std::uint8_t higher = frame[x] > floor[x] ? frame[x] : floor[x];
    const auto above = static_cast<std::uint8_t>(higher - floor[x]);
    largest = above > largest ? above : largest;
    brightest = frame[x] > brightest ? frame[x] : brightest;
  }
  excess = largest;
  value = brightest;
}

int CountFrom(const std::uint8_t* frame, int count, std::uint8_t level)
{
  int sum = 0;
  for (int begin = 0; begin < count; begin += 128) {
    std::uint8_t part = 0;
    const int end = std::min(begin + 128, count);
    for (int x = begin; x < end; ++x)
      part = static_cast<std::uint8_t>(part + (frame[x] >= level ? 1 : 0));
    sum += part;
  }
  return sum;
}

void Ramp(float from, float step, int count, std::uint8_t* out)
{
  for (int x = 0; x < count; ++x)
    out[x] = static_cast<std::uint8_t>(from + step * static_cast<float>(x) + 0.5f);
}

double LongRadius(const Eigen::Matrix2d& covariance)
{
  const double mean = 0.5 * covariance.trace(),
               spread = std::hypot(0.5 * (covariance(0, 0) - covariance(1, 1)), covariance(0, 1));
  return std::sqrt(mean + spread);
}

double ShortRadius(const Eigen::Matrix2d& covariance)
{
  const double mean = 0.5 * covariance.trace(),
               spread = std::hypot(0.5 * (covariance(0, 0) - covariance(1, 1)), covariance(0, 1));
  return std::sqrt(std::max(mean - spread, 1e-6));
}

// Eigenvalues within [low^2, high^2].
Eigen::Matrix2d Bounded(const Eigen::Matrix2d& covariance, double low, double high)
{
  const double angle = 0.5 * std::atan2(2.0 * covariance(0, 1), covariance(0, 0) - covariance(1, 1));
  const double lengths[2] = {std::clamp(LongRadius(covariance), low, high), std::clamp(ShortRadius(covariance), low, high)};
  const Eigen::Vector2d axis(std::cos(angle), std::sin(angle)), across(-axis.y(), axis.x());
  return lengths[0] * lengths[0] * axis * axis.transpose() + lengths[1] * lengths[1] * across * across.transpose();
}

double WindowRadius(const GaussianSpot& spot)
{
  return std::max(6.0, 4.5 * LongRadius(spot.precision.inverse()));
}

} // namespace

// Lit pixels that touch, and what a fit begins with.
struct SpotDetector::Candidate {
  int left, right, top, bottom; // the box, ends included
  std::vector<Run> runs;
  int pixels = 0, saturated = 0;
  double highest = 0.0;
  std::vector<GaussianSpot> starts;
};

double SpotDetector::Source::Value(int x, int y) const
{
  const double grey = frame[static_cast<std::ptrdiff_t>(y) * width + x];
  return background ? grey - static_cast<double>(background->At(x, y)) : grey;
}

double SpotDetector::Source::Background(int x, int y) const
{
  return background ? static_cast<double>(background->At(x, y)) : 0.0;
}

SpotDetector::SpotDetector(const SpotDetectorParameters& parameters)
  : parameters_(parameters), noise_{parameters.readNoise, parameters.greyPerElectron}
{
  CheckRanges(parameters);
  for (int floor = 0; floor < 256; ++floor) // a background is noisy, too
    thresholds_[floor] = static_cast<std::uint8_t>(std::min(
        255.0, std::ceil(std::max(parameters.threshold, parameters.significance * std::sqrt(1.2 * noise_.Variance(floor))))));
}

SpotFrame SpotDetector::Detect(const GreyFrame& frame, const LightsOffBackground* background)
{
  if (frame.data == nullptr || frame.width < 8 || frame.height < 8)
    throw Error(Error::Kind::BadInput, "a frame must have 8 x 8 pixels at least");
  if (background != nullptr && !(background->Fits(frame) && background->IsComplete()))
    throw Error(Error::Kind::BadInput, "the background is not complete, or not as large as the frame");

  Source source{frame.data, nullptr, background, frame.width, frame.height};
  const std::size_t size = static_cast<std::size_t>(frame.width) * static_cast<std::size_t>(frame.height);
  if (frame.pixelStep != 1 || frame.rowStep != frame.width) {
    mono_.resize(size);
    for (int y = 0; y < frame.height; ++y)
      for (int x = 0; x < frame.width; ++x)
        mono_[static_cast<std::size_t>(y) * static_cast<std::size_t>(frame.width) + static_cast<std::size_t>(x)] = frame(x, y);
    source.frame = mono_.data();
  }
  if (background != nullptr)
    source.floor = background->RoundedRow(0);
  else {
    if (parameters_.method == SpotMethod::Gaussian) {
      surroundings_.resize(size);
      MakeSurroundings(source); // of every pixel
    } else
      surroundings_.assign(size, 0); // eq. 7.1 knows no surroundings
    source.floor = surroundings_.data();
  }

  SpotFrame out;
  FindRuns(source, out);
  if (out.state != FrameState::Good)
    return out;
  std::vector<Candidate> candidates = Join(source);
  std::sort(candidates.begin(), candidates.end(), [](const Candidate& a, const Candidate& b) { return a.pixels > b.pixels; });
  if (candidates.size() > 4 * static_cast<std::size_t>(parameters_.maximumSpots)) {
    out.refused += static_cast<int>(candidates.size()) - 4 * parameters_.maximumSpots;
    candidates.resize(4 * static_cast<std::size_t>(parameters_.maximumSpots));
  }

  if (parameters_.method == SpotMethod::Centroid) {
    for (const Candidate& candidate : candidates)
      AddCentroid(source, candidate, out);
  } else {
    std::vector<bool> done(candidates.size(), false);
    for (std::size_t i = 0; i < candidates.size(); ++i) {
      if (done[i])
        continue;
      std::vector<const Candidate*> group{&candidates[i]};
      std::size_t starts = candidates[i].starts.size();
      done[i] = true;
      for (std::size_t member = 0; member < group.size(); ++member)
        for (std::size_t j = 0; j < candidates.size(); ++j) {
          if (done[j] || starts + candidates[j].starts.size() > GroupLimit)
            continue;
          const GaussianSpot &a = group[member]->starts.front(), &b = candidates[j].starts.front();
          if ((a.centre - b.centre).norm() < 0.7 * (WindowRadius(a) + WindowRadius(b))) {
            done[j] = true;
            starts += candidates[j].starts.size();
            group.push_back(&candidates[j]);
          }
        }
      FitGroup(source, group, out);
    }
  }
  std::sort(out.spots.begin(), out.spots.end(), [](const Spot& a, const Spot& b) { return a.Brightness() > b.Brightness(); });
  if (out.spots.size() > static_cast<std::size_t>(parameters_.maximumSpots))
    out.spots.resize(static_cast<std::size_t>(parameters_.maximumSpots));
  return out;
}

void SpotDetector::MakeSurroundings(const Source& source)
{
  const int columns = (source.width + Block - 1) / Block, rows = (source.height + Block - 1) / Block;
  std::vector<float> medians(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows));
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column) {
      std::array<std::uint8_t, 16> seen{};
      std::size_t count = 0;
      for (int y = row * Block + Block / 8; y < std::min(source.height, (row + 1) * Block); y += Block / 4)
        for (int x = column * Block + Block / 8; x < std::min(source.width, (column + 1) * Block); x += Block / 4)
          seen[count++] = source.frame[static_cast<std::ptrdiff_t>(y) * source.width + x];
      if (count == 0) // a strip at the border
        seen[count++] = source.frame[static_cast<std::ptrdiff_t>(std::min(source.height - 1, row * Block)) * source.width +
                                     std::min(source.width - 1, column * Block)];
      const auto middle = seen.begin() + static_cast<std::ptrdiff_t>(count / 2);
      std::nth_element(seen.begin(), middle, seen.begin() + static_cast<std::ptrdiff_t>(count));
      medians[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) + static_cast<std::size_t>(column)] = *middle;
    }
  std::vector<float> line(static_cast<std::size_t>(columns));
  for (int y = 0; y < source.height; ++y) {
    const float at = std::clamp((static_cast<float>(y) + 0.5f) / Block - 0.5f, 0.0f, static_cast<float>(rows - 1));
    const int upper = std::min(static_cast<int>(at), std::max(rows - 2, 0)), lower = std::min(upper + 1, rows - 1);
    const float share = at - static_cast<float>(upper);
    for (std::size_t c = 0; c < line.size(); ++c)
      line[c] = (1.0f - share) * medians[static_cast<std::size_t>(upper) * line.size() + c] +
                share * medians[static_cast<std::size_t>(lower) * line.size() + c];
    std::uint8_t* out = surroundings_.data() + static_cast<std::ptrdiff_t>(y) * source.width;
    for (int piece = -1; piece < columns; ++piece) { // between the middles of neighbouring squares, and to the borders
      const int begin = std::max(0, piece * Block + Block / 2), end = std::min(source.width, (piece + 1) * Block + Block / 2);
      if (begin >= end)
        continue;
      const float left = line[static_cast<std::size_t>(std::max(piece, 0))],
                  right = line[static_cast<std::size_t>(std::min(piece + 1, columns - 1))];
      const float step = (right - left) / Block;
      Ramp(left + step * (static_cast<float>(begin - piece * Block - Block / 2) + 0.5f), step, end - begin, out + begin);
    }
  }
}

void SpotDetector::FindRuns(const Source& source, SpotFrame& out)
{
  runs_.clear();
  constexpr int Piece = 64;
  const int least = thresholds_[0];
  const std::ptrdiff_t size = static_cast<std::ptrdiff_t>(source.width) * source.height;
  std::ptrdiff_t lit = 0, saturated = 0;
  for (int y = 0; y < source.height; ++y) {
    const std::uint8_t *frame = source.frame + static_cast<std::ptrdiff_t>(y) * source.width,
                       *floor = source.floor + static_cast<std::ptrdiff_t>(y) * source.width;
    int excess = 0, brightest = 0;
    Largest(frame, floor, source.width, excess, brightest);
    if (brightest >= parameters_.saturation)
      saturated += CountFrom(frame, source.width, static_cast<std::uint8_t>(parameters_.saturation));
    if (excess < least)
      continue;
    int begin = -1; // of the run that is open
    for (int piece = 0; piece < source.width; piece += Piece) {
      const int end = std::min(piece + Piece, source.width);
      Largest(frame + piece, floor + piece, end - piece, excess, brightest);
      if (excess < least) {
        if (begin >= 0)
          runs_.push_back({y, begin, piece});
        begin = -1;
        continue;
      }
      for (int x = piece; x < end; ++x) {
        const bool isLit = frame[x] - floor[x] >= thresholds_[floor[x]];
        lit += isLit;
        if (isLit && begin < 0)
          begin = x;
        else if (!isLit && begin >= 0) {
          runs_.push_back({y, begin, x});
          begin = -1;
        }
      }
    }
    if (begin >= 0)
      runs_.push_back({y, begin, source.width});
  }
  out.saturatedShare = static_cast<double>(saturated) / static_cast<double>(size);
  out.changedShare = static_cast<double>(lit) / static_cast<double>(size);
  const auto percent = [](double share) { return NumberText(std::round(1000.0 * share) / 10.0) + "%"; };
  if (out.saturatedShare > TooBrightShare) {
    out.state = FrameState::TooBright;
    out.message = percent(out.saturatedShare) + " of the picture is saturated: too much light falls on the shell; "
                                                "shade it, or shorten the exposure";
  } else if (out.changedShare > parameters_.maximumChange) {
    out.state = FrameState::Changed;
    out.message = percent(out.changedShare) +
                  " of the picture is brighter than its background: the light in the room has changed, "
                  "or the camera has moved";
  }
}

std::vector<SpotDetector::Candidate> SpotDetector::Join(const Source& source)
{
  JoinedSets labels(runs_.size());
  std::size_t above = 0; // the first run of the row above that may still touch
  for (std::size_t i = 0; i < runs_.size(); ++i) {
    const Run& run = runs_[i];
    while (above < i && (runs_[above].y < run.y - 1 || (runs_[above].y == run.y - 1 && runs_[above].end < run.begin)))
      ++above;
    for (std::size_t j = above; j < i && runs_[j].y == run.y - 1 && runs_[j].begin <= run.end; ++j)
      labels.Join(j, i);
  }

  std::vector<Candidate> joined;
  std::vector<int> place(runs_.size(), -1);
  for (std::size_t i = 0; i < runs_.size(); ++i) {
    const Run& run = runs_[i];
    int& at = place[labels.Of(i)];
    if (at < 0) {
      at = static_cast<int>(joined.size());
      joined.push_back({run.begin, run.end - 1, run.y, run.y, {}, 0, 0, 0.0, {}});
    }
    Candidate& c = joined[static_cast<std::size_t>(at)];
    c.left = std::min(c.left, run.begin);
    c.right = std::max(c.right, run.end - 1);
    c.bottom = run.y;
    c.runs.push_back(run);
    c.pixels += run.end - run.begin;
  }
  joined.erase(
      std::remove_if(joined.begin(), joined.end(), [this](const Candidate& c) { return c.pixels < parameters_.minimumPixels; }),
      joined.end());

  for (Candidate& c : joined) {
    // Of an ellipse of even brightness, whose border is where a Gaussian crosses the threshold.
    Eigen::Vector2d sum = Eigen::Vector2d::Zero();
    Eigen::Matrix2d squares = Eigen::Matrix2d::Zero();
    double threshold = 1.0;
    for (const Run& run : c.runs)
      for (int x = run.begin; x < run.end; ++x) {
        const std::ptrdiff_t index = static_cast<std::ptrdiff_t>(run.y) * source.width + x;
        const Eigen::Vector2d at(x - c.left, run.y - c.top);
        sum += at;
        squares += at * at.transpose();
        c.saturated += source.frame[index] >= parameters_.saturation;
        const double excess = source.frame[index] - source.floor[index];
        if (excess > c.highest) {
          c.highest = excess;
          threshold = thresholds_[source.floor[index]];
        }
      }
    const Eigen::Vector2d mean = sum / c.pixels;
    const Eigen::Matrix2d moments = squares / c.pixels - mean * mean.transpose() + Eigen::Matrix2d::Identity() / 12.0;
    const double peak = c.highest * (c.saturated > 0 ? 1.5 : 1.0);
    GaussianSpot start;
    start.centre = mean + Eigen::Vector2d(c.left, c.top);
    start.peak = peak;
    const Eigen::Matrix2d covariance =
        Bounded(moments * 2.0 / std::max(std::log(peak / threshold), 0.25), 0.8, 1.2 * parameters_.maximumSize);
    start.precision = covariance.inverse();
    c.starts.push_back(start);

    // Two maxima with a dip between them, in means of 3 x 3 pixels, are two spots.
    const int width = c.right - c.left + 1, height = c.bottom - c.top + 1;
    if (c.pixels < 16 || width > 160 || height > 160)
      continue;
    std::vector<float> smooth(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
    const auto at = [&](int x, int y) -> float& {
      return smooth[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)];
    };
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) {
        int total = 0, count = 0;
        for (int ny = c.top + y - 1; ny <= c.top + y + 1; ++ny)
          for (int nx = c.left + x - 1; nx <= c.left + x + 1; ++nx)
            if (source.Covers(nx, ny)) {
              const std::ptrdiff_t index = static_cast<std::ptrdiff_t>(ny) * source.width + nx;
              total += source.frame[index] - source.floor[index];
              ++count;
            }
        at(x, y) = static_cast<float>(total) / static_cast<float>(count);
      }
    struct Maximum {
      int x, y;
      float value;
    };
    std::vector<Maximum> maxima;
    for (int y = 1; y + 1 < height; ++y)
      for (int x = 1; x + 1 < width; ++x) {
        bool isHighest = true;
        for (int ny = y - 1; ny <= y + 1 && isHighest; ++ny)
          for (int nx = x - 1; nx <= x + 1; ++nx)
            isHighest = isHighest && at(nx, ny) <= at(x, y);
        if (isHighest)
          maxima.push_back({x, y, at(x, y)});
      }
    std::sort(maxima.begin(), maxima.end(), [](const Maximum& a, const Maximum& b) { return a.value > b.value; });
    std::vector<Maximum> kept;
    for (const Maximum& m : maxima) {
      const double needed =
          m.value - std::max(0.1 * static_cast<double>(m.value), 1.5 * std::sqrt(noise_.Variance(static_cast<double>(m.value))));
      bool apart = true;
      for (const Maximum& k : kept) {
        float lowest = m.value;
        const int steps = std::max({std::abs(m.x - k.x), std::abs(m.y - k.y), 1});
        for (int step = 0; step <= steps; ++step)
          lowest = std::min(lowest, at(m.x + (k.x - m.x) * step / steps, m.y + (k.y - m.y) * step / steps));
        apart = apart && static_cast<double>(lowest) < needed;
      }
      if (apart && kept.size() < GroupLimit)
        kept.push_back(m);
    }
    if (kept.size() < 2)
      continue;
    double nearest = 1e9;
    for (const Maximum& a : kept)
      for (const Maximum& b : kept)
        if (&a != &b)
          nearest = std::min(nearest, std::hypot(a.x - b.x, a.y - b.y));
    c.starts.clear();
    const double radius = std::clamp(std::min(nearest / 2.5, ShortRadius(covariance)), 0.8, parameters_.maximumSize);
    for (const Maximum& m : kept)
      c.starts.push_back({Eigen::Vector2d(c.left + m.x, c.top + m.y), static_cast<double>(m.value),
                          Eigen::Matrix2d::Identity() / (radius * radius)});
  }
  return joined;
}

void SpotDetector::AddCentroid(const Source& source, const Candidate& candidate, SpotFrame& out) const
{
  double mass = 0.0;
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  const auto forEach = [&](const auto& body) {
    for (const Run& run : candidate.runs)
      for (int x = run.begin; x < run.end; ++x) {
        const std::ptrdiff_t index = static_cast<std::ptrdiff_t>(run.y) * source.width + x;
        // Eq. 7.1: (v - T) / (255 - T); the divisor cancels.
        body(Eigen::Vector2d(x, run.y), std::max(source.Value(x, run.y) - parameters_.threshold, 0.0), source.frame[index]);
      }
  };
  forEach([&](const Eigen::Vector2d& at, double density, int) {
    mass += density;
    sum += density * at;
  });
  if (mass <= 0.0) {
    ++out.refused;
    return;
  }
  Spot spot;
  spot.position = sum / mass;
  Eigen::Matrix2d moments = Eigen::Matrix2d::Zero();
  forEach([&](const Eigen::Vector2d& at, double density, int grey) {
    const Eigen::Vector2d from = at - spot.position;
    spot.covariance += noise_.Variance(grey) / (mass * mass) * from * from.transpose();
    moments += density / mass * from * from.transpose();
  });
  spot.peak = candidate.highest;
  spot.peakSigma = std::sqrt(noise_.Variance(candidate.highest));
  spot.size = std::sqrt(LongRadius(moments) * ShortRadius(moments));
  spot.elongation = LongRadius(moments) / ShortRadius(moments);
  spot.saturatedPixels = candidate.saturated;
  out.spots.push_back(spot);
}

std::vector<SpotSample> SpotDetector::Samples(const Source& source, const std::vector<GaussianSpot>& spots, int bin,
                                              double& noiseShare) const
{
  Eigen::Vector2d low = spots.front().centre, high = low;
  std::vector<double> radii;
  for (const GaussianSpot& spot : spots) {
    const double radius = WindowRadius(spot);
    radii.push_back(radius);
    low = low.cwiseMin(spot.centre - Eigen::Vector2d::Constant(radius));
    high = high.cwiseMax(spot.centre + Eigen::Vector2d::Constant(radius));
  }
  const int left = std::max(0, static_cast<int>(std::ceil(low.x()))), top = std::max(0, static_cast<int>(std::ceil(low.y())));
  const int right = std::min(source.width - 1, static_cast<int>(high.x())),
            bottom = std::min(source.height - 1, static_cast<int>(high.y()));
  std::vector<SpotSample> samples;
  samples.reserve(static_cast<std::size_t>(std::max(0, (right - left + 1) * (bottom - top + 1) / (bin * bin))));
  const double perPixel = 1.0 / (bin * bin);
  for (int y = top; y + bin - 1 <= bottom; y += bin)
    for (int x = left; x + bin - 1 <= right; x += bin) {
      SpotSample s;
      s.x = x + 0.5 * (bin - 1);
      s.y = y + 0.5 * (bin - 1);
      bool isUsed = false;
      for (std::size_t k = 0; k < spots.size(); ++k) {
        const double dx = s.x - spots[k].centre.x(), dy = s.y - spots[k].centre.y();
        isUsed = isUsed || dx * dx + dy * dy <= radii[k] * radii[k];
      }
      for (int py = y; isUsed && py < y + bin; ++py)
        for (int px = x; px < x + bin; ++px) {
          const int grey = source.frame[static_cast<std::ptrdiff_t>(py) * source.width + px];
          const double background = source.Background(px, py);
          isUsed = isUsed && grey < parameters_.saturation;
          s.value += (grey - background) * perPixel;
          s.background += background * perPixel;
        }
      if (isUsed)
        samples.push_back(s);
    }
  noiseShare = source.background ? source.background->NoiseShare(std::clamp((top + bottom) / 2, 0, source.height - 1)) : 0.0;
  return samples;
}

void SpotDetector::FitGroup(const Source& source, const std::vector<const Candidate*>& group, SpotFrame& out)
{
  std::vector<GaussianSpot> starts;
  for (const Candidate* candidate : group)
    starts.insert(starts.end(), candidate->starts.begin(), candidate->starts.end());
  if (starts.size() > GroupLimit)
    starts.resize(GroupLimit);

  std::vector<Eigen::Vector2d> hot; // what is smaller than any lens draws, within the light of a spot
  const auto fit = [&](const std::vector<GaussianSpot>& from) {
    double smallest = parameters_.maximumSize;
    for (const GaussianSpot& spot : from)
      smallest = std::min(smallest, ShortRadius(spot.precision.inverse()));
    const int bin = std::max(1, static_cast<int>(smallest / 2.0));
    SpotFitSettings settings;
    settings.noise = noise_;
    settings.saturation = parameters_.saturation;
    settings.pixelsPerSample = bin * bin;
    std::vector<SpotSample> samples = Samples(source, from, bin, settings.backgroundNoise);
    for (const Eigen::Vector2d& place : hot)
      samples.erase(std::remove_if(samples.begin(), samples.end(),
                                   [&](const SpotSample& s) { return (Eigen::Vector2d(s.x, s.y) - place).norm() < bin + 0.6; }),
                    samples.end());
    SpotFitResult result = FitSpots(samples, from, settings);
    if (bin > 1) // a mean over a square is wider and lower
      for (GaussianSpot& spot : result.spots) {
        const Eigen::Matrix2d wide = spot.precision.inverse();
        const Eigen::Matrix2d covariance = wide - Eigen::Matrix2d::Identity() * ((bin * bin - 1) / 12.0);
        if (covariance.determinant() > 0.0 && covariance(0, 0) > 0.0) {
          spot.peak *= std::sqrt(wide.determinant() / covariance.determinant());
          spot.precision = covariance.inverse();
        }
      }
    return result;
  };
  // Two Gaussians that describe one spot better than one Gaussian would are still one spot.
  const auto areApart = [](const SpotFitResult& result) {
    for (std::size_t i = 0; i < result.spots.size(); ++i)
      for (std::size_t j = i + 1; j < result.spots.size(); ++j) {
        const GaussianSpot &a = result.spots[i], &b = result.spots[j];
        const double sizeA = ShortRadius(a.precision.inverse()), sizeB = ShortRadius(b.precision.inverse());
        if ((a.centre - b.centre).norm() < std::max(sizeA, sizeB) ||
            std::min(a.peak, b.peak) < OwnLight * std::max(a.peak, b.peak) ||
            std::max(sizeA, sizeB) > 2.5 * std::min(sizeA, sizeB))
          return false;
      }
    return result.converged;
  };

  SpotFitResult result = fit(starts);
  for (int attempt = 0; attempt < 3 && result.converged && result.spots.size() > 1; ++attempt) { // hot pixels look like maxima
    std::vector<GaussianSpot> kept;
    for (const GaussianSpot& spot : result.spots) {
      if (ShortRadius(spot.precision.inverse()) >= parameters_.minimumSize)
        kept.push_back(spot);
      else
        hot.push_back(spot.centre);
    }
    if (kept.size() == result.spots.size() || kept.empty())
      break;
    starts = kept;
    result = fit(starts);
  }
  // What is much weaker than a spot beside it is some of that spot's own light, which the print or the lens spread.
  const auto weaker = [](const GaussianSpot& a, const GaussianSpot& b) { return a.peak < b.peak; };
  const double weakest = OwnLight * std::max_element(starts.begin(), starts.end(), weaker)->peak;
  while (starts.size() > 1 && !areApart(result)) {
    const std::vector<GaussianSpot>& spots = result.converged ? result.spots : starts;
    const auto [low, high] = std::minmax_element(spots.begin(), spots.end(), weaker);
    if (low->peak >= OwnLight * high->peak)
      break;
    ++out.refused;
    starts.erase(starts.begin() + (low - spots.begin()));
    result = fit(starts);
  }
  if (starts.size() == 1 && result.converged && result.chiSquared > 1.8) {
    const Eigen::Matrix2d covariance = result.spots[0].precision.inverse();
    const double along = LongRadius(covariance), across = ShortRadius(covariance);
    const double angle = 0.5 * std::atan2(2.0 * covariance(0, 1), covariance(0, 0) - covariance(1, 1));
    if (along > 1.15 * across) {
      std::vector<GaussianSpot> two(2, result.spots[0]);
      for (GaussianSpot& spot : two) {
        spot.peak *= 0.7;
        spot.precision = Eigen::Matrix2d::Identity() / (0.8 * across * across);
      }
      const Eigen::Vector2d half = 0.8 * along * Eigen::Vector2d(std::cos(angle), std::sin(angle));
      two[0].centre += half;
      two[1].centre -= half;
      const SpotFitResult tried = fit(two);
      if (areApart(tried) && tried.chiSquared < 0.7 * result.chiSquared && Accept(source, tried, out))
        return;
    }
  }
  if ((starts.size() == 1 || areApart(result)) && Accept(source, result, out))
    return;
  if (starts.size() > 1) { // what cannot be told together, one by one
    for (const Candidate* candidate : group) {
      if (candidate->starts.front().peak < weakest)
        continue;
      GaussianSpot one = candidate->starts.front();
      if (candidate->starts.size() > 1)
        one.centre = Eigen::Vector2d(0.5 * (candidate->left + candidate->right), 0.5 * (candidate->top + candidate->bottom));
      const SpotFitResult alone = fit({one});
      if (alone.chiSquared > WorstAlone || !Accept(source, alone, out)) // one that lies between two is worse than none
        ++out.refused;
    }
    return;
  }
  ++out.refused;
}

// Puts spots of a fit out, if all of them are spots.
bool SpotDetector::Accept(const Source& source, const SpotFitResult& fit, SpotFrame& out) const
{
  if (!fit.converged)
    return false;
  std::vector<Spot> spots;
  for (std::size_t i = 0; i < fit.spots.size(); ++i) {
    const GaussianSpot& fitted = fit.spots[i];
    const Eigen::Matrix2d covariance = fitted.precision.inverse();
    Spot spot;
    spot.position = fitted.centre;
    spot.covariance = fit.covariances[i];
    spot.peak = fitted.peak;
    spot.peakSigma = fit.peakSigmas[i];
    spot.size = std::sqrt(LongRadius(covariance) * ShortRadius(covariance));
    spot.elongation = LongRadius(covariance) / ShortRadius(covariance);
    spot.chiSquared = fit.chiSquared;
    const int x = static_cast<int>(std::lround(spot.position.x())), y = static_cast<int>(std::lround(spot.position.y()));
    const bool isSpot =
        source.Covers(x, y) && ShortRadius(covariance) >= parameters_.minimumSize && spot.size <= parameters_.maximumSize &&
        spot.elongation < 6.0 && spot.peak >= 0.6 * parameters_.threshold && spot.peak >= 4.0 * spot.peakSigma &&
        spot.peak < 100.0 * parameters_.saturation && LongRadius(spot.covariance) < std::max(1.0, 0.3 * spot.size);
    if (!isSpot)
      return false;
    const int reach = static_cast<int>(std::ceil(3.0 * LongRadius(covariance)));
    for (int py = std::max(0, y - reach); py <= std::min(source.height - 1, y + reach); ++py)
      for (int px = std::max(0, x - reach); px <= std::min(source.width - 1, x + reach); ++px)
        spot.saturatedPixels += source.frame[static_cast<std::ptrdiff_t>(py) * source.width + px] >= parameters_.saturation;
    spots.push_back(spot);
  }
  out.spots.insert(out.spots.end(), spots.begin(), spots.end());
  return true;
}

} // namespace echorama
