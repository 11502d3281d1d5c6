// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Geometry/ImageGeometry.h"
#include "Core/Geometry/TransformGraph.h"
#include "Readers/SequenceFile.h"
#include <string>
#include <vector>

namespace echorama {

/// The frame of coordinates that a sequence is placed in, out of those that a way leads to from \a image (from anywhere, when
/// the graph does not know \a image): \a requested when it is not empty; else the first of Reference, World and Tracker that is
/// there; else the only frame that transforms lead to and none leads from.
/// \returns an empty text when the graph is empty and nothing was requested
/// \throws Error(NotPossible) that names the choices when the requested one is not among them, or nothing was requested and none
/// or several qualify.
std::string ChooseWorldFrame(const TransformGraph& graph, const std::string& image, const std::string& requested);

/// Whether frames of several slices can be placed so: the third axis points, to a degree, where that of a right-handed grid with
/// the other two does. Those of one slice always can.
bool AreAxesOfGrid(const Eigen::Affine3d& imageToWorld, const std::array<int, 3>& dimensions);

/// The grid nearest to pixels of \a dimensions under \a imageToWorld that is a rigid pose with a spacing: its x and y axes are
/// turned by the same small angle to become perpendicular, about the middle of the frame. The third axis is perpendicular to
/// both and only its spacing is that of the matrix. \a imageToWorld must not be singular.
/// \throws Error(NotPossible) when they are not AreAxesOfGrid(): slices would be mirrored or sheared.
ImageGeometry FrameGeometry(const Eigen::Affine3d& imageToWorld, const std::array<int, 3>& dimensions);

/// Where the frames of a sequence lie, composed by name from the transforms of the file and fixed ones (a calibration).
class SequencePoses {
public:
  /// \param fixed transforms that hold for all frames; one that the file has too is that of the file
  /// \param image the frame of coordinates that counts pixels; \param world as ChooseWorldFrame
  /// \throws what ChooseWorldFrame throws, Error(BadInput) when a fixed transform is none
  SequencePoses(const SequenceContent& content, const std::vector<NamedTransform>& fixed, const std::string& image = "Image",
                const std::string& world = "");

  const std::string& World() const { return world_; } ///< empty: there are no transforms
  const std::string& Image() const { return image_; }

  /// Whether a way leads from \a frame to the world at all. Its path, as ComposedTransform::PathText, is always the same.
  bool Reaches(const std::string& frame) const;
  bool ImageIsPlaced() const { return Reaches(image_); }

  /// All frames of coordinates that there are.
  std::vector<std::string> Frames() const { return graph_.Frames(); }

  /// The frames that a way leads from to the world and that a transform of the file begins at: the tracked things.
  std::vector<std::string> Tools() const;

  /// The transforms are those of \a frame from now on; what it lacks is Missing.
  void MoveTo(const SequenceFrame& frame);

  /// From \a frame to the world, at the moment of the last MoveTo. \throws as TransformGraph::Find.
  ComposedTransform Find(const std::string& frame) const { return graph_.Find(frame, world_); }

private:
  TransformGraph graph_;
  std::vector<std::string> names_; // of the file's transforms
  std::string image_, world_;
};

} // namespace echorama
