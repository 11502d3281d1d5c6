// SPDX-License-Identifier: BSD-3-Clause
// Any bytes as a file of finished pairs. "CHECKSUM" becomes that of its pairs, which nobody guesses.
#include "Core/Base/Checksum.h"
#include "Core/Base/Json.h"
#include "Filters/Registration/FinishedPairs.h"
#include "Testing/Fuzzing.h"

using namespace echorama;

namespace {

using Json = nlohmann::ordered_json;

// With the right checksum, where it has the place for one.
std::string Sealed(std::string text)
{
  const Json file = Json::parse(text, nullptr, false);
  const std::size_t at = text.find("CHECKSUM");
  if (!file.is_object() || !file.contains("pairs") || at == std::string::npos)
    return text;
  const std::string pairs = file["pairs"].dump(-1, ' ', false, Json::error_handler_t::replace);
  return text.replace(at, 8, Checksum(pairs.data(), pairs.size()));
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
  const std::string text = Sealed({reinterpret_cast<const char*>(data), size});
  const MemoryFile file(reinterpret_cast<const std::uint8_t*>(text.data()), text.size());
  return Survives([&] { FinishedPairs(file.Path()).Find("a"); });
}
