// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Geometry/ProbeGeometry.h"
#include "Core/Imaging/VolumeView.h"
#include "Filters/Acoustics/BeamBend.h"
#include "Filters/Live/BeamThickness.h"
#include <memory>
#include <vector>

namespace echorama {

/// What a sample or a pixel is made of: bits, so that what is made of several has those of all.
enum BeamContent : unsigned char {
  ContentNothing = 0,  ///< no volume reaches there
  ContentData = 1,     ///< it was measured
  ContentInvented = 2, ///< background that embedding invented
};

/// From and to the labels of an embedded volume (the array `Embedding`: 0 nothing, 1 data, 2 both, 3 invented).
inline unsigned char ContentOfLabel(unsigned char label)
{
  return label == 1 ? ContentData : label == 2 ? ContentData | ContentInvented : label == 3 ? ContentInvented : ContentNothing;
}
inline unsigned char LabelOfContent(unsigned char content)
{
  return content == ContentInvented ? 3 : content == (ContentData | ContentInvented) ? 2 : content;
}

/// What is taken of volumes.
struct VolumeMix {
  /// Where several are real.
  enum class Overlap {
    First, ///< the one that was added first
    /// The mean, each by how far the place is from where it ends and others go on (BorderDistance): without a seam, but where
    /// two such borders cross. It needs PrepareMean().
    Mean,
  } overlap = Overlap::First;
  bool showInvented = true; ///< else what is invented is not there; samples that are partly data stay
};

ParameterList Describe(VolumeMix& m);

/// Volumes that lie in the world, ready to be read along beams again and again.
///
/// Only views are kept: the voxels must stay where they are, and as they are.
class BeamVolumes {
public:
  BeamVolumes();
  ~BeamVolumes();
  BeamVolumes(BeamVolumes&&) noexcept;
  BeamVolumes& operator=(BeamVolumes&&) noexcept;

  /// \param embedding labels as above; empty: all is data. Where the nearest voxel has the label 0 nothing is real.
  /// Where there is a valid region, or labels, or voxels may not be finite, all voxels are looked at once, to tell bricks of 8^3
  /// that are real throughout. Instantiated for the types in VoxelTypes.h. \throws Error(BadInput)
  template <class T>
  void Add(const PosedVolume<T>& volume, VolumeView<const unsigned char> embedding = {});
  /// Once all are there: where each counts how much in a mean. What is invented counts nothing where others have data.
  void PrepareMean();
  bool Empty() const { return readers_.empty(); }

  /// Fills \a value and \a content (samples x beams x 1) of a probe that does not sweep: trilinear along the beams, averaged over
  /// the planes of the thickness. The samples of a beam lie evenly over its depths, the beams over the fan, first and last
  /// included. A plane that no volume reaches at a sample does not count there, and a sample of which less than half of the
  /// thickness is real has no content, and the value 0: nothing is made up beyond the end of a volume (nor in holes of its valid
  /// region). The content is that of all planes together.
  ///
  /// Positions are in single precision: 1e-4 voxels or better. The same numbers on any number of threads.
  /// \param bend where what is under the probe lay when the volumes were recorded; nullptr: there
  /// \throws Error(InvalidParameter), also for a probe that sweeps, and for a mean that is not prepared; Error(BadInput) for a
  /// pose that is not rigid
  void Read(const PlacedProbe& probe, const BeamThickness& thickness, VolumeView<float> value, VolumeView<unsigned char> content,
            const VolumeMix& mix = {}, const BeamBend* bend = nullptr) const;

  class Reader; ///< of one volume
private:
  std::vector<std::unique_ptr<Reader>> readers_;
};

} // namespace echorama
