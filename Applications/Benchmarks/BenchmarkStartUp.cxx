// SPDX-License-Identifier: BSD-3-Clause
// From the start of a program to its end, with next to nothing to do in between: ours, beside Python alone, all of VTK in it, and
// elastix. Seconds are those of the processors (user and system), as others may run; wall_seconds passed meanwhile. All take
// turns.
#include "Testing/Benchmark.h"
#include <algorithm>
#include <fcntl.h>
#include <filesystem>
#include <fstream>
#include <spawn.h>
#include <stdexcept>
#include <string>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>
#include <vector>

using namespace echorama::benchmark;
namespace fs = std::filesystem;

namespace {

struct Contestant {
  std::string name, method;
  std::vector<std::string> words;
  std::vector<double> cpu = {}, wall = {}; // seconds of each run
};

double SecondsOf(const timeval& time)
{
  return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
}

// Runs it once, without what it prints. \returns false when there is no such program.
bool RunOnce(Contestant& contestant)
{
  std::vector<char*> words;
  for (std::string& word : contestant.words)
    words.push_back(word.data());
  words.push_back(nullptr);
  posix_spawn_file_actions_t silence;
  posix_spawn_file_actions_init(&silence);
  for (const int output : {STDOUT_FILENO, STDERR_FILENO})
    posix_spawn_file_actions_addopen(&silence, output, "/dev/null", O_WRONLY, 0);
  pid_t child = 0;
  bool started = false;
  int status = 0;
  rusage usage{};
  const double wall = Seconds([&] {
    started = posix_spawnp(&child, words[0], &silence, nullptr, words.data(), environ) == 0;
    if (started)
      wait4(child, &status, 0, &usage);
  });
  posix_spawn_file_actions_destroy(&silence);
  if (!started || !WIFEXITED(status) || WEXITSTATUS(status) == 127)
    return false;
  if (WEXITSTATUS(status) != 0)
    throw std::runtime_error(contestant.name + " ended with status " + std::to_string(WEXITSTATUS(status)));
  contestant.cpu.push_back(SecondsOf(usage.ru_utime) + SecondsOf(usage.ru_stime));
  contestant.wall.push_back(wall);
  return true;
}

double Median(std::vector<double> values)
{
  std::nth_element(values.begin(), values.begin() + values.size() / 2, values.end());
  return values[values.size() / 2];
}

} // namespace

int main()
{
  const fs::path folder = fs::temp_directory_path() / ("echorama-bench-" + std::to_string(getpid()));
  fs::create_directories(folder);
  const std::string volume = (folder / "volume.mha").string();
  std::ofstream(volume, std::ios::binary) << "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\n"
                                          << "DimSize = 64 64 64\nElementSpacing = 1 1 1\nElementType = MET_UCHAR\n"
                                          << "ElementDataFile = LOCAL\n"
                                          << std::string(64 * 64 * 64, 'x');
  setenv("PYTHONPATH", ECHORAMA_PYTHON_PATH, 1);
  const std::string program = ECHORAMA_PROGRAM, python = ECHORAMA_PYTHON;
  std::vector<Contestant> contestants = {
      {"echorama --help", "echorama", {program, "--help"}},
      {"echorama info FILE", "echorama", {program, "info", volume}},
      {"echorama align --help", "echorama", {program, "align", "--help"}},
      {"echorama view --help", "echorama", {program, "view", "--help"}},
      {"import echorama", "echorama", {python, "-c", "import echorama"}},
      {"from echorama import vtkUltrasoundReader", "echorama", {python, "-c", "from echorama import vtkUltrasoundReader"}},
      {"from echorama import *", "echorama", {python, "-c", "from echorama import *"}},
      {"python3 -c pass", "python", {python, "-c", "pass"}},
      {"import vtkmodules.all", "vtk", {python, "-c", "import vtkmodules.all"}},
      {"elastix --help", "elastix", {"elastix", "--help"}},
  };
  std::vector<Contestant*> present;
  for (Contestant& one : contestants)
    if (RunOnce(one)) // in vain: files come into memory
      present.push_back(&one);
  for (Contestant* one : present)
    one->cpu.clear(), one->wall.clear();
  for (int run = 0; run < Trials(21); ++run)
    for (Contestant* one : present)
      RunOnce(*one);
  fs::remove_all(folder);
  for (const Contestant* one : present)
    ReportTime("start_up", one->name, one->method, Median(one->cpu), {{"wall_seconds", Median(one->wall)}});
  return 0;
}
