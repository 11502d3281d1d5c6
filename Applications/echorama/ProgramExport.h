// SPDX-License-Identifier: BSD-3-Clause
#pragma once

/// Of what the program and the libraries of its subcommands use of each other: all else they keep to themselves.
#define ECHORAMA_PROGRAM_EXPORT __attribute__((visibility("default")))
