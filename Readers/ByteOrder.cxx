// SPDX-License-Identifier: BSD-3-Clause
#include "Readers/ByteOrder.h"
#include <algorithm>

namespace echorama {
namespace {

template <std::size_t Size> // known to the compiler, so that the loop becomes vector instructions
void SwapBytesOf(char* bytes, std::size_t count)
{
  for (std::size_t i = 0; i < count; ++i, bytes += Size)
    std::reverse(bytes, bytes + Size);
}

} // namespace

void SwapBytes(char* bytes, std::size_t size, std::size_t count)
{
  if (size == 2)
    SwapBytesOf<2>(bytes, count);
  else if (size == 4)
    SwapBytesOf<4>(bytes, count);
  else if (size == 8)
    SwapBytesOf<8>(bytes, count);
}

} // namespace echorama
