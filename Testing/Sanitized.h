// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <dlfcn.h>
#include <gtest/gtest.h>

/// Whether the kernels were compiled with the sanitizers, which look for slips of memory and take fifteen times as long. The
/// test programs are the same then; they are started with the sanitizers' library.
inline bool IsSanitized()
{
  return dlsym(RTLD_DEFAULT, "__asan_init") != nullptr;
}

/// Said first by tests that pass through the same code as others with more data.
#define ECHORAMA_SKIP_SANITIZED()                                                                                                \
  if (IsSanitized())                                                                                                             \
  GTEST_SKIP() << "other tests go through the same code; too slow under the sanitizers"
