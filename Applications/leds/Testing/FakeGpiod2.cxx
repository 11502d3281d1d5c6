// SPDX-License-Identifier: BSD-3-Clause
#include "FakeGpiod.h"
#include <gpiod.h>
#include <vector>

struct gpiod_chip {};
struct gpiod_chip_info {};
struct gpiod_line_info {
  unsigned offset;
};
struct gpiod_line_settings {
  bool output = false, low = false;
  int value = -1;
};
struct gpiod_line_config {
  std::vector<unsigned> offsets;
  gpiod_line_settings settings;
};
struct gpiod_request_config {
  std::string consumer;
};
struct gpiod_line_request {
  std::size_t lines;
};

extern "C" {

gpiod_chip* gpiod_chip_open(const char* path)
{
  return fake::Open(path) ? new gpiod_chip : nullptr;
}
void gpiod_chip_close(gpiod_chip* chip)
{
  delete chip;
}
gpiod_chip_info* gpiod_chip_get_info(gpiod_chip*)
{
  return new gpiod_chip_info;
}
void gpiod_chip_info_free(gpiod_chip_info* info)
{
  delete info;
}
std::size_t gpiod_chip_info_get_num_lines(gpiod_chip_info*)
{
  return fake::Lines;
}
int gpiod_chip_get_line_offset_from_name(gpiod_chip*, const char* name)
{
  return fake::OffsetOf(name);
}
gpiod_line_info* gpiod_chip_get_line_info(gpiod_chip*, unsigned offset)
{
  return new gpiod_line_info{offset};
}
void gpiod_line_info_free(gpiod_line_info* info)
{
  delete info;
}
bool gpiod_line_info_is_used(gpiod_line_info* info)
{
  return info->offset == fake::Taken;
}
const char* gpiod_line_info_get_consumer(gpiod_line_info*)
{
  return fake::Consumer;
}
gpiod_line_settings* gpiod_line_settings_new()
{
  return new gpiod_line_settings;
}
void gpiod_line_settings_free(gpiod_line_settings* settings)
{
  delete settings;
}
int gpiod_line_settings_set_direction(gpiod_line_settings* settings, gpiod_line_direction direction)
{
  settings->output = direction == GPIOD_LINE_DIRECTION_OUTPUT;
  return 0;
}
int gpiod_line_settings_set_output_value(gpiod_line_settings* settings, gpiod_line_value value)
{
  settings->value = value;
  return 0;
}
void gpiod_line_settings_set_active_low(gpiod_line_settings* settings, bool low)
{
  settings->low = low;
}
gpiod_line_config* gpiod_line_config_new()
{
  return new gpiod_line_config;
}
void gpiod_line_config_free(gpiod_line_config* config)
{
  delete config;
}
int gpiod_line_config_add_line_settings(gpiod_line_config* config, const unsigned* offsets, std::size_t n,
                                        gpiod_line_settings* settings)
{
  config->offsets.assign(offsets, offsets + n);
  config->settings = *settings;
  return 0;
}
gpiod_request_config* gpiod_request_config_new()
{
  return new gpiod_request_config;
}
void gpiod_request_config_free(gpiod_request_config* config)
{
  delete config;
}
void gpiod_request_config_set_consumer(gpiod_request_config* config, const char* consumer)
{
  config->consumer = consumer;
}
gpiod_line_request* gpiod_chip_request_lines(gpiod_chip*, gpiod_request_config* config, gpiod_line_config* lines)
{
  if (fake::Word() == "busy" || !lines->settings.output) {
    errno = EBUSY;
    return nullptr;
  }
  std::string text = "taken by " + config->consumer + (lines->settings.low ? " as low" : " as high");
  for (const unsigned offset : lines->offsets)
    text += " " + std::to_string(offset) + "=" + std::to_string(lines->settings.value);
  fake::Log(text);
  return new gpiod_line_request{lines->offsets.size()};
}
int gpiod_line_request_set_values(gpiod_line_request* request, const gpiod_line_value* values)
{
  return fake::Set(values, request->lines);
}
void gpiod_line_request_release(gpiod_line_request* request)
{
  fake::Log("released");
  delete request;
}
const char* gpiod_api_version()
{
  return "2 (fake)";
}

} // extern "C"
