// SPDX-License-Identifier: BSD-3-Clause
// The kernels without VTK: makes a coarse phantom and prints how much of its box the fan fills, and its mean grey.
#include "Core/Base/Error.h"
#include "Filters/Phantoms/Phantom.h"
#include <iostream>
#include <vector>

int main()
{
  try {
    echorama::PhantomParameters parameters;
    parameters.spacingMm = 4.0;
    const echorama::ImageGeometry geometry = echorama::PhantomGeometry(parameters);
    std::vector<unsigned char> grey(geometry.VoxelCount()), valid(geometry.VoxelCount());
    echorama::MakePhantom(parameters, echorama::VolumeView<unsigned char>(grey.data(), geometry.dimensions),
                          echorama::VolumeView<unsigned char>(valid.data(), geometry.dimensions));
    double real = 0.0, sum = 0.0;
    for (std::size_t i = 0; i < grey.size(); ++i) {
      real += valid[i];
      sum += valid[i] ? grey[i] : 0;
    }
    std::cout << grey.size() << " voxels, " << 100.0 * real / static_cast<double>(grey.size()) << "% in the fan, mean grey "
              << sum / real << std::endl;
  } catch (const echorama::Error& error) {
    std::cerr << error.what() << std::endl;
    return 1;
  }
  return 0;
}
