// SPDX-License-Identifier: BSD-3-Clause
// Scatterers are most of the work of a single plane, and a probe that moves by a millimetre meets almost the same ones: so they
// are cached. Then the sum of echoes counts, which goes with the beams. Fewer scatterers would save as much, but have another
// speckle: the picture would jump when it gets better.
#include "ProgressiveSlice.h"
#include "Core/Base/Error.h"
#include <algorithm>
#include <cmath>
#include <string>

namespace echorama {
namespace {

// As many beams as wanted, over the same fan.
Volume<unsigned char> WithBeams(const Volume<unsigned char>& few, int elements)
{
  const auto from = few.View();
  const int samples = from.Dimensions()[0], last = from.Dimensions()[1] - 1;
  Volume<unsigned char> all({samples, elements, 1});
  for (int element = 0; element < elements; ++element) {
    const double place = static_cast<double>(element) * last / (elements - 1);
    const int before = std::min(static_cast<int>(place), last - 1);
    const auto part = static_cast<float>(place - before);
    const unsigned char *a = from.Row(before, 0), *b = from.Row(before + 1, 0);
    unsigned char* out = all.View().Row(element, 0);
    for (int i = 0; i < samples; ++i)
      out[i] = static_cast<unsigned char>((1.0f - part) * static_cast<float>(a[i]) + part * static_cast<float>(b[i]) + 0.5f);
  }
  return all;
}

} // namespace

SynthesisParameters ProgressiveSlice::ParametersOf(const SynthesisParameters& full, int level)
{
  if (level < 0 || level >= levels)
    throw Error(Error::Kind::InvalidParameter, "the level of the picture is " + std::to_string(level) + "; it must be in [0, " +
                                                   std::to_string(levels - 1) + "]");
  SynthesisParameters p = full;
  if (level == levels - 1)
    return p;
  const int one = level == 0 ? 4 : level == 1 ? 2 : 1; // of so many beams
  p.elements = std::max(2, (full.elements + one - 1) / one);
  p.transport.maxBounces = 0;
  return p;
}

Volume<unsigned char> ProgressiveSlice::Make(const SynthesisParameters& full, int level, const Progress& progress,
                                             SynthesisCost* cost)
{
  const SynthesisParameters p = ParametersOf(full, level);
  full.Check();
  if (!full.probe.IsPlane())
    throw Error(Error::Kind::InvalidParameter, "the probe sweeps; one plane is made at a time (SliceOf makes its settings)");
  if (full.mode != SynthesisParameters::Mode::Coherent)
    throw Error(Error::Kind::InvalidParameter, "Mode is counting; only a coherent picture can be made better step by step");
  Volume<unsigned char> beams = SynthesizeBeams(scene_, p, progress, cost, &cache_);
  return p.elements == full.elements ? beams : WithBeams(beams, full.elements);
}

} // namespace echorama
