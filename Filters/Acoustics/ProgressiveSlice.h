// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "ScattererCache.h"
#include "Synthesize.h"

namespace echorama {

/// One plane of a scene by the acoustic model, live: a coarse picture while the probe moves, made better while it rests. What
/// does not depend on the pose is kept: the scene, and the scatterers that were made so far.
///
/// Each level is a whole picture of the same tissue and of the same speckle. 0: a quarter of the beams (those between are
/// interpolated, grey by grey), and nothing but the direct way of sound; 1: half of the beams; 2: all of them; 3, the last: with
/// reflected ways as well, the picture that SynthesizeBeams makes, to the last bit.
///
/// The scene must outlive it and stay as it is. Not thread safe; Make itself uses all threads.
class ProgressiveSlice {
public:
  static constexpr int levels = 4;

  /// \param maxBytes for scatterers: those of the last picture, and of those before while there is room
  explicit ProgressiveSlice(const AcousticScene& scene, double maxBytes = 1e9) : scene_(scene), cache_(maxBytes) {}

  /// What a level is made with. \throws Error(InvalidParameter) for a level that there is not
  static SynthesisParameters ParametersOf(const SynthesisParameters& full, int level);

  /// The plane on the beams of \a full, as SynthesizeBeams: samples x elements x 1.
  /// \throws as SynthesizeBeams; Error(InvalidParameter) for a level that there is not, a probe that sweeps and the mode Counting
  Volume<unsigned char> Make(const SynthesisParameters& full, int level, const Progress& progress = {},
                             SynthesisCost* cost = nullptr);

  std::size_t MemoryBytes() const { return cache_.Bytes(); } ///< of scatterers

private:
  const AcousticScene& scene_;
  ScattererCache cache_;
};

} // namespace echorama
