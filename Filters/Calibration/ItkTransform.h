// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Geometry/RigidTransform.h"
#include <string>

namespace echorama {

/// Where another program put a volume, by the rigid transform that it wrote for it as its moving image, LPS, mm:
///
/// * ITK's text files ("#Insight Transform File V1.0", .tfm or .txt; 3D Slicer, SimpleITK and plastimatch write them): Euler3D,
///   VersorRigid3D, QuaternionRigid and Translation; Rigid3D, Affine and MatrixOffsetTransformBase whose matrix is a rotation;
///   Composite of such ones.
/// * elastix' TransformParameters.N.txt: Euler, Translation, and Affine whose matrix is a rotation. A chain by
///   InitialTransformParametersFileName is followed where it is to be composed: to that path as it is given, else to a file of
///   that name beside.
///
/// All of them map points of the fixed image, the world, to points of the moving one. \returns the inverse: VolumeToWorld of what
/// was the moving image, as WriteItkTransform takes it.
/// \throws Error(FileSystem) when a file cannot be opened, Error(BadFile) that names file and line: another format, a transform
/// of another type or dimension, several transforms, a matrix M with an entry of M^T M more than 1e-5 off the identity's, a
/// mirror, numbers that are missing, too many, not finite or beyond 1e7 mm, images that were taken without their direction.
Pose ReadItkTransform(const std::string& path);

/// Writes a pose as a transform of ITK (.tfm) for other programs. ITK maps points of the result to points of what is moved, so
/// the file holds the inverse: a volume under it in 3D Slicer lies where \a volumeToWorld puts it.
/// \throws Error(InvalidParameter) for a pose that is not rigid, Error(FileSystem).
void WriteItkTransform(const std::string& path, const Pose& volumeToWorld);

} // namespace echorama
