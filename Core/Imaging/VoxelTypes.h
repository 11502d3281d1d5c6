// SPDX-License-Identifier: BSD-3-Clause
#pragma once

/// The voxel types that our filters promise to work on: X(type) for each. Kernels instantiate themselves with it, and the
/// VTK layer dispatches over it; volumes of other types are refused with a message.
#define ECHORAMA_FOR_EACH_VOXEL_TYPE(X)                                                                                          \
  X(unsigned char)                                                                                                               \
  X(short)                                                                                                                       \
  X(unsigned short)                                                                                                              \
  X(float)                                                                                                                       \
  X(double)
