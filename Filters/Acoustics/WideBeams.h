// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Progress.h"
#include "EchoSum.h"
#include "SoundPath.h"
#include "Synthesize.h"
#include <vector>

namespace echorama {

/// One of the rays of an element.
struct ApertureRay {
  RayStart start;      ///< what it starts inside of is left open
  double weight = 1.0; ///< how much it counts, by the apodisation
  RaySamples samples;  ///< the numbers that it has left
};

/// The rays of an element over its active aperture, which meet at the focus at one time; one alone is its axis.
std::vector<ApertureRay> RaysOf(const SynthesisParameters& parameters, int element, const RayStart& axis);

/// The direct way of a beam as a whole.
struct WideWay {
  /// The middle of the beam, to the depth that sound is waited for: straight pieces of amplitude 1 that lose nothing.
  std::vector<SoundSegment> segments;
  std::vector<float> amplitude; ///< there and back, of the whole beam, at WideBeams::DepthOf(0), (1) ...
};

/// Direct ways of beams that are wide: bent and shaded as a whole, as neighbours are that share most of their aperture.
///
/// One ray tells how sound fares that passes where it does; a beam is as wide there as its aperture's cone and diffraction make
/// it. At nodes of scan depth, the speed and direction of a beam are the mean of all rays of its element and of the neighbours in
/// its plane that are heard, by their amplitude and by how far their axes lie from its own; and from node to node it keeps the
/// share of amplitude that they keep. How far neighbours count is a Gaussian of variance
///   s^2 (1 - d / F)^2 / n + (d / (k s))^2
/// at the depth d, with s the standard deviation of the apodisation, F the focus, and k the wave number: what n rays of an
/// element leave open of the cone, and diffraction, which they know nothing of. For directions it is the mean from the
/// face to d, in distances of beams, since each bend counts over the width that the beam had there. Planes of a sweep know
/// nothing of each other, so that one is the same alone and within the sweep: across it the beam has the width of its rays.
///
/// Where all rays are bent alike the beam is as well.
class WideBeams {
public:
  explicit WideBeams(const SynthesisParameters& parameters);

  /// Writes down the direct way of a ray of a beam. From several threads for different beams, and the rays of each in order.
  void Add(std::ptrdiff_t beam, const ApertureRay& ray, const SoundPath& path);

  /// Of all rays. Thread safe.
  WideWay Way(std::ptrdiff_t beam) const;

  /// As far as its amplitude is above the dynamic range of transport.
  std::vector<SoundSegment> HeardWay(std::ptrdiff_t beam) const;

  double DepthOf(int node) const { return node * stepMm_; }
  int Nodes() const { return nodes_; }
  /// The amplitude at samples of a depth axis, linear between nodes.
  std::vector<float> AmplitudeAt(const WideWay& way, const DepthAxis& axis) const;

private:
  // By node, how much a neighbour counts that is so many elements away.
  struct Weights {
    std::vector<std::vector<float>> byOffset;
    void Set(const std::vector<double>& sigmas, int elements);
  };
  float* FieldsOf(std::ptrdiff_t beam) { return fields_.data() + beam * fieldsPerBeam * nodes_; }
  const float* FieldsOf(std::ptrdiff_t beam) const { return fields_.data() + beam * fieldsPerBeam * nodes_; }
  void Share(std::ptrdiff_t beam, const Weights& weights, int field, int late, std::vector<float>& sum) const;

  static constexpr int fieldsPerBeam = 4; // amplitude; amplitude times the motion across, up and along beside a straight ray's

  const SynthesisParameters& p_;
  int elements_, nodes_ = 0;
  double stepMm_ = 0.0, lastDepth_;
  Weights here_, sinceFace_;
  std::vector<float> fields_;
  std::vector<double> weightOfBeams_;
};

/// The rays of all beams, followed along the direct way alone. The result does not depend on the
/// number of threads.
WideBeams TraceWideBeams(const AcousticScene& scene, const SynthesisParameters& parameters, const Progress& progress = {});

} // namespace echorama
