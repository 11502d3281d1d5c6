// SPDX-License-Identifier: BSD-3-Clause
// The membrane of an overlap: time, certified bound, and the largest true error against a solution converged to 1e-6.
//
//   BenchmarkMembrane [--cap SECONDS] [1e5] [1e6] [1e7] [levels] [blends]
//
// Cases: overlaps of two fan-shaped views with about 1e5, 1e6 and 1e7 unknowns; the energy of the descent against time for 1
// to 8 levels; total time to blend three volumes. Peers: cascadic red-black SOR (a coarse-to-fine first guess, then the best
// of a few relaxation factors, stopped by looking at the true error, which no user can), once to the error of multigrid and
// once to 1/512; and the dissertation's steepest descent, in twenty times the time of multigrid, and until 1/512 or the cap.
#include "Core/Base/Parallel.h"
#include "Core/Imaging/DistanceMap.h"
#include "Filters/Stitching/BlendWeights.h"
#include "Filters/Stitching/Membrane.h"
#include "Testing/Benchmark.h"
#include <cmath>
#include <limits>
#include <optional>
#include <set>

using namespace echorama;

namespace {

struct Scene {
  RowField<unsigned char> kinds;
  RowField<float> values;
  std::ptrdiff_t unknowns = 0;
};

// Two fan-shaped views of a volume, turned against each other: unknown where both see, known where one does. The hull of
// what is unknown, and one voxel around it, is kept.
Scene Overlap(int size, bool flat)
{
  const int depth = flat ? 1 : size;
  const auto inside = [&](double x, double y, double z, double turn, double shift) {
    const double half = 0.5 * size;
    const double a = std::cos(turn) * (x - half - shift) + std::sin(turn) * (z - half) * 0.6 + 0.13 * (y - half);
    const double c = -std::sin(turn) * (x - half - shift) + std::cos(turn) * (z - half);
    const double b = y - half;
    const double apex = c + 0.75 * size;
    const double r = std::sqrt(a * a + apex * apex + (flat ? 0.0 : b * b));
    return r < 1.2 * size && r > 0.3 * size && std::abs(a) < 0.55 * apex && (flat || std::abs(b) < 0.45 * apex);
  };
  std::vector<unsigned char> all(static_cast<std::size_t>(size) * size * depth);
  const auto at = [&](int i, int j, int k) -> unsigned char& { return all[(static_cast<std::size_t>(k) * size + j) * size + i]; };
  for (int k = 0; k < depth; ++k)
    for (int j = 0; j < size; ++j)
      for (int i = 0; i < size; ++i) {
        const double y = flat ? 0.5 * size : j, z = flat ? j : k;
        const bool a = inside(i, y, z, 0.15, -0.1 * size), b = inside(i, y, z, -0.2, 0.1 * size);
        at(i, j, k) = a && b ? 1 : a ? 2 : b ? 3 : 0;
      }
  std::vector<int> first, end;
  GridBox box{{0, 0, 0}, {size, size, depth}};
  for (int k = 0; k < depth; ++k)
    for (int j = 0; j < size; ++j) {
      int low = size, high = 0;
      for (int dk = -1; dk <= 1; ++dk)
        for (int dj = -1; dj <= 1; ++dj)
          if (j + dj >= 0 && j + dj < size && k + dk >= 0 && k + dk < depth && dj * dk == 0)
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
  for (int k = 0; k < depth; ++k)
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

double Largest(const Scene& scene, const std::vector<float>& values, const std::vector<float>& exact)
{
  double error = 0.0;
  for (std::size_t at = 0; at < values.size(); ++at)
    if (scene.kinds.values[at] == 1)
      error = std::max(error, std::abs(static_cast<double>(values[at]) - static_cast<double>(exact[at])));
  return error;
}

// The peer. A dense box per level with a border; rows are swept from their first to their last unknown. A coarse voxel is
// known if any of its eight is, else unknown if any is.
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

  // The first guess: every coarse level swept until little moves, and interpolated.
  void Guess()
  {
    for (std::size_t number = levels_.size(); number-- > 0;) {
      Level& level = levels_[number];
      if (number + 1 < levels_.size())
        Interpolate(levels_[number + 1], level);
      if (number > 0)
        Sweeps(number, 1.8f, 60);
    }
  }

  void Sweeps(std::size_t number, float omega, int count)
  {
    Level& level = levels_[number];
    for (int half = 0; half < 2 * count; ++half)
      ParallelRanges(level.size[2], std::max<std::ptrdiff_t>(1, 32768 / level.Slice()), Progress(),
                     [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
                       std::vector<float> step(static_cast<std::size_t>(level.size[0]));
                       for (int k = static_cast<int>(begin); k < static_cast<int>(end); ++k)
                         for (int j = 0; j < level.size[1]; ++j) {
                           const auto [first, last] =
                               level.span[static_cast<std::size_t>(k) * static_cast<std::size_t>(level.size[1]) +
                                          static_cast<std::size_t>(j)];
                           if (first < last)
                             Relax(level, level.At(0, j, k), (j + k + half) & 1, omega, first, last, step.data());
                         }
                     });
  }

  std::vector<float> Result() const
  {
    const RowSpans& spans = *scene_.kinds.spans;
    std::vector<float> values = scene_.values.values;
    const Level& level = levels_.front();
    for (int k = 0; k < level.size[2]; ++k)
      for (int j = 0; j < level.size[1]; ++j)
        for (int i = spans.First(j, k); i < spans.End(j, k); ++i)
          values[static_cast<std::size_t>(spans.Start(j, k) + i - spans.First(j, k))] = level.value[level.At(i, j, k)];
    return values;
  }

private:
  struct Level {
    std::array<int, 3> size;
    std::vector<unsigned char> kind;
    std::vector<float> value, inverse; // inverse: one over the number of neighbours, 0 where there is nothing to solve
    std::vector<std::pair<int, int>> span;

    explicit Level(std::array<int, 3> extent) : size(extent)
    {
      kind.assign(static_cast<std::size_t>(Slice() * (size[2] + 2)), 0);
      value.assign(kind.size(), 0.0f);
    }
    std::ptrdiff_t Row() const { return size[0] + 2; }
    std::ptrdiff_t Slice() const { return Row() * (size[1] + 2); }
    std::size_t At(int i, int j, int k) const { return static_cast<std::size_t>((k + 1) * Slice() + (j + 1) * Row() + i + 1); }
    void Prepare()
    {
      inverse.assign(kind.size(), 0.0f);
      for (int k = 0; k < size[2]; ++k)
        for (int j = 0; j < size[1]; ++j) {
          int first = size[0], last = 0;
          for (int i = 0; i < size[0]; ++i) {
            const std::size_t at = At(i, j, k);
            const auto row = static_cast<std::size_t>(Row()), slice = static_cast<std::size_t>(Slice());
            const int count = (kind[at - 1] != 0) + (kind[at + 1] != 0) + (kind[at - row] != 0) + (kind[at + row] != 0) +
                              (kind[at - slice] != 0) + (kind[at + slice] != 0);
            if (kind[at] == 1 && count > 0) {
              inverse[at] = 1.0f / static_cast<float>(count);
              first = std::min(first, i);
              last = i + 1;
            }
          }
          span.emplace_back(first, last);
        }
    }
  };

  static void Relax(Level& level, std::size_t start, int parity, float omega, int first, int last, float* __restrict step)
  {
    float* u = level.value.data() + start;
    const float* inverse = level.inverse.data() + start;
    const std::ptrdiff_t row = level.Row(), slice = level.Slice();
    for (int i = first; i < last; ++i) {
      const float sum = u[i - 1] + u[i + 1] + u[i - row] + u[i + row] + u[i - slice] + u[i + slice];
      const float take = ((i ^ parity) & 1) == 0 && inverse[i] > 0.0f ? omega : 0.0f;
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
          float sum = 0.0f;
          int known = 0, unknown = 0;
          for (int corner = 0; corner < 8; ++corner) {
            const std::size_t at =
                fine.At(2 * I + (corner & 1), 2 * J + (corner >> 1 & 1), 2 * K + (corner >> 2)); // may be border
            known += fine.kind[at] == 2;
            unknown += fine.kind[at] == 1;
            sum += fine.kind[at] == 2 ? fine.value[at] : 0.0f;
          }
          coarse.kind[coarse.At(I, J, K)] = static_cast<unsigned char>(known ? 2 : unknown ? 1 : 0);
          coarse.value[coarse.At(I, J, K)] = known ? sum / static_cast<float>(known) : 0.0f;
        }
    return coarse;
  }

  static void Interpolate(const Level& coarse, Level& fine)
  {
    ParallelFor(fine.size[2], [&](std::ptrdiff_t k) {
      for (int j = 0; j < fine.size[1]; ++j)
        for (int i = 0; i < fine.size[0]; ++i) {
          const std::size_t at = fine.At(i, j, static_cast<int>(k));
          if (fine.inverse[at] == 0.0f)
            continue;
          const int here[3] = {i, j, static_cast<int>(k)};
          float sum = 0.0f, total = 0.0f;
          for (int corner = 0; corner < 8; ++corner) {
            int cell[3];
            float weight = 1.0f;
            for (int axis = 0; axis < 3; ++axis) {
              const bool other = (corner >> axis & 1) != 0;
              cell[axis] = here[axis] / 2 + (other ? (here[axis] & 1 ? 1 : -1) : 0);
              weight *= other ? 0.25f : 0.75f;
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

void CompareSolvers(int size, double cap)
{
  const Scene scene = Overlap(size, false);
  const std::string name = std::to_string(scene.unknowns) + " unknowns";
  const auto solve = [&](const MembraneParameters& parameters, MembraneReport& report) {
    RowField<float> values = scene.values;
    report = SolveMembrane(scene.kinds, Eigen::Vector3d::Ones(), values, 0.5f, parameters);
    return values.values;
  };
  MembraneReport report;
  MembraneParameters converged;
  converged.tolerance = 1e-6;
  const std::vector<float> exact = solve(converged, report);

  // Ours: the median of three.
  std::vector<std::array<double, 3>> times;
  std::vector<float> values;
  for (int run = 0; run < 3; ++run) {
    const double cpu = Cpu();
    values = solve({}, report);
    times.push_back({report.solveSeconds, report.setupSeconds, Cpu() - cpu});
  }
  std::sort(times.begin(), times.end());
  const double ours = times[1][0], oursError = Largest(scene, values, exact);
  benchmark::Report("membrane", name, "multigrid", times[1][0] + times[1][1], oursError, "of the span",
                    {{"unknowns", scene.unknowns},
                     {"cycles", report.cycles},
                     {"certified_bound", report.bound},
                     {"setup_seconds", times[1][1]},
                     {"solve_seconds", ours},
                     {"cpu_seconds", times[1][2]},
                     {"ns_per_unknown", 1e9 * ours / static_cast<double>(scene.unknowns)}});

  // The same without the wish to know: the cycles until the true error is below 1/512, as the peer is stopped.
  MembraneParameters uncertified;
  uncertified.tolerance = 1e-12;
  for (uncertified.maximumCycles = 0; uncertified.maximumCycles < 10; ++uncertified.maximumCycles) {
    const double error = Largest(scene, solve(uncertified, report), exact);
    if (error <= 1.0 / 512) {
      benchmark::Report("membrane", name, "multigrid, told when", report.setupSeconds + report.solveSeconds, error, "of the span",
                        {{"unknowns", scene.unknowns},
                         {"cycles", report.cycles},
                         {"setup_seconds", report.setupSeconds},
                         {"solve_seconds", report.solveSeconds}});
      break;
    }
  }

  for (const double target : {1.0 / 512, oursError}) {
    struct Best {
      double seconds = std::numeric_limits<double>::infinity(), cpu = 0.0, setup = 0.0,
             error = std::numeric_limits<double>::quiet_NaN(), omega = 0.0;
      int sweeps = 0;
    } best;
    for (const double omega : {1.7, 1.85, 1.93, 1.96, 1.98}) { // the best of a square of n voxels is 2 / (1 + sin(pi / n))
      std::optional<CascadicSor> sor;
      const double setup = benchmark::Seconds([&] { sor.emplace(scene); });
      const double cpu = Cpu();
      double seconds = benchmark::Seconds([&] { sor->Guess(); }), checking = 0.0, error = 1.0;
      int sweeps = 0;
      while (error > target && seconds < cap && seconds < best.seconds) {
        seconds += benchmark::Seconds([&] { sor->Sweeps(0, static_cast<float>(omega), 4); });
        sweeps += 4;
        const double before = Cpu();
        error = Largest(scene, sor->Result(), exact);
        checking += Cpu() - before;
      }
      if (error <= target && seconds < best.seconds)
        best = {seconds, Cpu() - cpu - checking, setup, error, omega, sweeps};
    }
    benchmark::Report("membrane", name, "cascadic_sor", best.setup + best.seconds, best.error, "of the span",
                      {{"unknowns", scene.unknowns},
                       {"target_error", target},
                       {"reached", std::isfinite(best.seconds)},
                       {"sweeps", best.sweeps},
                       {"omega", best.omega},
                       {"setup_seconds", best.setup},
                       {"solve_seconds", best.seconds},
                       {"cpu_seconds", best.cpu},
                       {"times_multigrid_solve", best.seconds / ours}});
  }

  // The descent, with the stop that serves it best.
  MembraneParameters descent;
  descent.solver = MembraneSolver::SteepestDescent;
  for (const bool untilGood : {false, true}) {
    double seconds = 0.0, error = 1.0, stop = 0.0;
    int steps = 0;
    for (const double tried : {1e-4, 1e-5, 1e-6, 1e-7}) {
      descent.descentStop = tried;
      descent.maximumSeconds = untilGood ? cap : 20.0 * ours;
      const std::vector<float> result = solve(descent, report);
      const double triedError = Largest(scene, result, exact);
      if (triedError < error) {
        error = triedError;
        seconds = report.solveSeconds;
        stop = tried;
        steps = report.cycles;
      }
      if ((untilGood && error <= 1.0 / 512) || report.solveSeconds > descent.maximumSeconds)
        break;
    }
    benchmark::Report("membrane", name, "steepest_descent", seconds, error, "of the span",
                      {{"unknowns", scene.unknowns},
                       {"allowed_seconds", descent.maximumSeconds},
                       {"reached", error <= 1.0 / 512},
                       {"stop", stop},
                       {"steps", steps},
                       {"times_multigrid_solve", seconds / ours}});
  }
}

// Figures 5.6 and 5.7 of the dissertation.
void CompareLevels()
{
  const Scene scene = Overlap(110, false);
  RowField<float> exact = scene.values;
  MembraneParameters parameters;
  parameters.tolerance = 1e-6;
  SolveMembrane(scene.kinds, Eigen::Vector3d::Ones(), exact, 0.5f, parameters);
  parameters.solver = MembraneSolver::SteepestDescent;
  parameters.trace = true;
  for (int levels = 1; levels <= 8; ++levels) {
    parameters.levels = levels;
    RowField<float> values = scene.values;
    const MembraneReport report = SolveMembrane(scene.kinds, Eigen::Vector3d::Ones(), values, 0.5f, parameters);
    const std::string method = std::to_string(levels) + (levels == 1 ? " level" : " levels");
    benchmark::Report("membrane", "descent by levels", method, report.solveSeconds, Largest(scene, values.values, exact.values),
                      "of the span", {{"unknowns", scene.unknowns}, {"levels", levels}, {"steps", report.cycles}});
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
  const auto membranes = [&](const MembraneParameters& parameters) {
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
      SolveMembrane(kinds, Eigen::Vector3d::Ones(), values, 0.5f, parameters);
      std::copy(values.values.begin(), values.values.end(), scale[v].View().Data());
    }
  };
  MembraneParameters six, one;
  six.solver = one.solver = MembraneSolver::SteepestDescent;
  one.levels = 1;
  const auto report = [&](const std::string& method, const auto& prepare, bool maximum) {
    const double seconds = benchmark::Seconds([&] {
      prepare();
      traverse(maximum);
    });
    benchmark::Report("membrane", "blend of three volumes", method, seconds, std::numeric_limits<double>::quiet_NaN(), "",
                      {{"voxels", voxels}});
  };
  report(
      "average", [] {}, false);
  report(
      "maximum", [] {}, true);
  report("distance", distances, false);
  report(
      "membrane, 1 level of descent", [&] { membranes(one); }, false);
  report(
      "membrane, 6 levels of descent", [&] { membranes(six); }, false);
  report(
      "membrane, multigrid", [&] { membranes({}); }, false);
}

} // namespace

int main(int argc, char** argv)
{
  double cap = 30.0;
  std::set<std::string> wanted;
  for (int n = 1; n < argc; ++n)
    if (std::string(argv[n]) == "--cap" && n + 1 < argc)
      cap = std::atof(argv[++n]);
    else
      wanted.insert(argv[n]);
  const auto want = [&wanted](const char* name) { return wanted.empty() || wanted.count(name) > 0; };
  for (const auto& [unknowns, size] : {std::pair{"1e5", 69}, {"1e6", 147}, {"1e7", 317}})
    if (want(unknowns))
      CompareSolvers(size, cap);
  if (want("levels"))
    CompareLevels();
  if (want("blends"))
    CompareBlends();
  return 0;
}
