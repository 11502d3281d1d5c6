// SPDX-License-Identifier: BSD-3-Clause
// All sockets are non-blocking; waiting is done by poll alone, in slices of a tenth of a second where someone may want to
// stop.
#include "Tracking/Devices/TcpSocket.h"
#include "Core/Base/Error.h"
#include "Tracking/Devices/HostLookup.h"
#include "Tracking/Stream/Clock.h"
#include <algorithm>
#include <arpa/inet.h>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstring>
#include <fcntl.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/uio.h>
#include <system_error>
#include <unistd.h>

namespace echorama {
namespace {

constexpr double PollSeconds = 0.1; // s

std::string Reason(int error)
{
  return std::generic_category().message(error);
}

[[noreturn]] void Refuse(const std::string& place, const std::string& reason)
{
  throw Error(Error::Kind::FileSystem, place + ": " + reason);
}

sockaddr_in AddressOf(const in_addr& host, int port)
{
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  address.sin_addr = host;
  return address;
}

int NewSocket(const std::string& place)
{
  const int descriptor = socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  if (descriptor < 0)
    Refuse(place, Reason(errno));
  return descriptor;
}

void Set(int descriptor, int level, int option, int value)
{
  setsockopt(descriptor, level, option, &value, sizeof value); // what the system does not know is not needed
}

void Tune(int descriptor)
{
  Set(descriptor, IPPROTO_TCP, TCP_NODELAY, 1);
  Set(descriptor, SOL_SOCKET, SO_KEEPALIVE, 1);
  Set(descriptor, IPPROTO_TCP, TCP_KEEPIDLE, 5);
  Set(descriptor, IPPROTO_TCP, TCP_KEEPINTVL, 2);
  Set(descriptor, IPPROTO_TCP, TCP_KEEPCNT, 3);
}

int Poll(std::vector<pollfd>& descriptors, double seconds)
{
  timespec wait{};
  wait.tv_sec = static_cast<time_t>(seconds);
  wait.tv_nsec = static_cast<long>((seconds - std::floor(seconds)) * 1e9);
  return ppoll(descriptors.data(), descriptors.size(), &wait, nullptr); // an interrupted wait is a short one
}

bool Again(int error)
{
  return error == EAGAIN || error == EWOULDBLOCK || error == EINTR;
}

} // namespace

TcpSocket::TcpSocket(TcpSocket&& other) noexcept
  : descriptor_(other.descriptor_), peer_(std::move(other.peer_)), end_(std::move(other.end_))
{
  other.descriptor_ = -1;
}

TcpSocket& TcpSocket::operator=(TcpSocket&& other) noexcept
{
  std::swap(descriptor_, other.descriptor_);
  std::swap(peer_, other.peer_);
  std::swap(end_, other.end_);
  return *this;
}

void TcpSocket::Close()
{
  if (descriptor_ >= 0)
    close(descriptor_);
  descriptor_ = -1;
}

TcpSocket TcpSocket::Connect(const std::string& host, int port, double seconds, const Stopped& stopped)
{
  const std::string place = host + ":" + std::to_string(port);
  const double until = ClockNow() + seconds;
  const auto hosts = LookUpHost(host, place, seconds, stopped);
  TcpSocket result;
  if (hosts.empty())
    return result;
  const sockaddr_in address = AddressOf(hosts[0], port);
  result.descriptor_ = NewSocket(place);
  result.peer_ = place;
  Tune(result.descriptor_);
  if (connect(result.descriptor_, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0)
    return result;
  if (errno != EINPROGRESS && errno != EINTR)
    Refuse(place, Reason(errno));
  while (true) {
    std::vector<pollfd> waiting{{result.descriptor_, POLLOUT, 0}};
    if (Poll(waiting, PollSeconds) > 0)
      break;
    if (stopped && stopped())
      return {};
    if (ClockNow() > until)
      Refuse(place, "no answer within " + std::to_string(static_cast<int>(std::ceil(seconds))) + " s");
  }
  int error = 0;
  socklen_t size = sizeof error;
  getsockopt(result.descriptor_, SOL_SOCKET, SO_ERROR, &error, &size);
  if (error != 0)
    Refuse(place, Reason(error));
  return result;
}

TcpSocket TcpSocket::Listen(const std::string& host, int port)
{
  const std::string place = host + ":" + std::to_string(port);
  const sockaddr_in address = AddressOf(LookUpHost(host, place, 5.0)[0], port);
  TcpSocket result;
  result.descriptor_ = NewSocket(place);
  result.peer_ = place;
  Set(result.descriptor_, SOL_SOCKET, SO_REUSEADDR, 1);
  if (bind(result.descriptor_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 ||
      listen(result.descriptor_, 16) != 0)
    Refuse(place, Reason(errno));
  return result;
}

TcpSocket TcpSocket::Accept() const
{
  TcpSocket result;
  sockaddr_in address{};
  socklen_t size = sizeof address;
  result.descriptor_ = accept4(descriptor_, reinterpret_cast<sockaddr*>(&address), &size, SOCK_NONBLOCK | SOCK_CLOEXEC);
  if (result.IsOpen()) {
    Tune(result.descriptor_);
    result.peer_ = HostNumber(address.sin_addr) + ":" + std::to_string(ntohs(address.sin_port));
  } else if (!Again(errno)) {
    result.end_ = Reason(errno);
  }
  return result;
}

int TcpSocket::Port() const
{
  sockaddr_in address{};
  socklen_t size = sizeof address;
  return getsockname(descriptor_, reinterpret_cast<sockaddr*>(&address), &size) == 0 ? ntohs(address.sin_port) : 0;
}

std::optional<std::size_t> TcpSocket::Receive(unsigned char* bytes, std::size_t size)
{
  const ssize_t got = recv(descriptor_, bytes, size, 0);
  if (got > 0)
    return static_cast<std::size_t>(got);
  if (got < 0 && Again(errno))
    return 0;
  end_ = got == 0 ? "closed by the peer" : Reason(errno);
  return {};
}

std::optional<std::size_t> TcpSocket::Send(const std::vector<Piece>& pieces)
{
  std::vector<iovec> vectors;
  vectors.reserve(pieces.size());
  for (const Piece& piece : pieces)
    vectors.push_back({const_cast<unsigned char*>(piece.bytes), piece.size}); // it is only read
  msghdr message{};
  message.msg_iov = vectors.data();
  message.msg_iovlen = vectors.size();
  const ssize_t gone = sendmsg(descriptor_, &message, MSG_NOSIGNAL);
  if (gone >= 0)
    return static_cast<std::size_t>(gone);
  if (Again(errno))
    return 0;
  end_ = Reason(errno);
  return {};
}

void WaitForSockets(const std::vector<const TcpSocket*>& reading, const std::vector<const TcpSocket*>& writing, double seconds)
{
  std::vector<pollfd> descriptors;
  descriptors.reserve(reading.size() + writing.size());
  for (const TcpSocket* socket : reading)
    descriptors.push_back({socket->Descriptor(), POLLIN, 0});
  for (const TcpSocket* socket : writing)
    descriptors.push_back({socket->Descriptor(), POLLOUT, 0});
  Poll(descriptors, seconds);
}

void SendQueue::Push(Bytes message)
{
  bytes_ += message->size();
  waiting_.push_back(std::move(message));
  while (bytes_ > bound_ && waiting_.size() > 1) { // one message always has room
    bytes_ -= waiting_.front()->size();
    waiting_.pop_front();
    ++dropped_;
  }
}

void SendQueue::PushNewest(const std::string& name, Bytes message)
{
  for (auto& [other, older] : newest_) {
    if (other == name) {
      older = std::move(message);
      ++dropped_;
      return;
    }
  }
  if (newest_.size() >= names_) { // a peer that does not read must not fill the memory by names
    newest_.pop_front();
    ++dropped_;
  }
  newest_.emplace_back(name, std::move(message));
}

void SendQueue::Begin()
{
  offset_ = 0;
  begun_.reset();
  if (!waiting_.empty()) {
    begun_ = std::move(waiting_.front());
    waiting_.pop_front();
    bytes_ -= begun_->size();
  } else if (!newest_.empty()) {
    begun_ = std::move(newest_.front().second);
    newest_.pop_front();
  }
}

bool SendQueue::Flush(TcpSocket& socket)
{
  constexpr std::size_t Together = 64; // messages in one call: they leave together, and wake their reader once
  if (!begun_)
    Begin();
  while (begun_) {
    std::vector<TcpSocket::Piece> pieces{{begun_->data() + offset_, begun_->size() - offset_}};
    for (std::size_t i = 0; i < std::min(Together, waiting_.size()); ++i)
      pieces.push_back({waiting_[i]->data(), waiting_[i]->size()});
    const auto gone = socket.Send(pieces);
    if (!gone)
      return false;
    if (*gone == 0)
      return true; // it takes no more now
    std::size_t left = *gone;
    while (begun_ && left >= begun_->size() - offset_) {
      left -= begun_->size() - offset_;
      ++sent_;
      Begin();
    }
    offset_ += left;
  }
  return true;
}

} // namespace echorama
