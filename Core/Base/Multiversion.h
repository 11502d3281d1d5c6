// SPDX-License-Identifier: BSD-3-Clause
#pragma once

/// Before a free, non-template function that holds a hot loop: packages (x86-64-v2) get it in three versions, chosen when
/// the program starts. A build for one CPU (ECHORAMA_CPU) needs one. Off under the sanitizers, which cannot start
/// before the choice is made.
#if defined(ECHORAMA_MULTIVERSION) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__)
#define ECHORAMA_HOT __attribute__((target_clones("default", "arch=x86-64-v3", "arch=x86-64-v4")))
#else
#define ECHORAMA_HOT
#endif
