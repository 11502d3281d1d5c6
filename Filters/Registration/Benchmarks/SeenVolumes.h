// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The volumes that benchmarks align: views of the phantom, and real ones.
#include "Filters/Phantoms/Phantom.h"
#include "Filters/Phantoms/PhantomViews.h"
#include "Filters/Registration/Pyramid.h"
#include "Readers/BorderZeros.h"
#include "Readers/ImageHeader.h"
#include "Readers/VolumeFile.h"
#include <string>
#include <vector>

namespace echorama {

struct SeenVolume {
  ImageGeometry geometry;
  Volume<unsigned char> voxels, valid;
  std::vector<PyramidLevel> pyramid;

  explicit SeenVolume(const ImageGeometry& of) : geometry(of), voxels(of.dimensions), valid(of.dimensions) {}
  void Prepare() { pyramid = BuildPyramid<unsigned char>({voxels.View(), valid.View(), geometry}); }
};

inline SeenVolume SeenPhantom(const PhantomView& view)
{
  PhantomParameters p;
  p.probeToWorld = view.probeToWorld;
  p.gainDb = view.gainDb;
  SeenVolume seen(PhantomGeometry(p));
  MakePhantom(p, seen.voxels.View(), seen.valid.View());
  seen.Prepare();
  return seen;
}

inline SeenVolume SeenFile(const std::string& path)
{
  const ImageHeader header = ReadImageHeader(path);
  CheckVolume(header);
  SeenVolume seen(header.geometry);
  ReadVoxels(header, seen.voxels.View().Data());
  ValidFromBorderZeros<unsigned char>(seen.voxels.View(), seen.valid.View());
  seen.Prepare();
  return seen;
}

} // namespace echorama
