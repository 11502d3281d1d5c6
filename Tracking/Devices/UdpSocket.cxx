// SPDX-License-Identifier: BSD-3-Clause
#include "Tracking/Devices/UdpSocket.h"
#include "Core/Base/Error.h"
#include <algorithm>
#include <arpa/inet.h>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <fcntl.h>
#include <memory>
#include <netdb.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>
#include <utility>

namespace echorama {
namespace {

[[noreturn]] void Refuse(const std::string& host, int port, const std::string& reason)
{
  throw Error(Error::Kind::FileSystem, "udp://" + host + ":" + std::to_string(port) + ": " + reason);
}

using Addresses = std::unique_ptr<addrinfo, void (*)(addrinfo*)>;

Addresses Resolve(const std::string& host, std::string& reason)
{
  addrinfo hints{};
  hints.ai_family = AF_INET;
  hints.ai_socktype = SOCK_DGRAM;
  addrinfo* found = nullptr;
  const int failed = getaddrinfo(host.c_str(), nullptr, &hints, &found);
  if (failed != 0)
    reason = gai_strerror(failed);
  return Addresses(failed == 0 ? found : nullptr, freeaddrinfo);
}

sockaddr_in AddressOf(const std::string& host, int port)
{
  std::string reason;
  const Addresses found = Resolve(host, reason);
  if (!found)
    Refuse(host, port, reason);
  sockaddr_in address{};
  std::memcpy(&address, found->ai_addr, std::min(sizeof address, static_cast<std::size_t>(found->ai_addrlen)));
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  return address;
}

std::string NumberOf(const sockaddr_in& address)
{
  char text[INET_ADDRSTRLEN] = "";
  inet_ntop(AF_INET, &address.sin_addr, text, sizeof text);
  return text;
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
    Refuse(host, port, std::strerror(errno));
  return made;
}

UdpSocket UdpSocket::SendingTo(const std::string& host, int port)
{
  const sockaddr_in address = AddressOf(host, port);
  UdpSocket made;
  made.descriptor_ = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (!made.IsOpen() || connect(made.descriptor_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0)
    Refuse(host, port, std::strerror(errno));
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
  sender = NumberOf(from);
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

std::vector<std::string> HostNumbers(const std::string& host)
{
  std::string reason;
  const Addresses found = Resolve(host, reason);
  if (!found)
    throw Error(Error::Kind::FileSystem, host + ": " + reason);
  std::vector<std::string> numbers;
  for (const addrinfo* info = found.get(); info; info = info->ai_next) {
    sockaddr_in address{};
    std::memcpy(&address, info->ai_addr, std::min(sizeof address, static_cast<std::size_t>(info->ai_addrlen)));
    if (std::find(numbers.begin(), numbers.end(), NumberOf(address)) == numbers.end())
      numbers.push_back(NumberOf(address));
  }
  return numbers;
}

} // namespace echorama
