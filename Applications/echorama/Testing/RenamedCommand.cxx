// SPDX-License-Identifier: BSD-3-Clause
// A command in the place of noise, for Testing/TestFormerNames.py: parameters that were renamed, and what they were set to.
#include "Applications/echorama/Commands.h"
#include "Applications/echorama/ParameterOptions.h"
#include "Core/Base/FormerNames.h"
#include "Core/Base/ParameterJson.h"
#include <memory>

namespace echorama {
namespace {

struct Sample {
  double lengthMm = 1.5;
  Eigen::Vector3d place = {0.0, 0.0, 0.0};
  bool isFast = false, isSafe = true;
  double spacingMm = 1.0;
};

ParameterList Describe(Sample& r)
{
  return {Formerly(Parameter("LengthMm", r.lengthMm, {0, 10}, "mm", "How long."), "SizeMm", "9.1"),
          Formerly(Parameter("Place", r.place, {-5, 5}, "mm", "Where."), "Position", "9.2"),
          Formerly(Parameter("IsFast", r.isFast, "Whether it runs."), "Quick", "9.3"),
          Formerly(Parameter("IsSafe", r.isSafe, "Whether it is safe."), "Secure", "9.4"),
          Formerly(Parameter("SpacingMm", r.spacingMm, {0, 10}, "mm", "How fine."), "EdgeMm", "9.5")};
}

} // namespace

void EchoramaCommand(CLI::App* options, Action& action)
{
  auto values = std::make_shared<Sample>();
  for (const char* name : {"LengthMm", "Place", "IsFast", "IsSafe"})
    AddParameter(options, Describe(*values), name);
  AddParameter(options, Describe(*values), "SpacingMm", "--spacing");
  action = [values](Session& session) { session.result = JsonOf(Describe(*values)); };
}

} // namespace echorama
