// SPDX-License-Identifier: BSD-3-Clause
// A binary tree over the boxes, halved at the median of their centres along the longest axis. It is asked once for each box, and
// tells of those that come after it.
#include "BoxTree.h"
#include "Index.h"
#include <algorithm>
#include <cmath>
#include <numeric>

namespace echorama {
namespace {

class Tree {
public:
  explicit Tree(const std::vector<Eigen::AlignedBox3d>& boxes) : boxes_(boxes)
  {
    for (std::size_t i = 0; i < boxes.size(); ++i)
      if (!boxes[i].isEmpty())
        order_.push_back(static_cast<int>(i));
    if (!order_.empty())
      Grow(0, order_.size());
  }

  /// Calls found(other) for each box that meets it.
  template <class Found>
  void Ask(const Eigen::AlignedBox3d& box, const Found& found) const
  {
    if (!nodes_.empty())
      Ask(0, box, found);
  }

private:
  static constexpr std::size_t LeafSize = 4;
  struct Node {
    Eigen::AlignedBox3d box;
    std::size_t first, end; // of a leaf's boxes, in order_
    std::size_t far = 0;    // its second child; the first follows it; 0: a leaf
  };

  void Grow(std::size_t first, std::size_t end)
  {
    const std::size_t self = nodes_.size();
    nodes_.push_back({Eigen::AlignedBox3d(), first, end});
    Eigen::AlignedBox3d centres;
    for (std::size_t i = first; i < end; ++i) {
      nodes_[self].box.extend(boxes_[Index(order_[i])]);
      centres.extend(boxes_[Index(order_[i])].center());
    }
    if (end - first <= LeafSize)
      return;
    int axis = 0;
    centres.sizes().maxCoeff(&axis);
    const auto begin = order_.begin() + static_cast<std::ptrdiff_t>(first);
    const std::size_t middle = first + (end - first) / 2;
    std::nth_element(begin, order_.begin() + static_cast<std::ptrdiff_t>(middle),
                     order_.begin() + static_cast<std::ptrdiff_t>(end),
                     [&](int a, int b) { return boxes_[Index(a)].center()[axis] < boxes_[Index(b)].center()[axis]; });
    Grow(first, middle);
    nodes_[self].far = nodes_.size();
    Grow(middle, end);
  }

  template <class Found>
  void Ask(std::size_t self, const Eigen::AlignedBox3d& box, const Found& found) const
  {
    const Node& node = nodes_[self];
    if (!node.box.intersects(box))
      return;
    if (node.far == 0) {
      for (std::size_t i = node.first; i < node.end; ++i)
        if (boxes_[Index(order_[i])].intersects(box))
          found(order_[i]);
      return;
    }
    Ask(self + 1, box, found);
    Ask(node.far, box, found);
  }

  const std::vector<Eigen::AlignedBox3d>& boxes_;
  std::vector<int> order_;
  std::vector<Node> nodes_;
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
  const Tree tree(boxes);
  std::vector<std::pair<int, int>> pairs;
  for (std::size_t a = 0; a < boxes.size(); ++a) {
    const auto begin = static_cast<std::ptrdiff_t>(pairs.size());
    if (!boxes[a].isEmpty())
      tree.Ask(boxes[a], [&](int b) {
        if (Index(b) > a)
          pairs.emplace_back(static_cast<int>(a), b);
      });
    std::sort(pairs.begin() + begin, pairs.end());
  }
  return pairs;
}

} // namespace echorama
