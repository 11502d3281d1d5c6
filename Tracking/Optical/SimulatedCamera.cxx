// SPDX-License-Identifier: BSD-3-Clause
// What does not change is made once: the place of the skin behind every pixel (a ray each), the lens's falloff, the light of the
// room. A frame then is that light, plus the lights in boxes about their places, plus noise.
//
// A light in a slab of diffusing plastic makes a bell of light on the inner side. Its width grows with the distance from the
// skin, and its peak falls with the square of the width and, since ever less of the light meets the skin, with 1 / (1 + (distance
// / fadeMm)^2). A weak wide bell about it stands for what the plastic scatters more than once. Skin has the same brightness from
// all sides, so a pixel shows the bell at its own place of the skin, whatever the angle.
//
// Noise: each pixel takes 32 random bits of its own, named by seed, frame, row and column, through a table of the normal
// distribution's quantiles, the outermost of which are tables themselves: 6 standard deviations of tail.
//
// With a rolling shutter row r is exposed r row times later than the first: by the place that the light then has.
#include "SimulatedCamera.h"
#include "Core/Base/Angles.h"
#include "Core/Base/Parallel.h"
#include "Core/Base/Random.h"
#include "Tracking/Optical/MarkerPattern.h"
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>

namespace echorama {

ParameterList Describe(SimulatedCameraParameters& p)
{
  return Join(
      {Describe(p.lens),
       {Parameter("FrameRate", p.frameRate, {1, 1000}, "Hz", "Frames per second."),
        Parameter("ExposureMs", p.exposureMs, {0.01, 1000}, "ms", "How long a row takes light; not longer than a frame."),
        Parameter("RowUs", p.rowUs, {0, 1000}, "us", "How much later each row begins: 0 is a global shutter."),
        Parameter("LatencyMs", p.latencyMs, {0, 1000}, "ms", "From the end of a frame's exposure until the host has it."),
        Parameter("LostFrames", p.lostFrames, {0, 1}, "", "Share of frames that the host never gets."),
        Parameter("ReadNoise", p.readNoise, {0, 50}, "grey levels", "Noise in the dark."),
        Parameter("GreyPerElectron", p.greyPerElectron, {0, 10}, "grey levels", "What one electron adds: shot noise."),
        Parameter("Dark", p.dark, {0, 100}, "grey levels", "What the camera says of darkness."),
        Parameter("Ambient", p.ambient, {0, 255}, "grey levels", "Light of the room through the skin."),
        Parameter("Slope", p.slope, {-10, 10}, "grey levels per pixel", "How much brighter the skin is further to the right."),
        Parameter("SunShare", p.sunShare, {0, 1}, "", "Share of the picture that sunlight saturates."),
        Parameter("SunEdge", p.sunEdge, {0.001, 1}, "", "How soft the border of the sunlight is, in cosines of its angle."),
        Parameter("HotPixels", p.hotPixels, {0, 100000}, "", "Half of them blink."),
        Parameter("Vignetting", p.vignetting, {0, 4}, "",
                  "The lens darkens with this power of the angle's cosine (halved angle)."),
        Parameter("Marker", p.marker,
                  "What a marker around the skin's foot says, six hexadecimal digits; its dark cells let 0.7 of the light of the "
                  "room in. None: there is no marker."),
        Parameter("SpotMm", p.spotMm, {0.1, 50}, "mm", "Standard deviation of a touching light on the skin."),
        Parameter("SpreadPerMm", p.spreadPerMm, {0, 10}, "", "How fast that grows with the distance from the skin."),
        Parameter("FadeMm", p.fadeMm, {0.1, 1000}, "mm", "Distance at which half of the light meets the skin."),
        Parameter("Halo", p.halo, {0, 1}, "", "Peak of the wide bell, four times as wide, over that of the narrow one."),
        Parameter("Seed", p.seed, {}, "", "Of noise, hot pixels and lost frames.")}});
}

namespace {

// Normal quantiles at the middles of 65536 equal shares of probability; those of the outermost share, finer.
class NormalTable {
public:
  static const NormalTable& Get()
  {
    static const NormalTable table;
    return table;
  }
  float operator()(std::uint32_t bits) const
  {
    const std::uint32_t high = bits >> 16;
    if (high == 0)
      return tail_[bits & 0xffffu];
    if (high == 0xffffu)
      return -tail_[bits & 0xffffu];
    return body_[high];
  }

private:
  NormalTable() : body_(65536), tail_(65536)
  {
    double at = -4.3;
    for (std::size_t i = 1; i < 65535; ++i)
      body_[i] = static_cast<float>(at = Quantile((static_cast<double>(i) + 0.5) / 65536.0, at));
    at = -6.3;
    for (std::size_t i = 0; i < 65536; ++i)
      tail_[i] = static_cast<float>(at = Quantile((static_cast<double>(i) + 0.5) / 65536.0 / 65536.0, at));
  }
  // Newton on the logarithm of the distribution, which is concave: from below it does not overshoot.
  static double Quantile(double share, double start)
  {
    double x = start;
    for (int iteration = 0; iteration < 50; ++iteration) {
      const double below = 0.5 * std::erfc(-x * 0.7071067811865476), density = 0.3989422804014327 * std::exp(-0.5 * x * x);
      const double step = (std::log(share) - std::log(below)) * below / density;
      x += step;
      if (std::abs(step) < 1e-9)
        break;
    }
    return x;
  }
  std::vector<float> body_, tail_;
};

void Develop(const float* grey, const float* normal, int count, float readVariance, float gain, std::uint8_t* out)
{
  for (int x = 0; x < count; ++x) {
    const float level = grey[x] > 0.0f ? grey[x] : 0.0f;
    const float noisy = level + std::sqrt(readVariance + gain * level) * normal[x] + 0.5f;
    const float bounded = noisy > 0.0f ? (noisy < 255.0f ? noisy : 255.0f) : 0.0f;
    out[x] = static_cast<std::uint8_t>(bounded);
  }
}

constexpr float MarkerShade = 0.7f;

std::optional<MarkerPattern> PatternNamed(const std::string& marker)
{
  if (marker.empty())
    return std::nullopt;
  if (marker.size() > 6 || marker.find_first_not_of("0123456789abcdefABCDEF") != std::string::npos)
    throw Error(Error::Kind::InvalidParameter, "marker: " + marker + " is no number of six hexadecimal digits");
  return MarkerPattern::Of(static_cast<std::uint32_t>(std::stoul(marker, nullptr, 16)));
}

// Its cells are directions of the camera's frame.
bool IsDark(const MarkerPattern& marker, const Eigen::Vector3d& direction)
{
  const auto cell = [](double degrees) { return static_cast<int>(std::floor(degrees / MarkerPattern::cellDegrees)); };
  return marker.IsDark(cell(std::asin(std::clamp(direction.z(), -1.0, 1.0)) * DegreesPerRadian - MarkerPattern::lowestDegrees),
                       cell(std::atan2(direction.y(), direction.x()) * DegreesPerRadian));
}

constexpr std::uint64_t HotPixelItem = 1, LossItem = 2; // streams of one seed that are no frame's noise
constexpr std::uint64_t OtherStreams = 0x5eed0000c0de0000u;

} // namespace

SimulatedCamera::SimulatedCamera(const SimulatedCameraParameters& parameters, const SeenSurface& skin, const Pose& cameraToShell)
  : parameters_(parameters), shellToCamera_(cameraToShell.inverse())
{
  CheckRanges(parameters);
  parameters.lens.Check();
  if (parameters.exposureMs * 1e-3 > FrameSeconds())
    throw Error(Error::Kind::InvalidParameter, "the exposure is longer than a frame");
  if (parameters.rowUs * 1e-6 * parameters.lens.height > FrameSeconds() * 1.0001)
    throw Error(Error::Kind::InvalidParameter, "the rows of a frame take longer than a frame");

  const int width = parameters.lens.width, height = parameters.lens.height;
  const std::size_t size = Index(0, height);
  points_.assign(size, Eigen::Vector3f::Constant(std::numeric_limits<float>::quiet_NaN()));
  falloff_.assign(size, 0.0f);
  ambient_.assign(size, static_cast<float>(parameters.dark));
  std::vector<float> towardsSun(size, -2.0f);
  const std::optional<MarkerPattern> marker = PatternNamed(parameters.marker);
  const Eigen::Vector3d sun = Eigen::Vector3d(0.6, 0.35, 0.7).normalized();
  ParallelRanges(height, 8, Progress(), [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
    for (int y = static_cast<int>(begin); y < static_cast<int>(end); ++y)
      for (int x = 0; x < width; ++x) {
        const auto direction = parameters_.lens.Unproject({x, y});
        if (!direction)
          continue;
        const auto hit = skin.FirstHit(cameraToShell.translation(), cameraToShell.linear() * *direction);
        if (!hit)
          continue;
        const std::size_t index = Index(x, y);
        points_[index] = hit->point.cast<float>();
        falloff_[index] = static_cast<float>(std::pow(0.5 * (1.0 + direction->z()), parameters_.vignetting));
        towardsSun[index] = static_cast<float>(-hit->normal.dot(sun));
        const float ofRoom = falloff_[index] * static_cast<float>(parameters_.ambient) +
                             static_cast<float>(parameters_.slope * (x - parameters_.lens.centreX));
        ambient_[index] += marker && IsDark(*marker, *direction) ? MarkerShade * ofRoom : ofRoom;
      }
  });
  if (std::none_of(falloff_.begin(), falloff_.end(), [](float f) { return f > 0.0f; }))
    throw Error(Error::Kind::NotPossible, "the camera sees nothing of the skin");

  if (parameters.sunShare > 0.0) {
    std::vector<float> sorted = towardsSun;
    const auto rank = static_cast<std::ptrdiff_t>((1.0 - parameters.sunShare) * static_cast<double>(size - 1));
    std::nth_element(sorted.begin(), sorted.begin() + rank, sorted.end());
    const double edge = static_cast<double>(sorted[static_cast<std::size_t>(rank)]);
    if (edge <= -2.0)
      throw Error(Error::Kind::NotPossible, "the sun cannot saturate more of the picture than shows skin");
    // 255 grey levels where that share begins, twice as many far within.
    for (std::size_t i = 0; i < size; ++i)
      if (falloff_[i] > 0.0f)
        ambient_[i] +=
            static_cast<float>(510.0 / (1.0 + std::exp(-(static_cast<double>(towardsSun[i]) - edge) / parameters.sunEdge)));
  }

  Random random(parameters.seed ^ OtherStreams, HotPixelItem);
  for (int i = 0; i < parameters.hotPixels; ++i)
    hotPixels_.push_back(
        {static_cast<std::size_t>(random.Below(size)), static_cast<float>(random.Uniform(30.0, 300.0)), i % 2 == 1});
}

double SimulatedCamera::RowBegin(std::int64_t number, double row) const
{
  return static_cast<double>(number) * FrameSeconds() + row * parameters_.rowUs * 1e-6;
}

std::optional<Eigen::Vector2d> SimulatedCamera::PixelOf(const Eigen::Vector3d& point) const
{
  return parameters_.lens.Project(shellToCamera_ * point);
}

std::optional<SeenSurface::Hit> SimulatedCamera::SkinAt(const SeenSurface& skin, const Eigen::Vector2d& pixel) const
{
  const auto direction = parameters_.lens.Unproject(pixel);
  if (!direction)
    return std::nullopt;
  const Pose cameraToShell = shellToCamera_.inverse();
  return skin.FirstHit(cameraToShell.translation(), cameraToShell.linear() * *direction);
}

LightTruth SimulatedCamera::TruthOf(std::int64_t number, const SimulatedLight& light) const
{
  LightTruth truth;
  const double exposure = parameters_.exposureMs * 1e-3;
  double row = 0.5 * (parameters_.lens.height - 1);
  for (int iteration = 0; iteration < 5; ++iteration) { // where it is says when its row is exposed
    truth.time = RowBegin(number, row) + 0.5 * exposure;
    truth.light = light.place(truth.time);
    const auto pixel = PixelOf(truth.light.point);
    if (!pixel || !parameters_.lens.Covers(*pixel))
      return truth;
    truth.pixel = *pixel;
    row = pixel->y();
  }
  const auto x = static_cast<int>(std::lround(truth.pixel.x())), y = static_cast<int>(std::lround(truth.pixel.y()));
  const std::size_t index = Index(std::clamp(x, 0, parameters_.lens.width - 1), std::clamp(y, 0, parameters_.lens.height - 1));
  // Behind other skin it would not be seen.
  const Eigen::Vector3d seen = points_[index].cast<double>();
  const double distance = (shellToCamera_ * truth.light.point).norm();
  truth.isVisible = truth.light.peak > 0.0 && seen.allFinite() && (seen - truth.light.point).norm() < 0.05 * distance + 1.0;
  const double begin = truth.time - 0.5 * exposure;
  truth.onShare = light.onShare ? light.onShare(begin, begin + exposure) : 1.0;
  return truth;
}

void SimulatedCamera::AddLight(std::int64_t number, const SimulatedLight& light, const LightTruth& truth,
                               std::vector<float>& grey) const
{
  const double width = std::hypot(parameters_.spotMm, parameters_.spreadPerMm * truth.light.hoverMm);
  const double fade = truth.light.hoverMm / parameters_.fadeMm;
  const double peak = truth.light.peak * parameters_.spotMm * parameters_.spotMm / (width * width) / (1.0 + fade * fade);
  // As far as the wide bell is above a hundredth of a grey level; aslant it is seen smaller.
  const double haloWidth = 4.0 * width;
  const double bound = parameters_.halo > 0.0 ? peak * parameters_.halo : peak;
  if (!(peak > 0.01))
    return;
  const double reachMm =
      std::max(width * std::sqrt(2.0 * std::log(std::max(peak / 0.01, 1.0))),
               parameters_.halo > 0.0 ? haloWidth * std::sqrt(2.0 * std::log(std::max(bound / 0.01, 1.0))) : 0.0);
  const double distance = (shellToCamera_ * truth.light.point).norm();
  const int reach =
      static_cast<int>(std::ceil(1.5 * parameters_.lens.focal * reachMm / std::max(distance - reachMm, 0.3 * distance)));
  const int middleX = static_cast<int>(std::lround(truth.pixel.x())), middleY = static_cast<int>(std::lround(truth.pixel.y()));
  const double exposure = parameters_.exposureMs * 1e-3;
  const auto reachSquared = static_cast<float>(reachMm * reachMm), narrowSquared = static_cast<float>(40.0 * width * width);
  const auto ofNarrow = static_cast<float>(-0.5 / (width * width)), ofWide = static_cast<float>(-0.5 / (haloWidth * haloWidth));
  for (int y = std::max(0, middleY - reach); y <= std::min(parameters_.lens.height - 1, middleY + reach); ++y) {
    double share = truth.onShare;
    Eigen::Vector3f centre = truth.light.point.cast<float>();
    if (parameters_.rowUs > 0.0) {
      const double begin = RowBegin(number, y);
      share = light.onShare ? light.onShare(begin, begin + exposure) : 1.0;
      centre = light.place(begin + 0.5 * exposure).point.cast<float>();
    }
    if (share <= 0.0)
      continue;
    const auto scale = static_cast<float>(peak * share), halo = static_cast<float>(parameters_.halo);
    for (int x = std::max(0, middleX - reach); x <= std::min(parameters_.lens.width - 1, middleX + reach); ++x) {
      const std::size_t index = Index(x, y);
      if (!(falloff_[index] > 0.0f))
        continue;
      const float squared = (points_[index] - centre).squaredNorm();
      if (squared > reachSquared)
        continue;
      const float narrow = squared < narrowSquared ? std::exp(ofNarrow * squared) : 0.0f; // beyond, exp takes its slow way to 0
      grey[index] += scale * falloff_[index] * (narrow + halo * std::exp(ofWide * squared));
    }
  }
}

void SimulatedCamera::Render(std::int64_t number, const std::vector<SimulatedLight>& lights, SimulatedFrame& frame) const
{
  const int width = parameters_.lens.width, height = parameters_.lens.height;
  frame.width = width;
  frame.height = height;
  frame.begin = RowBegin(number, 0.0);
  frame.delivered = RowBegin(number, height - 1) + (parameters_.exposureMs + parameters_.latencyMs) * 1e-3;
  frame.isLost = Random(parameters_.seed ^ OtherStreams ^ static_cast<std::uint64_t>(number) << 20, LossItem).Uniform() <
                 parameters_.lostFrames;
  frame.truth.clear();
  frame.pixels.resize(Index(0, height));

  std::vector<float> grey = ambient_;
  for (const SimulatedLight& light : lights) {
    frame.truth.push_back(TruthOf(number, light));
    if (frame.truth.back().isVisible)
      AddLight(number, light, frame.truth.back(), grey);
  }
  for (std::size_t i = 0; i < hotPixels_.size(); ++i) {
    const HotPixel& hot = hotPixels_[i];
    if (!hot.blinks || Random(parameters_.seed ^ OtherStreams ^ static_cast<std::uint64_t>(number) << 20, 10 + i).Uniform() < 0.3)
      grey[hot.index] += hot.level;
  }

  const NormalTable& normals = NormalTable::Get();
  const std::array<std::uint32_t, 2> key{static_cast<std::uint32_t>(parameters_.seed),
                                         static_cast<std::uint32_t>(parameters_.seed >> 32)};
  const auto unsignedNumber = static_cast<std::uint64_t>(number);
  const auto readVariance = static_cast<float>(parameters_.readNoise * parameters_.readNoise);
  ParallelRanges(height, 16, Progress(), [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
    std::vector<float> normal(static_cast<std::size_t>(width) + 4);
    for (std::ptrdiff_t y = begin; y < end; ++y) {
      for (int x = 0; x < width; x += 4) {
        const auto words =
            Random::Block({static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y),
                           static_cast<std::uint32_t>(unsignedNumber), static_cast<std::uint32_t>(unsignedNumber >> 32)},
                          key);
        for (std::size_t k = 0; k < 4; ++k)
          normal[static_cast<std::size_t>(x) + k] = normals(words[k]);
      }
      const std::size_t row = Index(0, static_cast<int>(y));
      Develop(grey.data() + row, normal.data(), width, readVariance, static_cast<float>(parameters_.greyPerElectron),
              frame.pixels.data() + row);
    }
  });
}

} // namespace echorama
