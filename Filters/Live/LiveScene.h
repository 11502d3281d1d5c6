// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Filters/Acoustics/ProgressiveSlice.h"
#include "Filters/Acoustics/SliceTracer.h"
#include "Filters/Live/LiveImage.h"
#include "Filters/Live/NeedlePath.h"

namespace echorama {

/// What a live image is made of.
enum class LiveSource {
  Volumes,  ///< read from volumes
  Scene,    ///< a scene, drawn: the live view of dissertation 7.7 (SliceTracer)
  Acoustic, ///< a scene by the acoustic model (ProgressiveSlice)
};

/// What counts for scenes alone.
struct LiveSceneParameters {
  LiveSource source = LiveSource::Volumes;
  SliceLook look;     ///< of a scene that is drawn
  int refinement = 3; ///< level of the acoustic picture
};

ParameterList Describe(LiveSceneParameters& p);

/// The settings of a scanner of scenes that come to those of a live image: the transducer is that of the probe's kind, with the
/// frequency of the image and its focus, where it states one; the gain makes up for the attenuation of tissue at this frequency,
/// and the sliders and the knob add to it. Noise of electronics is that of the acoustic model.
SynthesisParameters SceneSettings(const LiveImageParameters& p, const Pose& probeToWorld, std::int64_t frame = 0);

/// The thickness of a live image, for SliceTracer.
SliceThickness SceneThickness(const LiveImageParameters& p);

/// A scene under a probe that moves: what does not depend on the pose is kept.
class LiveScene {
public:
  /// \throws as AcousticScene
  explicit LiveScene(const TissueSurface& tissue) : scene_(tissue), tracer_(scene_), slice_(scene_) {}
  LiveScene(const LiveScene&) = delete;
  LiveScene& operator=(const LiveScene&) = delete;

  /// Greys on the beams, 0 to 255, samples x beams x 1.
  /// \param thickness and \param bend are of a scene that is drawn
  /// \throws as SliceTracer::Trace and ProgressiveSlice::Make
  Volume<float> MakeBeams(const SynthesisParameters& settings, const LiveSceneParameters& p, const Progress& progress = {},
                          const SliceThickness& thickness = {}, const BeamBend* bend = nullptr);

  /// What a needle cannot pass: materials stiffer than 100 MPa, as bone, stones and steel. For as long as the scene lives.
  NeedleObstacle Hard() const;

  /// Of the last picture: how much of the beams has contact, and how much meets a body; 0 to 1.
  double ContactShare() const { return contactShare_; }
  double SeenShare() const { return seenShare_; }

  /// The material at a point of the world, if it is one that Hard() is of: no probe can be there either. nullptr: it is soft.
  const Material* HardMaterialAt(const Eigen::Vector3d& point) const;

private:
  AcousticScene scene_;
  SliceTracer tracer_;
  ProgressiveSlice slice_;
  double contactShare_ = 0.0, seenShare_ = 0.0;
};

} // namespace echorama
