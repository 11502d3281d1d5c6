// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The inner loops of the metrics: what a block of points reads at one pose, and the sums over it.
#include "Core/Geometry/RigidTransform.h"

namespace echorama {

constexpr int BlockSize = 256;                   ///< points that are read together
constexpr int PatchSize = 128;                   ///< points of a patch: 5 x 5 x 5, and three that weigh nothing
constexpr int Channels = 12, ChannelStride = 16; ///< of a descriptor; the byte after the channels is the weight

/// An affine map in single precision.
struct Map {
  float xx, xy, xz, x0, yx, yy, yz, y0, zx, zy, zz, z0;
};
Map MapOf(const Eigen::Affine3d& a);

struct SeenVoxel;

/// The voxels of the volume that is read; at least two along each axis.
struct Field {
  const SeenVoxel* seen = nullptr;
  const unsigned char* descriptors = nullptr; ///< ChannelStride bytes per voxel
  int nx = 0, ny = 0, nz = 0;
};

/// Values are brought to a common scale: ours * valueScale + valueOffset, theirs * readScale + readOffset.
struct Fit {
  float readScale = 1.0f, readOffset = 0.0f, valueScale = 1.0f, valueOffset = 0.0f;
};

/// The points of a block: where, what their own volume shows there and how much that counts. A view.
struct BlockOfPoints {
  const float *x, *y, *z, *value, *weight;
  const float* second;     ///< a second value of each (patches)
  const float* descriptor; ///< ChannelStride numbers of each (descriptors)
  int count;
};

/// What a block of points reads, one array per quantity. Beyond the last point weights are 0.
struct Terms {
  float r[BlockSize];                             ///< difference
  float r2[BlockSize];                            ///< squared difference, as the loss takes it
  float w[BlockSize];                             ///< weight of both
  float covered[BlockSize];                       ///< own weight, where the other volume has any
  float jacobian[6][BlockSize];                   ///< of r by the twist, without the direction's sign; first the index gradient
  float x[BlockSize], y[BlockSize], z[BlockSize]; ///< from the centre of the twist, mm
  float curved[BlockSize];                        ///< w times the slope of the loss
  float curvedJ[6][BlockSize];                    ///< times the Jacobian
};

/// Up to three differences with gradients that stand for those of all channels.
struct Condensed {
  float r[3][BlockSize], gradient[3][3][BlockSize];
};

/// Sums of one direction.
struct RawSums {
  double weight = 0.0, loss = 0.0, covered = 0.0;
  double moment[3] = {}, gradient[6] = {}, hessian[21] = {};
  double values[5] = {};                                            ///< theirs t and ours o: t, o, tt, oo, to, weighted
  double slopes[6] = {}, theirSlopes[6] = {}, residualTheirs = 0.0; ///< J, t J, r t, weighted

  void operator+=(const RawSums& other);
};

/// Fills r, r2, w, covered and jacobian[0..2] (index gradients).
void ReadValues(const Field& field, const Map& toIndex, const Fit& fit, const BlockOfPoints& points, Terms& t);

/// Fills r2 (mean over the channels), w and covered; what Gauss-Newton needs of the channels goes into \a condensed.
void ReadDescriptors(const Field& field, const Map& toIndex, const BlockOfPoints& points, Terms& t, Condensed& condensed);

/// One descriptor, in index coordinates; weight 0 outside.
void ReadDescriptor(const Field& field, float x, float y, float z, float* descriptor, float& weight);

/// Positions and the slope of the loss of scale^2 = \a scale2.
void Place(const Map& toCentre, float scale2, const BlockOfPoints& points, Terms& t);

/// From index gradients to the Jacobian by the twist (after Place).
void Turn(const Map& worldGradient, Terms& t);

/// Replaces, patch by patch, what is read by the part that value, second value and 1 do not explain, in deviations of what is
/// read (and the Jacobian by that of this part, the coefficients following the pose); patches without texture lose weight.
/// Works on r that holds the bare values read. After Place and Turn; sets r, r2, w, curved.
void ExplainPatches(const BlockOfPoints& points, float floor, bool isWithSlopes, Terms& t);

void SumLoss(const Terms& t, float scale2, RawSums& sums);
void SumSlopes(Terms& t, RawSums& sums);
/// With a fit: how the fit itself moves with the pose; \a theirs: fitted values read.
void SumFit(const Terms& t, const float* theirs, RawSums& sums);
/// For the fit: t.r holds the bare values read, \a ours the bare own values.
void SumValues(const Terms& t, const float* ours, RawSums& sums);

/// 2 d^2 (sqrt(1 + r^2 / d^2) - 1).
inline float Loss(float r2, float scale2)
{
  return 2.0f * r2 / (1.0f + __builtin_sqrtf(1.0f + r2 / scale2));
}

} // namespace echorama
