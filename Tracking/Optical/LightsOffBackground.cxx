// SPDX-License-Identifier: BSD-3-Clause
// The plain mean of the first frames, then one that forgets: mean += w (frame - mean). Its variance is that of one frame times
// s, with s' = (1 - w)^2 s + w^2. Rows are taken one by one, in bytes and floats.
#include "LightsOffBackground.h"
#include "Core/Base/CheckRange.h"
#include <algorithm>

namespace echorama {

namespace {

void AddRow(const std::uint8_t* row, int count, float weight, float* mean, std::uint8_t* rounded)
{
  for (int x = 0; x < count; ++x) {
    mean[x] += weight * (static_cast<float>(row[x]) - mean[x]);
    rounded[x] = static_cast<std::uint8_t>(mean[x] + 0.5f);
  }
}

} // namespace

LightsOffBackground::LightsOffBackground(double newest) : newest_(newest)
{
  CheckRange("newest", newest, 0.001, 1.0);
}

void LightsOffBackground::Clear()
{
  width_ = height_ = unseenRows_ = 0;
}

void LightsOffBackground::Add(const GreyFrame& frame, int beginRow, int endRow)
{
  if (frame.data == nullptr || frame.width < 1 || frame.height < 1)
    throw Error(Error::Kind::BadInput, "the frame of the background is empty");
  if (!(0 <= beginRow && beginRow <= endRow && endRow <= frame.height))
    throw Error(Error::Kind::InvalidParameter, "the background is given rows that the frame does not have");
  if (!Fits(frame)) {
    width_ = frame.width;
    height_ = unseenRows_ = frame.height;
    const std::size_t size = Index(0, height_);
    mean_.assign(size, 0.0f);
    rounded_.assign(size, 0);
    counts_.assign(static_cast<std::size_t>(height_), 0);
    noiseShare_.assign(static_cast<std::size_t>(height_), 0.0);
  }
  std::vector<std::uint8_t> gathered(frame.pixelStep == 1 ? 0 : static_cast<std::size_t>(width_));
  for (int y = beginRow; y < endRow; ++y) {
    int& count = counts_[static_cast<std::size_t>(y)];
    unseenRows_ -= count == 0;
    count = std::min(count + 1, 1000000);
    const double weight = std::max(newest_, 1.0 / count);
    double& share = noiseShare_[static_cast<std::size_t>(y)];
    share = (1.0 - weight) * (1.0 - weight) * share + weight * weight;
    const std::uint8_t* row = frame.data + y * frame.rowStep;
    if (frame.pixelStep != 1) {
      for (int x = 0; x < width_; ++x)
        gathered[static_cast<std::size_t>(x)] = frame(x, y);
      row = gathered.data();
    }
    AddRow(row, width_, static_cast<float>(weight), mean_.data() + Index(0, y), rounded_.data() + Index(0, y));
  }
}

} // namespace echorama
