// SPDX-License-Identifier: BSD-3-Clause
#include "CalibrationRigFile.h"
#include "Core/Base/CsvLine.h"
#include "Core/Base/Error.h"
#include "Core/Base/NumberText.h"
#include "Core/Base/TextFile.h"
#include "Core/Base/Words.h"
#include "Filters/Phantoms/CalibrationRig.h"
#include <algorithm>
#include <sstream>

namespace echorama {

std::vector<RigBall> RigBallsOf(const std::string& rig)
{
  std::vector<RigBall> balls;
  double scale = 0.0;
  if (ParseNumber(rig, scale)) {
    CalibrationRigParameters parameters;
    parameters.scale = scale;
    parameters.Check();
    for (const auto& ball : parameters.balls)
      balls.push_back({ball.name, scale * ball.centre, scale * ball.radius});
    return balls;
  }
  std::istringstream lines(std::string(SkipByteOrderMark(ReadTextFile(rig, 1 << 20))));
  const std::vector<std::string> wanted = {"label", "x", "y", "z", "radius"};
  std::vector<std::size_t> columns;
  int number = 0;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    const auto fail = [&](const std::string& reason) {
      throw Error(Error::Kind::BadFile, rig + ": line " + std::to_string(number) + ": " + reason);
    };
    if (!line.empty() && line.back() == '\r')
      line.pop_back();
    if (line.empty() || line[0] == '#')
      continue;
    std::vector<std::string> cells;
    if (!SplitCsvLine(line, ',', cells))
      fail("a quotation mark is not closed");
    if (columns.empty()) {
      for (const std::string& name : wanted) {
        const auto at = std::find(cells.begin(), cells.end(), name);
        if (at == cells.end())
          fail("the first line must name the columns label, x, y, z and radius; " + name + " is missing");
        columns.push_back(static_cast<std::size_t>(at - cells.begin()));
      }
      continue;
    }
    RigBall ball;
    double values[4];
    for (std::size_t i = 0; i < wanted.size(); ++i) {
      const std::string cell = columns[i] < cells.size() ? cells[columns[i]] : "";
      if (i == 0)
        ball.name = cell;
      else if (!ParseNumber(cell, values[i - 1]))
        fail("\"" + cell + "\" is no number for " + wanted[i]);
    }
    ball.centre = Eigen::Vector3d(values);
    ball.radius = values[3];
    if (!(ball.radius > 0.0))
      fail("the radius must be above 0");
    balls.push_back(ball);
  }
  if (balls.empty())
    throw Error(Error::Kind::BadFile, rig + ": it holds no balls");
  return balls;
}

} // namespace echorama
