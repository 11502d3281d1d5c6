// SPDX-License-Identifier: BSD-3-Clause
// libgpiod 2 (Debian 13).
#include "GpioLines.h"
#include <cerrno>
#include <gpiod.h>
#include <new>

namespace echorama {
namespace {

template <class T>
using Owned = std::unique_ptr<T, void (*)(T*)>;

template <class T>
Owned<T> Own(T* made, void (*end)(T*))
{
  return {made, end};
}

class Lines : public LightLines {
public:
  explicit Lines(const GpioPlace& place) : place_(place), request_(nullptr, gpiod_line_request_release)
  {
    const auto chip = Own(gpiod_chip_open(place.Path().c_str()), gpiod_chip_close);
    if (!chip)
      place.FailChip(errno);
    const auto info = Own(gpiod_chip_get_info(chip.get()), gpiod_chip_info_free);
    if (!info)
      place.FailChip(errno);
    const std::vector<unsigned> offsets =
        place.Offsets(static_cast<unsigned>(gpiod_chip_info_get_num_lines(info.get())),
                      [&](const char* name) { return gpiod_chip_get_line_offset_from_name(chip.get(), name); });
    for (std::size_t i = 0; i < offsets.size(); ++i) {
      const auto line = Own(gpiod_chip_get_line_info(chip.get(), offsets[i]), gpiod_line_info_free);
      if (!line)
        place.FailLines(errno);
      if (gpiod_line_info_is_used(line.get()))
        place.FailTaken(place.lines[i], gpiod_line_info_get_consumer(line.get()));
    }
    const auto settings = Own(gpiod_line_settings_new(), gpiod_line_settings_free);
    const auto lines = Own(gpiod_line_config_new(), gpiod_line_config_free);
    const auto config = Own(gpiod_request_config_new(), gpiod_request_config_free);
    if (!settings || !lines || !config)
      throw std::bad_alloc();
    gpiod_line_settings_set_direction(settings.get(), GPIOD_LINE_DIRECTION_OUTPUT);
    gpiod_line_settings_set_output_value(settings.get(), GPIOD_LINE_VALUE_INACTIVE);
    gpiod_line_settings_set_active_low(settings.get(), place.activeLow);
    gpiod_request_config_set_consumer(config.get(), "echorama-leds");
    if (gpiod_line_config_add_line_settings(lines.get(), offsets.data(), offsets.size(), settings.get()) != 0)
      place.FailLines(errno);
    request_.reset(gpiod_chip_request_lines(chip.get(), config.get(), lines.get()));
    if (!request_)
      place.FailLines(errno);
    values_.assign(offsets.size(), GPIOD_LINE_VALUE_INACTIVE);
  }
  Lines(const Lines&) = delete;
  Lines& operator=(const Lines&) = delete;
  ~Lines() override
  {
    values_.assign(values_.size(), GPIOD_LINE_VALUE_INACTIVE);
    gpiod_line_request_set_values(request_.get(), values_.data());
  }

  void Set(std::uint32_t on) override
  {
    for (std::size_t i = 0; i < values_.size(); ++i)
      values_[i] = (on >> i & 1u) != 0 ? GPIOD_LINE_VALUE_ACTIVE : GPIOD_LINE_VALUE_INACTIVE;
    if (gpiod_line_request_set_values(request_.get(), values_.data()) != 0)
      place_.FailLines(errno);
  }

private:
  GpioPlace place_;
  Owned<gpiod_line_request> request_;
  std::vector<gpiod_line_value> values_; // in the order in which the lines were asked for
};

} // namespace

std::unique_ptr<LightLines> OpenGpioLines(const GpioPlace& place)
{
  return std::make_unique<Lines>(place);
}

std::string GpioLibrary()
{
  return std::string("libgpiod ") + gpiod_api_version();
}

} // namespace echorama
