// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <cstdlib>
#include <fcntl.h>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <termios.h>
#include <unistd.h>

namespace echorama {

/// A serial line that is none: what is written to Master() is read at Path() and the other way round. Path() is a link, as udev
/// makes them, so that a device can be unplugged and come back under its name.
class PseudoTerminal {
public:
  PseudoTerminal()
  {
    static int number = 0;
    path_ =
        std::filesystem::temp_directory_path() / ("echorama-line-" + std::to_string(getpid()) + "-" + std::to_string(number++));
    Plug();
  }
  ~PseudoTerminal() { Unplug(); }
  PseudoTerminal(const PseudoTerminal&) = delete;
  PseudoTerminal& operator=(const PseudoTerminal&) = delete;

  void Plug()
  {
    Unplug();
    master_ = posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC);
    char name[128];
    if (master_ < 0 || grantpt(master_) != 0 || unlockpt(master_) != 0 || ptsname_r(master_, name, sizeof name) != 0)
      throw std::runtime_error("no pseudo-terminal to be had");
    termios raw{};
    tcgetattr(master_, &raw);
    cfmakeraw(&raw); // else it would send back what is written to it before anybody opens it
    tcsetattr(master_, TCSANOW, &raw);
    fcntl(master_, F_SETFL, O_NONBLOCK);
    std::filesystem::create_symlink(name, path_);
  }
  void Unplug()
  {
    std::filesystem::remove(path_);
    if (master_ >= 0)
      close(master_);
    master_ = -1;
  }

  std::string Path() const { return path_.string(); }
  int Master() const { return master_; } ///< does not block; -1 while unplugged

private:
  std::filesystem::path path_;
  int master_ = -1;
};

} // namespace echorama
