// SPDX-License-Identifier: BSD-3-Clause
// The marker's cells are directions as seen from the camera, so the picture is first turned into a strip by azimuth and
// elevation: its circle's edge, unrolled. There the marker is a grid, and sums over its cells come from a table of sums. Every
// place where it may be is tried: most fail at the first pair of a fixed column. What decides is the checksum; of several places
// that agree on it, the one whose weakest pair has the most contrast is taken.
#include "ShellMarker.h"
#include "Core/Base/Angles.h"
#include "Core/Base/Error.h"
#include "Core/Base/FormatText.h"
#include "Tracking/Optical/MarkerPattern.h"
#include <algorithm>
#include <cmath>
#include <vector>

namespace echorama {
namespace {

using Pattern = MarkerPattern;

constexpr int binsPerDegree = 4, binsAround = 360 * binsPerDegree;
constexpr double mostHigherDegrees = 3.0, mostLeaningDegrees = 0.6, leastContrast = 0.04;

double BrightnessAt(const GreyFrame& frame, const Eigen::Vector2d& pixel)
{
  const int x = std::clamp(static_cast<int>(std::floor(pixel.x())), 0, frame.width - 2),
            y = std::clamp(static_cast<int>(std::floor(pixel.y())), 0, frame.height - 2);
  const double u = std::clamp(pixel.x() - x, 0.0, 1.0), v = std::clamp(pixel.y() - y, 0.0, 1.0);
  return (1.0 - v) * ((1.0 - u) * frame(x, y) + u * frame(x + 1, y)) +
         v * ((1.0 - u) * frame(x, y + 1) + u * frame(x + 1, y + 1));
}

// The picture by azimuth and elevation, as sums from its corner.
class UnrolledPicture {
public:
  UnrolledPicture(const GreyFrame& frame, const FisheyeLens& lens)
  {
    sums_.assign(static_cast<std::size_t>((height + 1) * (width + 1)), {});
    for (int j = 0; j < height; ++j) {
      const double elevation = (lowestDegrees + (j + 0.5) / binsPerDegree) / DegreesPerRadian;
      Sum row;
      for (int i = 0; i < width; ++i) {
        const double azimuth = (i + 0.5) / binsPerDegree / DegreesPerRadian;
        const auto pixel =
            lens.Project({std::cos(elevation) * std::cos(azimuth), std::cos(elevation) * std::sin(azimuth), std::sin(elevation)});
        if (pixel && lens.Covers(*pixel)) {
          row.brightness += BrightnessAt(frame, *pixel);
          ++row.count;
        }
        const Sum& below = sums_[Index(i + 1, j)];
        sums_[Index(i + 1, j + 1)] = {below.brightness + row.brightness, below.count + row.count};
      }
    }
  }

  // The mean of the inner part of a cell whose corner is there; negative where the picture does not show all of it.
  double CellMean(double azimuthDegrees, double elevationDegrees) const
  {
    constexpr double margin = 0.2 * Pattern::cellDegrees, inner = 0.6 * Pattern::cellDegrees;
    const int i = static_cast<int>(std::lround((azimuthDegrees + margin) * binsPerDegree)),
              j = static_cast<int>(std::lround((elevationDegrees + margin - lowestDegrees) * binsPerDegree)),
              size = static_cast<int>(std::lround(inner * binsPerDegree));
    const auto sum = [&](int x, int y) { return sums_[Index(x, y)]; };
    const Sum a = sum(i, j), b = sum(i + size, j), c = sum(i, j + size), d = sum(i + size, j + size);
    return d.count - b.count - c.count + a.count == size * size
               ? (d.brightness - b.brightness - c.brightness + a.brightness) / (size * size)
               : -1.0;
  }

private:
  struct Sum {
    double brightness = 0.0;
    int count = 0;
  };

  static constexpr double reachDegrees = mostHigherDegrees + mostLeaningDegrees + 1.0;
  static constexpr double lowestDegrees = Pattern::lowestDegrees - reachDegrees;
  static constexpr int width = binsAround + static_cast<int>((Pattern::columns + 1) * Pattern::cellDegrees) * binsPerDegree;
  static constexpr int height = static_cast<int>((2.0 * reachDegrees + Pattern::rows * Pattern::cellDegrees) * binsPerDegree);

  static std::size_t Index(int i, int j) { return static_cast<std::size_t>(j) * (width + 1) + static_cast<std::size_t>(i); }

  std::vector<Sum> sums_;
};

// Where a marker may be.
struct MarkerPlace {
  double azimuth = 0.0, elevation = 0.0, leaning = 0.0; // degrees
};

// How much darker the lower cell of a pair is: difference over sum; nothing where it is not seen.
std::optional<double> PairAt(const UnrolledPicture& picture, const MarkerPlace& at, int pair, int column)
{
  const double azimuth = at.azimuth + column * Pattern::cellDegrees;
  const double elevation =
      at.elevation + at.leaning * (2.0 * column / (Pattern::columns - 1) - 1.0) + 2 * pair * Pattern::cellDegrees;
  const double lower = picture.CellMean(azimuth, elevation), upper = picture.CellMean(azimuth, elevation + Pattern::cellDegrees);
  if (lower < 0.0 || upper < 0.0)
    return std::nullopt;
  return (upper - lower) / std::max(upper + lower, 1e-9);
}

// Reads the marker at a place; a status other than Read when it is not there.
ShellMarkerReading ReadAt(const UnrolledPicture& picture, const MarkerPlace& at)
{
  static const Pattern blank = Pattern::Of(0);
  ShellMarkerReading reading;
  Pattern pattern;
  reading.contrast = 1.0;
  int clear = 0;
  for (const bool isFixedTurn : {true, false})
    for (int column = 0; column < Pattern::columns; ++column)
      for (int pair = 0; pair < Pattern::pairs; ++pair) {
        if (Pattern::IsFixed(column) != isFixedTurn)
          continue;
        const auto difference = PairAt(picture, at, pair, column);
        const double contrast = std::abs(difference.value_or(0.0));
        bool& bit = pattern.bits[static_cast<std::size_t>(pair)][static_cast<std::size_t>(column)];
        bit = difference.value_or(0.0) > 0.0;
        if (isFixedTurn &&
            (contrast < leastContrast || bit != blank.bits[static_cast<std::size_t>(pair)][static_cast<std::size_t>(column)]))
          return reading;
        clear += contrast >= leastContrast;
        reading.contrast = std::min(reading.contrast, contrast);
      }
  const auto id = pattern.Id();
  constexpr int all = Pattern::pairs * Pattern::columns;
  if (id && clear == all) {
    reading.status = ShellMarkerReading::Status::Read;
    reading.id = *id;
  } else if (clear >= all * 4 / 5)
    reading.status = ShellMarkerReading::Status::Unclear;
  reading.azimuthDegrees = at.azimuth;
  reading.elevationDegrees = at.elevation - Pattern::lowestDegrees;
  return reading;
}

} // namespace

std::string ShellMarkerReading::Text() const
{
  switch (status) {
  case Status::Read:
    return Format("shell %06X (contrast %.2f)", id, contrast);
  case Status::Unclear:
    return "a marker that cannot be read";
  default:
    return "no marker";
  }
}

ShellMarkerReading ReadShellMarker(const GreyFrame& frame, const FisheyeLens& lens)
{
  lens.Check();
  if (!frame.data || frame.width != lens.width || frame.height != lens.height)
    throw Error(Error::Kind::InvalidParameter, Format("the picture is %d x %d pixels, and the lens is that of one of %d x %d",
                                                      frame.width, frame.height, lens.width, lens.height));
  const UnrolledPicture picture(frame, lens);
  ShellMarkerReading best;
  for (int i = 0; i < 2 * 360; ++i)
    for (double higher = -mostHigherDegrees; higher <= mostHigherDegrees; higher += 0.5)
      for (const double leaning : {0.0, -mostLeaningDegrees, mostLeaningDegrees}) {
        const ShellMarkerReading reading = ReadAt(picture, {0.5 * i, Pattern::lowestDegrees + higher, leaning});
        const auto rank = [](const ShellMarkerReading& r) {
          return r.status == ShellMarkerReading::Status::Read ? 2 : r.status == ShellMarkerReading::Status::Unclear ? 1 : 0;
        };
        if (rank(reading) > rank(best) || (rank(reading) == rank(best) && rank(best) > 0 && reading.contrast > best.contrast))
          best = reading;
      }
  if (best.status == ShellMarkerReading::Status::Absent)
    best = {};
  return best;
}

} // namespace echorama
