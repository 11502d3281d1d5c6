// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "BeamBend.h"
#include "SpeckleTexture.h"
#include "Synthesize.h"
#include <limits>
#include <optional>
#include <tuple>
#include <vector>

namespace echorama {

/// How SliceTracer draws: what of it is chosen for the eye.
struct SliceLook {
  double darkeningDb = 0.3;
  bool attenuation = true;
  bool surfaceLosses = true;
  bool surfaceLines = true;
  double speckle = 0.8;
  double pressMm = 0.0, pressReachMm = 25.0;
  double gelMm = 1.0;
  double reverberationDb = 25.0;
  int rays = 5;
};

ParameterList Describe(SliceLook& l);

/// The warp of a beam under pressure: the probe has been pressed in by \a pressMm, and how far tissue has given way falls off
/// with depth, to 1/e over \a reachMm. Depths are along the beam from the face; negative ones lie before it, and move with it. It
/// is for the eye, not mechanics: tissue gives way along the beams alone. Identity without pressure. It never folds: at rest
/// depth rises with depth by 1 or more, everywhere.
struct PressWarp {
  double pressMm = 0.0, reachMm = 25.0;

  /// Where that lay at rest which lies at \a depth now.
  double RestDepth(double depth) const;
  /// The inverse.
  double PressedDepth(double restDepth) const;
};

/// How thick the plane is: standard deviation of its sensitivity, as of a Gaussian beam,
///   sigma(depth)^2 = waistMm^2 + (spread (depth - focusMm))^2.
struct SliceThickness {
  double waistMm = 0.0, spread = 0.0, focusMm = 60.0; ///< spread in mm per mm
};

/// Straight rays that stand for such a beam: each leaves the face shiftMm beside the plane and goes away from it by \a slope mm
/// per mm of depth. At any depth the mean of their distances to the plane is 0, and the mean square sigma^2. The first lies in
/// the plane; one alone when there is no thickness. \throws Error(InvalidParameter) unless \a count is 1, or odd and at least 5
struct SkewRay {
  double shiftMm = 0.0, slope = 0.0;
};
std::vector<SkewRay> RaysOf(const SliceThickness& thickness, int count);

/// What is known of a beam besides its picture: of the ray in the plane.
struct SliceBeam {
  bool contact = true; ///< the face gives sound off into something that is no gas
  int surfaces = 0;    ///< how many it crosses
  /// Way from the face to the first body, mm: 0 where the face is within one, infinite where there is none.
  double toBodyMm = std::numeric_limits<double>::infinity();
};

/// One plane of a scene, drawn fast: the live view of dissertation 7.7. Every element sends a straight ray. Along it the grey
/// is that of the material, darker by a described amount for each surface that was crossed. Speckle is read from a volume of
/// noise that lies fixed in the world, along the beams and blurred across them by the width of the beam, so that it stays with
/// the tissue when the probe moves; then it is blended in. The picture is warped where the probe presses.
///
/// Beyond the dissertation: attenuation, losses at surfaces by their step of impedance, and lines at surfaces by that step and
/// the angle, each on a switch; and the thickness of the plane, by some rays of each element (RaysOf), whose powers are averaged
/// before the speckle comes. All levels are in dB as in SynthesizeBeams, and so are gain, dynamic range and greys, so that both
/// show a scene with the same settings much alike. What it has not: bent and repeated ways, speckle and edges of shadows that
/// know of the aperture within the plane, noise of electronics, misplaced depths where sound is slower or faster.
///
/// Of the parameters these count: probe, pose (and stepPoses), elements, samples, transducer, receiver but for its noise,
/// transport.acceptanceDegrees, mirrorDb and seed. Tissue that a displacement moved keeps the speckle of the world.
///
/// The scene must outlive it. What does not depend on the pose is kept from one picture to the next.
class SliceTracer {
public:
  explicit SliceTracer(const AcousticScene& scene) : scene_(scene) {}

  /// Greys from 0 to 255, not rounded: depth fastest, then beam. Does not depend on the number of threads.
  /// \param beams what is known of them, if wanted \param bend where tissue lay in the scene that the probe presses: it takes the
  /// place of pressMm and pressReachMm. nullptr: none
  /// \throws Error(InvalidParameter) as SynthesisParameters::Check(), for a look out of its ranges and for a probe that sweeps
  Volume<float> Trace(const SynthesisParameters& parameters, const SliceLook& look, std::vector<SliceBeam>* beams = nullptr,
                      const SliceThickness& thickness = {}, const BeamBend* bend = nullptr);

private:
  void MakeLateral(const SynthesisParameters& p, const std::vector<double>& depths);

  const AcousticScene& scene_;
  std::optional<SpeckleTexture> texture_;
  std::uint64_t textureSeed_ = 0;
  // The weights of beams beside one: (2 reach_ + 1) rows of one number per sample.
  int reach_ = 0;
  std::vector<float> weights_;
  std::vector<double> weightsKey_; // all that they depend on
};

} // namespace echorama
