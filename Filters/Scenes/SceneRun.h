// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Geometry/Landmark.h"
#include "Core/Imaging/DisplacementField.h"
#include "Filters/Physics/GelMotion.h"
#include "SceneTissue.h"
#include "SceneViews.h"
#include <memory>
#include <optional>

namespace echorama {

/// Makes the surface of gel, as a body of it in air; no body where there is none.
using GelSurfacer = std::function<TissueSurface(const GelCoat& coat, const Material& gel, const Material& air)>;

/// All that is made of one view, in the world of the scene.
struct SceneScan {
  SynthesisParameters parameters; ///< probe and pose among them
  Volume<unsigned char> beams;
  TissueSurface tissue;                 ///< what sound met in the middle of the sweep, gel with it
  std::optional<PressedTissue> pressed; ///< in the middle of the sweep
  std::optional<GelCoat> gel;           ///< likewise
  TissueSurface gelSurface;
  std::vector<Landmark> landmarks; ///< where the tissue of each place is in the middle of the sweep, of those in the fan
  SynthesisCost cost;
  double pressSeconds = 0.0, gelSeconds = 0.0;
};

/// Makes the views of a scene.
///
/// Listed views are independent: each presses tissue that was at rest, with gel of its own. Where the way matters, which is where
/// there is gel or friction, views along a path go on from one another: tissue and gel follow the probe from the path's begin,
/// so gel that was left on the skin is met again. Bodies that come and go are not felt by the probe, but move with the tissue
/// around them.
class SceneRun {
public:
  /// \param landmarks how many places that two views see are listed, besides the balls of a rig; none where the probe moves
  /// during a sweep, as a place is then not seen where it lies \throws as SceneTissue and ViewsOf
  SceneRun(SynthesisScene scene, int landmarks, const MeshReader& readMesh, GelSurfacer surfacer, const Progress& progress = {});
  ~SceneRun();
  SceneRun(const SceneRun&) = delete;
  SceneRun& operator=(const SceneRun&) = delete;

  const SynthesisScene& Scene() const { return scene_; }
  const std::vector<SceneView>& Views() const { return views_; }
  /// All bodies of all views, at rest.
  TissueSurface Tissue() const { return tissue_->All(); }
  /// What there is to say about the scene, and since then about the views that were made.
  const std::vector<std::string>& Notes() const { return notes_; }

  /// Makes a view, counted from 0. In their order they cost least: going back on a path begins it anew.
  /// \throws Error(InvalidParameter) for a view that there is not; of press, gel and synthesis, with the number of the view
  SceneScan Make(std::size_t view, const Progress& progress = {});

private:
  struct Moved;
  bool Continues() const;
  bool BodiesComeAndGo() const;
  void Begin();
  void Move(const TimedPose& probe, const Progress& progress);
  void Drive(std::size_t view, SceneScan& scan, const Progress& progress);
  void Scan(std::size_t view, std::size_t state, SceneScan& scan, const Progress& progress);
  TissueSurface Deformed(TissueSurface tissue);

  SynthesisScene scene_;
  GelSurfacer surfacer_;
  std::vector<std::string> notes_;
  std::vector<SceneView> views_;
  SynthesisParameters parameters_;
  std::unique_ptr<SceneTissue> tissue_;
  TissueSurface pressed_; ///< what the probe presses, at rest
  TissueBody body_;       ///< the same as cells
  std::vector<Landmark> places_;
  std::unique_ptr<Moved> moved_;
  std::unique_ptr<const AcousticScene> acoustic_; ///< where all views see the same
};

} // namespace echorama
