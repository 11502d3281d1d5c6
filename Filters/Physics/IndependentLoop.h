// SPDX-License-Identifier: BSD-3-Clause
#pragma once

/// Before a loop whose rounds do not write what others read, though the compiler cannot know.
#if defined(__GNUC__) && !defined(__clang__)
#define ECHORAMA_INDEPENDENT _Pragma("GCC ivdep")
#else
#define ECHORAMA_INDEPENDENT
#endif
