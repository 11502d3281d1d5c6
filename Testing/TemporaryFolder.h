// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Error.h"
#include <csignal>
#include <filesystem>
#include <fstream>
#include <gtest/gtest.h>
#include <sstream>
#include <string>
#include <sys/resource.h>
#include <unistd.h>

namespace echorama::testing {

/// A test with a folder of its own, which is removed afterwards.
class TemporaryFolder : public ::testing::Test {
protected:
  void SetUp() override
  {
    folder =
        std::filesystem::temp_directory_path() /
        (std::string("echorama-") + ::testing::UnitTest::GetInstance()->current_test_info()->name() + std::to_string(getpid()));
    std::filesystem::create_directories(folder);
  }
  void TearDown() override { std::filesystem::remove_all(folder); }

  std::string Path(const std::string& name) const { return (folder / name).string(); }

  std::string Put(const std::string& name, const std::string& content) const
  {
    std::ofstream(Path(name), std::ios::binary) << content;
    return Path(name);
  }

  int FileCount() const
  {
    int count = 0;
    for (const auto& entry : std::filesystem::directory_iterator(folder))
      count += entry.is_regular_file();
    return count;
  }

  std::filesystem::path folder;
};

/// Expects an Error of \a kind whose message holds \a path and \a words.
template <class Function>
void ExpectRefused(const Function& function, Error::Kind kind, const std::string& path, const std::string& words)
{
  try {
    function();
    ADD_FAILURE() << "accepted: " << path << " (expected: " << words << ")";
  } catch (const Error& error) {
    const std::string message = error.what();
    EXPECT_EQ(error.GetKind(), kind) << message;
    EXPECT_NE(message.find(path), std::string::npos) << message;
    EXPECT_NE(message.find(words), std::string::npos) << message << " lacks \"" << words << "\"";
  }
}

/// While it lives, no file of this process grows beyond \a bytes: a disk that is full.
class FullDisk {
public:
  explicit FullDisk(rlim_t bytes) : handler_(std::signal(SIGXFSZ, SIG_IGN))
  {
    getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit small{bytes, before_.rlim_max};
    setrlimit(RLIMIT_FSIZE, &small);
  }
  ~FullDisk()
  {
    setrlimit(RLIMIT_FSIZE, &before_);
    std::signal(SIGXFSZ, handler_);
  }

private:
  rlimit before_{};
  void (*handler_)(int);
};

} // namespace echorama::testing
