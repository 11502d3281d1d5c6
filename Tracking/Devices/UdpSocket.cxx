// SPDX-License-Identifier: BSD-3-Clause
#include "Tracking/Devices/UdpSocket.h"
#include "Core/Base/Error.h"
#include "Tracking/Devices/HostLookup.h"
#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <fcntl.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>
#include <utility>

namespace echorama {
namespace {

[[noreturn]] void RefuseUdp(const std::string& host, int port, const std::string& reason)
{
  throw Error(Error::Kind::FileSystem, "udp://" + host + ":" + std::to_string(port) + ": " + reason);
}

sockaddr_in AddressOf(const std::string& host, int port)
{
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr = LookUpHost(host, "udp://" + host + ":" + std::to_string(port), 5.0)[0];
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  return address;
}

} // namespace

UdpSocket::UdpSocket(UdpSocket&& other) noexcept : descriptor_(std::exchange(other.descriptor_, -1)) {}

UdpSocket& UdpSocket::operator=(UdpSocket&& other) noexcept
{
  if (this != &other) {
    Close();
    descriptor_ = std::exchange(other.descriptor_, -1);
  }
  return *this;
}

void UdpSocket::Close()
{
  if (descriptor_ >= 0)
    close(descriptor_);
  descriptor_ = -1;
}

UdpSocket UdpSocket::Receiving(const std::string& host, int port)
{
  const sockaddr_in address = AddressOf(host, port);
  UdpSocket made;
  made.descriptor_ = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (!made.IsOpen() || bind(made.descriptor_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0)
    RefuseUdp(host, port, std::strerror(errno));
  return made;
}

UdpSocket UdpSocket::SendingTo(const std::string& host, int port)
{
  const sockaddr_in address = AddressOf(host, port);
  UdpSocket made;
  made.descriptor_ = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (!made.IsOpen() || connect(made.descriptor_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0)
    RefuseUdp(host, port, std::strerror(errno));
  return made;
}

int UdpSocket::Port() const
{
  sockaddr_in address{};
  socklen_t length = sizeof address;
  return getsockname(descriptor_, reinterpret_cast<sockaddr*>(&address), &length) == 0 ? ntohs(address.sin_port) : 0;
}

bool UdpSocket::Receive(std::vector<unsigned char>& bytes, std::string& sender, double seconds)
{
  pollfd wait{descriptor_, POLLIN, 0};
  const int milliseconds = static_cast<int>(std::ceil(1000.0 * std::clamp(seconds, 0.0, 60.0)));
  if (poll(&wait, 1, milliseconds) <= 0)
    return false;
  sockaddr_in from{};
  socklen_t length = sizeof from;
  const ssize_t count = recvfrom(descriptor_, bytes.data(), bytes.size(), 0, reinterpret_cast<sockaddr*>(&from), &length);
  if (count < 0)
    return false;
  bytes.resize(static_cast<std::size_t>(count));
  sender = HostNumber(from.sin_addr);
  return true;
}

bool UdpSocket::Send(const std::vector<unsigned char>& bytes)
{
  // The second try is for an earlier datagram that nobody took: the system tells it with the next.
  for (int attempt = 0; attempt < 2; ++attempt) {
    if (send(descriptor_, bytes.data(), bytes.size(), MSG_NOSIGNAL) == static_cast<ssize_t>(bytes.size()))
      return true;
    if (errno != ECONNREFUSED)
      return false;
  }
  return false;
}

} // namespace echorama
