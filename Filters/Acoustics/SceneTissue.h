// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Filters/Tissue/SurfaceCheck.h"
#include "SynthesisScene.h"
#include <functional>
#include <string>
#include <vector>

namespace echorama {

/// Reads the triangles of a file as they stand there: its own unit and axes. Throws Error that names the file.
using MeshReader = std::function<TriangleSurface(const std::string& path)>;

/// All tissue of a scene, in the order of its list; the first material is the background. A calibration rig brings its own
/// water, which becomes the background where the scene's is water.
/// \param notes gets a sentence for each mesh that has faults, and for each packing that was saturated
/// \throws Error(InvalidParameter) of an item's own check, what \a readMesh throws, Error(Cancelled).
TissueSurface TissueOf(const SynthesisScene& scene, const MeshReader& readMesh, std::vector<std::string>& notes,
                       const Progress& progress = {});

/// Where the probe is at each step of a sweep whose middle one is at \a middle; empty when it rests.
std::vector<Pose> StepPoses(const SynthesisScene& scene, const Pose& middle);

} // namespace echorama
