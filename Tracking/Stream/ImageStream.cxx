// SPDX-License-Identifier: BSD-3-Clause
#include "Tracking/Stream/ImageStream.h"
#include "Tracking/Stream/Clock.h"
#include <algorithm>
#include <cmath>
#include <deque>
#include <mutex>

namespace echorama {

struct ImageStream::Parts {
  std::size_t bound = 1;
  mutable std::mutex mutex;
  std::deque<StreamedImage> images;
  std::uint64_t version = 0;
};

ImageStream::ImageStream(std::size_t bound) : parts_(std::make_unique<Parts>())
{
  parts_->bound = std::max<std::size_t>(1, bound);
}

ImageStream::~ImageStream() = default;

void ImageStream::Add(StreamedImage image)
{
  if (!std::isfinite(image.arrival))
    image.arrival = ClockNow();
  const std::lock_guard<std::mutex> lock(parts_->mutex);
  parts_->images.push_back(std::move(image));
  if (parts_->images.size() > parts_->bound)
    parts_->images.pop_front();
  ++parts_->version;
}

StreamedImage ImageStream::Latest() const
{
  const std::lock_guard<std::mutex> lock(parts_->mutex);
  return parts_->images.empty() ? StreamedImage() : parts_->images.back();
}

std::vector<StreamedImage> ImageStream::Images() const
{
  const std::lock_guard<std::mutex> lock(parts_->mutex);
  return {parts_->images.begin(), parts_->images.end()};
}

std::uint64_t ImageStream::Version() const
{
  const std::lock_guard<std::mutex> lock(parts_->mutex);
  return parts_->version;
}

} // namespace echorama
