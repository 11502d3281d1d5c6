// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "AlignPair.h"
#include "Core/Base/ElapsedTime.h"
#include "Core/Sharing/Packing.h"
#include <map>
#include <optional>

namespace echorama {

/// Pairs that were aligned before, in a file, so that a run that was stopped goes on where it was.
///
/// A pair is known again by its key: all that its answer depends on. The file is replaced as a whole, every few seconds (a
/// large one less often, at least every five minutes) and at the end; what a crash leaves is the file as it was then.
class FinishedPairs {
public:
  /// Reads \a path if it is there. Empty: no file, and nothing is remembered.
  /// \throws Error(BadFile) that names a file that is something else or damaged: it is neither used nor replaced;
  /// Error(FileSystem) when it cannot be read
  explicit FinishedPairs(std::string path);
  /// Writes what has not been written yet, as far as that is possible.
  ~FinishedPairs();
  FinishedPairs(const FinishedPairs&) = delete;
  FinishedPairs& operator=(const FinishedPairs&) = delete;

  /// Of two volumes with these contents (VolumeOnDemand) at these poses, for this version of Echorama. Empty, and then nothing is
  /// remembered, without a file or where a content is not known.
  std::string KeyOf(const PlacedVolume& fixed, const std::string& fixedContent, const PlacedVolume& moving,
                    const std::string& movingContent, const AlignPairParameters& parameters) const;

  std::optional<PairAlignment> Find(const std::string& key) const;
  /// \throws Error(FileSystem) when it is time to write, and that fails
  void Add(const std::string& key, const PairAlignment& found);
  void Write();

  bool Empty() const { return pairs_.empty(); }

private:
  const std::string path_;
  std::map<std::string, PairAlignment> pairs_;
  bool isChanged_ = false;
  Clock::time_point written_ = Clock::now();
  double secondsToWrite_ = 0.0; // the last time
};

/// A pair as another rank is told of it, to the last bit.
void Pack(Packed& to, const PairAlignment& pair);
void Unpack(Unpacked& from, PairAlignment& pair);

} // namespace echorama
