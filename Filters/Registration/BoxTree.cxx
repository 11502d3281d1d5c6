// SPDX-License-Identifier: BSD-3-Clause
#include "BoxTree.h"
#include "Index.h"
#include <algorithm>
#include <cmath>
#include <unsupported/Eigen/BVH>

namespace echorama {
namespace {

// What the tree is asked: the boxes after one that meet it.
struct After {
  const std::vector<Eigen::AlignedBox3d>& boxes;
  int number;
  std::vector<int> found = {};
  bool intersectVolume(const Eigen::AlignedBox3d& node) const { return node.intersects(boxes[Index(number)]); }
  bool intersectObject(int other)
  {
    if (other > number && boxes[Index(other)].intersects(boxes[Index(number)]))
      found.push_back(other);
    return false; // there may be more
  }
};

} // namespace

Eigen::AlignedBox3d TurnedBox::Bounds() const
{
  const Eigen::Vector3d reach = axes.cwiseAbs() * half;
  return {centre - reach, centre + reach};
}

// Of two boxes that are apart, a face of one or a plane along an edge of each lies between them (Gottschalk 1996). The slack
// keeps edges that are parallel from deciding by rounding.
bool Meet(const TurnedBox& a, const TurnedBox& b)
{
  constexpr double Slack = 1e-9;
  const Eigen::Matrix3d turn = a.axes.transpose() * b.axes, size = turn.cwiseAbs().array() + Slack;
  const Eigen::Vector3d way = a.axes.transpose() * (b.centre - a.centre);
  for (int i = 0; i < 3; ++i)
    if (std::fabs(way[i]) > a.half[i] + size.row(i).dot(b.half))
      return false;
  for (int j = 0; j < 3; ++j)
    if (std::fabs(way.dot(turn.col(j))) > b.half[j] + size.col(j).dot(a.half))
      return false;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      const int i1 = (i + 1) % 3, i2 = (i + 2) % 3, j1 = (j + 1) % 3, j2 = (j + 2) % 3;
      if (std::fabs(way[i2] * turn(i1, j) - way[i1] * turn(i2, j)) >
          a.half[i1] * size(i2, j) + a.half[i2] * size(i1, j) + b.half[j1] * size(i, j2) + b.half[j2] * size(i, j1))
        return false;
    }
  return true;
}

std::vector<std::pair<int, int>> PairsThatMeet(const std::vector<Eigen::AlignedBox3d>& boxes)
{
  std::vector<int> numbers;
  std::vector<Eigen::AlignedBox3d> filled;
  for (std::size_t i = 0; i < boxes.size(); ++i)
    if (!boxes[i].isEmpty()) {
      numbers.push_back(static_cast<int>(i));
      filled.push_back(boxes[i]);
    }
  const Eigen::KdBVH<double, 3, int> tree(numbers.begin(), numbers.end(), filled.begin(), filled.end());
  std::vector<std::pair<int, int>> pairs;
  for (const int a : numbers) {
    After after{boxes, a};
    Eigen::BVIntersect(tree, after);
    std::sort(after.found.begin(), after.found.end());
    for (const int b : after.found)
      pairs.emplace_back(a, b);
  }
  return pairs;
}

} // namespace echorama
