// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Geometry/ToolPose.h"
#include "Tracking/Stream/ImageStream.h"
#include <map>
#include <string>
#include <vector>

namespace echorama {

/// OpenIGTLink messages as bytes; OpenIgtLinkDecoder reads them. A peer that knows header version 1 alone cannot read the others:
/// a sender uses 2 when its peer has done so.
class OpenIgtLinkEncoder {
public:
  using Bytes = std::vector<unsigned char>;

  /// \a headerVersion: 1, or 2 for meta data: then transforms say TransformStatus and TransformValid, as Plus does.
  explicit OpenIgtLinkEncoder(int headerVersion = 1) : headerVersion_(headerVersion) {}

  /// One TRANSFORM. The matrix is sent as it stands.
  Bytes Transform(const ToolPose& pose) const;
  /// One TDATA of tools at one time, that of the first. Poses that are not valid are left out, as there is no word for them.
  Bytes TrackingData(const std::vector<ToolPose>& poses) const;
  /// One IMAGE. Its axes are turned from L, P, S to R, A, S, which is what 3D Slicer takes all images for, unless \a turn
  /// is false; then its numbers stay as they are and are marked as R, A, S all the same, as Plus does.
  /// \throws Error(BadInput) that names the image when its geometry cannot be, voxels are missing, or its name, sizes
  /// or type do not fit; Error(TooLarge) from 2 GiB on.
  Bytes Image(const StreamedImage& image, bool turn = true) const;
  /// \a code: 1 when all is well.
  Bytes Status(int code, const std::string& text) const;
  /// STT_TDATA. \a resolutionSeconds: the shortest time between two poses of a tool; 0: all of them.
  Bytes StartTrackingData(double resolutionSeconds, const std::string& coordinateName) const;
  /// Any message without content: "STP_TDATA", "GET_STATUS" ...
  Bytes Bare(const std::string& type) const;
  /// RTS_TDATA: the answer to a start or stop.
  Bytes TrackingReply(bool well) const;

  /// What a tool is called on the wire, where names have 20 bytes: "ProbeToTracker"; "AVeryLongToolNameToTracker" goes as
  /// "AVeryLongToolName", from which ToolTransformName makes the same. Empty when it cannot be said in 20 bytes.
  static std::string WireName(const std::string& transform);

private:
  Bytes Finished(const std::string& type, const std::string& device, double time, const Bytes& content,
                 const std::map<std::string, std::string>& metaData = {}) const;

  int headerVersion_;
};

} // namespace echorama
