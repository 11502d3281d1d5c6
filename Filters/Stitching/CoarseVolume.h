// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "GridBox.h"

namespace echorama {

/// One volume on a coarse copy of the output grid (a voxel of it is some voxels of the output wide): what is decided for all
/// volumes together and needs no single voxels - gains, seams - is decided there. All boxes are the same.
struct CoarseVolume {
  Boxed<unsigned char> inside; ///< bit 0: the volume is there
  Boxed<unsigned char> wanted; ///< 1 where the fields below are looked at (MarkStitchSamples); an empty box: everywhere
  Boxed<float> value;          ///< its voxel there (one sample, not a mean); only where inside
  Boxed<float> low;            ///< its smooth part there (the detail is value - low); only where inside
  Boxed<float> trust;          ///< how far it can be trusted there, (0, 1]; an empty box: all alike
  Boxed<float>
      scale; ///< s of eq. 5.3 / the membrane, [0, 1]: 1 where it is alone, 0 where it ends; an empty box before it is known
};

} // namespace echorama
