// SPDX-License-Identifier: BSD-3-Clause
// No branches in the loops over points, so that compilers make them wide. Sums run in lanes of their own, so that the order of
// additions, and with it the last digit, does not depend on how wide the machine is.
#include "MetricBlock.h"
#include "Metric.h"
#include <algorithm>
#include <cmath>

namespace echorama {
namespace {

constexpr int Lanes = 16;
constexpr int ReadAhead = 16; // points

inline double Fold(const float* lanes)
{
  double sum = 0.0;
  for (int lane = 0; lane < Lanes; ++lane)
    sum += static_cast<double>(lanes[lane]);
  return sum;
}

inline double Sum(const float* a, int count = BlockSize)
{
  float lanes[Lanes] = {};
  for (int p = 0; p < count; p += Lanes)
    for (int lane = 0; lane < Lanes; ++lane)
      lanes[lane] += a[p + lane];
  return Fold(lanes);
}

inline double Dot(const float* a, const float* b, int count = BlockSize)
{
  float lanes[Lanes] = {};
  for (int p = 0; p < count; p += Lanes)
    for (int lane = 0; lane < Lanes; ++lane)
      lanes[lane] += a[p + lane] * b[p + lane];
  return Fold(lanes);
}

// Where points lie in a volume that is read: their first voxel, how far beyond it, and whether they are in the grid at all.
struct Places {
  int first[BlockSize];
  float tx[BlockSize], ty[BlockSize], tz[BlockSize], inside[BlockSize];
};

void FindPlaces(const Field& field, const Map& m, const float* px, const float* py, const float* pz, int count, Places& out)
{
  const int row = field.nx, slice = row * field.ny;
  const int lastX = field.nx - 2, lastY = field.ny - 2, lastZ = field.nz - 2;
  const float endX = static_cast<float>(field.nx - 1), endY = static_cast<float>(field.ny - 1),
              endZ = static_cast<float>(field.nz - 1);
  for (int p = 0; p < count; ++p) {
    const float x = m.xx * px[p] + m.xy * py[p] + m.xz * pz[p] + m.x0;
    const float y = m.yx * px[p] + m.yy * py[p] + m.yz * pz[p] + m.y0;
    const float z = m.zx * px[p] + m.zy * py[p] + m.zz * pz[p] + m.z0;
    const float cx = x > 0.0f ? (x < endX ? x : endX) : 0.0f;
    const float cy = y > 0.0f ? (y < endY ? y : endY) : 0.0f;
    const float cz = z > 0.0f ? (z < endZ ? z : endZ) : 0.0f;
    const int ix = static_cast<int>(cx), iy = static_cast<int>(cy), iz = static_cast<int>(cz);
    const int i = ix < lastX ? ix : lastX, j = iy < lastY ? iy : lastY, k = iz < lastZ ? iz : lastZ;
    out.tx[p] = cx - static_cast<float>(i);
    out.ty[p] = cy - static_cast<float>(j);
    out.tz[p] = cz - static_cast<float>(k);
    out.first[p] = k * slice + j * row + i;
    out.inside[p] = (x >= 0.0f) & (y >= 0.0f) & (z >= 0.0f) & (x <= endX) & (y <= endY) & (z <= endZ) ? 1.0f : 0.0f;
  }
}

// Value, weight, value, weight of two voxels that lie side by side, in steps.
inline void TwoVoxels(const SeenVoxel* at, float* out)
{
  out[0] = static_cast<float>(at[0].value);
  out[1] = static_cast<float>(at[0].weight);
  out[2] = static_cast<float>(at[1].value);
  out[3] = static_cast<float>(at[1].weight);
}

// What lies between the voxels: value, index gradient, weight.
void ReadPlaces(const Field& field, const Places& at, int count, float* value, float* weight, float* gx, float* gy, float* gz)
{
  const std::ptrdiff_t row = field.nx, slice = row * field.ny;
  for (int p = 0; p < count; ++p) {
    // Points are strewn over a volume that no cache holds: voxels are asked for before they are needed.
    const SeenVoxel* soon = field.seen + at.first[std::min(p + ReadAhead, count - 1)];
    __builtin_prefetch(soon);
    __builtin_prefetch(soon + row);
    __builtin_prefetch(soon + slice);
    __builtin_prefetch(soon + slice + row);

    const SeenVoxel* first = field.seen + at.first[p];
    const float tx = at.tx[p], ty = at.ty[p], tz = at.tz[p];
    float a[4], b[4], c[4], d[4], all[4], alongY[4], alongZ[4];
    TwoVoxels(first, a);
    TwoVoxels(first + row, b);
    TwoVoxels(first + slice, c);
    TwoVoxels(first + slice + row, d);
    for (int l = 0; l < 4; ++l) {
      const float ba = b[l] - a[l], dc = d[l] - c[l], near = a[l] + ty * ba, far = c[l] + ty * dc;
      alongY[l] = ba + tz * (dc - ba);
      alongZ[l] = far - near;
      all[l] = near + tz * alongZ[l];
    }
    gx[p] = all[2] - all[0];
    value[p] = all[0] + tx * gx[p];
    weight[p] = all[1] + tx * (all[3] - all[1]);
    gy[p] = alongY[0] + tx * (alongY[2] - alongY[0]);
    gz[p] = alongZ[0] + tx * (alongZ[2] - alongZ[0]);
  }
}

void CompareBlock(const Fit& fit, const float* inside, const float* ours, const float* ourWeight, int count, float* r, float* r2,
                  float* w, float* covered, float* gx, float* gy, float* gz)
{
  const float scale = fit.readScale * SeenVoxel::ValueUnit;
  for (int p = 0; p < count; ++p) {
    const float weight = inside[p] * ourWeight[p], u = SeenVoxel::WeightUnit * w[p];
    r[p] = scale * r[p] + fit.readOffset - (fit.valueScale * ours[p] + fit.valueOffset);
    r2[p] = r[p] * r[p];
    gx[p] *= scale;
    gy[p] *= scale;
    gz[p] *= scale;
    w[p] = weight * u;
    covered[p] = u > 1e-6f ? weight : 0.0f;
  }
}

inline void Widen(const unsigned char* bytes, float* out)
{
  for (int c = 0; c < ChannelStride; ++c)
    out[c] = static_cast<float>(bytes[c]) * (1.0f / 255.0f);
}

// Twelve channels in four lanes.
inline float Dot12(const float* a, const float* b)
{
  float lanes[4];
  for (int l = 0; l < 4; ++l)
    lanes[l] = a[l] * b[l] + a[l + 4] * b[l + 4] + a[l + 8] * b[l + 8];
  return (lanes[0] + lanes[1]) + (lanes[2] + lanes[3]);
}

// The sum over channels of r g and g g^T is all that Gauss-Newton needs. With L L^T = sum of g g^T it is the same as of three
// differences L^-1 (sum of r g) with the columns of L as gradients.
void ReadDescriptorBlock(const Field& field, const Map& m, const BlockOfPoints& points, Terms& t, Condensed& out)
{
  const int row = ChannelStride * field.nx, slice = row * field.ny;
  const float endX = static_cast<float>(field.nx - 1), endY = static_cast<float>(field.ny - 1),
              endZ = static_cast<float>(field.nz - 1);
  for (int p = 0; p < points.count; ++p) {
    const float x = m.xx * points.x[p] + m.xy * points.y[p] + m.xz * points.z[p] + m.x0;
    const float y = m.yx * points.x[p] + m.yy * points.y[p] + m.yz * points.z[p] + m.y0;
    const float z = m.zx * points.x[p] + m.zy * points.y[p] + m.zz * points.z[p] + m.z0;
    const bool inside = (x >= 0.0f) & (y >= 0.0f) & (z >= 0.0f) & (x <= endX) & (y <= endY) & (z <= endZ);
    if (!inside) { // costly to read, so not read
      t.w[p] = t.covered[p] = t.r2[p] = 0.0f;
      for (int d = 0; d < 3; ++d) {
        out.r[d][p] = 0.0f;
        for (int e = 0; e < 3; ++e)
          out.gradient[d][e][p] = 0.0f;
      }
      continue;
    }
    const int i = std::min(static_cast<int>(x), field.nx - 2), j = std::min(static_cast<int>(y), field.ny - 2),
              k = std::min(static_cast<int>(z), field.nz - 2);
    const float tx = x - static_cast<float>(i), ty = y - static_cast<float>(j), tz = z - static_cast<float>(k);
    const unsigned char* c = field.descriptors + static_cast<std::ptrdiff_t>(k) * slice + static_cast<std::ptrdiff_t>(j) * row +
                             static_cast<std::ptrdiff_t>(i) * ChannelStride;
    float a0[ChannelStride], a1[ChannelStride], b0[ChannelStride], b1[ChannelStride];
    float c0[ChannelStride], c1[ChannelStride], d0[ChannelStride], d1[ChannelStride];
    Widen(c, a0);
    Widen(c + ChannelStride, a1);
    Widen(c + row, b0);
    Widen(c + row + ChannelStride, b1);
    Widen(c + slice, c0);
    Widen(c + slice + ChannelStride, c1);
    Widen(c + slice + row, d0);
    Widen(c + slice + row + ChannelStride, d1);
    float r[ChannelStride], u[ChannelStride], gx[ChannelStride], gy[ChannelStride], gz[ChannelStride];
    const float* own = points.descriptor + ChannelStride * static_cast<std::ptrdiff_t>(p);
    for (int l = 0; l < ChannelStride; ++l) {
      const float da = a1[l] - a0[l], db = b1[l] - b0[l], dc = c1[l] - c0[l], dd = d1[l] - d0[l];
      const float a = a0[l] + tx * da, b = b0[l] + tx * db, e = c0[l] + tx * dc, d = d0[l] + tx * dd;
      const float ab = a + ty * (b - a), cd = e + ty * (d - e);
      const float dab = da + ty * (db - da), dcd = dc + ty * (dd - dc);
      gx[l] = dab + tz * (dcd - dab);
      gy[l] = (b - a) + tz * ((d - e) - (b - a));
      gz[l] = cd - ab;
      u[l] = ab + tz * (cd - ab);
      r[l] = u[l] - own[l];
    }
    t.w[p] = points.weight[p] * u[Channels];
    t.covered[p] = u[Channels] > 1e-6f ? points.weight[p] : 0.0f;
    constexpr float Share = 1.0f / Channels;
    t.r2[p] = Share * Dot12(r, r);
    const float xx = Share * Dot12(gx, gx) + 1e-12f, yx = Share * Dot12(gy, gx), zx = Share * Dot12(gz, gx);
    const float yy = Share * Dot12(gy, gy) + 1e-12f, zy = Share * Dot12(gz, gy), zz = Share * Dot12(gz, gz) + 1e-12f;
    const float rx = Share * Dot12(r, gx), ry = Share * Dot12(r, gy), rz = Share * Dot12(r, gz);
    const float l00 = std::sqrt(xx), l10 = yx / l00, l20 = zx / l00;
    const float l11 = std::sqrt(std::max(yy - l10 * l10, 1e-12f)), l21 = (zy - l20 * l10) / l11;
    const float l22 = std::sqrt(std::max(zz - l20 * l20 - l21 * l21, 1e-12f));
    const float r0 = rx / l00, r1 = (ry - l10 * r0) / l11, r2 = (rz - l20 * r0 - l21 * r1) / l22;
    const float rs[3] = {r0, r1, r2};
    const float g[3][3] = {{l00, l10, l20}, {0.0f, l11, l21}, {0.0f, 0.0f, l22}};
    for (int d = 0; d < 3; ++d) {
      out.r[d][p] = rs[d];
      for (int e = 0; e < 3; ++e)
        out.gradient[d][e][p] = g[d][e];
    }
  }
}

void PlaceBlock(const Map& toCentre, float scale2, const float* px, const float* py, const float* pz, int count, Terms& t)
{
  const float inverse = 1.0f / scale2;
  for (int p = 0; p < count; ++p) {
    t.x[p] = toCentre.xx * px[p] + toCentre.xy * py[p] + toCentre.xz * pz[p] + toCentre.x0;
    t.y[p] = toCentre.yx * px[p] + toCentre.yy * py[p] + toCentre.yz * pz[p] + toCentre.y0;
    t.z[p] = toCentre.zx * px[p] + toCentre.zy * py[p] + toCentre.zz * pz[p] + toCentre.z0;
    t.curved[p] = t.w[p] / std::sqrt(1.0f + t.r2[p] * inverse);
  }
}

} // namespace

Map MapOf(const Eigen::Affine3d& a)
{
  const Eigen::Matrix<float, 3, 4> m = a.matrix().topRows<3>().cast<float>();
  return {m(0, 0), m(0, 1), m(0, 2), m(0, 3), m(1, 0), m(1, 1), m(1, 2), m(1, 3), m(2, 0), m(2, 1), m(2, 2), m(2, 3)};
}

void RawSums::operator+=(const RawSums& o)
{
  const auto add = [](double* a, const double* b, int n) {
    for (int i = 0; i < n; ++i)
      a[i] += b[i];
  };
  weight += o.weight;
  loss += o.loss;
  covered += o.covered;
  add(moment, o.moment, 3);
  add(gradient, o.gradient, 6);
  add(hessian, o.hessian, 21);
  add(values, o.values, 5);
  add(slopes, o.slopes, 6);
  add(theirSlopes, o.theirSlopes, 6);
  residualTheirs += o.residualTheirs;
}

void ReadValues(const Field& field, const Map& toIndex, const Fit& fit, const BlockOfPoints& b, Terms& t)
{
  Places places;
  FindPlaces(field, toIndex, b.x, b.y, b.z, b.count, places);
  ReadPlaces(field, places, b.count, t.r, t.w, t.jacobian[0], t.jacobian[1], t.jacobian[2]);
  CompareBlock(fit, places.inside, b.value, b.weight, b.count, t.r, t.r2, t.w, t.covered, t.jacobian[0], t.jacobian[1],
               t.jacobian[2]);
}

void ReadDescriptors(const Field& field, const Map& toIndex, const BlockOfPoints& points, Terms& t, Condensed& condensed)
{
  ReadDescriptorBlock(field, toIndex, points, t, condensed);
}

void ReadDescriptor(const Field& field, float x, float y, float z, float* descriptor, float& weight)
{
  std::fill_n(descriptor, ChannelStride, 0.0f);
  weight = 0.0f;
  if (!(x >= 0.0f && y >= 0.0f && z >= 0.0f && x <= static_cast<float>(field.nx - 1) && y <= static_cast<float>(field.ny - 1) &&
        z <= static_cast<float>(field.nz - 1)))
    return;
  const int i = std::min(static_cast<int>(x), field.nx - 2), j = std::min(static_cast<int>(y), field.ny - 2),
            k = std::min(static_cast<int>(z), field.nz - 2);
  const float tx = x - static_cast<float>(i), ty = y - static_cast<float>(j), tz = z - static_cast<float>(k);
  for (int corner = 0; corner < 8; ++corner) {
    const int a = corner & 1, b = corner >> 1 & 1, c = corner >> 2;
    const std::ptrdiff_t at = (static_cast<std::ptrdiff_t>(k + c) * field.ny + j + b) * field.nx + i + a;
    const float share = (a ? tx : 1.0f - tx) * (b ? ty : 1.0f - ty) * (c ? tz : 1.0f - tz) / 255.0f;
    for (int l = 0; l < ChannelStride; ++l)
      descriptor[l] += share * static_cast<float>(field.descriptors[ChannelStride * at + l]);
  }
  weight = descriptor[Channels];
}

void Place(const Map& toCentre, float scale2, const BlockOfPoints& b, Terms& t)
{
  PlaceBlock(toCentre, scale2, b.x, b.y, b.z, b.count, t);
}

void Turn(const Map& worldGradient, Terms& t)
{
  const Map m = worldGradient;
  for (int p = 0; p < BlockSize; ++p) {
    const float x = t.x[p], y = t.y[p], z = t.z[p];
    const float i = t.jacobian[0][p], j = t.jacobian[1][p], k = t.jacobian[2][p];
    const float gx = m.xx * i + m.xy * j + m.xz * k;
    const float gy = m.yx * i + m.yy * j + m.yz * k;
    const float gz = m.zx * i + m.zy * j + m.zz * k;
    t.jacobian[0][p] = gx;
    t.jacobian[1][p] = gy;
    t.jacobian[2][p] = gz;
    t.jacobian[3][p] = y * gz - z * gy;
    t.jacobian[4][p] = z * gx - x * gz;
    t.jacobian[5][p] = x * gy - y * gx;
  }
}

void ExplainPatches(const BlockOfPoints& points, float floor, bool isWithSlopes, Terms& t)
{
  for (int from = 0; from + PatchSize <= points.count; from += PatchSize) {
    float* r = t.r + from;
    float* w = t.w + from;
    const float *a = points.value + from, *g = points.second + from;
    float wa[PatchSize], wg[PatchSize], wr[PatchSize];
    for (int p = 0; p < PatchSize; ++p) {
      wa[p] = w[p] * a[p];
      wg[p] = w[p] * g[p];
      wr[p] = w[p] * r[p];
    }
    const double all = Sum(w, PatchSize);
    const double b = Sum(wr, PatchSize), bb = Dot(wr, r, PatchSize);
    double variance = 0.0, scale = 0.0, mean = 0.0, ca = 0.0, cg = 0.0, c1 = 0.0;
    Eigen::Matrix3d inverse = Eigen::Matrix3d::Zero();
    if (all > 1e-3) {
      mean = b / all;
      variance = std::max(bb / all - mean * mean, 0.0);
      const double sa = Sum(wa, PatchSize), sg = Sum(wg, PatchSize), aa = Dot(wa, a, PatchSize), ag = Dot(wa, g, PatchSize),
                   gg = Dot(wg, g, PatchSize);
      Eigen::Matrix3d normal;
      normal << aa, ag, sa, ag, gg, sg, sa, sg, all;
      normal.diagonal() += Eigen::Vector3d(1e-4 * aa + 1e-4 * all, 1e-4 * gg + 1e-4 * all, 1e-6 * all);
      inverse = normal.inverse();
      const Eigen::Vector3d c = inverse * Eigen::Vector3d(Dot(wa, r, PatchSize), Dot(wg, r, PatchSize), b);
      ca = c[0];
      cg = c[1];
      c1 = c[2];
      scale = 1.0 / std::sqrt(variance + static_cast<double>(floor));
    }
    const float s = static_cast<float>(scale), fa = static_cast<float>(ca), fg = static_cast<float>(cg),
                f1 = static_cast<float>(c1),
                texture = static_cast<float>(all > 1e-3 ? variance / (variance + static_cast<double>(floor)) : 0.0);
    if (isWithSlopes)
      for (int d = 0; d < 6; ++d) {
        float* jacobian = t.jacobian[d] + from;
        const Eigen::Vector3d c =
            inverse * Eigen::Vector3d(Dot(wa, jacobian, PatchSize), Dot(wg, jacobian, PatchSize), Dot(w, jacobian, PatchSize));
        const float da = static_cast<float>(c[0]), dg = static_cast<float>(c[1]), d1 = static_cast<float>(c[2]);
        for (int p = 0; p < PatchSize; ++p)
          jacobian[p] = s * (jacobian[p] - (da * a[p] + dg * g[p] + d1));
      }
    for (int p = 0; p < PatchSize; ++p) {
      r[p] = s * (r[p] - (fa * a[p] + fg * g[p] + f1));
      t.r2[from + p] = r[p] * r[p];
      w[p] *= texture;
      t.curved[from + p] = w[p];
    }
  }
}

void SumLoss(const Terms& t, float scale2, RawSums& sums)
{
  float lanes[Lanes] = {};
  for (int p = 0; p < BlockSize; p += Lanes)
    for (int lane = 0; lane < Lanes; ++lane) {
      const float r2 = t.r2[p + lane];
      lanes[lane] += t.w[p + lane] * (2.0f * r2 / (1.0f + std::sqrt(1.0f + r2 / scale2)));
    }
  sums.loss += Fold(lanes);
  sums.weight += Sum(t.w);
  sums.covered += Sum(t.covered);
  sums.moment[0] += Dot(t.w, t.x);
  sums.moment[1] += Dot(t.w, t.y);
  sums.moment[2] += Dot(t.w, t.z);
}

void SumSlopes(Terms& t, RawSums& sums)
{
  for (int d = 0; d < 6; ++d)
    for (int p = 0; p < BlockSize; ++p)
      t.curvedJ[d][p] = t.curved[p] * t.jacobian[d][p];
  int k = 0;
  for (int i = 0; i < 6; ++i) {
    sums.gradient[i] += Dot(t.r, t.curvedJ[i]);
    for (int j = 0; j <= i; ++j)
      sums.hessian[k++] += Dot(t.jacobian[j], t.curvedJ[i]);
  }
}

void SumFit(const Terms& t, const float* theirs, RawSums& sums)
{
  float weighted[BlockSize];
  for (int p = 0; p < BlockSize; ++p)
    weighted[p] = t.curved[p] * theirs[p];
  for (int i = 0; i < 6; ++i) {
    sums.slopes[i] += Sum(t.curvedJ[i]);
    sums.theirSlopes[i] += Dot(weighted, t.jacobian[i]);
  }
  sums.residualTheirs += Dot(weighted, t.r);
}

void SumValues(const Terms& t, const float* ours, RawSums& sums)
{
  float theirs[BlockSize], own[BlockSize];
  for (int p = 0; p < BlockSize; ++p) {
    theirs[p] = t.w[p] * t.r[p];
    own[p] = t.w[p] * ours[p];
  }
  sums.weight += Sum(t.w);
  sums.values[0] += Sum(theirs);
  sums.values[1] += Sum(own);
  sums.values[2] += Dot(theirs, t.r);
  sums.values[3] += Dot(own, ours);
  sums.values[4] += Dot(theirs, ours);
}

} // namespace echorama
