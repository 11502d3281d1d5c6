// SPDX-License-Identifier: BSD-3-Clause
// Corners suffice: pixels lie between them. The smallest box that contains points is a hard problem, and frames make it easy:
// they are planes that move little sideways, so the mean image's axes are right for most sweeps. Where the probe wanders or
// turns, the principal directions can be better; whichever box is smaller is taken. Where the probe turns so far that there is
// no mean image, the principal directions are all there is.
#include "ReconstructionGrid.h"
#include "Core/Base/Error.h"
#include "Core/Base/FormatText.h"
#include "Core/Base/Memory.h"
#include "Core/Geometry/RigidTransform.h"
#include "Filters/Reconstruction/VolumeReconstruction.h"
#include <algorithm>
#include <cmath>
#include <Eigen/Eigenvalues>
#include <limits>
#include <optional>
#include <string>

namespace echorama {

namespace {

constexpr double megabyte = 1e6;
constexpr double slack = 1e-6;           // of a voxel: rounding adds no empty layer
constexpr double leastPreference = 1e-3; // of all images, for a line to be nearest to their axes
constexpr double leastSine = 0.1;        // of the angle between the mean axes
constexpr double undecided = 1e-9;

Eigen::AlignedBox3d BoxAlong(const Eigen::Matrix3d& directions, const std::vector<Eigen::Vector3d>& points)
{
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& point : points)
    box.extend(directions.transpose() * point);
  return box;
}

// What a box costs; a flat one is as thick as a voxel.
double Cost(const Eigen::AlignedBox3d& box, double spacing)
{
  return (box.sizes().array() + spacing).prod();
}

// The line that is nearest to an axis of all images, pointing as most of them do: whatever their order, and with images that were
// turned over. Nothing when no line is nearest.
std::optional<Eigen::Vector3d> MeanAxis(const std::vector<FramePlace>& frames, int column)
{
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const FramePlace& frame : frames) {
    const Eigen::Vector3d axis = frame.imageToWorld.linear().col(column).normalized();
    spread += axis * axis.transpose();
    sum += axis;
  }
  const double count = static_cast<double>(frames.size());
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(spread);
  if (solver.eigenvalues()[2] - solver.eigenvalues()[1] < leastPreference * count)
    return std::nullopt;
  Eigen::Vector3d axis = solver.eigenvectors().col(2);
  double sign = axis.dot(sum);
  if (std::abs(sign) < undecided * count) { // as many point one way as the other: then along the world's axis that is nearest
    Eigen::Index most = 0;
    axis.cwiseAbs().maxCoeff(&most);
    sign = axis[most];
  }
  if (sign < 0.0)
    axis = -axis;
  return axis;
}

// Axes of the images, averaged. Nothing when the images point everywhere, or when both axes come out alike.
std::optional<Eigen::Matrix3d> MeanImage(const std::vector<FramePlace>& frames)
{
  const auto across = MeanAxis(frames, 0), down = MeanAxis(frames, 1);
  if (!across || !down || across->cross(*down).norm() < leastSine)
    return std::nullopt;
  Eigen::Matrix3d axes;
  axes << *across, *down, across->cross(*down).normalized();
  return NearestRotation(axes);
}

// Principal directions, each along the axis of \a image that it is nearest to.
Eigen::Matrix3d Principal(const std::vector<Eigen::Vector3d>& points, const Eigen::Matrix3d& image)
{
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& point : points)
    mean += point / static_cast<double>(points.size());
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const Eigen::Vector3d& point : points)
    spread += (point - mean) * (point - mean).transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(spread);
  const Eigen::Matrix3d found = solver.eigenvectors();
  int order[3] = {0, 1, 2}, best[3] = {0, 1, 2};
  double agreement = -1.0;
  do {
    double sum = 0.0;
    for (int axis = 0; axis < 3; ++axis)
      sum += std::abs(found.col(order[axis]).dot(image.col(axis)));
    if (sum > agreement) {
      agreement = sum;
      std::copy(order, order + 3, best);
    }
  } while (std::next_permutation(order, order + 3));
  Eigen::Matrix3d axes;
  for (int axis = 0; axis < 3; ++axis) {
    axes.col(axis) = found.col(best[axis]);
    if (axes.col(axis).dot(image.col(axis)) < 0.0)
      axes.col(axis) *= -1.0;
  }
  if (axes.determinant() < 0.0)
    axes.col(2) *= -1.0;
  return axes;
}

ImageGeometry GridAround(const Eigen::AlignedBox3d& box, const Eigen::Matrix3d& directions, double spacing)
{
  ImageGeometry grid;
  grid.direction = directions;
  grid.spacing.setConstant(spacing);
  grid.origin = directions * box.min();
  const Eigen::Array3d size = (box.sizes().array() / spacing - slack).ceil().max(0.0) + 1.0;
  if (!(size.maxCoeff() <= std::numeric_limits<int>::max()) || !(size.prod() <= 1e15))
    throw Error(Error::Kind::TooLarge, "the output grid would have " + SizeText(size[0], size[1], size[2]) +
                                           " voxels; choose a larger SpacingMm, or leave frames out that lie far away");
  for (int axis = 0; axis < 3; ++axis)
    grid.dimensions[static_cast<std::size_t>(axis)] = static_cast<int>(size[axis]);
  return grid;
}

std::string Megabytes(double bytes)
{
  return Format(bytes < 10.0 * megabyte ? "%.2g MB" : "%.0f MB", bytes / megabyte);
}

} // namespace

ImageGeometry ReconstructionGrid(const std::vector<FramePlace>& frames, GridDirections directions, double spacingMm)
{
  if (frames.empty())
    throw Error(Error::Kind::BadInput, "there is no frame with a valid pose");
  Parameter("SpacingMm", spacingMm, {0, Unlimited}, "mm", "").Check();
  std::vector<Eigen::Vector3d> corners;
  double pixel = 0.0;
  for (const FramePlace& frame : frames) {
    const FrameUse use = CheckPose(frame.imageToWorld);
    if (use != FrameUse::Used)
      throw Error(Error::Kind::BadInput, std::string("a frame cannot be placed: ") + FrameUseText(use));
    for (int corner = 0; corner < 4; ++corner)
      corners.push_back(frame.imageToWorld *
                        Eigen::Vector3d(frame.pixels[corner & 1 ? 1 : 0], frame.pixels[corner & 2 ? 3 : 2], 0.0));
    pixel += std::max(frame.imageToWorld.linear().col(0).norm(), frame.imageToWorld.linear().col(1).norm());
  }
  const double spacing = spacingMm > 0.0 ? spacingMm : pixel / static_cast<double>(frames.size());
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();
  if (directions == GridDirections::Fitted) {
    const std::optional<Eigen::Matrix3d> image = MeanImage(frames);
    axes = image.value_or(axes);
    const Eigen::Matrix3d principal = Principal(corners, axes);
    if (!image || Cost(BoxAlong(principal, corners), spacing) < Cost(BoxAlong(axes, corners), spacing))
      axes = principal;
  }
  return GridAround(BoxAlong(axes, corners), axes, spacing);
}

ImageGeometry WithSpacing(const ImageGeometry& grid, double spacingMm)
{
  ImageGeometry other = grid;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double length = (grid.dimensions[axis] - 1) * grid.spacing[static_cast<Eigen::Index>(axis)];
    other.dimensions[axis] = static_cast<int>(std::min(std::ceil(length / spacingMm - slack) + 1.0, 2147483647.0));
  }
  other.spacing.setConstant(spacingMm);
  return other;
}

void CheckMemory(const ImageGeometry& grid, double bytesPerVoxel, double limitMb)
{
  Parameter("MemoryLimitMb", limitMb, {0, Unlimited}, "MB", "").Check();
  const double allowed = limitMb > 0.0 ? limitMb * megabyte : FreeMemory();
  const double needed = static_cast<double>(grid.VoxelCount()) * bytesPerVoxel;
  if (needed <= allowed)
    return;
  double spacing = std::cbrt(grid.spacing.prod());
  for (double bytes = needed; bytes > allowed && spacing < 1e9;) {
    spacing *= std::max(1.01, std::cbrt(bytes / allowed));
    const double digit = std::pow(10.0, std::floor(std::log10(spacing)) - 1.0);
    spacing = std::ceil(spacing / digit) * digit; // two digits, rounded up
    bytes = static_cast<double>(WithSpacing(grid, spacing).VoxelCount()) * bytesPerVoxel;
  }
  throw Error(Error::Kind::TooLarge, "a volume of " + SizeText(grid.dimensions) + " voxels takes " + Megabytes(needed) +
                                         " to make, more than the " + Megabytes(allowed) +
                                         (limitMb > 0.0 ? " allowed (MemoryLimitMb)" : " that are free") +
                                         Format("; SpacingMm = %.2g would fit", spacing));
}

} // namespace echorama
