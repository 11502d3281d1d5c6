// SPDX-License-Identifier: BSD-3-Clause
#include "BodySet.h"
#include <algorithm>

namespace echorama {

bool BodySet::Contains(std::int32_t shell) const
{
  return std::binary_search(begin(), end(), shell);
}

void BodySet::Insert(std::int32_t shell)
{
  const auto place = std::lower_bound(begin(), end(), shell) - begin();
  if (place < count_ && begin()[place] == shell)
    return;
  if (count_ < few) {
    std::copy_backward(few_.begin() + place, few_.begin() + count_, few_.begin() + count_ + 1);
    few_[static_cast<std::size_t>(place)] = shell;
  } else {
    if (count_ == few)
      many_.assign(few_.begin(), few_.end());
    many_.insert(many_.begin() + place, shell);
  }
  ++count_;
}

void BodySet::Erase(std::int32_t shell)
{
  const auto place = std::lower_bound(begin(), end(), shell) - begin();
  if (place == count_ || begin()[place] != shell)
    return;
  if (count_ <= few) {
    std::copy(few_.begin() + place + 1, few_.begin() + count_, few_.begin() + place);
  } else {
    many_.erase(many_.begin() + place);
    if (count_ - 1 == few) {
      std::copy(many_.begin(), many_.end(), few_.begin());
      many_.clear();
    }
  }
  --count_;
}

bool BodySet::operator==(const BodySet& other) const
{
  return count_ == other.count_ && std::equal(begin(), end(), other.begin());
}

} // namespace echorama
