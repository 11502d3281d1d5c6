// SPDX-License-Identifier: BSD-3-Clause
// Any bytes as a task for the scan simulator: what is read comes back the same when it is written again.
#include "Testing/Fuzzing.h"
#include "Widgets/Session/ScanTask.h"

using namespace echorama;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
  return Survives([&] {
    const ScanTask task = ScanTaskOf(std::string(reinterpret_cast<const char*>(data), size));
    const std::string text = ScanTaskText(task);
    if (ScanTaskText(ScanTaskOf(text)) != text)
      std::abort();
  });
}
