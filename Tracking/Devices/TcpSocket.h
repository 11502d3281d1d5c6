// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace echorama {

/// A TCP connection over IPv4, or a place where others connect. Owns the descriptor. Nothing blocks for longer than it is
/// told; small messages leave at once (TCP_NODELAY); a peer that has gone raises no signal. That the cable of a
/// peer who was sending has been pulled is noticed within some ten seconds (keep-alive).
class TcpSocket {
public:
  /// Asked ten times a second while waiting; true ends the wait.
  using Stopped = std::function<bool()>;

  TcpSocket() = default; ///< not open
  ~TcpSocket() { Close(); }
  TcpSocket(TcpSocket&& other) noexcept;
  TcpSocket& operator=(TcpSocket&& other) noexcept;

  /// Connects to a name or number. \returns a socket that is not open when \a stopped said so.
  /// \throws Error(FileSystem) that names host, port and reason when that fails, or takes longer than \a seconds.
  static TcpSocket Connect(const std::string& host, int port, double seconds, const Stopped& stopped);

  /// Listens. \a host: "127.0.0.1" for this machine alone, "0.0.0.0" for all that can reach it; a name must belong to this
  /// machine. Port 0: any that is free, see Port(). \throws Error(FileSystem) that names host, port and reason.
  static TcpSocket Listen(const std::string& host, int port);

  /// Of a listening socket: the next that has connected; not open when there is none. Never waits. When there may be one
  /// that cannot be taken, for want of descriptors, say, EndReason() of what is returned tells; it still counts as to be read.
  TcpSocket Accept() const;

  bool IsOpen() const { return descriptor_ >= 0; }
  void Close();
  int Descriptor() const { return descriptor_; }    ///< for WaitForSockets
  int Port() const;                                 ///< our own
  const std::string& Peer() const { return peer_; } ///< "192.168.0.3:40112", or what was asked for

  /// Takes what is there, without waiting: up to \a size bytes, 0 when there is nothing yet.
  /// \returns nothing when the connection has ended; why() says how.
  std::optional<std::size_t> Receive(unsigned char* bytes, std::size_t size);

  /// Bytes that lie elsewhere.
  struct Piece {
    const unsigned char* bytes = nullptr;
    std::size_t size = 0;
  };
  /// Gives what the system takes of the pieces, one after the other, without waiting. \returns how many bytes; nothing when the
  /// connection has ended.
  std::optional<std::size_t> Send(const std::vector<Piece>& pieces);

  /// How the connection ended: "closed by the peer", "connection reset by peer" ...
  const std::string& EndReason() const { return end_; }

private:
  int descriptor_ = -1;
  std::string peer_, end_;
};

/// Waits for up to \a seconds until one of the sockets has something to read (or has ended), or one of \a writing takes more.
void WaitForSockets(const std::vector<const TcpSocket*>& reading, const std::vector<const TcpSocket*>& writing, double seconds);

/// What waits to be sent to one peer. Bounded: when a peer does not read, the oldest messages that have not begun are dropped,
/// always whole ones. Messages are shared between peers, not copied.
class SendQueue {
public:
  using Bytes = std::shared_ptr<const std::vector<unsigned char>>;

  /// \param bound bytes of what waits in turn. \param names of which the newest is kept; one more costs the oldest.
  explicit SendQueue(std::size_t bound = std::size_t{1} << 20, std::size_t names = 64) : bound_(bound), names_(names) {}

  /// In turn, within the bound.
  void Push(Bytes message);
  /// Outside the bound in bytes and behind all others: large things, of which only the newest of each name is worth sending.
  void PushNewest(const std::string& name, Bytes message);

  /// Sends what the socket takes now. \returns false when the connection has ended.
  bool Flush(TcpSocket& socket);
  bool Empty() const { return !begun_ && waiting_.empty() && newest_.empty(); }
  std::uint64_t Sent() const { return sent_; }       ///< messages that went out whole
  std::uint64_t Dropped() const { return dropped_; } ///< messages that did not go out

private:
  void Begin(); // the next, if there is one

  std::size_t bound_, names_, bytes_ = 0; // of what waits
  Bytes begun_;                           // must be finished, whatever else is dropped
  std::size_t offset_ = 0;                // how much of it has gone
  std::deque<Bytes> waiting_;
  std::deque<std::pair<std::string, Bytes>> newest_;
  std::uint64_t sent_ = 0, dropped_ = 0;
};

} // namespace echorama
