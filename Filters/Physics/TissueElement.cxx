// SPDX-License-Identifier: BSD-3-Clause
// Stable neo-Hookean tissue (Smith, de Goes and Kim 2018) on trilinear cells with eight integration points:
//   W = m/2 (|F|^2 - 3) - m/2 log((|F|^2 + 1) / 4) + l/2 (J - 1)^2 - 3/4 m (J - 1),   m = 4/3 mu,  l + l' = lambda + 5/6 mu
// with the changes of volume paid for twice: l = min(m, ...) at every integration point, which keeps each of them from
// collapsing, and the rest, l'/2 (mean J - 1)^2, by the volume of the cell as a whole. Charging everything to the points would
// lock: trilinear cells cannot bend and keep the volume of all eight points. That law lets a cell vanish for a finite force, and
// one of soft fat between stiff skin and a head would; a point that has lost half of its volume therefore resists more and more:
//   W += 100/3 m (1/2 - J)^3
// Nothing is singular, not even in cells that are turned inside out, so that any guess may be a start.
//
// Eight cells of a row are computed at once, a lane each. Rows of cells write to the nodes on both of their sides: layers are
// therefore done in two turns, even ones and odd ones, and within a layer in order.
#include "TissueElement.h"
#include "Core/Base/Parallel.h"
#include <algorithm>
#include <cmath>
#include <Eigen/Geometry>

namespace echorama {
namespace {

constexpr int Lanes = LatticeShape::Lanes;
constexpr double CollapseStarts = 0.5, CollapseStiffness = 100.0; // J, and in m

using FloatPack [[gnu::vector_size(Lanes * sizeof(float))]] = float;
using DoublePack [[gnu::vector_size(Lanes * sizeof(double))]] = double;

// The derivatives of the eight shape functions at the eight integration points, and their cross products.
struct Shapes {
  double gradient[8][8][3];
  double cross[8][8][8][3];
  double weight; // of a point, mm^3

  explicit Shapes(const Eigen::Vector3d& spacing) : weight(spacing.prod() / 8.0)
  {
    const double place[2] = {0.5 - std::sqrt(1.0 / 12.0), 0.5 + std::sqrt(1.0 / 12.0)};
    for (int g = 0; g < 8; ++g)
      for (int a = 0; a < 8; ++a) {
        double value[3], slope[3];
        for (int axis = 0; axis < 3; ++axis) {
          const double at = place[g >> axis & 1];
          value[axis] = a >> axis & 1 ? at : 1.0 - at;
          slope[axis] = (a >> axis & 1 ? 1.0 : -1.0) / spacing[axis];
        }
        gradient[g][a][0] = slope[0] * value[1] * value[2];
        gradient[g][a][1] = value[0] * slope[1] * value[2];
        gradient[g][a][2] = value[0] * value[1] * slope[2];
      }
    for (int g = 0; g < 8; ++g)
      for (int a = 0; a < 8; ++a)
        for (int b = 0; b < 8; ++b) {
          const Eigen::Vector3d product =
              Eigen::Map<const Eigen::Vector3d>(gradient[g][a]).cross(Eigen::Map<const Eigen::Vector3d>(gradient[g][b]));
          for (int c = 0; c < 3; ++c)
            cross[g][a][b][c] = product[c];
        }
  }
};

// Eight cells of a row.
struct CellRow {
  const double* displacement[3]; // of the node (i, j, k)
  double* force[3];
  std::ptrdiff_t corner[8]; // how far the corners lie from there
  const float *shear, *bulk;
  const Shapes* shapes;
};

template <class Pack>
struct Moduli {
  Pack m, local, shared;
};

template <class Pack, class Scalar>
[[gnu::always_inline]] inline Moduli<Pack> ModuliOf(const CellRow& row)
{
  Moduli<Pack> moduli;
  for (int l = 0; l < Lanes; ++l) {
    const Scalar m = Scalar(4.0 / 3.0) * Scalar(row.shear[l]),
                 all = Scalar(row.bulk[l]) + Scalar(5.0 / 6.0) * Scalar(row.shear[l]);
    moduli.m[l] = m;
    moduli.local[l] = all < m ? all : m;
    moduli.shared[l] = all - moduli.local[l];
  }
  return moduli;
}

// F - 1 at the integration points.
template <class Pack, class Scalar>
[[gnu::always_inline]] inline void Gradients(const CellRow& row, Pack (&h)[8][9])
{
  Pack u[8][3];
  for (int a = 0; a < 8; ++a)
    for (int c = 0; c < 3; ++c) {
      DoublePack value;
      std::memcpy(&value, row.displacement[c] + row.corner[a], sizeof(value));
      for (int l = 0; l < Lanes; ++l)
        u[a][c][l] = static_cast<Scalar>(value[l]);
    }
  for (int g = 0; g < 8; ++g)
    for (int c = 0; c < 3; ++c)
      for (int d = 0; d < 3; ++d) {
        Pack sum = u[0][c] * static_cast<Scalar>(row.shapes->gradient[g][0][d]);
        for (int a = 1; a < 8; ++a)
          sum += u[a][c] * static_cast<Scalar>(row.shapes->gradient[g][a][d]);
        h[g][3 * c + d] = sum;
      }
}

// J - 1, without the digits that 1 would take.
template <class Pack>
[[gnu::always_inline]] inline Pack Swelling(const Pack (&h)[9])
{
  return h[0] + h[4] + h[8] + (h[0] * h[4] - h[1] * h[3]) + (h[0] * h[8] - h[2] * h[6]) + (h[4] * h[8] - h[5] * h[7]) +
         h[0] * (h[4] * h[8] - h[5] * h[7]) - h[1] * (h[3] * h[8] - h[5] * h[6]) + h[2] * (h[3] * h[7] - h[4] * h[6]);
}

// How far J lies below where collapse starts, or 0.
template <class Pack>
[[gnu::always_inline]] inline Pack Collapse(const Pack& swelling)
{
  Pack collapse = static_cast<std::decay_t<decltype(Pack{}[0])>>(CollapseStarts - 1.0) - swelling;
  for (int l = 0; l < Lanes; ++l)
    collapse[l] = collapse[l] > 0 ? collapse[l] : 0;
  return collapse;
}

template <class Pack>
[[gnu::always_inline]] inline void Cofactor(const Pack (&f)[9], Pack (&c)[9])
{
  c[0] = f[4] * f[8] - f[5] * f[7];
  c[1] = f[5] * f[6] - f[3] * f[8];
  c[2] = f[3] * f[7] - f[4] * f[6];
  c[3] = f[2] * f[7] - f[1] * f[8];
  c[4] = f[0] * f[8] - f[2] * f[6];
  c[5] = f[1] * f[6] - f[0] * f[7];
  c[6] = f[1] * f[5] - f[2] * f[4];
  c[7] = f[2] * f[3] - f[0] * f[5];
  c[8] = f[0] * f[4] - f[1] * f[3];
}

// Adds the forces, unless there is no place for them, and returns the energy of each cell.
void CellForces(const CellRow& row, double* energies)
{
  const Moduli<DoublePack> moduli = ModuliOf<DoublePack, double>(row);
  DoublePack h[8][9], swelling[8], mean = {}, energy = {};
  Gradients<DoublePack, double>(row, h);
  for (int g = 0; g < 8; ++g) {
    swelling[g] = Swelling(h[g]);
    mean += swelling[g] * 0.125;
  }
  DoublePack force[8][3] = {};
  for (int g = 0; g < 8; ++g) {
    DoublePack f[9], cofactor[9], square = {};
    for (int n = 0; n < 9; ++n) {
      f[n] = h[g][n];
      square += h[g][n] * h[g][n];
    }
    const DoublePack stretch = 2.0 * (h[g][0] + h[g][4] + h[g][8]) + square; // |F|^2 - 3
    DoublePack logarithm;
    for (int l = 0; l < Lanes; ++l)
      logarithm[l] = std::log1p(0.25 * stretch[l]);
    const DoublePack collapse = Collapse(swelling[g]);
    energy += 0.5 * moduli.m * (stretch - logarithm) + swelling[g] * (0.5 * moduli.local * swelling[g] - 0.75 * moduli.m) +
              CollapseStiffness / 3.0 * moduli.m * collapse * collapse * collapse;
    if (!row.force[0])
      continue;
    f[0] += 1.0;
    f[4] += 1.0;
    f[8] += 1.0;
    Cofactor(f, cofactor);
    const DoublePack stiff = moduli.m * (1.0 - 1.0 / (stretch + 4.0));
    const DoublePack pressure =
        moduli.local * swelling[g] - 0.75 * moduli.m + moduli.shared * mean - CollapseStiffness * moduli.m * collapse * collapse;
    for (int a = 0; a < 8; ++a) {
      const double* slope = row.shapes->gradient[g][a];
      for (int c = 0; c < 3; ++c)
        for (int d = 0; d < 3; ++d)
          force[a][c] += (stiff * f[3 * c + d] + pressure * cofactor[3 * c + d]) * slope[d];
    }
  }
  energy = (energy + 4.0 * moduli.shared * mean * mean) * row.shapes->weight;
  for (int l = 0; l < Lanes; ++l)
    energies[l] = energy[l];
  if (!row.force[0])
    return;
  for (int a = 0; a < 8; ++a)
    for (int c = 0; c < 3; ++c) {
      double* to = row.force[c] + row.corner[a];
      for (int l = 0; l < Lanes; ++l)
        to[l] += force[a][c][l] * row.shapes->weight;
    }
}

// Adds the stiffness of eight cells to the rows of the matrix at their corners: rows[j + 2 k].
void CellStiffness(const CellRow& row, float* const* rows, int padded, bool tame)
{
  const Moduli<FloatPack> moduli = ModuliOf<FloatPack, float>(row);
  FloatPack h[8][9], swelling[8], mean = {};
  Gradients<FloatPack, float>(row, h);
  for (int g = 0; g < 8; ++g) {
    swelling[g] = Swelling(h[g]);
    mean += swelling[g] * 0.125f;
  }
  // The matrix is a sum of products of vectors with themselves (two for each point, one for the cell), of multiples of
  // the identity, and of antisymmetric blocks from the second derivative of the volume.
  FloatPack vectors[17][8][3], stiff[8], turned[8][9];
  const auto weight = static_cast<float>(row.shapes->weight);
  for (int a = 0; a < 8; ++a)
    for (int c = 0; c < 3; ++c)
      vectors[16][a][c] = FloatPack{};
  for (int g = 0; g < 8; ++g) {
    FloatPack f[9], cofactor[9], size = {};
    for (int n = 0; n < 9; ++n)
      f[n] = h[g][n];
    f[0] += 1.0f;
    f[4] += 1.0f;
    f[8] += 1.0f;
    for (int n = 0; n < 9; ++n)
      size += f[n] * f[n];
    Cofactor(f, cofactor);
    const FloatPack inverse = 1.0f / (size + 1.0f);
    stiff[g] = weight * moduli.m * (1.0f - inverse);
    const FloatPack collapse = Collapse(swelling[g]);
    constexpr auto collapseStiffness = static_cast<float>(CollapseStiffness);
    FloatPack pressure =
        moduli.local * swelling[g] - 0.75f * moduli.m + moduli.shared * mean - collapseStiffness * moduli.m * collapse * collapse;
    for (int l = 0; tame && l < Lanes; ++l)
      pressure[l] = std::min(std::max(pressure[l], -0.75f * moduli.m[l]), 0.25f * moduli.m[l]);
    pressure *= weight;
    FloatPack stretching, bulging;
    for (int l = 0; l < Lanes; ++l) {
      stretching[l] = std::sqrt(2.0f * weight * moduli.m[l]) * inverse[l];
      bulging[l] = std::sqrt(weight * (moduli.local[l] + 2.0f * collapseStiffness * moduli.m[l] * collapse[l]));
    }
    for (int n = 0; n < 9; ++n)
      turned[g][n] = pressure * f[n];
    for (int a = 0; a < 8; ++a)
      for (int c = 0; c < 3; ++c) {
        FloatPack along = {}, across = {};
        for (int d = 0; d < 3; ++d) {
          const auto slope = static_cast<float>(row.shapes->gradient[g][a][d]);
          along += f[3 * c + d] * slope;
          across += cofactor[3 * c + d] * slope;
        }
        vectors[2 * g][a][c] = along * stretching;
        vectors[2 * g + 1][a][c] = across * bulging;
        vectors[16][a][c] += across;
      }
  }
  FloatPack whole;
  for (int l = 0; l < Lanes; ++l)
    whole[l] = std::sqrt(0.125f * weight * moduli.shared[l]);
  for (int a = 0; a < 8; ++a)
    for (int c = 0; c < 3; ++c)
      vectors[16][a][c] *= whole;
  for (int a = 0; a < 8; ++a)
    for (int b = a; b < 8; ++b) {
      FloatPack block[9] = {}, diagonal = {}, turn[3] = {};
      for (int n = 0; n < 17; ++n)
        for (int c = 0; c < 3; ++c)
          for (int d = 0; d < 3; ++d)
            block[3 * c + d] += vectors[n][a][c] * vectors[n][b][d];
      for (int g = 0; g < 8; ++g) {
        const double *x = row.shapes->gradient[g][a], *y = row.shapes->gradient[g][b], *z = row.shapes->cross[g][a][b];
        diagonal += stiff[g] * static_cast<float>(x[0] * y[0] + x[1] * y[1] + x[2] * y[2]);
        for (int c = 0; a != b && c < 3; ++c)
          turn[c] += turned[g][3 * c] * static_cast<float>(z[0]) + turned[g][3 * c + 1] * static_cast<float>(z[1]) +
                     turned[g][3 * c + 2] * static_cast<float>(z[2]);
      }
      for (int c = 0; c < 3; ++c)
        block[4 * c] += diagonal;
      block[1] += turn[2];
      block[3] -= turn[2];
      block[5] += turn[0];
      block[7] -= turn[0];
      block[6] += turn[1];
      block[2] -= turn[1];
      // The block of the corner that comes first; of its own, all of it.
      const int dx = (b & 1) - (a & 1), dy = (b >> 1 & 1) - (a >> 1 & 1), dz = (b >> 2 & 1) - (a >> 2 & 1);
      float* to = rows[a >> 1] + (a & 1) +
                  static_cast<std::ptrdiff_t>((LatticeMatrix::Offset(dx, dy, dz) - LatticeMatrix::Own) * 9) * padded;
      for (int entry = 0; entry < 9; ++entry, to += padded)
        for (int l = 0; l < Lanes; ++l)
          to[l] += block[entry][l];
    }
}

// J - 1 at the integration points.
void CellSwellings(const CellRow& row, double (*swellings)[Lanes])
{
  DoublePack h[8][9];
  Gradients<DoublePack, double>(row, h);
  for (int g = 0; g < 8; ++g) {
    const DoublePack swelling = Swelling(h[g]);
    std::memcpy(swellings[g], &swelling, sizeof(swelling));
  }
}

bool AnyTissue(const float* shear)
{
  return std::any_of(shear, shear + Lanes, [](float value) { return value > 0.0f; });
}

// Calls body(row of eight cells, i, j, k) for all cells that are there: layers of one parity beside each other, then the others.
template <class Body>
void ForCells(const TissueCells& cells, const Shapes& shapes, const LatticeField<double>& displacement,
              LatticeField<double>* force, const Body& body)
{
  const LatticeShape& shape = displacement.Shape();
  for (int parity = 0; parity < 2; ++parity)
    ParallelFor((cells.cells[2] + 1 - parity) / 2, [&](std::ptrdiff_t layer) {
      const int k = 2 * static_cast<int>(layer) + parity;
      CellRow row;
      row.shapes = &shapes;
      for (int a = 0; a < 8; ++a)
        row.corner[a] = (a >> 2) * shape.slice + (a >> 1 & 1) * shape.row + (a & 1);
      for (int j = 0; j < cells.cells[1]; ++j)
        for (int i = 0; i < cells.cells[0]; i += Lanes) {
          row.shear = cells.shear.data() + cells.At(i, j, k);
          row.bulk = cells.bulk.data() + cells.At(i, j, k);
          if (!AnyTissue(row.shear))
            continue;
          for (int c = 0; c < 3; ++c) {
            row.displacement[c] = displacement.Component(c) + shape.At(i, j, k);
            row.force[c] = force ? force->Component(c) + shape.At(i, j, k) : nullptr;
          }
          body(row, i, j, k);
        }
    });
}

double Evaluate(const TissueCells& cells, const Eigen::Vector3d& spacing, const LatticeField<double>& displacement,
                LatticeField<double>* force)
{
  const Shapes shapes(spacing);
  std::vector<double> layers(static_cast<std::size_t>(cells.cells[2]), 0.0);
  ForCells(cells, shapes, displacement, force, [&](const CellRow& row, int, int, int k) {
    double energies[Lanes];
    CellForces(row, energies);
    for (const double energy : energies)
      layers[static_cast<std::size_t>(k)] += energy;
  });
  double sum = 0.0;
  for (const double layer : layers)
    sum += layer;
  return sum;
}

} // namespace

TissueCells::TissueCells(const std::array<int, 3>& nodes)
  : cells{nodes[0] - 1, nodes[1] - 1, nodes[2] - 1}, row((nodes[0] - 1 + Lanes - 1) / Lanes * Lanes)
{
  const auto count = static_cast<std::size_t>(row * cells[1] * cells[2]);
  shear.assign(count, 0.0f);
  bulk.assign(count, 0.0f);
  density.assign(count, 0.0f);
}

double TissueEnergy(const TissueCells& cells, const Eigen::Vector3d& spacing, const LatticeField<double>& displacement)
{
  return Evaluate(cells, spacing, displacement, nullptr);
}

double TissueForce(const TissueCells& cells, const Eigen::Vector3d& spacing, const LatticeField<double>& displacement,
                   LatticeField<double>& force)
{
  force.Fill(0.0);
  return Evaluate(cells, spacing, displacement, &force);
}

void TissueStiffness(const TissueCells& cells, const Eigen::Vector3d& spacing, const LatticeField<double>& displacement,
                     LatticeMatrix& matrix, bool tame)
{
  const Shapes shapes(spacing);
  matrix.Clear();
  ForCells(cells, shapes, displacement, nullptr, [&](const CellRow& row, int i, int j, int k) {
    float* const rows[4] = {matrix.Row(j, k) + i, matrix.Row(j + 1, k) + i, matrix.Row(j, k + 1) + i,
                            matrix.Row(j + 1, k + 1) + i};
    CellStiffness(row, rows, matrix.Shape().Padded(), tame);
  });
}

double LeastTissueVolume(const TissueCells& cells, const Eigen::Vector3d& spacing, const LatticeField<double>& displacement)
{
  const Shapes shapes(spacing);
  std::vector<double> layers(static_cast<std::size_t>(cells.cells[2]), 1.0);
  ForCells(cells, shapes, displacement, nullptr, [&](const CellRow& row, int, int, int k) {
    double swellings[8][Lanes];
    CellSwellings(row, swellings);
    double& least = layers[static_cast<std::size_t>(k)];
    for (const auto& swelling : swellings)
      for (int l = 0; l < Lanes; ++l)
        if (row.shear[l] > 0.0f)
          least = std::min(least, 1.0 + swelling[l]);
  });
  return layers.empty() ? 1.0 : *std::min_element(layers.begin(), layers.end());
}

double TissueVolumeRatio(const TissueCells& cells, const Eigen::Vector3d& spacing, const LatticeField<double>& displacement)
{
  const Shapes shapes(spacing);
  std::vector<double> layers(static_cast<std::size_t>(cells.cells[2]), 0.0), counts = layers;
  ForCells(cells, shapes, displacement, nullptr, [&](const CellRow& row, int, int, int k) {
    double swellings[8][Lanes];
    CellSwellings(row, swellings);
    for (const auto& swelling : swellings)
      for (int l = 0; l < Lanes; ++l)
        if (row.shear[l] > 0.0f) {
          layers[static_cast<std::size_t>(k)] += swelling[l];
          counts[static_cast<std::size_t>(k)] += 1.0;
        }
  });
  double sum = 0.0, count = 0.0;
  for (std::size_t k = 0; k < layers.size(); ++k) {
    sum += layers[k];
    count += counts[k];
  }
  return count > 0.0 ? 1.0 + sum / count : 1.0;
}

} // namespace echorama
