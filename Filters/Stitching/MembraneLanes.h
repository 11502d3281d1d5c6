// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace echorama {

// ECHORAMA_MEMBRANE_SEPARATE says before a loop that what it writes at one place it does not read at another.
// GCC must not unroll the loop over lanes before it has seen that they are vectors.
#if defined(__GNUC__) && !defined(__clang__)
#define ECHORAMA_MEMBRANE_LANES(l) _Pragma("GCC ivdep") _Pragma("GCC unroll 1") for (int l = 0; l < Lanes; ++l)
#define ECHORAMA_MEMBRANE_SEPARATE _Pragma("GCC ivdep")
#else
#define ECHORAMA_MEMBRANE_SEPARATE
#define ECHORAMA_MEMBRANE_LANES(l) for (int l = 0; l < Lanes; ++l)
#endif

/// Runs body(i, lane, fresh) for i in [begin, end), \a Lanes at a time, which compilers turn into vector instructions. The
/// last ones may overlap those before: fresh is 0 for voxels that were done already, else 1. Rows are short: voxels that are
/// left over and done one by one would cost as much as all others. (Thirty-two lanes are one vector of bytes.)
template <int Lanes, class Body>
[[gnu::always_inline]] inline void ForLanes(int begin, int end, const Body& body)
{
  if (end - begin < Lanes) {
    if constexpr (Lanes > 8) {
      ForLanes<Lanes / 2>(begin, end, body);
    } else {
      for (int i = begin; i < end; ++i)
        body(i, 0, 1.0f);
    }
    return;
  }
  int i = begin;
  for (; i + Lanes <= end; i += Lanes) {
    ECHORAMA_MEMBRANE_LANES(l)
    body(i + l, l, 1.0f);
  }
  if (i < end) {
    const int done = i - (end - Lanes);
    ECHORAMA_MEMBRANE_LANES(l)
    body(end - Lanes + l, l, l < done ? 0.0f : 1.0f);
  }
}

constexpr int MembraneByteLanes = 32;  ///< for loops that read codes
constexpr int MembraneFloatLanes = 16; ///< for others

} // namespace echorama
