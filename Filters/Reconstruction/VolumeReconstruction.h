// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Parameters.h"
#include "Core/Geometry/ImageGeometry.h"
#include "Core/Imaging/VolumeView.h"
#include <cstddef>
#include <cstdint>
#include <memory>

namespace echorama {

/// How a pixel goes into the volume.
enum class SplatMethod {
  Nearest, ///< into its nearest voxel
  Linear,  ///< into the eight voxels around it, with the weights of trilinear interpolation
};

/// What becomes of a voxel that several pixels reach.
enum class Compounding {
  Mean,        ///< their mean, weighted by the splat
  Maximum,     ///< the largest; a pixel counts for voxels where its weight is at least 1/8, as in Plus
  Latest,      ///< the mean of those of the latest frame that reached it
  Alpha,       ///< each frame's mean is laid over what was there with an opacity
  RunningMean, ///< the mean as the Plus toolkit keeps it: see ReconstructionParameters::compounding
};

/// What lies between two frames that follow each other.
enum class BetweenFrames {
  Nothing,  ///< every frame stands for itself
  Forward,  ///< frames with pixels and matrices interpolated linearly, so close that no pixel moves more than a step
  Backward, ///< each voxel between the two planes takes a blend of both frames at its perpendicular feet on them
};

struct ReconstructionParameters {
  SplatMethod splat = SplatMethod::Nearest;

  /// RunningMean repeats the arithmetic of Plus (MEAN compounding): the mean is rounded to the output's type after every pixel
  /// and the weight to 1/256. Late pixels with little weight then change nothing, and a voxel whose weight rounds to 0 counts
  /// as not seen. It is there to compare with volumes that Plus made.
  Compounding compounding = Compounding::Mean;
  double alpha = 0.5; ///< 1 is Latest

  BetweenFrames between = BetweenFrames::Forward;
  double stepMm = 0.0;
  double maximumGapMm = 10.0; ///< nor are those joined between which a pixel moves further than 1000 steps
};
ParameterList Describe(ReconstructionParameters& p);

/// A 2D image and where it lies.
template <class T>
struct TrackedFrame {
  VolumeView<const T> pixels;           ///< one slice
  VolumeView<const unsigned char> mask; ///< which pixels are real, 1 or 0; empty: all. Pixels that are not finite never are
  Eigen::Affine3d imageToWorld = Eigen::Affine3d::Identity(); ///< from pixel indices (x, y, 0) to mm
};

/// What was done with a frame.
enum class FrameUse {
  Used,
  PoseNotFinite, ///< a number of the matrix is not finite
  PoseSingular,  ///< the image has no area: an axis is 0 mm long, or both are parallel
  NoPixels,      ///< no pixel is real
  Outside,       ///< no real pixel lies in the grid
};

/// A sentence for people, such as "its pose is singular".
const char* FrameUseText(FrameUse use);

/// Whether the frame of this pose may be used: Used, PoseNotFinite or PoseSingular.
FrameUse CheckPose(const Eigen::Affine3d& imageToWorld);

/// Where the volume goes: views of the size of the grid, which the reconstruction owns while it lives.
template <class T>
struct ReconstructionOutput {
  VolumeView<T> intensity;             ///< 0 where nothing was seen
  VolumeView<unsigned char> valid;     ///< 1 where something was seen or filled
  VolumeView<unsigned short> coverage; ///< how many pixels a voxel got (65535: that or more); 0 where not seen, or filled
};

/// Bytes that a reconstruction on \a grid takes, its output included.
/// \param voxelBytes of the output's type
double ReconstructionMemory(const ReconstructionParameters& parameters, const ImageGeometry& grid, std::size_t voxelBytes);

/// Tracked 2D frames into a volume, one by one: after each Add() the output is up to date.
///
/// Frames that follow each other are joined (BetweenFrames) unless they are too far apart. A frame that cannot be used leaves the
/// volume as it was. Coverage counts pixels, those of frames in between included; with linear splats, the sum of their weights,
/// rounded, at least 1. A voxel that was reached by more than 65535 pixels goes on as a moving mean over as many.
///
/// Voxels keep their sums in single precision. The result does not depend on the number of threads, nor on the instruction set.
/// Sources: pixel nearest neighbour and its relatives in Solberg et al., "Freehand 3D ultrasound reconstruction algorithms - a
/// review" (2007); the backward blend as in Coupe et al., "Probe trajectory interpolation" (2007), along the perpendiculars.
template <class T>
class VolumeReconstruction {
public:
  /// Clears the output.
  /// \throws Error(InvalidParameter) for a parameter out of range, Error(BadInput) for a grid that is not one or an output of
  /// another size, Error(TooLarge) for more than 2^26 voxels along an axis.
  VolumeReconstruction(const ReconstructionParameters& parameters, const ImageGeometry& grid,
                       const ReconstructionOutput<T>& output);
  ~VolumeReconstruction();
  VolumeReconstruction(VolumeReconstruction&&) noexcept;
  VolumeReconstruction& operator=(VolumeReconstruction&&) noexcept;

  /// Adds a frame, and what lies between it and the one before. The pixels are copied where they are needed later.
  /// \throws Error(BadInput) when the frame is not one slice, or its mask has another size.
  FrameUse Add(const TrackedFrame<T>& frame);

  /// The next frame is not joined to the last one.
  void Break();

  int FramesUsed() const;
  int FramesBetween() const; ///< how many were put in between (Forward), or pairs that were blended (Backward)

private:
  struct Body;
  std::unique_ptr<Body> body_;
};

} // namespace echorama
