// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <algorithm>
#include <string_view>
#include <vector>

namespace echorama {

constexpr std::string_view Blanks = " \t\r\v\f"; // no line breaks: they end lines

/// \a text without blanks at its ends.
inline std::string_view TrimBlanks(std::string_view text)
{
  const std::size_t first = text.find_first_not_of(Blanks);
  return first == std::string_view::npos ? std::string_view() : text.substr(first, text.find_last_not_of(Blanks) - first + 1);
}

/// \a text without the byte-order mark of UTF-8 that spreadsheets and editors may begin a file with.
inline std::string_view SkipByteOrderMark(std::string_view text)
{
  return text.substr(text.substr(0, 3) == "\xef\xbb\xbf" ? 3 : 0);
}

/// What blanks separate in \a text.
inline std::vector<std::string_view> SplitWords(std::string_view text)
{
  std::vector<std::string_view> words;
  for (std::size_t at = text.find_first_not_of(Blanks); at != std::string_view::npos;) {
    const std::size_t end = std::min(text.find_first_of(Blanks, at), text.size());
    words.push_back(text.substr(at, end - at));
    at = text.find_first_not_of(Blanks, end);
  }
  return words;
}

} // namespace echorama
