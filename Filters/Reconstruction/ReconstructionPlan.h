// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Progress.h"
#include "Filters/Reconstruction/FrameSector.h"
#include "Filters/Reconstruction/ReconstructionGrid.h"
#include <limits>
#include <optional>
#include <string>
#include <typeindex>
#include <vector>

namespace echorama {

/// Which part of the images goes into the volume.
enum class SectorChoice {
  All,
  Detected,  ///< found by what changes from frame to frame (DetectSector)
  Rectangle, ///< given
  Fan,       ///< given
};

struct SectorParameters {
  SectorChoice choice = SectorChoice::Detected;
  std::array<int, 4> rectangle{0, std::numeric_limits<int>::max(), 0, std::numeric_limits<int>::max()}; ///< as RectangleMask
  ImageFan fan;
};

/// The sector that is given for images of \a size, nothing for All and Detected. \throws Error as RectangleMask and FanMask
std::optional<Volume<unsigned char>> GivenSector(const SectorParameters& parameters, const std::array<int, 3>& size,
                                                 const Eigen::Affine3d& imageToWorld);

/// Where both masks are not 0; an empty one allows everything. \a store keeps what is combined.
VolumeView<const unsigned char> BothMasks(VolumeView<const unsigned char> own, VolumeView<const unsigned char> sector,
                                          Volume<unsigned char>& store);

/// What is known before the volume is made.
struct ReconstructionPlan {
  ImageGeometry grid;
  std::optional<Volume<unsigned char>> sector; ///< of all frames, when there is one
  std::string sectorText;                      ///< what was taken, for people
  bool sectorFound = true;                     ///< false: it was looked for in vain
};

/// Goes through the frames of a sweep to plan a reconstruction: which pixels count, and the grid that holds them.
class ReconstructionSurvey {
public:
  explicit ReconstructionSurvey(const SectorParameters& sector) : parameters_(sector) {}

  /// A frame counts when it has a pose that can be used (CheckPose), pixels of the type of the first one that has, and a real one
  /// among them (\a valid). \returns whether it is that first one. \throws Error(BadInput) when the sector is to be detected and
  /// frames are of different sizes.
  template <class T>
  bool Add(VolumeView<const T> pixels, VolumeView<const unsigned char> valid, const std::optional<Eigen::Affine3d>& imageToWorld);

  int Seen() const { return seen_; }             ///< frames in all
  bool Empty() const { return places_.empty(); } ///< none counts so far

  /// \param given the grid; nothing: that of the pixels that count
  /// \throws Error(BadInput) when no frame counts, Error as DetectSector and ReconstructionGrid.
  ReconstructionPlan Finish(const std::optional<ImageGeometry>& given, GridDirections directions, double spacingMm,
                            const Progress& progress = {});

private:
  SectorParameters parameters_;
  FrameSector changes_;
  std::vector<FramePlace> places_;
  std::array<int, 3> size_{0, 0, 0};
  std::optional<Eigen::Affine3d> first_;
  std::optional<std::type_index> type_;
  int seen_ = 0;
};

} // namespace echorama
