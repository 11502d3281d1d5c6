// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Core/Base/Worker.h"
#include "PseudoTerminal.h"
#include "Tracking/Devices/SerialPort.h"
#include "Tracking/Stream/Clock.h"
#include <cstring>
#include <fstream>
#include <gtest/gtest.h>

using namespace echorama;
using Outcome = SerialPort::Outcome;

namespace {

void ExpectRefused(SerialPort& port, const std::string& words)
{
  try {
    port.Open();
    ADD_FAILURE() << "opened " << port.Path();
  } catch (const Error& error) {
    EXPECT_EQ(error.GetKind(), Error::Kind::FileSystem);
    EXPECT_NE(std::string(error.what()).find(port.Path()), std::string::npos) << error.what();
    EXPECT_NE(std::string(error.what()).find(words), std::string::npos) << error.what();
  }
  EXPECT_FALSE(port.IsOpen());
}

TEST(SerialPort, EveryByteGoesThroughUnchanged)
{
  PseudoTerminal line;
  SerialPort port(line.Path(), 115200);
  port.Open();
  std::string all;
  for (int i = 0; i < 256; ++i)
    all += static_cast<char>(i);
  ASSERT_EQ(port.Write(all, 1.0), Outcome::Done);
  std::string out(256, 'x');
  ASSERT_EQ(read(line.Master(), out.data(), out.size()), 256);
  EXPECT_EQ(out, all);

  ASSERT_EQ(write(line.Master(), all.data(), all.size()), 256);
  std::vector<unsigned char> in;
  while (in.size() < 256 && port.Read(in, 1.0) == Outcome::Done) {
  }
  EXPECT_EQ(std::string(in.begin(), in.end()), all);
}

TEST(SerialPort, WaitsNoLongerThanAsked)
{
  PseudoTerminal line;
  SerialPort port(line.Path(), 9600);
  port.Open();
  std::vector<unsigned char> bytes;
  const double begin = ClockNow();
  EXPECT_EQ(port.Read(bytes, 0.02), Outcome::Timeout);
  EXPECT_GE(ClockNow() - begin, 0.019);
  EXPECT_LT(ClockNow() - begin, 30.0);
  EXPECT_TRUE(port.IsOpen());
  EXPECT_EQ(port.Write(std::string(1 << 20, 'x'), 0.02), Outcome::Timeout); // nobody takes them
  EXPECT_TRUE(port.IsOpen());
}

TEST(SerialPort, TheLastBytesGoOutBeforeItCloses)
{
  PseudoTerminal line;
  for (int i = 0; i < 100; ++i) {
    SerialPort port(line.Path(), 115200);
    port.Open();
    ASSERT_EQ(port.Write("P", 1.0), Outcome::Done);
    port.Close();
    char byte = 0;
    ASSERT_EQ(read(line.Master(), &byte, 1), 1);
    EXPECT_EQ(byte, 'P');
  }
}

TEST(SerialPort, UnpluggedIsLostAndComesBack)
{
  PseudoTerminal line;
  SerialPort port(line.Path(), 115200);
  port.Open();
  ASSERT_EQ(write(line.Master(), "last", 4), 4);
  std::vector<unsigned char> bytes;
  ASSERT_EQ(port.Read(bytes, 1.0), Outcome::Done);
  line.Unplug();
  EXPECT_EQ(port.Read(bytes, 1.0), Outcome::Lost);
  EXPECT_FALSE(port.IsOpen());
  EXPECT_EQ(port.Read(bytes, 1.0), Outcome::Lost);
  EXPECT_EQ(port.Write("x", 1.0), Outcome::Lost);
  ExpectRefused(port, "no such device");
  line.Plug();
  port.Open();
  ASSERT_EQ(write(line.Master(), "new", 3), 3);
  bytes.clear();
  EXPECT_EQ(port.Read(bytes, 1.0), Outcome::Done);
  EXPECT_EQ(std::string(bytes.begin(), bytes.end()), "new");
}

TEST(SerialPort, UnpluggedWhileItWaits)
{
  PseudoTerminal line;
  SerialPort port(line.Path(), 115200);
  port.Open();
  Worker hand;
  hand.Start([&line](const Worker::Signal& signal) {
    signal.Sleep(0.05);
    line.Unplug();
  });
  std::vector<unsigned char> bytes;
  EXPECT_EQ(port.Read(bytes, 30.0), Outcome::Lost);
}

TEST(SerialPort, OneProgramAtATime)
{
  PseudoTerminal line;
  SerialPort first(line.Path(), 115200), second(line.Path(), 115200);
  first.Open();
  ExpectRefused(second, "another program");
  first.Close();
  second.Open();
  EXPECT_TRUE(second.IsOpen());
}

TEST(SerialPort, GivesTheLineBackAsItWas)
{
  PseudoTerminal line;
  const int other = open(line.Path().c_str(), O_RDWR | O_NOCTTY);
  ASSERT_GE(other, 0);
  termios before{}, after{};
  tcgetattr(other, &before);
  before.c_lflag |= ECHO;
  tcsetattr(other, TCSANOW, &before);
  tcgetattr(other, &before);
  {
    SerialPort port(line.Path(), 19200);
    port.Open();
    termios during{};
    tcgetattr(other, &during);
    EXPECT_EQ(during.c_lflag & ECHO, 0u);
    EXPECT_EQ(cfgetospeed(&during), static_cast<speed_t>(B19200));
  }
  tcgetattr(other, &after);
  EXPECT_EQ(std::memcmp(&before, &after, sizeof before), 0);
  close(other);
}

TEST(SerialPort, SaysWhatIsTheMatter)
{
  SerialPort none("/dev/echorama-has-no-such-line", 115200);
  ExpectRefused(none, "no such device");
  const std::string path = std::filesystem::temp_directory_path() / ("echorama-file-" + std::to_string(getpid()));
  std::ofstream(path) << "text";
  SerialPort file(path, 115200);
  ExpectRefused(file, "no serial line");
  if (geteuid() != 0) { // root may open everything
    std::filesystem::permissions(path, std::filesystem::perms::none);
    ExpectRefused(file, "dialout");
  }
  std::filesystem::remove(path);
  EXPECT_THROW(SerialPort("/dev/null", 12345), Error);
}

} // namespace
