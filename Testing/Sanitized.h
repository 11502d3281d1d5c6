// SPDX-License-Identifier: BSD-3-Clause
#pragma once
/// ECHORAMA_SANITIZED: whether a test runs under the sanitizers, which look for slips of memory and take fifteen times as long.
/// Tests that pass through the same code as others with more data say ECHORAMA_SKIP_SANITIZED() first.
#include <gtest/gtest.h>
#if defined(__has_feature)
#if __has_feature(address_sanitizer)
#define ECHORAMA_SANITIZED
#endif
#endif

#ifdef ECHORAMA_SANITIZED
#define ECHORAMA_SKIP_SANITIZED() GTEST_SKIP() << "other tests go through the same code; too slow under the sanitizers"
#else
#define ECHORAMA_SKIP_SANITIZED() static_cast<void>(0)
#endif
