// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <cstddef>
#include <string>
#include <vector>

namespace echorama {

/// Datagrams over IPv4, in or out. Owns the descriptor. Nothing blocks for longer than it is told.
class UdpSocket {
public:
  UdpSocket() = default; ///< not open
  ~UdpSocket() { Close(); }
  UdpSocket(UdpSocket&& other) noexcept;
  UdpSocket& operator=(UdpSocket&& other) noexcept;

  /// Receives. \a host: "127.0.0.1" for what this machine sends, "0.0.0.0" for all that can reach it; a name must belong to
  /// this machine. Port 0: any that is free, see Port(). \throws Error(FileSystem) that names host, port and reason.
  static UdpSocket Receiving(const std::string& host, int port);

  /// Sends to a name or number. \throws Error(FileSystem) that names host, port and reason.
  static UdpSocket SendingTo(const std::string& host, int port);

  bool IsOpen() const { return descriptor_ >= 0; }
  void Close();
  int Port() const; ///< our own

  /// Waits for up to \a seconds for a datagram. \returns whether one came. One that is longer than \a bytes was is cut to that,
  /// so that its size, unless \a bytes is as long as any that is expected and one byte more, says nothing.
  bool Receive(std::vector<unsigned char>& bytes, std::string& sender, double seconds);

  /// \returns whether the system took it; that anybody receives it is not said by that.
  bool Send(const std::vector<unsigned char>& bytes);

private:
  int descriptor_ = -1;
};

} // namespace echorama
