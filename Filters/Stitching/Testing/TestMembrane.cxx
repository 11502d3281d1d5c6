// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Parallel.h"
#include "Core/Base/Random.h"
#include "Filters/Stitching/Membrane.h"
#include "Filters/Stitching/MembraneLevels.h"
#include "Testing/Sanitized.h"
#include <cmath>
#include <gtest/gtest.h>

using namespace echorama;

namespace {

constexpr auto Void = static_cast<unsigned char>(MembraneVoxel::Void);
constexpr auto Unknown = static_cast<unsigned char>(MembraneVoxel::Unknown);
constexpr auto Known = static_cast<unsigned char>(MembraneVoxel::Known);

// A box of voxels, and the spans of those that are not void.
struct Scene {
  std::array<int, 3> size;
  std::vector<unsigned char> kind;
  std::vector<float> value;
  Eigen::Vector3d spacing = Eigen::Vector3d::Ones();

  explicit Scene(std::array<int, 3> extent)
    : size(extent), kind(static_cast<std::size_t>(extent[0]) * extent[1] * extent[2], Void), value(kind.size(), 0.0f)
  {
  }
  std::size_t At(int i, int j, int k) const { return (static_cast<std::size_t>(k) * size[1] + j) * size[0] + i; }
  template <class Body>
  void ForAll(const Body& body) const
  {
    for (int k = 0; k < size[2]; ++k)
      for (int j = 0; j < size[1]; ++j)
        for (int i = 0; i < size[0]; ++i)
          body(i, j, k, At(i, j, k));
  }
  double Weight(int axis) const { return std::pow(spacing.minCoeff() / spacing[axis], 2); }

  MembraneReport Solve(const MembraneParameters& parameters = {}, float isolated = 0.5f, const Progress& progress = {})
  {
    const std::array<int, 3> origin{3, -2, 5}; // grids have boxes anywhere
    std::vector<int> first, end;
    for (int k = 0; k < size[2]; ++k)
      for (int j = 0; j < size[1]; ++j) {
        int low = 0, high = 0;
        for (int i = 0; i < size[0]; ++i)
          if (kind[At(i, j, k)] != Void) {
            low = low < high ? low : i;
            high = i + 1;
          }
        first.push_back(origin[0] + low);
        end.push_back(origin[0] + high);
      }
    const auto spans = std::make_shared<const RowSpans>(GridBox{origin, size}, std::move(first), std::move(end));
    RowField<unsigned char> kinds(spans);
    RowField<float> values(spans);
    const auto copy = [&](bool back) {
      for (int k = 0; k < size[2]; ++k)
        for (int j = 0; j < size[1]; ++j) {
          const int y = j + origin[1], z = k + origin[2];
          for (int i = spans->First(y, z); i < spans->End(y, z); ++i) {
            const std::size_t at = At(i - origin[0], j, k);
            const int n = i - spans->First(y, z);
            if (back) {
              value[at] = values.Row(y, z)[n];
            } else {
              kinds.Row(y, z)[n] = kind[at];
              values.Row(y, z)[n] = value[at];
            }
          }
        }
    };
    copy(false);
    const MembraneReport report = SolveMembrane(kinds, spacing, values, isolated, parameters, progress);
    copy(true);
    return report;
  }

  // Gauss-Seidel with over-relaxation in doubles, until nothing moves.
  std::vector<double> Reference() const
  {
    std::vector<double> u(value.begin(), value.end());
    struct Equation {
      std::size_t at;
      std::vector<std::pair<std::size_t, double>> others;
      double sum = 0.0;
    };
    std::vector<Equation> equations;
    ForAll([&](int i, int j, int k, std::size_t at) {
      if (kind[at] != Unknown)
        return;
      Equation equation{at, {}};
      const int here[3] = {i, j, k};
      for (int axis = 0; axis < 3; ++axis)
        for (int step = -1; step <= 1; step += 2) {
          int there[3] = {i, j, k};
          there[axis] = here[axis] + step;
          if (there[axis] < 0 || there[axis] >= size[axis] || kind[At(there[0], there[1], there[2])] == Void)
            continue;
          equation.others.emplace_back(At(there[0], there[1], there[2]), Weight(axis));
          equation.sum += Weight(axis);
        }
      u[at] = 0.0;
      if (equation.sum > 0.0)
        equations.push_back(equation);
    });
    for (int sweep = 0; sweep < 20000; ++sweep) {
      double moved = 0.0;
      for (const Equation& equation : equations) {
        double sum = 0.0;
        for (const auto& [other, weight] : equation.others)
          sum += weight * u[other];
        const double step = 1.7 * (sum / equation.sum - u[equation.at]);
        u[equation.at] += step;
        moved = std::max(moved, std::abs(step));
      }
      if (moved < 1e-13)
        break;
    }
    return u;
  }

  double Error(const std::vector<double>& reference) const
  {
    double error = 0.0;
    for (std::size_t at = 0; at < kind.size(); ++at)
      if (kind[at] == Unknown) {
        EXPECT_TRUE(std::isfinite(value[at]));
        error = std::max(error, std::abs(static_cast<double>(value[at]) - reference[at]));
      }
    return error;
  }
};

// Blobs of void, unknown, and known of two values, with holes in them.
Scene Blobs(std::array<int, 3> size, std::uint64_t seed)
{
  Random random(11, seed);
  Scene scene(size);
  struct Wave {
    Eigen::Vector3d along;
    double phase;
  };
  std::vector<Wave> waves;
  for (int n = 0; n < 8; ++n)
    waves.push_back({random.Uniform(0.15, 0.9) * random.Direction(), random.Uniform(0.0, 6.28)});
  const double holes = seed % 3 == 0 ? 0.15 : 0.0, voids = random.Uniform(-0.8, 0.2), width = random.Uniform(0.3, 1.5);
  const float low = seed % 2 ? 0.0f : -3.0f, high = seed % 2 ? 1.0f : 7.0f;
  scene.ForAll([&](int i, int j, int k, std::size_t at) {
    const auto wave = [&](int n) {
      return std::sin(waves[static_cast<std::size_t>(n)].along.dot(Eigen::Vector3d(i, j, k)) +
                      waves[static_cast<std::size_t>(n)].phase);
    };
    const double a = wave(0) + wave(1) + 0.4 * wave(2), b = wave(4) + wave(5) + 0.5 * wave(6);
    if (b < voids || random.Uniform() < holes)
      return;
    scene.kind[at] = std::abs(a) < width ? Unknown : Known;
    scene.value[at] = scene.kind[at] == Unknown ? NAN : a > 0.0 ? high : low;
  });
  return scene;
}

// Two fan-shaped views that overlap.
Scene Fans(int size, bool flat = false)
{
  Scene scene({size, size, flat ? 1 : size});
  const auto sees = [size](double x, double y, double z, double turn, double shift) {
    const double half = 0.5 * size, a = std::cos(turn) * (x - half - shift) + std::sin(turn) * (z - half) + 0.1 * (y - half);
    const double c = std::cos(turn) * (z - half) - std::sin(turn) * (x - half - shift) + 0.75 * size,
                 r = std::hypot(a, c, y - half);
    return r < 1.2 * size && r > 0.3 * size && std::abs(a) < 0.55 * c && std::abs(y - half) < 0.45 * c;
  };
  scene.ForAll([&](int i, int j, int k, std::size_t at) {
    const double y = flat ? 0.5 * size : j, z = flat ? j : k;
    const bool a = sees(i, y, z, 0.15, -0.1 * size), b = sees(i, y, z, -0.2, 0.1 * size);
    scene.kind[at] = a && b ? Unknown : a || b ? Known : Void;
    scene.value[at] = a && !b ? 1.0f : 0.0f;
  });
  return scene;
}

MembraneParameters Tolerance(double tolerance)
{
  MembraneParameters parameters;
  parameters.tolerance = tolerance;
  return parameters;
}

} // namespace

// Between two plates the membrane is a straight line, along any axis; nothing flows to the void.
TEST(Membrane, RampBetweenPlates)
{
  for (int axis = 0; axis < 3; ++axis)
    for (const bool flat : {false, true}) {
      Scene scene({7, 7, flat ? 1 : 7});
      if (flat && axis == 2)
        continue;
      const int length = 31;
      scene.size[static_cast<std::size_t>(axis)] = length;
      scene = Scene(scene.size);
      scene.spacing[axis] = 2.5;
      scene.ForAll([&](int i, int j, int k, std::size_t at) {
        const int x = axis == 0 ? i : axis == 1 ? j : k;
        scene.kind[at] = x == 0 || x == length - 1 ? Known : Unknown;
        scene.value[at] = x == 0 ? 10.0f : -20.0f;
      });
      const MembraneReport report = scene.Solve(Tolerance(1e-6));
      EXPECT_TRUE(report.certified);
      double error = 0.0;
      scene.ForAll([&](int i, int j, int k, std::size_t at) {
        const int x = axis == 0 ? i : axis == 1 ? j : k;
        error = std::max(error, std::abs(static_cast<double>(scene.value[at]) - (10.0 - 30.0 * x / (length - 1))));
      });
      EXPECT_LE(error, report.bound);
      EXPECT_LE(report.bound, 30e-6);
    }
}

// Between two circles it is a logarithm, between two spheres one over the radius, up to how round voxels are.
TEST(Membrane, BetweenShells)
{
  for (const bool flat : {true, false}) {
    const int size = flat ? 121 : 61;
    const double half = size / 2, inner = flat ? 20.0 : 12.0, outer = flat ? 56.0 : 28.0;
    Scene scene({size, size, flat ? 1 : size});
    const auto radius = [&](int i, int j, int k) { return std::hypot(i - half, j - half, flat ? 0.0 : k - half); };
    // Exact values on the shells, so that their steps do not matter.
    const auto exact = [&](double r) {
      return flat ? std::log(outer / r) / std::log(outer / inner) : (1.0 / r - 1.0 / outer) / (1.0 / inner - 1.0 / outer);
    };
    scene.ForAll([&](int i, int j, int k, std::size_t at) {
      const double r = radius(i, j, k);
      scene.kind[at] = r > inner && r < outer ? Unknown : r > outer + 2.0 || r < inner - 2.0 ? Void : Known;
      scene.value[at] = r > 0.0 ? static_cast<float>(exact(r)) : 0.0f;
    });
    EXPECT_TRUE(scene.Solve(Tolerance(1e-5)).certified);
    scene.ForAll([&](int i, int j, int k, std::size_t at) {
      if (scene.kind[at] == Unknown) {
        EXPECT_NEAR(static_cast<double>(scene.value[at]), exact(radius(i, j, k)), 1e-3);
      }
    });
  }
}

// Necks, islands, holes, thin walls; against a solver that knows nothing of rows, levels and floats.
TEST(Membrane, BoundHoldsOnAnyShape)
{
  const std::array<int, 3> sizes[] = {{13, 11, 12}, {16, 16, 16}, {31, 23, 1}, {1, 17, 19}, {23, 1, 16}, {40, 3, 5}, {7, 29, 2}};
  int solved = 0;
  const int rounds = IsSanitized() ? 1 : 9;
  for (int round = 0; round < rounds; ++round)
    for (std::size_t n = 0; n < std::size(sizes); ++n) {
      const std::uint64_t seed = static_cast<std::uint64_t>(round) * 16 + n;
      Scene scene = Blobs(sizes[n], seed);
      if (round % 3 == 1)
        scene.spacing = {1.0, 1.0, 5.0};
      if (round % 3 == 2)
        scene.spacing = {0.7, 0.2, 0.3};
      SCOPED_TRACE(seed);
      Scene tight = scene, few = scene;
      const std::vector<double> reference = [&] {
        // Components without known voxels are not part of the equations: their answer is given.
        Scene copy = scene;
        for (float& value : copy.value)
          value = std::isnan(value) ? 0.0f : value;
        return copy.Reference();
      }();
      const float isolated = 0.0f; // what the reference's first guess leaves there
      const MembraneReport report = scene.Solve({}, isolated), tightReport = tight.Solve(Tolerance(1e-5), isolated);
      MembraneParameters none;
      none.maximumCycles = 0;
      const MembraneReport fewReport = few.Solve(none, isolated);
      EXPECT_TRUE(report.certified);
      EXPECT_TRUE(tightReport.certified);
      EXPECT_LE(scene.Error(reference), report.bound + 1e-10);
      EXPECT_LE(tight.Error(reference), tightReport.bound + 1e-10);
      EXPECT_LE(few.Error(reference), fewReport.bound + 1e-10);
      EXPECT_LE(report.bound, 10.0 / 512);
      EXPECT_LE(tightReport.bound, 10e-5);
      EXPECT_EQ(fewReport.cycles, 0);
      EXPECT_LT(fewReport.bound, 1e6);
      solved += tightReport.cycles > 0;
    }
  EXPECT_GE(solved, rounds * 2); // the others are small enough to be solved directly
}

// Strips so long that heat takes 245,000 and 4.5 million steps to leave them: floats still bound the error of the one, and no
// longer that of the other.
TEST(Membrane, BoundHoldsInLongStrips)
{
  for (const int length : {1400, 6000}) {
    Scene scene({length, 5, 1});
    scene.ForAll([&](int i, int, int, std::size_t at) {
      scene.kind[at] = i == 0 || i == length - 1 ? Known : Unknown;
      scene.value[at] = i == 0 ? 0.0f : 1.0f;
    });
    const MembraneReport report = scene.Solve();
    EXPECT_TRUE(report.certified);
    scene.ForAll([&](int i, int, int, std::size_t at) {
      EXPECT_NEAR(static_cast<double>(scene.value[at]), i / (length - 1.0), report.bound);
    });
  }
}

// Whatever residuals are, A w is nowhere less than was said, and w not much larger than it must be.
TEST(Membrane, WhatBoundsErrorsLacksNothing)
{
  constexpr float Floor = 1e-4f;
  constexpr double Part = 0.4;
  for (std::uint64_t seed = 0; seed < 6; ++seed) {
    SCOPED_TRACE(seed);
    Scene scene = Blobs(seed == 0 ? std::array<int, 3>{6, 5, 5} : std::array<int, 3>{40, 33, seed < 5 ? 29 : 1}, seed + 1);
    scene.spacing = seed % 2 ? Eigen::Vector3d(1.0, 1.0, 1.0) : Eigen::Vector3d(0.4, 1.0, 0.7);
    const auto kindAt = [&](int i, int j, int k) {
      const bool inside = i >= 0 && i < scene.size[0] && j >= 0 && j < scene.size[1] && k >= 0 && k < scene.size[2];
      return inside ? scene.kind[scene.At(i, j, k)] : Void;
    };
    const auto near = [](int i, int j, int k, int n) {
      std::array<int, 3> at{i, j, k};
      at[static_cast<std::size_t>(n / 2)] += n % 2 ? 1 : -1;
      return at;
    };
    // What touches no known voxel is not part of it.
    Scene reached = scene;
    for (bool grows = true; grows;) {
      grows = false;
      scene.ForAll([&](int i, int j, int k, std::size_t at) {
        for (int n = 0; n < 6 && reached.kind[at] == Unknown; ++n) {
          const auto [x, y, z] = near(i, j, k, n);
          if (kindAt(x, y, z) != Void && (kindAt(x, y, z) == Known || reached.kind[scene.At(x, y, z)] == Known)) {
            reached.kind[at] = Known;
            grows = true;
          }
        }
      });
    }
    scene.ForAll([&](int, int, int, std::size_t at) {
      if (reached.kind[at] == Unknown)
        scene.kind[at] = Void;
    });
    std::vector<std::array<int, 2>> spans(static_cast<std::size_t>(scene.size[1]) * scene.size[2], {0, 0});
    scene.ForAll([&](int i, int j, int k, std::size_t at) {
      auto& span = spans[static_cast<std::size_t>(k) * scene.size[1] + j];
      if (scene.kind[at] == Unknown)
        span = {span[0] < span[1] ? span[0] : i, i + 1};
    });
    const MembraneRows rows({0, 0}, {scene.size[1], scene.size[2]}, spans);
    const auto place = [&rows](int i, int j, int k) { return static_cast<std::size_t>(rows.At(j, k).at + i); };
    Zeroed<unsigned char> codes(static_cast<std::size_t>(rows.count));
    for (int k = -1; k <= scene.size[2]; ++k)
      for (int j = -1; j <= scene.size[1]; ++j)
        for (int i = rows.At(j, k).first; i < rows.At(j, k).last; ++i) {
          int code = kindAt(i, j, k) == Known ? static_cast<int>(MembraneKnown) : 0;
          for (int n = 0; n < 6 && kindAt(i, j, k) == Unknown; ++n) {
            const auto [x, y, z] = near(i, j, k, n);
            code += (kindAt(x, y, z) != Void) << n / 2 * 2;
          }
          codes[place(i, j, k)] = static_cast<unsigned char>(code);
        }
    MembraneLevels levels(rows, codes, scene.spacing, {});
    Random random(5, seed);
    std::vector<double> least(scene.kind.size(), 0.0); // what A w must reach
    scene.ForAll([&](int i, int j, int k, std::size_t at) {
      if (scene.kind[at] != Unknown)
        return;
      const double residual = (random.Uniform() < 0.5 ? -1.0 : 1.0) * std::pow(10.0, random.Uniform(-8.0, 0.0));
      levels.Finest().right[place(i, j, k)] = static_cast<float>(residual);
      least[at] = Part * (std::abs(static_cast<double>(static_cast<float>(residual))) + static_cast<double>(Floor));
    });
    const double about = levels.SpreadCoarsely(Floor), largest = levels.SpreadFinely(Floor, Part);
    EXPECT_LE(largest * Part, 3.0 * about);
    double found = 0.0;
    scene.ForAll([&](int i, int j, int k, std::size_t at) {
      if (scene.kind[at] != Unknown)
        return;
      const auto w = [&](const std::array<int, 3>& p) {
        return static_cast<double>(levels.Finest().value[place(p[0], p[1], p[2])]);
      };
      double sum = 0.0;
      for (int n = 0; n < 6; ++n) {
        const auto other = near(i, j, k, n);
        const int kind = kindAt(other[0], other[1], other[2]);
        if (kind != Void)
          sum += scene.Weight(n / 2) * (w({i, j, k}) - (kind == Unknown ? w(other) : 0.0));
      }
      found = std::max(found, w({i, j, k}));
      EXPECT_GE(sum, least[at] * (1.0 - 1e-9)) << i << " " << j << " " << k;
    });
    EXPECT_GE(largest * Part, found * (1.0 - 1e-12));
  }
}

TEST(Membrane, ComponentsThatTouchOneValueOrNone)
{
  Scene scene({40, 9, 3});
  scene.ForAll([&](int i, int j, int, std::size_t at) {
    if (j != 0 && j != 8 && i % 10 != 0)
      scene.kind[at] = Unknown;
    else if (j == 0 && i > 10 && i < 20) // second
      scene.kind[at] = Known, scene.value[at] = 0.1f;
    else if (j == 8 && i > 20 && i < 30) // third
      scene.kind[at] = Known, scene.value[at] = -7.3f;
    else if ((j == 0 || j == 8) && i > 30) // fourth
      scene.kind[at] = Known, scene.value[at] = j == 0 ? 0.0f : 1.0f;
  });
  const MembraneReport report = scene.Solve({}, 0.3f);
  EXPECT_EQ(report.unknowns, 36 * 7 * 3);
  scene.ForAll([&](int i, int j, int k, std::size_t at) {
    if (scene.kind[at] != Unknown)
      return;
    if (i < 30) {
      EXPECT_EQ(scene.value[at], i < 10 ? 0.3f : i < 20 ? 0.1f : -7.3f);
    } else {
      EXPECT_NEAR(scene.value[at], j / 8.0, 1.0 / 512) << i << " " << k;
    }
  });
}

// Two halves that a wall of void, one voxel thick, keeps apart: coarse cells join what does not belong together.
TEST(Membrane, ThinWallOfVoid)
{
  for (const bool open : {false, true}) {
    Scene scene({33, 32, 8});
    scene.ForAll([&](int i, int j, int k, std::size_t at) {
      scene.kind[at] = i == 0 || i == 32 ? Known : i == 15 && !(open && j == 3 && k == 2) ? Void : Unknown;
      scene.value[at] = i == 32 ? 1.0f : 0.0f;
    });
    const MembraneReport report = scene.Solve(Tolerance(1e-6));
    EXPECT_TRUE(report.certified);
    if (open)
      EXPECT_LE(scene.Error(scene.Reference()), report.bound + 1e-10);
    else
      scene.ForAll([&](int i, int, int, std::size_t at) {
        if (scene.kind[at] == Unknown) {
          EXPECT_EQ(scene.value[at], i < 15 ? 0.0f : 1.0f);
        }
      });
  }
}

TEST(Membrane, NothingToSolve)
{
  Scene scene({4, 4, 4});
  EXPECT_EQ(scene.Solve().unknowns, 0);
  std::fill(scene.kind.begin(), scene.kind.end(), Known);
  EXPECT_TRUE(scene.Solve().certified);
  scene.kind[scene.At(1, 1, 1)] = Unknown;
  scene.value[scene.At(0, 1, 1)] = 6.0f;
  scene.value[scene.At(3, 3, 3)] = NAN; // nobody looks there
  EXPECT_TRUE(scene.Solve().certified);
  EXPECT_NEAR(scene.value[scene.At(1, 1, 1)], 1.0f, 6.0f / 512);
  RowField<unsigned char> noKinds;
  RowField<float> noValues;
  EXPECT_TRUE(SolveMembrane(noKinds, Eigen::Vector3d::Ones(), noValues, 0.0f).certified);
}

TEST(Membrane, SameOnAnyNumberOfThreads)
{
  ECHORAMA_SKIP_SANITIZED();
  Scene one = Fans(72), many = one;
  {
    const ThreadLimit limit(1);
    one.Solve();
  }
  many.Solve();
  EXPECT_EQ(one.value, many.value);
  for (std::size_t at = 0; at < one.kind.size(); ++at)
    EXPECT_TRUE(one.value[at] >= 0.0f && one.value[at] <= 1.0f);
}

TEST(Membrane, CyclesDoNotGrowWithSize)
{
  ECHORAMA_SKIP_SANITIZED();
  for (const bool flat : {false, true}) {
    const int small = Fans(flat ? 80 : 30, flat).Solve().cycles, large = Fans(flat ? 640 : 120, flat).Solve().cycles;
    EXPECT_LE(large, small + 2);
    EXPECT_LE(large, 8);
  }
}

TEST(Membrane, StopsOnRequest)
{
  Scene scene = Fans(32);
  int calls = 0;
  try {
    scene.Solve({}, 0.5f, Progress([&calls](double) { return ++calls < 4; }));
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.GetKind(), Error::Kind::Cancelled);
  }
}

TEST(Membrane, RefusesBadInput)
{
  const auto kindOf = [](const auto& change) {
    Scene scene = Fans(16);
    MembraneParameters parameters;
    change(scene, parameters);
    try {
      scene.Solve(parameters);
    } catch (const Error& error) {
      return error.GetKind();
    }
    return Error::Kind::Cancelled;
  };
  using Parameters = MembraneParameters;
  EXPECT_EQ(kindOf([](Scene& scene, Parameters&) { scene.spacing[1] = 0.0; }), Error::Kind::InvalidParameter);
  EXPECT_EQ(kindOf([](Scene&, Parameters& p) { p.tolerance = 0.0; }), Error::Kind::InvalidParameter);
  EXPECT_EQ(kindOf([](Scene&, Parameters& p) { p.tolerance = NAN; }), Error::Kind::InvalidParameter);
  EXPECT_EQ(kindOf([](Scene&, Parameters& p) { p.maximumCycles = -1; }), Error::Kind::InvalidParameter);
  EXPECT_EQ(kindOf([](Scene& scene, Parameters&) {
              for (std::size_t at = 0; at < scene.kind.size(); ++at)
                if (scene.kind[at] == Known)
                  scene.value[at] = NAN;
            }),
            Error::Kind::BadInput);
  const auto spans = [] {
    return std::make_shared<const RowSpans>(GridBox{{0, 0, 0}, {2, 1, 1}}, std::vector<int>{0}, std::vector<int>{2});
  };
  RowField<unsigned char> kinds(spans());
  RowField<float> values(spans());
  EXPECT_THROW(SolveMembrane(kinds, Eigen::Vector3d::Ones(), values, 0.0f), Error);
}
