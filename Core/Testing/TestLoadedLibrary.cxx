// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Error.h"
#include "Core/Base/LoadedLibrary.h"
#include "Testing/TemporaryFolder.h"
#include <filesystem>
#include <gtest/gtest.h>

using namespace echorama;
using namespace echorama::testing;

namespace {

class LoadedLibrary : public TemporaryFolder {};

std::string ReasonFor(const std::string& library, const std::string& name)
{
  try {
    LoadedAddress(library, name, "scan.vdb");
  } catch (const Error& error) {
    EXPECT_EQ(error.GetKind(), Error::Kind::NotPossible);
    return error.what();
  }
  return "it was loaded";
}

TEST_F(LoadedLibrary, IsFoundWhereTheSystemLooks)
{
  const auto absolute = LoadedFunction<int(int)>("libc.so.6", "abs", "absolute");
  EXPECT_EQ(absolute(-7), 7);
}

TEST_F(LoadedLibrary, MissingIsNamedWithWhatNeedsIt)
{
  const std::string reason = ReasonFor("libEchoramaNone.so", "EchoramaNone");
  EXPECT_EQ(reason.rfind("scan.vdb: ", 0), 0u) << reason;
  EXPECT_NE(reason.find("libEchoramaNone.so"), std::string::npos) << reason;
  EXPECT_NE(reason.find("install"), std::string::npos) << reason;
}

TEST_F(LoadedLibrary, DamagedIsRefused)
{
  const std::string path = Path("libEchoramaEmpty.so");
  std::ofstream(path) << "no library";
  EXPECT_NE(ReasonFor(path, "EchoramaNone").find(path), std::string::npos);
}

TEST_F(LoadedLibrary, OfAnotherVersionIsRefused)
{
  const std::string reason = ReasonFor("libEchoramaCoreKernels.so", "EchoramaNone"); // it is there, the function is not
  EXPECT_NE(reason.find("another version"), std::string::npos) << reason;
  EXPECT_NE(reason.find("libEchoramaCoreKernels.so"), std::string::npos) << reason;
}

} // namespace
