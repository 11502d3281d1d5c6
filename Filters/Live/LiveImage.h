// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Filters/Live/BeamThickness.h"
#include "Filters/Live/BeamVolumes.h"
#include "Filters/Live/FanTable.h"
#include "Filters/Live/LiveProbe.h"
#include "Filters/Live/MachineControls.h"
#include "Filters/Live/Needle.h"
#include <memory>
#include <optional>
#include <tuple>

namespace echorama {

/// All that a live image depends on, but for the volumes and the pose of the probe.
struct LiveImageParameters {
  LiveProbeSettings probe;
  /// As stated, but that a thickness and a divergence of -1, and a focus of 0, are those of the probe.
  BeamThickness thickness{-1.0, 0.0, -1.0, 9};
  MachineControls controls;
  VolumeMix mix;
  int beams = 192, samples = 512;
  int width = 640, height = 480;
  bool flip = false;
};

ParameterList Describe(LiveImageParameters& p);

/// The thickness with that of the probe put in.
BeamThickness ThicknessOf(const LiveImageParameters& parameters);

/// Makes images of volumes under a probe, frame by frame. What a frame shares with the one before (the table of pixels, the
/// curves of the controls, the noise) is kept and made anew only when what it depends on has changed, so that a new pose costs
/// nothing but its own image.
class LiveImage {
public:
  /// Takes over new parameters; cheap when they are the old ones. \throws Error(InvalidParameter)
  void Set(const LiveImageParameters& parameters);

  /// Valid after Set().
  const ProbeGeometry& Probe() const { return geometry_; }
  /// Where the pixels lie in the world, at a pose of the probe.
  ImageGeometry Grid(const Pose& probeToWorld) const { return table_->Grid().Moved(probeToWorld); }

  /// Reads and develops the beams. \a frame counts only when the noise moves.
  /// \throws Error(BadInput) for a pose that is not rigid and finite
  /// \param bend of tissue that the probe presses: see BeamVolumes::Read()
  void MakeBeams(const BeamVolumes& volumes, const Pose& probeToWorld, std::int64_t frame = 0, const BeamBend* bend = nullptr);

  /// Takes greys from elsewhere, 0 to 255, all of them data; nothing is developed. \throws Error(BadInput) for another plane
  void SetBeams(const Volume<float>& value);

  /// Draws a needle into these beams, by the thickness and the controls of the image. \throws as echorama::DrawNeedle
  NeedleSight DrawNeedle(const NeedleLook& look, const Needle& needle, const Pose& probeToWorld);

  /// The beams of the last MakeBeams() or SetBeams(), samples x beams x 1: greys from 0 to 255, and what they are made of
  /// (BeamContent).
  VolumeView<const float> BeamValue() const { return value_.View(); }
  VolumeView<const unsigned char> BeamContents() const { return content_.View(); }
  /// How much of the beams has content, 0 to 1.
  double RealShare() const { return realShare_; }

  /// Scan-converts them, as FanTable::Convert().
  void MakePixels(VolumeView<unsigned char> intensity, VolumeView<unsigned char> valid, VolumeView<unsigned char> label) const;

private:
  void MakeNoise();

  LiveImageParameters parameters_;
  ProbeGeometry geometry_;
  BeamThickness thickness_;
  std::optional<FanTable> table_;
  std::optional<BeamDevelopment> development_;
  std::optional<std::tuple<MachineControls, double, double, int>> developmentKey_;
  Volume<float> noise_; // dB about its mean power; no samples: none
  std::optional<std::tuple<ProbeGeometry, int, int, std::int64_t, double>> noiseKey_;
  Volume<float> value_;
  Volume<unsigned char> content_;
  double realShare_ = 0.0;
};

} // namespace echorama
