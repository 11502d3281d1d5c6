// SPDX-License-Identifier: BSD-3-Clause
// The membrane of an overlap: time, certified bound, and the largest true error. What is true is found by another way: one
// equation per unknown, written down from the definition of a membrane, solved in double precision by Eigen's conjugate
// gradients; reference_bound is a bound of that solution's own error.
//
//   BenchmarkMembrane [1e5] [1e6] [1e7] [levels] [blends]
//
// Cases: overlaps of two fan-shaped views with about 1e5, 1e6 and 1e7 unknowns; the energy of the descent against time for 1
// to 8 levels; total time to blend three volumes. Peers: cascadic red-black SOR (a coarse-to-fine first guess, then the number of
// sweeps and the relaxation that get there soonest, found by looking at the true error, which no user can), in single precision
// to 1/512 and in double to the error of multigrid; and the dissertation's steepest descent in twenty times the time of
// multigrid. All have all threads; multigrid and SOR are timed in turn, equally often.
#include "Core/Base/Angles.h"
#include "Core/Base/Parallel.h"
#include "Core/Imaging/DistanceMap.h"
#include "Filters/Stitching/Benchmarks/MembraneDescent.h"
#include "Filters/Stitching/BlendWeights.h"
#include "Filters/Stitching/Membrane.h"
#include "Testing/Benchmark.h"
#include <cmath>
#include <Eigen/IterativeLinearSolvers>
#include <functional>
#include <limits>
#include <set>
#include <sys/resource.h>
#include <tbb/info.h>
#include <tuple>

using namespace echorama;

namespace {

struct Scene {
  RowField<unsigned char> kinds;
  RowField<float> values;
  std::ptrdiff_t unknowns = 0;
};

// Two fan-shaped views of a volume, turned against each other: unknown where both see, known where one does. The hull of
// what is unknown, and one voxel around it, is kept.
Scene Overlap(int size)
{
  const auto inside = [&](double x, double y, double z, double turn, double shift) {
    const double half = 0.5 * size;
    const double a = std::cos(turn) * (x - half - shift) + std::sin(turn) * (z - half) * 0.6 + 0.13 * (y - half);
    const double c = -std::sin(turn) * (x - half - shift) + std::cos(turn) * (z - half);
    const double b = y - half;
    const double apex = c + 0.75 * size;
    const double r = std::sqrt(a * a + apex * apex + b * b);
    return r < 1.2 * size && r > 0.3 * size && std::abs(a) < 0.55 * apex && std::abs(b) < 0.45 * apex;
  };
  std::vector<unsigned char> all(static_cast<std::size_t>(size) * size * size);
  const auto at = [&](int i, int j, int k) -> unsigned char& { return all[(static_cast<std::size_t>(k) * size + j) * size + i]; };
  for (int k = 0; k < size; ++k)
    for (int j = 0; j < size; ++j)
      for (int i = 0; i < size; ++i) {
        const bool a = inside(i, j, k, 0.15, -0.1 * size), b = inside(i, j, k, -0.2, 0.1 * size);
        at(i, j, k) = a && b ? 1 : a ? 2 : b ? 3 : 0;
      }
  std::vector<int> first, end;
  GridBox box{{0, 0, 0}, {size, size, size}};
  for (int k = 0; k < size; ++k)
    for (int j = 0; j < size; ++j) {
      int low = size, high = 0;
      for (int dk = -1; dk <= 1; ++dk)
        for (int dj = -1; dj <= 1; ++dj)
          if (j + dj >= 0 && j + dj < size && k + dk >= 0 && k + dk < size && dj * dk == 0)
            for (int i = 0; i < size; ++i)
              if (at(i, j + dj, k + dk) == 1) {
                low = std::min(low, std::max(0, i - 1));
                high = std::max(high, std::min(size, i + 2));
              }
      first.push_back(low < high ? low : 0);
      end.push_back(low < high ? high : 0);
    }
  Scene scene;
  auto spans = std::make_shared<const RowSpans>(box, std::move(first), std::move(end));
  scene.kinds = RowField<unsigned char>(spans);
  scene.values = RowField<float>(spans);
  for (int k = 0; k < size; ++k)
    for (int j = 0; j < size; ++j)
      for (int i = spans->First(j, k); i < spans->End(j, k); ++i) {
        const auto n = i - spans->First(j, k);
        const int kind = at(i, j, k);
        scene.kinds.Row(j, k)[n] = static_cast<unsigned char>(kind == 0 ? 0 : kind == 1 ? 1 : 2);
        scene.values.Row(j, k)[n] = kind == 2 ? 1.0f : 0.0f;
        scene.unknowns += kind == 1;
      }
  return scene;
}

double Cpu()
{
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_utime.tv_sec + usage.ru_stime.tv_sec) +
         1e-6 * static_cast<double>(usage.ru_utime.tv_usec + usage.ru_stime.tv_usec);
}

using Matrix = Eigen::SparseMatrix<double, Eigen::RowMajor>;

// Incomplete Cholesky factors without fill whose rows sum up (nearly) as the matrix's do (Gustafsson 1978): Eigen has those that
// do not, with which a large membrane takes many times as many steps.
class RowSumCholesky {
public:
  template <class Symmetric>
  RowSumCholesky& compute(const Symmetric& matrix)
  {
    start_ = matrix.outerIndexPtr();
    column_ = matrix.innerIndexPtr();
    value_ = matrix.valuePtr();
    const auto count = matrix.rows();
    inverse_.resize(count);
    Eigen::VectorXd above = Eigen::VectorXd::Zero(count); // sum of each row's values right of the diagonal
    for (int i = 0; i < count; ++i) {
      double pivot = 0.0;
      for (int n = start_[i]; n < start_[i + 1]; ++n) {
        const int j = column_[n];
        pivot += j == i ? value_[n] : j < i ? -value_[n] * inverse_[j] * (value_[n] + 0.97 * (above[j] - value_[n])) : 0.0;
        above[i] += j > i ? value_[n] : 0.0;
      }
      inverse_[i] = 1.0 / pivot;
    }
    return *this;
  }
  template <class Right>
  Eigen::VectorXd solve(const Right& right) const
  {
    Eigen::VectorXd z(right.size());
    for (int i = 0; i < z.size(); ++i) {
      double sum = right[i];
      for (int n = start_[i]; column_[n] < i; ++n)
        sum -= value_[n] * z[column_[n]];
      z[i] = sum * inverse_[i];
    }
    for (int i = static_cast<int>(z.size()) - 1; i >= 0; --i) {
      double sum = 0.0;
      for (int n = start_[i + 1] - 1; column_[n] > i; --n)
        sum += value_[n] * z[column_[n]];
      z[i] -= sum * inverse_[i];
    }
    return z;
  }
  static Eigen::ComputationInfo info() { return Eigen::Success; }

private:
  const int *start_ = nullptr, *column_ = nullptr;
  const double* value_ = nullptr;
  Eigen::VectorXd inverse_;
};

// The solution by another way, from the definition: at each unknown the sum of the differences to all neighbours that are not
// void is 0. It begins with \a guess, which saves steps and changes nothing of where it ends.
struct Reference {
  std::vector<double> values; // of the scene's voxels
  double bound = 0.0;         // no value is further from the solution

  Reference(const Scene& scene, const Zeroed<float>& guess) : values(guess.begin(), guess.end())
  {
    const RowSpans& spans = *scene.kinds.spans;
    const auto kind = [&](std::ptrdiff_t at) {
      return at < 0 ? 0 : static_cast<int>(scene.kinds.values[static_cast<std::size_t>(at)]);
    };
    const auto place = [&](int i, int j, int k) -> std::ptrdiff_t {
      return i >= spans.First(j, k) && i < spans.End(j, k) ? spans.Start(j, k) + i - spans.First(j, k) : -1;
    };
    std::vector<int> number(values.size(), -1);
    int count = 0;
    for (std::size_t at = 0; at < number.size(); ++at)
      number[at] = scene.kinds.values[at] == 1 ? count++ : -1;
    Matrix matrix(count, count);
    matrix.reserve(7 * static_cast<Eigen::Index>(count));
    Eigen::VectorXd right = Eigen::VectorXd::Zero(count), solution(count);
    for (int k = 0; k < spans.Box().size[2]; ++k)
      for (int j = 0; j < spans.Box().size[1]; ++j)
        for (int i = spans.First(j, k); i < spans.End(j, k); ++i) {
          const std::ptrdiff_t here = place(i, j, k);
          const int row = number[static_cast<std::size_t>(here)];
          if (row < 0)
            continue;
          const std::ptrdiff_t near[] = {place(i, j, k - 1), place(i, j - 1, k), place(i - 1, j, k),
                                         place(i + 1, j, k), place(i, j + 1, k), place(i, j, k + 1)};
          matrix.startVec(row);
          const auto insert = [&](std::ptrdiff_t at) {
            if (kind(at) == 1)
              matrix.insertBack(row, number[static_cast<std::size_t>(at)]) = -1.0;
            else if (kind(at) == 2)
              right[row] += static_cast<double>(scene.values.values[static_cast<std::size_t>(at)]);
          };
          std::for_each(near, near + 3, insert); // columns grow
          matrix.insertBack(row, row) = static_cast<double>(std::count_if(near, near + 6, kind));
          std::for_each(near + 3, near + 6, insert);
          solution[row] = values[static_cast<std::size_t>(here)];
        }
    matrix.finalize();
    Eigen::ConjugateGradient<Matrix, Eigen::Lower | Eigen::Upper, RowSumCholesky> solver(matrix);
    solver.setTolerance(1e-12);
    solution = solver.solveWithGuess(right, solution);
    for (std::size_t at = 0; at < values.size(); ++at)
      if (number[at] >= 0)
        values[at] = solution[number[at]];
    // The inverse of the matrix has no negative values: where A v >= c > 0, no error is larger than max(v) / c times the largest
    // residual.
    const double residual = (right - matrix * solution).cwiseAbs().maxCoeff();
    solver.setTolerance(1e-2);
    const Eigen::VectorXd v = solver.solve(Eigen::VectorXd::Ones(count));
    bound = v.maxCoeff() * residual / (matrix * v).minCoeff();
    if (!(bound > 0.0 && bound < 1e-6))
      throw Error(Error::Kind::NotPossible, "the reference of a membrane did not converge");
  }

  double LargestError(const Scene& scene, const Zeroed<float>& other) const
  {
    double error = 0.0;
    for (std::size_t at = 0; at < values.size(); ++at)
      if (scene.kinds.values[at] == 1)
        error = std::max(error, std::abs(static_cast<double>(other[at]) - values[at]));
    return error;
  }
};

// The peer. A dense box per level with a border; rows are swept from their first to their last unknown. A coarse voxel is
// known if any of its eight is, else unknown if any is.
template <class T>
class CascadicSor {
public:
  explicit CascadicSor(const Scene& scene) : scene_(scene)
  {
    const RowSpans& spans = *scene.kinds.spans;
    Level finest(spans.Box().size);
    for (int k = 0; k < finest.size[2]; ++k)
      for (int j = 0; j < finest.size[1]; ++j)
        for (int i = spans.First(j, k); i < spans.End(j, k); ++i) {
          finest.kind[finest.At(i, j, k)] = scene.kinds.Row(j, k)[i - spans.First(j, k)];
          finest.value[finest.At(i, j, k)] = scene.values.Row(j, k)[i - spans.First(j, k)];
        }
    levels_.push_back(std::move(finest));
    while (*std::max_element(levels_.back().size.begin(), levels_.back().size.end()) > 8)
      levels_.push_back(Halved(levels_.back()));
    for (Level& level : levels_)
      level.Prepare();
  }

  // Coarser grids are swept until little moves, and interpolated; the finest is swept \a sweeps times. \a omega is the relaxation
  // on the finest: twice as coarse a grid wants 2 - omega to be twice as large.
  void Solve(double omega, int sweeps)
  {
    for (std::size_t number = levels_.size(); number-- > 0;) {
      if (number + 1 < levels_.size())
        Interpolate(levels_[number + 1], levels_[number]);
      if (number > 0)
        Sweeps(number, std::max(1.0, 2.0 - std::ldexp(2.0 - omega, static_cast<int>(number))), 60);
    }
    Sweeps(0, omega, sweeps);
  }

  void Sweeps(std::size_t number, double omega, int count)
  {
    Level& level = levels_[number];
    for (int half = 0; half < 2 * count; ++half)
      ParallelRanges(level.size[2], std::max<std::ptrdiff_t>(1, 32768 / level.Slice()), Progress(),
                     [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
                       std::vector<T> step(static_cast<std::size_t>(level.size[0]));
                       for (int k = static_cast<int>(begin); k < static_cast<int>(end); ++k)
                         for (int j = 0; j < level.size[1]; ++j) {
                           const auto [first, last] =
                               level.span[static_cast<std::size_t>(k) * static_cast<std::size_t>(level.size[1]) +
                                          static_cast<std::size_t>(j)];
                           if (first < last)
                             Relax(level, level.At(0, j, k), (j + k + half) & 1, static_cast<T>(omega), first, last, step.data());
                         }
                     });
  }

  double LargestError(const Reference& exact) const
  {
    const RowSpans& spans = *scene_.kinds.spans;
    const Level& level = levels_.front();
    std::vector<double> largest(static_cast<std::size_t>(level.size[2]), 0.0);
    ParallelFor(level.size[2], [&](std::ptrdiff_t slice) {
      const int k = static_cast<int>(slice);
      double most = 0.0;
      for (int j = 0; j < level.size[1]; ++j)
        for (int i = spans.First(j, k); i < spans.End(j, k); ++i)
          if (const std::size_t at = level.At(i, j, k); level.kind[at] == 1)
            most = std::max(most, std::abs(static_cast<double>(level.value[at]) -
                                           exact.values[static_cast<std::size_t>(spans.Start(j, k) + i - spans.First(j, k))]));
      largest[static_cast<std::size_t>(slice)] = most;
    });
    return *std::max_element(largest.begin(), largest.end());
  }

private:
  struct Level {
    std::array<int, 3> size;
    std::vector<unsigned char> kind;
    std::vector<T> value, inverse; // inverse: one over the number of neighbours, 0 where there is nothing to solve
    std::vector<std::pair<int, int>> span;

    explicit Level(std::array<int, 3> extent) : size(extent)
    {
      kind.assign(static_cast<std::size_t>(Slice() * (size[2] + 2)), 0);
      value.assign(kind.size(), T());
    }
    std::ptrdiff_t Row() const { return size[0] + 2; }
    std::ptrdiff_t Slice() const { return Row() * (size[1] + 2); }
    std::size_t At(int i, int j, int k) const { return static_cast<std::size_t>((k + 1) * Slice() + (j + 1) * Row() + i + 1); }
    void Prepare()
    {
      inverse.assign(kind.size(), T());
      for (int k = 0; k < size[2]; ++k)
        for (int j = 0; j < size[1]; ++j) {
          int first = size[0], last = 0;
          for (int i = 0; i < size[0]; ++i) {
            const std::size_t at = At(i, j, k);
            const auto row = static_cast<std::size_t>(Row()), slice = static_cast<std::size_t>(Slice());
            const int count = (kind[at - 1] != 0) + (kind[at + 1] != 0) + (kind[at - row] != 0) + (kind[at + row] != 0) +
                              (kind[at - slice] != 0) + (kind[at + slice] != 0);
            if (kind[at] == 1 && count > 0) {
              inverse[at] = T(1) / static_cast<T>(count);
              first = std::min(first, i);
              last = i + 1;
            }
          }
          span.emplace_back(first, last);
        }
    }
  };

  static void Relax(Level& level, std::size_t start, int parity, T omega, int first, int last, T* __restrict step)
  {
    T* u = level.value.data() + start;
    const T* inverse = level.inverse.data() + start;
    const std::ptrdiff_t row = level.Row(), slice = level.Slice();
    for (int i = first; i < last; ++i) {
      const T sum = u[i - 1] + u[i + 1] + u[i - row] + u[i + row] + u[i - slice] + u[i + slice];
      const T take = ((i ^ parity) & 1) == 0 && inverse[i] > T() ? omega : T();
      step[i] = take * (sum * inverse[i] - u[i]);
    }
    for (int i = first; i < last; ++i)
      u[i] += step[i];
  }

  static Level Halved(const Level& fine)
  {
    Level coarse({(fine.size[0] + 1) / 2, (fine.size[1] + 1) / 2, (fine.size[2] + 1) / 2});
    for (int K = 0; K < coarse.size[2]; ++K)
      for (int J = 0; J < coarse.size[1]; ++J)
        for (int I = 0; I < coarse.size[0]; ++I) {
          T sum = T();
          int known = 0, unknown = 0;
          for (int corner = 0; corner < 8; ++corner) {
            const std::size_t at =
                fine.At(2 * I + (corner & 1), 2 * J + (corner >> 1 & 1), 2 * K + (corner >> 2)); // may be border
            known += fine.kind[at] == 2;
            unknown += fine.kind[at] == 1;
            sum += fine.kind[at] == 2 ? fine.value[at] : T();
          }
          coarse.kind[coarse.At(I, J, K)] = static_cast<unsigned char>(known ? 2 : unknown ? 1 : 0);
          coarse.value[coarse.At(I, J, K)] = known ? sum / static_cast<T>(known) : T();
        }
    return coarse;
  }

  static void Interpolate(const Level& coarse, Level& fine)
  {
    ParallelFor(fine.size[2], [&](std::ptrdiff_t k) {
      for (int j = 0; j < fine.size[1]; ++j)
        for (int i = 0; i < fine.size[0]; ++i) {
          const std::size_t at = fine.At(i, j, static_cast<int>(k));
          if (fine.inverse[at] == T())
            continue;
          const int here[3] = {i, j, static_cast<int>(k)};
          T sum = T(), total = T();
          for (int corner = 0; corner < 8; ++corner) {
            int cell[3];
            T weight = T(1);
            for (int axis = 0; axis < 3; ++axis) {
              const bool other = (corner >> axis & 1) != 0;
              cell[axis] = here[axis] / 2 + (other ? (here[axis] & 1 ? 1 : -1) : 0);
              weight *= static_cast<T>(other ? 0.25 : 0.75);
            }
            const std::size_t from = coarse.At(cell[0], cell[1], cell[2]);
            if (coarse.kind[from] != 0) {
              sum += weight * coarse.value[from];
              total += weight;
            }
          }
          fine.value[at] = sum / total;
        }
    });
  }

  const Scene& scene_;
  std::vector<Level> levels_;
};

using Times = std::array<double, 3>; // of solving, of setting up, of the processor

// A method that is timed beside others: what one run took, and what is told of it.
struct Contender {
  std::string method;
  std::function<Times()> run;
  double error;
  nlohmann::ordered_json more;
  int runs = benchmark::Trials(3);
  std::vector<Times> times = {};
};

template <class T>
Contender Sor(const Scene& scene, const Reference& exact, double target)
{
  constexpr double allowedSeconds = 8.0;
  // The relaxation: that of a cube with as many voxels, then 2 - omega is divided or multiplied by 1.4 as long as that helps, so
  // that the best one lies between two that are worse. Judged by sweeps, which no other work on the machine can change.
  struct Trial {
    double omega = 0.0, sweeps = std::numeric_limits<double>::infinity(), error = std::numeric_limits<double>::infinity();
    bool operator<(const Trial& other) const { return std::tie(sweeps, error) < std::tie(other.sweeps, other.error); }
  };
  Trial best;
  nlohmann::ordered_json tried;
  int most = 0;
  const auto improves = [&](double distance) {
    CascadicSor<T> sor(scene);
    Trial trial;
    trial.omega = 2.0 - distance;
    sor.Solve(trial.omega, 0);
    if (most == 0) {
      const double sweep = benchmark::Seconds([&] { CascadicSor<T>(sor).Sweeps(0, trial.omega, 4); }) / 4.0;
      most = std::max(4, static_cast<int>(allowedSeconds / sweep));
    }
    int sweeps = 0;
    for (; (trial.error = sor.LargestError(exact)) > target && sweeps < std::min<double>(most, best.sweeps); sweeps += 2)
      sor.Sweeps(0, trial.omega, 2);
    if (trial.error <= target)
      trial.sweeps = sweeps;
    tried.push_back(trial.omega);
    const bool better = trial < best;
    if (better)
      best = trial;
    return better;
  };
  const double first = 2.0 - 2.0 / (1.0 + std::sin(Pi / std::cbrt(static_cast<double>(scene.unknowns))));
  improves(first);
  for (double distance = first / 1.4; improves(distance);)
    distance /= 1.4;
  if (best.omega == 2.0 - first)
    for (double distance = first * 1.4; distance < 1.0 && improves(distance);)
      distance *= 1.4;
  const bool reached = std::isfinite(best.sweeps);
  const int sweeps = reached ? static_cast<int>(best.sweeps) : most;
  const auto run = [&scene, sweeps, omega = best.omega] {
    std::unique_ptr<CascadicSor<T>> sor;
    const double setup = benchmark::Seconds([&] { sor = std::make_unique<CascadicSor<T>>(scene); }), cpu = Cpu();
    const double solve = benchmark::Seconds([&] { sor->Solve(omega, sweeps); });
    return Times{solve, setup, Cpu() - cpu};
  };
  return {"cascadic_sor",
          run,
          best.error,
          {{"target_error", target},
           {"reached", reached},
           {"sweeps", sweeps},
           {"omega", best.omega},
           {"omegas_tried", tried},
           {"allowed_seconds", allowedSeconds},
           {"precision", sizeof(T) == 4 ? "single" : "double"}},
          reached ? benchmark::Trials(3) : 1};
}

void CompareSolvers(int size)
{
  const Scene scene = Overlap(size);
  const auto solve = [&scene](const MembraneParameters& parameters, MembraneReport& report) {
    RowField<float> values = scene.values;
    report = SolveMembrane(scene.kinds, Eigen::Vector3d::Ones(), values, 0.5f, parameters);
    return values.values;
  };
  MembraneReport report;
  const Zeroed<float> values = solve({}, report);
  const Reference exact(scene, values);
  const auto tell = [&](const std::string& method, double time, double error, nlohmann::ordered_json more) {
    more.update({{"unknowns", scene.unknowns},
                 {"reference", "Eigen's conjugate gradients, double precision"},
                 {"reference_bound", exact.bound}});
    benchmark::Report("membrane", std::to_string(scene.unknowns) + " unknowns", method, time, error, "of the span", more);
  };

  const auto multigrid = [&](const MembraneParameters& parameters) {
    return [&solve, parameters] {
      MembraneReport run;
      const double cpu = Cpu();
      solve(parameters, run);
      return Times{run.solveSeconds, run.setupSeconds, Cpu() - cpu};
    };
  };
  std::vector<Contender> contenders{{"multigrid",
                                     multigrid({}),
                                     exact.LargestError(scene, values),
                                     {{"cycles", report.cycles}, {"certified_bound", report.bound}}}};
  // The same without the wish to know: the cycles until the true error is below 1/512, as the peer is stopped.
  constexpr double good = 1.0 / 512;
  MembraneParameters told;
  told.tolerance = 1e-12;
  double error = 1.0;
  for (told.maximumCycles = 0; told.maximumCycles < 10; ++told.maximumCycles)
    if ((error = exact.LargestError(scene, solve(told, report))) <= good)
      break;
  contenders.push_back({"multigrid, told when", multigrid(told), error, {{"cycles", report.cycles}}});
  contenders.push_back(Sor<float>(scene, exact, good));
  contenders.push_back(Sor<double>(scene, exact, contenders[0].error));

  for (int run = 0; run < contenders[0].runs; ++run)
    for (Contender& contender : contenders)
      if (run < contender.runs)
        contender.times.push_back(contender.run());
  double ours = 0.0;
  for (Contender& contender : contenders) {
    std::sort(contender.times.begin(), contender.times.end());
    const auto [solving, setup, cpu] = contender.times[contender.times.size() / 2];
    ours = &contender == &contenders[0] ? solving : ours;
    contender.more.update({{"setup_seconds", setup},
                           {"solve_seconds", solving},
                           {"cpu_seconds", cpu},
                           {"times_multigrid_solve", solving / ours},
                           {"runs", contender.runs},
                           {"threads", tbb::info::default_concurrency()}});
    tell(contender.method, setup + solving, contender.error, contender.more);
  }

  // The descent in twenty times our time, with the stop that serves it best.
  DescentParameters descent;
  descent.maximumSeconds = 20.0 * ours;
  error = 1.0;
  double time = 0.0;
  nlohmann::ordered_json more;
  for (const double stop : {1e-4, 1e-5, 1e-6, 1e-7}) {
    descent.stop = stop;
    RowField<float> tried = scene.values;
    const DescentReport descended = DescendMembrane(scene.kinds, Eigen::Vector3d::Ones(), tried, descent);
    const double triedError = exact.LargestError(scene, tried.values);
    if (triedError < error) {
      error = triedError;
      time = descended.seconds;
      more = {{"allowed_seconds", descent.maximumSeconds},
              {"stop", stop},
              {"steps", descended.steps},
              {"reached", error <= good},
              {"runs", 1},
              {"threads", tbb::info::default_concurrency()}};
    }
    if (descended.seconds > descent.maximumSeconds)
      break;
  }
  tell("steepest_descent", time, error, more);
}

// Figures 5.6 and 5.7 of the dissertation.
void CompareLevels()
{
  const Scene scene = Overlap(110);
  RowField<float> guess = scene.values;
  SolveMembrane(scene.kinds, Eigen::Vector3d::Ones(), guess, 0.5f);
  const Reference exact(scene, guess.values);
  DescentParameters parameters;
  parameters.trace = true;
  for (int levels = 1; levels <= 8; ++levels) {
    parameters.levels = levels;
    RowField<float> values = scene.values;
    const DescentReport report = DescendMembrane(scene.kinds, Eigen::Vector3d::Ones(), values, parameters);
    const std::string method = std::to_string(levels) + (levels == 1 ? " level" : " levels");
    benchmark::Report("membrane", "descent by levels", method, report.seconds, exact.LargestError(scene, values.values),
                      "of the span",
                      {{"unknowns", scene.unknowns},
                       {"levels", levels},
                       {"steps", report.steps},
                       {"reference", "Eigen's conjugate gradients, double precision"},
                       {"reference_bound", exact.bound}});
    const std::size_t every = report.trace.size() / 120 + 1;
    for (std::size_t n = 0; n < report.trace.size(); ++n)
      if (n % every == 0 || n + 1 == report.trace.size() || report.trace[n].level != report.trace[n + 1].level)
        std::cout << nlohmann::ordered_json{{"bench", "membrane"},
                                            {"levels", levels},
                                            {"t", report.trace[n].seconds},
                                            {"energy", report.trace[n].energy}}
                         .dump()
                  << std::endl;
  }
}

// Figures 5.5 and 5.10: all that it takes to blend three volumes that lie on one grid.
void CompareBlends()
{
  constexpr int Size = 144;
  const std::array<int, 3> n{Size, Size, Size};
  std::vector<Volume<unsigned char>> valid;
  std::vector<Volume<float>> intensity;
  for (int v = 0; v < 3; ++v) {
    valid.emplace_back(n);
    intensity.emplace_back(n);
    for (int k = 0; k < Size; ++k)
      for (int j = 0; j < Size; ++j)
        for (int i = 0; i < Size; ++i) {
          const double x = i - 0.5 * Size - 0.25 * Size * (v - 1) + 0.1 * k, y = j - 0.5 * Size, z = k + 0.3 * Size;
          valid.back().View()(i, j, k) = std::hypot(x, y, z) < 1.2 * Size && std::abs(x) < 0.35 * z && std::abs(y) < 0.4 * z;
          intensity.back().View()(i, j, k) = static_cast<float>(100 + 10 * v);
        }
  }
  const std::ptrdiff_t voxels = valid[0].View().Size();
  Volume<float> out(n);
  std::vector<Volume<float>> scale;
  for (int v = 0; v < 3; ++v)
    scale.emplace_back(n, 1.0f);
  const auto covered = [&](std::ptrdiff_t at) { return valid[0].View()[at] + valid[1].View()[at] + valid[2].View()[at]; };
  const auto traverse = [&](bool maximum) {
    ParallelRanges(voxels, 65536, Progress(), [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
      for (std::ptrdiff_t at = begin; at < end; ++at) {
        float sum = 0.0f, total = 0.0f, most = 0.0f;
        for (std::size_t v = 0; v < 3; ++v)
          if (valid[v].View()[at]) {
            const float s = scale[v].View()[at], weight = s * std::sqrt(s), value = intensity[v].View()[at];
            sum += weight * value;
            total += weight;
            most = std::max(most, value);
          }
        out.View()[at] = maximum ? most : total > 0.0f ? sum / total : 0.0f;
      }
    });
  };
  const auto distances = [&] {
    for (std::size_t v = 0; v < 3; ++v) {
      Volume<unsigned char> pure(n), empty(n);
      for (std::ptrdiff_t at = 0; at < voxels; ++at) {
        pure.View()[at] = valid[v].View()[at] && covered(at) == 1;
        empty.View()[at] = !valid[v].View()[at] && covered(at) > 0;
      }
      Volume<float> toPure(n), toEmpty(n);
      SquaredDistanceMap(pure.View(), Eigen::Vector3d::Ones(), toPure.View());
      SquaredDistanceMap(empty.View(), Eigen::Vector3d::Ones(), toEmpty.View());
      ParallelRanges(voxels, 65536, Progress(), [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
        for (std::ptrdiff_t at = begin; at < end; ++at)
          if (valid[v].View()[at])
            scale[v].View()[at] = BlendScale(std::sqrt(toPure.View()[at]), std::sqrt(toEmpty.View()[at]));
      });
    }
  };
  const auto membranes = [&](const auto& solve) {
    const auto spans = std::make_shared<const RowSpans>(GridBox{{0, 0, 0}, n}, std::vector<int>(Size * Size, 0),
                                                        std::vector<int>(Size * Size, Size));
    for (std::size_t v = 0; v < 3; ++v) {
      RowField<unsigned char> kinds(spans);
      RowField<float> values(spans);
      for (std::ptrdiff_t at = 0; at < voxels; ++at) {
        const int count = covered(at), own = valid[v].View()[at];
        kinds.values[static_cast<std::size_t>(at)] = static_cast<unsigned char>(count == 0 ? 0 : own && count > 1 ? 1 : 2);
        values.values[static_cast<std::size_t>(at)] = own ? 1.0f : 0.0f;
      }
      solve(kinds, values);
      std::copy(values.values.begin(), values.values.end(), scale[v].View().Data());
    }
  };
  const auto descent = [](int levels) {
    return [levels](const RowField<unsigned char>& kinds, RowField<float>& values) {
      DescentParameters parameters;
      parameters.levels = levels;
      DescendMembrane(kinds, Eigen::Vector3d::Ones(), values, parameters);
    };
  };
  const auto multigrid = [](const RowField<unsigned char>& kinds, RowField<float>& values) {
    SolveMembrane(kinds, Eigen::Vector3d::Ones(), values, 0.5f);
  };
  const auto report = [&](const std::string& method, const auto& prepare, bool maximum) {
    const double seconds = benchmark::Seconds([&] {
      prepare();
      traverse(maximum);
    });
    benchmark::ReportTime("membrane", "blend of three volumes", method, seconds, {{"voxels", voxels}, {"runs", 1}});
  };
  report(
      "average", [] {}, false);
  report(
      "maximum", [] {}, true);
  report("distance", distances, false);
  report(
      "membrane, 1 level of descent", [&] { membranes(descent(1)); }, false);
  report(
      "membrane, 6 levels of descent", [&] { membranes(descent(6)); }, false);
  report(
      "membrane, multigrid", [&] { membranes(multigrid); }, false);
}

} // namespace

int main(int argc, char** argv)
{
  const std::set<std::string> wanted(argv + 1, argv + argc);
  const auto want = [&wanted](const char* name) { return wanted.empty() || wanted.count(name) > 0; };
  for (const auto& [unknowns, size] : {std::pair{"1e5", 69}, {"1e6", 147}, {"1e7", 317}})
    if (want(unknowns))
      CompareSolvers(size);
  if (want("levels"))
    CompareLevels();
  if (want("blends"))
    CompareBlends();
  return 0;
}
