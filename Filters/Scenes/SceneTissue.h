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

/// All bodies of a scene. A calibration rig brings its own water, which becomes the background where the scene's is water.
class SceneTissue {
public:
  /// \param pressed where a scene that presses bends surfaces, which are divided as finely as its lattice there
  /// \param notes gets a sentence for each mesh that has faults, and for each packing that was saturated
  /// \throws Error(InvalidParameter) of an item's own check, what \a readMesh throws, Error(Cancelled).
  SceneTissue(const SynthesisScene& scene, const Eigen::AlignedBox3d& pressed, const MeshReader& readMesh,
              std::vector<std::string>& notes, const Progress& progress = {});

  /// All of it, whenever it is there.
  TissueSurface All() const;
  /// What is there in a view (from 1), in the order of the scene's list; the first material is the background.
  TissueSurface In(int view) const;
  /// What is there in all of \a views views, and so what a probe presses.
  TissueSurface InAll(int views) const;

private:
  template <class Condition>
  TissueSurface Where(const Condition& condition) const;

  struct Item {
    TissueSurface surface;
    int firstView, lastView;
  };
  Material background_;
  std::vector<Item> items_;
};

/// The rib before a view: RibBelow() as a body of bone.
void AddRib(TissueSurface& tissue, const ProbeGeometry& probe, const Pose& probeToWorld, double share);

} // namespace echorama
