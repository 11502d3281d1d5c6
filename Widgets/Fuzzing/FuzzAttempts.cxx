// SPDX-License-Identifier: BSD-3-Clause
// Any bytes as a history of attempts: what is read comes back the same when it is written again.
#include "Testing/Fuzzing.h"
#include "Widgets/Session/LiveScore.h"

using namespace echorama;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
  const MemoryFile file(data, size);
  return Survives([&] {
    const std::vector<Attempt> attempts = ReadAttempts(file.Path());
    const MemoryFile copy(nullptr, 0);
    for (const Attempt& attempt : attempts)
      AppendAttempt(copy.Path(), attempt);
    const std::vector<Attempt> again = attempts.empty() ? attempts : ReadAttempts(copy.Path());
    if (again.size() != attempts.size())
      std::abort();
    for (std::size_t i = 0; i < again.size(); ++i)
      if (again[i].trainee != attempts[i].trainee || again[i].project != attempts[i].project ||
          again[i].scoreMm != attempts[i].scoreMm || again[i].edits != attempts[i].edits)
        std::abort();
  });
}
