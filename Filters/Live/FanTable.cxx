// SPDX-License-Identifier: BSD-3-Clause
// Eight bytes a pixel say where it lies. A row is fetched (two pairs of samples, of two beams) and then blended by the vector
// units. A fan that closes a circle gets its first beam once more behind the last one.
#include "Filters/Live/FanTable.h"
#include "Core/Base/Angles.h"
#include "Core/Base/CheckRange.h"
#include "Core/Base/Error.h"
#include "Core/Base/Parallel.h"
#include "Core/Imaging/ScanConversion.h"
#include "Filters/Live/BeamVolumes.h"
#include <algorithm>
#include <cmath>
#include <cstring>

namespace echorama {
namespace {

constexpr double edge = 1e-3;  // how far beyond the outermost sample or beam is still inside, in distances between them
constexpr double margin = 2.0; // pixels on each side that stay free
constexpr float fractions = 65535.0f;
constexpr int rowsPerRange = 16;

void BlendPixels(const float* __restrict here, const float* __restrict next, const std::uint16_t* __restrict depth,
                 const std::uint16_t* __restrict fan, const int* __restrict inside, int count, unsigned char* __restrict out)
{
  for (int i = 0; i < count; ++i) {
    const float d = static_cast<float>(depth[i]) * (1.0f / fractions), f = static_cast<float>(fan[i]) * (1.0f / fractions);
    const float a = here[2 * i] + d * (here[2 * i + 1] - here[2 * i]), b = next[2 * i] + d * (next[2 * i + 1] - next[2 * i]);
    const int rounded = static_cast<int>(a + f * (b - a) + 0.5f);
    out[i] = static_cast<unsigned char>(inside[i] ? rounded : 0);
  }
}

// The content that all samples have, or -1 where they differ.
int CommonContent(VolumeView<const unsigned char> content)
{
  unsigned char all = 255, any = 0;
  for (const unsigned char each : content) {
    all &= each;
    any |= each;
  }
  return all == any ? any : -1;
}

} // namespace

bool ClosesCircle(const ProbeGeometry& geometry, int beams)
{
  return beams > 2 && std::abs(geometry.fanAngle - 2.0 * Pi * (beams - 1) / beams) < 1e-6 * geometry.fanAngle;
}

FanTable::FanTable(const FanImage& image) : image_(image)
{
  const ProbeGeometry& g = image.probe;
  g.Check();
  if (!g.IsPlane())
    throw Error(Error::Kind::InvalidParameter, "live image: the probe sweeps; it must image a single plane");
  CheckRange("the number of samples along a beam", image.samples, 2, 16384);
  CheckRange("the number of beams", image.beams, 2, 8192);
  CheckRange("the width of the image", image.width, 16, 16384);
  CheckRange("the height of the image", image.height, 16, 16384);
  closes_ = ClosesCircle(g, image.beams);

  // The box around the fan, from the tight grid around it. Of a full circle also what lies between the last beam and the first.
  ProbeGeometry whole = g;
  if (closes_) {
    whole.fanAngle = 2.0 * Pi * (1.0 - 1e-12);
    whole.fanWidth = g.fanWidth * whole.fanAngle / g.fanAngle;
    whole.fanOffset = 0.0;
  }
  const ImageGeometry tight = ScanConversionGrid(whole, Pose::Identity(), g.Size() * 1e-4, std::size_t{1} << 40);
  const double across = tight.spacing[0] * (tight.dimensions[0] - 1), down = tight.spacing[1] * (tight.dimensions[1] - 1);
  const double spacing = std::max(across / (image.width - 1 - 2.0 * margin), down / (image.height - 1 - 2.0 * margin));
  grid_.dimensions = {image.width, image.height, 1};
  grid_.spacing.setConstant(spacing);
  const double side = image.flipped ? -1.0 : 1.0;
  grid_.direction << side, 0, 0, 0, 0, -side, 0, 1, 0; // a rotation, also where the image is flipped
  grid_.origin = tight.Centre() - grid_.direction * Eigen::Vector3d(image.width - 1, image.height - 1, 0.0) * (0.5 * spacing);

  const std::size_t pixels = static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height);
  offset_.assign(pixels, -1);
  depth_.assign(pixels, 0);
  fan_.assign(pixels, 0);
  begin_.assign(static_cast<std::size_t>(image.height), 0);
  end_.assign(static_cast<std::size_t>(image.height), 0);
  ParallelFor(image.height, [this](std::ptrdiff_t row) { PlanRow(static_cast<int>(row)); });
}

void FanTable::PlanRow(int row)
{
  const ProbeGeometry& g = image_.probe;
  const int lastBeam = image_.beams - 1 + (closes_ ? 1 : 0), lastSample = image_.samples - 1;
  const auto split = [](double index, int last, std::uint16_t& fraction) {
    index = std::min(std::max(index, 0.0), static_cast<double>(last));
    const int before = std::min(static_cast<int>(index), last - 1);
    fraction = static_cast<std::uint16_t>(std::lround((index - before) * static_cast<double>(fractions)));
    return before;
  };
  int begin = image_.width, end = 0;
  for (int i = 0; i < image_.width; ++i) {
    const Eigen::Vector3d point = grid_.origin + grid_.direction * (grid_.spacing[0] * Eigen::Vector3d(i, row, 0));
    const ProbeArc::Place place = g.Fan().PlaceOf(point.x(), point.z());
    const double depth = (place.depth - g.depthMin) / (g.depthMax - g.depthMin) * lastSample;
    double beam = (place.along - g.fanOffset + 0.5) * (image_.beams - 1);
    if (closes_)
      beam -= image_.beams * std::floor(beam / image_.beams);
    if (!(depth >= -edge && depth <= lastSample + edge && beam >= -edge && beam <= lastBeam + edge))
      continue;
    const std::size_t at = static_cast<std::size_t>(row) * static_cast<std::size_t>(image_.width) + static_cast<std::size_t>(i);
    offset_[at] = split(beam, lastBeam, fan_[at]) * image_.samples;
    offset_[at] += split(depth, lastSample, depth_[at]);
    begin = std::min(begin, i);
    end = i + 1;
  }
  begin_[static_cast<std::size_t>(row)] = std::min(begin, end);
  end_[static_cast<std::size_t>(row)] = end;
}

void FanTable::Convert(VolumeView<const float> value, VolumeView<const unsigned char> content,
                       VolumeView<unsigned char> intensity, VolumeView<unsigned char> valid,
                       VolumeView<unsigned char> label) const
{
  const std::array<int, 3> plane{image_.samples, image_.beams, 1};
  if (value.Dimensions() != plane || content.Dimensions() != plane || intensity.Dimensions() != grid_.dimensions ||
      valid.Dimensions() != grid_.dimensions || (!label.Empty() && label.Dimensions() != grid_.dimensions))
    throw Error(Error::Kind::BadInput, "live image: beams or pixels do not have the dimensions that their table was made for");
  const int common = CommonContent(content);
  std::vector<float> closedValue;
  std::vector<unsigned char> closedContent;
  const float* values = value.Data();
  const unsigned char* contents = content.Data();
  if (closes_) {
    closedValue.assign(value.begin(), value.end());
    closedValue.insert(closedValue.end(), value.begin(), value.begin() + image_.samples);
    closedContent.assign(content.begin(), content.end());
    closedContent.insert(closedContent.end(), content.begin(), content.begin() + image_.samples);
    values = closedValue.data();
    contents = closedContent.data();
  }

  const std::size_t width = static_cast<std::size_t>(image_.width);
  ParallelRanges(image_.height, rowsPerRange, Progress(), [&](std::ptrdiff_t firstRow, std::ptrdiff_t lastRow) {
    std::vector<float> here(2 * width), next(2 * width);
    std::vector<int> inside(width);
    for (int row = static_cast<int>(firstRow); row < lastRow; ++row) {
      unsigned char* grey = intensity.Row(row, 0);
      unsigned char* mask = valid.Row(row, 0);
      unsigned char* marks = label.Empty() ? nullptr : label.Row(row, 0);
      for (unsigned char* each : {grey, mask, marks})
        if (each)
          std::memset(each, 0, width);
      const std::size_t rowStart = static_cast<std::size_t>(row) * width;
      const int begin = begin_[static_cast<std::size_t>(row)], count = end_[static_cast<std::size_t>(row)] - begin;
      const std::size_t first = rowStart + static_cast<std::size_t>(begin);
      const std::int32_t* offset = offset_.data() + first;
      for (int i = 0; i < count; ++i) {
        const std::ptrdiff_t at = std::max(offset[i], 0);
        std::memcpy(&here[static_cast<std::size_t>(2 * i)], values + at, 2 * sizeof(float));
        std::memcpy(&next[static_cast<std::size_t>(2 * i)], values + at + image_.samples, 2 * sizeof(float));
      }
      for (int i = 0; i < count; ++i) {
        int made = 0;
        if (common >= 0) {
          made = offset[i] >= 0 ? common : 0;
        } else if (offset[i] >= 0) {
          const unsigned char* a = contents + offset[i];
          const unsigned char* b = a + image_.samples;
          if ((a[0] != 0) & (a[1] != 0) & (b[0] != 0) & (b[1] != 0))
            made = a[0] | a[1] | b[0] | b[1];
        }
        inside[static_cast<std::size_t>(i)] = made;
        mask[begin + i] = made ? 1 : 0;
        if (marks)
          marks[begin + i] = LabelOfContent(static_cast<unsigned char>(made));
      }
      BlendPixels(here.data(), next.data(), depth_.data() + first, fan_.data() + first, inside.data(), count, grey + begin);
    }
  });
}

} // namespace echorama
