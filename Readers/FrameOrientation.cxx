// SPDX-License-Identifier: BSD-3-Clause
// One loop turns them all: it writes rows in memory and reads with the strides of the file, which are negative where an axis
// is flipped.
#include "Readers/FrameOrientation.h"
#include <algorithm>

namespace echorama {
namespace {

template <std::size_t Size>
struct Pixel {
  char bytes[Size];
};

template <class P>
void TurnPixels(const FrameOrientation& turn, const std::array<int, 3>& size, const char* in, char* out)
{
  // Sizes are those in memory; the strides are those of the file along the axes in memory.
  std::array<std::ptrdiff_t, 3> ofFile{}, stride{};
  std::array<std::size_t, 3> memoryAxis{};
  for (std::size_t i = 0; i < 3; ++i)
    memoryAxis[static_cast<std::size_t>(turn.axis[i])] = i;
  ofFile[0] = 1;
  ofFile[1] = size[memoryAxis[0]];
  ofFile[2] = ofFile[1] * size[memoryAxis[1]];
  const P* from = reinterpret_cast<const P*>(in);
  for (std::size_t i = 0; i < 3; ++i) {
    stride[i] = ofFile[static_cast<std::size_t>(turn.axis[i])];
    if (turn.flip[i]) {
      from += stride[i] * (size[i] - 1);
      stride[i] = -stride[i];
    }
  }
  P* to = reinterpret_cast<P*>(out);
  for (int z = 0; z < size[2]; ++z)
    for (int y = 0; y < size[1]; ++y) {
      const P* row = from + z * stride[2] + y * stride[1];
      for (int x = 0; x < size[0]; ++x)
        *to++ = row[x * stride[0]];
    }
}

} // namespace

bool FrameOrientation::Parse(const std::string& code)
{
  if (code.empty() || code == "XX")
    return true;
  if (code.size() != 2 && code.size() != 3)
    return false;
  const std::string letters = "MUFNAD"; // + and - along x, y, z
  std::array<int, 3> along{-1, -1, -1};
  std::array<bool, 3> back{};
  for (std::size_t i = 0; i < code.size(); ++i) {
    const std::size_t letter = letters.find(code[i]);
    if (letter == std::string::npos)
      return false;
    along[i] = static_cast<int>(letter / 2);
    back[i] = letter % 2 == 1;
  }
  if (code.size() == 2) {
    along[2] = 3 - along[0] - along[1];
    const bool cyclic = (along[0] + 1) % 3 == along[1];
    back[2] = (back[0] != back[1]) == cyclic;
  }
  for (int i = 0; i < 3; ++i) {
    const auto found = std::find(along.begin(), along.end(), i);
    if (found == along.end())
      return false; // two letters along one axis
    axis[static_cast<std::size_t>(i)] = static_cast<int>(found - along.begin());
    flip[static_cast<std::size_t>(i)] = back[static_cast<std::size_t>(found - along.begin())];
  }
  return true;
}

void FrameOrientation::Turn(std::size_t pixelBytes, const std::array<int, 3>& size, const char* in, char* out) const
{
  switch (pixelBytes) {
#define EchoramaTurnCase(n)                                                                                                      \
  case n:                                                                                                                        \
    TurnPixels<Pixel<n>>(*this, size, in, out);                                                                                  \
    return;
    EchoramaTurnCase(1) EchoramaTurnCase(2) EchoramaTurnCase(3) EchoramaTurnCase(4) EchoramaTurnCase(6) EchoramaTurnCase(8)
        EchoramaTurnCase(12) EchoramaTurnCase(16) EchoramaTurnCase(24) EchoramaTurnCase(32)
#undef EchoramaTurnCase
  }
}

} // namespace echorama
