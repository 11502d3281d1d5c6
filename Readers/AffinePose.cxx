// SPDX-License-Identifier: BSD-3-Clause
// The pose in an affine map: the polar decomposition gives the nearest rotation, and the corners of the grid say how far that
// moves a voxel from where the map has it. (The difference of two affine maps is largest at a corner.)
#include "Readers/AffinePose.h"
#include "Core/Base/Angles.h"
#include "Core/Base/Error.h"
#include "Core/Base/NumberText.h"
#include "Readers/DataFile.h"
#include "Readers/HeaderLines.h"
#include <algorithm>
#include <cmath>

namespace echorama {
namespace {

constexpr double SilentShear = 1e-3, LargestShear = 0.1; // voxels

void FindPose(ImageHeader& header, const Eigen::Matrix<double, 3, 4>& affine)
{
  const auto fail = [&header](const std::string& reason) { FailFile(header.path, reason); };
  ImageGeometry& g = header.geometry;
  Eigen::Matrix3d axes = affine.leftCols<3>();
  if (g.dimensions[2] == 1 && axes.col(2).isZero(0.0)) // an image that says nothing of its thickness
    axes.col(2) = axes.col(0).cross(axes.col(1)).normalized();
  g.origin = affine.col(3);
  g.spacing = axes.colwise().norm();
  if (!(g.spacing.minCoeff() > 0.0) || !axes.allFinite() || !g.spacing.allFinite())
    fail("its affine is singular: a row or column of it is zero or not finite");
  g.direction = axes * g.spacing.cwiseInverse().asDiagonal();
  if (!(std::fabs(g.direction.determinant()) > 1e-3))
    fail("its affine is singular: its axes lie in one plane");

  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(g.direction, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Matrix3d nearest = svd.matrixU() * svd.matrixV().transpose(); // a rotation or, left-handed, a mirror
  const Eigen::Matrix3d difference =
      g.spacing.cwiseInverse().asDiagonal() * nearest.transpose() * (g.direction - nearest) * g.spacing.asDiagonal();
  double residual = 0.0;
  for (int corner = 0; corner < 4; ++corner) {
    const Eigen::Vector3d half(0.5 * (g.dimensions[0] - 1), (corner & 1 ? 0.5 : -0.5) * (g.dimensions[1] - 1),
                               (corner & 2 ? 0.5 : -0.5) * (g.dimensions[2] - 1));
    residual = std::max(residual, (difference * half).norm());
  }
  if (residual <= SilentShear)
    return;
  const Eigen::Matrix3d cosines = g.direction.transpose() * g.direction;
  const double angle = std::asin(std::min(1.0, (cosines - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff())) * 180.0 / Pi;
  const std::string shear = "its affine is sheared: axes are " + NumberText(std::round(angle * 1e4) / 1e4) +
                            " degrees off a right angle, which no rigid pose can express";
  if (residual > LargestShear)
    fail(shear + " (the nearest moves voxels by up to " + NumberText(std::round(residual * 1e3) / 1e3) +
         " voxels); resample the volume with the program that made it");
  header.notes.push_back(shear + "; the nearest was taken, which moves voxels by up to " +
                         NumberText(std::round(residual * 1e4) / 1e4) + " voxels");
  const Eigen::Vector3d half = 0.5 * (Eigen::Vector3d(g.dimensions[0], g.dimensions[1], g.dimensions[2]).array() - 1.0).matrix();
  g.origin += (g.direction - nearest) * g.spacing.cwiseProduct(half); // the centre stays
  g.direction = nearest;
}

} // namespace

void PlaceAffine(ImageHeader& header, const Eigen::Matrix<double, 3, 4>& affine)
{
  FindPose(header, affine);
  PlaceAxes(header, 3);
  CheckGeometry(header.path, header.geometry);
}

} // namespace echorama
