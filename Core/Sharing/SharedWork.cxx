// SPDX-License-Identifier: BSD-3-Clause
// A message is a line that says how its rank is, and then what it has to say. Run() ends with an exchange of its own, so that a
// rank that fails after its last one is heard as well.
#include "SharedWork.h"
#include <algorithm>
#include <new>

namespace echorama {
namespace {

constexpr char Works = 'w', Fails = 'f'; // then the kind of the error, and its message
constexpr const char* Done = "done";

std::string LineOf(const std::string& text)
{
  std::string line = text;
  std::replace(line.begin(), line.end(), '\n', ' ');
  return line;
}

[[noreturn]] void ThrowFirst(const std::vector<std::string>& statuses)
{
  const auto first = std::find_if(statuses.begin(), statuses.end(), [](const std::string& s) { return s[0] == Fails; });
  const auto kind = static_cast<Error::Kind>((*first)[1] - '0');
  const std::string message = first->substr(2);
  const bool isEverywhere = std::all_of(statuses.begin(), statuses.end(), [&](const std::string& s) { return s == *first; });
  if (isEverywhere || kind == Error::Kind::Cancelled)
    throw Error(kind, message);
  throw Error(kind, "rank " + std::to_string(first - statuses.begin()) + ": " + message);
}

} // namespace

// What the ranks say, after it is seen how they are.
std::vector<std::string> SharedWork::Pass(const std::string& status, const std::string& mine)
{
  const std::string sent = LineOf(status) + "\n" + mine;
  std::vector<std::string> all;
  try {
    all = AllGather(sent);
  } catch (const Error&) {
    isOver_ = true; // there is nobody to tell
    throw;
  }
  constexpr std::int64_t length = 8; // each is told beforehand how long the message is
  const std::int64_t others = Ranks() - 1;
  ++traffic_.exchanges;
  traffic_.messages += 2 * others;
  traffic_.bytesSent += others * (length + static_cast<std::int64_t>(sent.size()));
  std::vector<std::string> statuses;
  for (std::size_t rank = 0; rank < all.size(); ++rank) {
    if (static_cast<int>(rank) != Rank())
      traffic_.bytesReceived += length + static_cast<std::int64_t>(all[rank].size());
    const std::size_t end = all[rank].find('\n');
    statuses.push_back(all[rank].substr(0, end));
    all[rank].erase(0, end + 1);
  }
  if (std::any_of(statuses.begin(), statuses.end(), [](const std::string& s) { return s[0] == Fails; })) {
    isOver_ = true;
    ThrowFirst(statuses);
  }
  for (const std::string& other : statuses)
    if (other != statuses[0]) {
      isOver_ = true; // all see the same, and throw
      throw Error(Error::Kind::BadInput, "the ranks do not work on the same (" + statuses[0].substr(1) + ", " + other.substr(1) +
                                             "): they need the same input and parameters, and processors of one kind");
    }
  return all;
}

std::vector<std::string> SharedWork::Exchange(const std::string& mine, const std::string& about)
{
  return Ranks() > 1 ? Pass(Works + about, mine) : std::vector<std::string>{mine};
}

void SharedWork::Run(const std::function<void()>& work)
{
  if (Ranks() == 1)
    return work();
  isOver_ = false;
  const auto fail = [this](Error::Kind kind, const std::string& message) {
    if (!isOver_)
      Pass(std::string{Fails, static_cast<char>('0' + static_cast<int>(kind))} + message, {});
  };
  try {
    work();
    Exchange({}, Done);
  } catch (const Error& error) {
    fail(error.GetKind(), error.what());
    throw;
  } catch (const std::bad_alloc&) {
    fail(Error::Kind::TooLarge, "there is not enough memory for the result");
    throw;
  } catch (const std::exception& error) {
    fail(Error::Kind::NotPossible, error.what());
    throw;
  }
}

} // namespace echorama
