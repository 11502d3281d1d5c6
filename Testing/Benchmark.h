// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The harness of the benchmarks: each prints one JSON object per line, time and error side by side, ours and the peer's.
#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <iostream>
#include <malloc.h>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace echorama::benchmark {

/// With ECHORAMA_SMOKE in the environment a benchmark only shows that it works: it runs everything once, and ends after the first
/// line that comes when it has had a few seconds of the processors.
inline bool Smoke()
{
  return std::getenv("ECHORAMA_SMOKE") != nullptr;
}

/// How often to try what is tried \a count times.
inline int Trials(int count)
{
  return Smoke() ? 1 : count;
}

/// Seconds of one call.
template <class Function>
double Seconds(const Function& function)
{
  const auto start = std::chrono::steady_clock::now();
  function();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// Median seconds of \a runs calls, after one that is not counted. Time ours and the peer in turn (see Duel) where the
/// ratio matters: machines are shared.
template <class Function>
double MedianSeconds(const Function& function, int runs = 5)
{
  if (Smoke())
    return Seconds(function);
  function();
  std::vector<double> seconds;
  for (int run = 0; run < runs; ++run)
    seconds.push_back(Seconds(function));
  std::nth_element(seconds.begin(), seconds.begin() + runs / 2, seconds.end());
  return seconds[runs / 2];
}

/// Median seconds of two functions that run in turn, A B A B ..., after one warm-up each.
template <class A, class B>
std::pair<double, double> Duel(const A& a, const B& b, int runs = 5)
{
  if (Smoke())
    return {Seconds(a), Seconds(b)};
  a();
  b();
  std::vector<double> first, second;
  for (int run = 0; run < runs; ++run) {
    first.push_back(Seconds(a));
    second.push_back(Seconds(b));
  }
  std::nth_element(first.begin(), first.begin() + runs / 2, first.end());
  std::nth_element(second.begin(), second.begin() + runs / 2, second.end());
  return {first[runs / 2], second[runs / 2]};
}

/// Largest memory of this process since ForgetPeak(), MB.
inline double PeakMb()
{
  std::ifstream stream("/proc/self/status");
  std::string word;
  double kilobytes = 0.0;
  while (stream >> word)
    if (word == "VmHWM:" && stream >> kilobytes)
      break;
  return kilobytes / 1024.0;
}

/// From now on the peak is what is there now.
inline void ForgetPeak()
{
  malloc_trim(0);
  std::ofstream("/proc/self/clear_refs") << "5";
}

/// The largest memory of this process since it was made, beyond what was there then.
class MemoryPeak {
public:
  MemoryPeak()
  {
    ForgetPeak();
    before_ = PeakMb();
  }
  double Beyond() const { return 1048576.0 * (PeakMb() - before_); } ///< bytes

private:
  double before_ = 0.0;
};

/// One line of output of what has no error, or whose error another line tells. Further keys are welcome. "peak_mb" is the largest
/// memory of the process since the line before: input and, where ours and a peer's take turns, both.
inline void ReportTime(const std::string& bench, const std::string& testCase, const std::string& method, double seconds,
                       const nlohmann::ordered_json& more = {})
{
  nlohmann::ordered_json line{{"bench", bench}, {"case", testCase}, {"method", method}, {"seconds", seconds}};
  if (more.is_object())
    line.update(more);
  line["peak_mb"] = PeakMb();
  std::cout << line.dump() << std::endl;
  ForgetPeak();
  if (Smoke() && std::clock() > 3 * CLOCKS_PER_SEC)
    std::_Exit(0);
}

/// The same with an error, which was measured.
inline void Report(const std::string& bench, const std::string& testCase, const std::string& method, double seconds, double error,
                   const std::string& errorUnit, const nlohmann::ordered_json& more = {})
{
  nlohmann::ordered_json all{{"error", error}, {"error_unit", errorUnit}};
  if (more.is_object())
    all.update(more);
  ReportTime(bench, testCase, method, seconds, all);
}

} // namespace echorama::benchmark
