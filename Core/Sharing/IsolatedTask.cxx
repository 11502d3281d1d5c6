// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Sharing/IsolatedTask.h"
#include <algorithm>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <ctime>
#include <fcntl.h>
#include <fstream>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

namespace echorama {
namespace {

// Of private memory that this process can write, which is what RLIMIT_DATA counts.
std::uint64_t BytesInUse()
{
  std::uint64_t pages[6] = {};
  std::ifstream stream("/proc/self/statm"); // size resident shared text lib data
  for (std::uint64_t& number : pages)
    stream >> number;
  return stream ? pages[5] * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE)) : 0;
}

void Limit(int resource, rlim_t value)
{
  rlimit limit{};
  getrlimit(resource, &limit);
  limit.rlim_cur = std::min(value, limit.rlim_max);
  setrlimit(resource, &limit);
}

[[noreturn]] void RunHere(const std::function<bool()>& task, rlim_t seconds, std::uint64_t bytesInUse, std::uint64_t bytes)
{
  prctl(PR_SET_PDEATHSIG, SIGKILL); // not to outlive who waits for it
  for (const int number : {SIGABRT, SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGXCPU})
    std::signal(number, SIG_DFL); // the program's own handlers are not for this
  Limit(RLIMIT_CORE, 0);
  Limit(RLIMIT_CPU, seconds);
  if (bytesInUse > 0)
    Limit(RLIMIT_DATA, bytesInUse + bytes);
  const int nothing = open("/dev/null", O_WRONLY | O_CLOEXEC);
  dup2(nothing, STDOUT_FILENO);
  dup2(nothing, STDERR_FILENO);
  bool succeeded = false;
  try {
    succeeded = task();
  } catch (...) {
  }
  _exit(succeeded ? 0 : 1);
}

} // namespace

TaskOutcome RunIsolated(const std::function<bool()>& task, const TaskLimits& limits, const Progress& progress, double fraction)
{
  const rlim_t seconds = static_cast<rlim_t>(std::ceil(limits.seconds));
  const std::uint64_t bytesInUse = BytesInUse(); // read here: after the fork little is allowed
  const pid_t child = fork();
  if (child < 0)
    throw Error(Error::Kind::NotPossible, "no other process can be started");
  if (child == 0)
    RunHere(task, seconds, bytesInUse, limits.bytes);
  int status = 0;
  for (long nap = 100000;; nap = std::min(2 * nap, 20000000L)) { // nanoseconds
    const pid_t ended = waitpid(child, &status, WNOHANG);
    if (ended == child)
      break;
    if (ended < 0 && errno != EINTR)
      return TaskOutcome::Failed; // somebody else has waited for it
    try {
      progress(fraction);
    } catch (...) {
      kill(child, SIGKILL);
      while (waitpid(child, nullptr, 0) < 0 && errno == EINTR)
        ;
      throw;
    }
    const timespec pause{0, nap};
    nanosleep(&pause, nullptr);
  }
  if (WIFEXITED(status))
    return WEXITSTATUS(status) == 0 ? TaskOutcome::Succeeded : TaskOutcome::Failed;
  return WTERMSIG(status) == SIGXCPU ? TaskOutcome::TimedOut : TaskOutcome::Failed;
}

} // namespace echorama
