// SPDX-License-Identifier: BSD-3-Clause
#include "Readers/CsvLine.h"
#include "Readers/HeaderLines.h"

namespace echorama {

bool SplitCsvLine(std::string_view line, char separator, std::vector<std::string>& cells)
{
  cells.assign(1, {});
  bool quoted = false;
  for (std::size_t i = 0; i < line.size(); ++i) {
    const char c = line[i];
    if (c == '"' && quoted && i + 1 < line.size() && line[i + 1] == '"')
      cells.back() += line[++i];
    else if (c == '"' && (quoted || HeaderLines::Trimmed(cells.back()).empty()))
      quoted = !quoted;
    else if (c == separator && !quoted)
      cells.emplace_back();
    else
      cells.back() += c;
  }
  return !quoted;
}

} // namespace echorama
