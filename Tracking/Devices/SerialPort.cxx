// SPDX-License-Identifier: BSD-3-Clause
// A line is read without ever blocking in read(): poll waits, with a limit, so that whoever reads can be told to stop. VMIN is 1
// so that "no byte yet" (EAGAIN) and "hung up" (0, or EIO) stay apart. Two locks keep others away: TIOCEXCL holds against
// everybody but root, flock against programs that ask for it, root's among them.
#include "Tracking/Devices/SerialPort.h"
#include "Core/Base/ElapsedTime.h"
#include "Core/Base/Error.h"
#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstring>
#include <fcntl.h>
#include <poll.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <unistd.h>

namespace echorama {
namespace {

struct Speed {
  int baud;
  speed_t code;
};

constexpr Speed speeds[] = {{1200, B1200},     {2400, B2400},     {4800, B4800},     {9600, B9600},
                            {19200, B19200},   {38400, B38400},   {57600, B57600},   {115200, B115200},
                            {230400, B230400}, {460800, B460800}, {921600, B921600}, {1000000, B1000000}};

std::string WhyNot(int error)
{
  switch (error) {
  case ENOENT:
  case ENXIO:
  case ENODEV:
    return "there is no such device; is it plugged in?";
  case EACCES:
  case EPERM:
    return "permission is missing; members of the group \"dialout\" may use serial lines (sudo usermod -aG dialout $USER, then "
           "log in again)";
  case EBUSY:
  case EWOULDBLOCK:
    return "another program uses it";
  default:
    return std::strerror(error);
  }
}

int MillisecondsUntil(Clock::time_point end)
{
  const auto left = std::chrono::duration_cast<std::chrono::microseconds>(end - Clock::now()).count();
  return static_cast<int>(std::clamp<long long>((left + 999) / 1000, 0, 60000));
}

Clock::time_point After(double seconds)
{
  return Clock::now() +
         std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(std::clamp(seconds, 0.0, 60.0)));
}

// Waits until the last bytes are out, as TCSADRAIN would, which waits forever for a device that takes none. These are dropped.
void LetOut(int file)
{
  int left = 0;
  for (const Clock::time_point end = After(0.05); ioctl(file, TIOCOUTQ, &left) == 0 && left > 0;) {
    if (Clock::now() >= end) {
      tcflush(file, TCOFLUSH);
      return;
    }
    usleep(1000);
  }
}

} // namespace

struct SerialPort::Line {
  int file = -1;
  termios before{};
  bool isOurs = false;

  ~Line()
  {
    if (isOurs) {
      LetOut(file);
      tcsetattr(file, TCSANOW, &before); // of no effect when the device is gone
      ioctl(file, TIOCNXCL);
    }
    if (file >= 0)
      close(file);
  }
};

SerialPort::SerialPort(std::string path, int baud) : path_(std::move(path)), baud_(baud)
{
  if (std::find(Speeds().begin(), Speeds().end(), baud) != Speeds().end())
    return;
  std::string list;
  for (const int speed : Speeds())
    list += (list.empty() ? "" : ", ") + std::to_string(speed);
  throw Error(Error::Kind::InvalidParameter, path_ + ": the speed must be one of " + list + " bits per second");
}

SerialPort::~SerialPort() = default;

const std::vector<int>& SerialPort::Speeds()
{
  static const std::vector<int> list = [] {
    std::vector<int> bauds;
    for (const Speed& speed : speeds)
      bauds.push_back(speed.baud);
    return bauds;
  }();
  return list;
}

bool SerialPort::IsOpen() const
{
  return line_ != nullptr;
}

void SerialPort::Close()
{
  line_.reset();
}

void SerialPort::Open()
{
  if (line_)
    return;
  const auto refuse = [this](int error) { throw Error(Error::Kind::FileSystem, path_ + ": " + WhyNot(error)); };
  auto line = std::make_unique<Line>();
  line->file = open(path_.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  if (line->file < 0)
    refuse(errno);
  if (isatty(line->file) != 1)
    throw Error(Error::Kind::FileSystem, path_ + ": it is no serial line");
  if (flock(line->file, LOCK_EX | LOCK_NB) != 0)
    refuse(errno);
  if (tcgetattr(line->file, &line->before) != 0)
    refuse(errno);
  line->isOurs = true;
  ioctl(line->file, TIOCEXCL); // a wish: not every driver knows it

  termios raw = line->before;
  cfmakeraw(&raw);
  raw.c_cflag |= CLOCAL | CREAD; // no modem that must answer first
  raw.c_cflag &= ~static_cast<tcflag_t>(CSTOPB | PARENB | CRTSCTS | HUPCL);
  raw.c_iflag &= ~static_cast<tcflag_t>(IXON | IXOFF | IXANY);
  raw.c_cc[VMIN] = 1;
  raw.c_cc[VTIME] = 0;
  const Speed* speed = std::find_if(std::begin(speeds), std::end(speeds), [this](const Speed& s) { return s.baud == baud_; });
  cfsetispeed(&raw, speed->code);
  cfsetospeed(&raw, speed->code);
  if (tcsetattr(line->file, TCSANOW, &raw) != 0)
    refuse(errno);
  tcflush(line->file, TCIOFLUSH);
  line_ = std::move(line);
}

SerialPort::Outcome SerialPort::Read(std::vector<unsigned char>& bytes, double seconds)
{
  if (!line_)
    return Outcome::Lost;
  const Clock::time_point end = After(seconds);
  for (;;) {
    unsigned char piece[4096];
    const ssize_t count = read(line_->file, piece, sizeof piece);
    if (count > 0) {
      bytes.insert(bytes.end(), piece, piece + count);
      return Outcome::Done;
    }
    if (count == 0 || (errno != EAGAIN && errno != EINTR))
      break;
    pollfd wait{line_->file, POLLIN, 0};
    const int ready = poll(&wait, 1, MillisecondsUntil(end));
    if (ready == 0)
      return Outcome::Timeout;
    if ((ready < 0 && errno != EINTR) || (ready > 0 && (wait.revents & POLLIN) == 0)) // hung up, and nothing left to read
      break;
  }
  Close();
  return Outcome::Lost;
}

SerialPort::Outcome SerialPort::Write(std::string_view bytes, double seconds)
{
  if (!line_)
    return Outcome::Lost;
  const Clock::time_point end = After(seconds);
  while (!bytes.empty()) {
    const ssize_t count = write(line_->file, bytes.data(), bytes.size());
    if (count > 0) {
      bytes.remove_prefix(static_cast<std::size_t>(count));
      continue;
    }
    if (count < 0 && errno != EAGAIN && errno != EINTR)
      break;
    pollfd wait{line_->file, POLLOUT, 0};
    const int ready = poll(&wait, 1, MillisecondsUntil(end));
    if (ready == 0)
      return Outcome::Timeout;
    if ((ready < 0 && errno != EINTR) || (ready > 0 && (wait.revents & POLLOUT) == 0))
      break;
  }
  if (bytes.empty())
    return Outcome::Done;
  Close();
  return Outcome::Lost;
}

} // namespace echorama
