// SPDX-License-Identifier: BSD-3-Clause
// libgpiod 1 (Debian 12).
#include "GpioLines.h"
#include <cerrno>
#include <gpiod.h>

namespace echorama {
namespace {

class Lines : public LightLines {
public:
  explicit Lines(const GpioPlace& place) : place_(place), chip_(gpiod_chip_open(place.Path().c_str()), gpiod_chip_close)
  {
    if (!chip_)
      place.FailChip(errno);
    const auto offsetOf = [&](const char* name) {
      gpiod_line* line = gpiod_chip_find_line(chip_.get(), name);
      return line ? static_cast<int>(gpiod_line_offset(line)) : -1;
    };
    const std::vector<unsigned> offsets = place.Offsets(gpiod_chip_num_lines(chip_.get()), offsetOf);
    gpiod_line_bulk_init(&lines_);
    for (std::size_t i = 0; i < offsets.size(); ++i) {
      gpiod_line* line = gpiod_chip_get_line(chip_.get(), offsets[i]);
      if (!line)
        place.FailLines(errno);
      if (gpiod_line_is_used(line))
        place.FailTaken(place.lines[i], gpiod_line_consumer(line));
      gpiod_line_bulk_add(&lines_, line);
    }
    gpiod_line_request_config request{};
    request.consumer = "echorama-leds";
    request.request_type = GPIOD_LINE_REQUEST_DIRECTION_OUTPUT;
    request.flags = place.activeLow ? GPIOD_LINE_REQUEST_FLAG_ACTIVE_LOW : 0;
    values_.assign(offsets.size(), 0);
    if (gpiod_line_request_bulk(&lines_, &request, values_.data()) != 0)
      place.FailLines(errno);
  }
  Lines(const Lines&) = delete;
  Lines& operator=(const Lines&) = delete;
  ~Lines() override
  {
    values_.assign(values_.size(), 0);
    gpiod_line_set_value_bulk(&lines_, values_.data());
    gpiod_line_release_bulk(&lines_);
  }

  void Set(std::uint32_t on) override
  {
    for (std::size_t i = 0; i < values_.size(); ++i)
      values_[i] = static_cast<int>(on >> i & 1u);
    if (gpiod_line_set_value_bulk(&lines_, values_.data()) != 0)
      place_.FailLines(errno);
  }

private:
  GpioPlace place_;
  std::unique_ptr<gpiod_chip, void (*)(gpiod_chip*)> chip_;
  gpiod_line_bulk lines_{};
  std::vector<int> values_;
};

} // namespace

std::unique_ptr<LightLines> OpenGpioLines(const GpioPlace& place)
{
  return std::make_unique<Lines>(place);
}

std::string GpioLibrary()
{
  return std::string("libgpiod ") + gpiod_version_string();
}

} // namespace echorama
