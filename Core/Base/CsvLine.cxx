// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/CsvLine.h"

namespace echorama {

bool SplitCsvLine(std::string_view line, char separator, std::vector<std::string>& cells)
{
  cells.assign(1, {});
  bool quoted = false;
  for (std::size_t i = 0; i < line.size(); ++i) {
    const char c = line[i];
    if (c == '"' && quoted && i + 1 < line.size() && line[i + 1] == '"')
      cells.back() += line[++i];
    else if (c == '"' && (quoted || cells.back().find_first_not_of(" \t\r\v\f") == std::string::npos))
      quoted = !quoted;
    else if (c == separator && !quoted)
      cells.emplace_back();
    else
      cells.back() += c;
  }
  return !quoted;
}

} // namespace echorama
