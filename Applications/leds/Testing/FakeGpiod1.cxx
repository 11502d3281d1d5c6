// SPDX-License-Identifier: BSD-3-Clause
#include "FakeGpiod.h"
#include <gpiod.h>

struct gpiod_chip {
  gpiod_line* lines = nullptr;
};
struct gpiod_line {
  unsigned offset = 0;
};

extern "C" {

gpiod_chip* gpiod_chip_open(const char* path)
{
  return fake::Open(path) ? new gpiod_chip{new gpiod_line[fake::Lines]} : nullptr;
}
void gpiod_chip_close(gpiod_chip* chip)
{
  delete[] chip->lines;
  delete chip;
}
unsigned gpiod_chip_num_lines(gpiod_chip*)
{
  return fake::Lines;
}
gpiod_line* gpiod_chip_get_line(gpiod_chip* chip, unsigned offset)
{
  chip->lines[offset].offset = offset;
  return chip->lines + offset;
}
gpiod_line* gpiod_chip_find_line(gpiod_chip* chip, const char* name)
{
  const int offset = fake::OffsetOf(name);
  return offset < 0 ? nullptr : gpiod_chip_get_line(chip, static_cast<unsigned>(offset));
}
unsigned gpiod_line_offset(gpiod_line* line)
{
  return line->offset;
}
bool gpiod_line_is_used(gpiod_line* line)
{
  return line->offset == fake::Taken;
}
const char* gpiod_line_consumer(gpiod_line*)
{
  return fake::Consumer;
}
int gpiod_line_request_bulk(gpiod_line_bulk* bulk, const gpiod_line_request_config* config, const int* values)
{
  if (fake::Word() == "busy" || config->request_type != GPIOD_LINE_REQUEST_DIRECTION_OUTPUT) {
    errno = EBUSY;
    return -1;
  }
  std::string text = "taken by " + std::string(config->consumer) + (config->flags == 0 ? " as high" : " as low");
  for (unsigned i = 0; i < bulk->num_lines; ++i)
    text += " " + std::to_string(bulk->lines[i]->offset) + "=" + std::to_string(values[i]);
  fake::Log(text);
  return 0;
}
int gpiod_line_set_value_bulk(gpiod_line_bulk* bulk, const int* values)
{
  return fake::Set(values, bulk->num_lines);
}
void gpiod_line_release_bulk(gpiod_line_bulk*)
{
  fake::Log("released");
}
const char* gpiod_version_string()
{
  return "1 (fake)";
}

} // extern "C"
