// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Volumes.h"
#include <array>
#include <vector>

namespace echorama {

/// From the volumes' grey levels to those of the screen.
struct GreyWindow {
  double black = 0.0, white = 255.0;
  double operator()(double value) const { return std::fmin(std::fmax((value - black) / (white - black), 0.0), 1.0); }
};

/// What a viewer draws of posed volumes: coloured pictures of planes, and bytes to render. Several volumes get tints that
/// add up to grey where they agree. Voxels outside the valid region are never drawn, but for the background of an embedded
/// volume.
class ShownVolumes {
public:
  /// Throws Error(BadInput) when a volume cannot be worked on.
  explicit ShownVolumes(const std::vector<LoadedVolume>& volumes);

  std::size_t Count() const { return volumes_.size(); }
  const ImageGeometry& Geometry(std::size_t i) const { return volumes_[i].geometry; }
  const std::array<double, 3>& Tint(std::size_t i) const { return volumes_[i].tint; }

  /// The grey level below which the \a share of the real voxels lies (drawn from some hundred thousand of them).
  double Percentile(double share) const;

  /// From the 0.1 to the 99.9 percentile.
  GreyWindow Window() const;

  /// The box around the real voxels of all volumes, and their mean position, in coordinates along the axes of the first
  /// volume, mm.
  const Eigen::AlignedBox3d& Box() const { return box_; }
  const Eigen::Vector3d& Middle() const { return middle_; }

  double SmallestSpacing() const;

  /// The picture of a plane (one slice of RGBA bytes, placed in the world): the mean of the tinted grey levels of the volumes
  /// that are real there; transparent where none is. Volumes with shown[i] == false are left out. With \a labels, what of an
  /// embedded volume is invented is blue, and what is mixed with that yellow.
  vtkSmartPointer<vtkImageData> Picture(const ImageGeometry& plane, const GreyWindow& window, const std::vector<bool>& shown,
                                        bool labels = false) const;

  /// Bytes for rendering the volume i: 0 where it is not real, else 1 to 255 through the window. Blocks of voxels are
  /// averaged so that no side is longer than \a maxSide.
  vtkSmartPointer<vtkImageData> Bytes(std::size_t i, const GreyWindow& window, int maxSide) const;

private:
  struct Shown {
    vtkSmartPointer<vtkImageData> image;
    vtkDataArray* intensity = nullptr;
    vtkDataArray* labels = nullptr; ///< of an embedded volume
    vtkDataArray* valid = nullptr;  ///< what is drawn: the labels where they are there
    ImageGeometry geometry;
    std::array<double, 3> tint{1.0, 1.0, 1.0};
  };
  std::vector<Shown> volumes_;
  std::vector<float> sorted_;
  Eigen::AlignedBox3d box_;
  Eigen::Vector3d middle_ = Eigen::Vector3d::Zero();
};

} // namespace echorama
