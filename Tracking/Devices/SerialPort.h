// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <cstddef>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace echorama {

/// A serial line: bytes in and out, nothing interpreted. 8 data bits, no parity, one stop bit, no handshake. One program at a
/// time has it. Not for use by several threads at once.
class SerialPort {
public:
  /// \a path as in /dev/ttyUSB0; links are followed each time it is opened. \throws Error(InvalidParameter) for a speed that
  /// the system does not have; see Speeds().
  SerialPort(std::string path, int baud);
  ~SerialPort(); ///< closes it
  SerialPort(const SerialPort&) = delete;
  SerialPort& operator=(const SerialPort&) = delete;

  static const std::vector<int>& Speeds(); ///< bits per second, rising

  /// Opens and sets the line up; what lay in it is dropped. Does nothing when it is open.
  /// \throws Error(FileSystem) that says what is the matter: not there, no permission, in use, no serial line.
  void Open();
  bool IsOpen() const;
  /// Gives the line back as it was, once the last bytes are out; those that the device does not take within 50 ms are dropped.
  /// Does nothing when it is closed.
  void Close();

  /// What a call came to.
  enum class Outcome {
    Done,    ///< bytes came, or all went out
    Timeout, ///< nothing came, or not all went out in time
    Lost     ///< the device is gone, and the line is closed
  };

  /// Waits for up to \a seconds until there are bytes, and appends those that are there to \a bytes.
  Outcome Read(std::vector<unsigned char>& bytes, double seconds);
  /// Writes all of \a bytes, unless that takes longer than \a seconds.
  Outcome Write(std::string_view bytes, double seconds);

  const std::string& Path() const { return path_; }

private:
  struct Line;
  std::string path_;
  int baud_ = 0;
  std::unique_ptr<Line> line_;
};

} // namespace echorama
