// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "AcousticScene.h"
#include "BeamLobes.h"
#include "Core/Base/Progress.h"
#include "Core/Geometry/Transducer.h"
#include "Core/Imaging/DisplacementField.h"
#include "Filters/Phantoms/BeamEchoes.h"
#include "Receiver.h"
#include "ScatterCounting.h"
#include "SoundTransport.h"
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace echorama {

class ScattererCache;

/// How echoes are made.
struct EchoModel {
  enum class Mode {
    Coherent, ///< rays for the ways of sound, and the coherent sum of the echoes of scatterers fixed to the tissue
    Counting, ///< random scatter events of rays, counted (ScatterCounting): the algorithm of dissertation 3.4
  };
  Mode mode = Mode::Coherent;
  SoundTransport transport;
  int subRays = 8;
  Sampling sampling = Sampling::Stratified; ///< also of how rough surfaces scatter rays
  bool wideBeams = false;                   ///< see WideBeams
  BeamLobes lobes;
  double mirrorDb = 45.0;
  ScatterCounting counting; ///< of the mode Counting
};

ParameterList Describe(EchoModel& m); ///< but counting

/// What a synthesised volume is made with: probe, sound and receiver.
struct SynthesisParameters : EchoModel {
  ProbeGeometry probe = ProbeGeometry::Convex(1.1344640137963142, 40.0, 0.9599310885968813, 30.0, 5.0, 120.0);
  Pose probeToWorld = Pose::Identity(); ///< rigid
  /// Where the probe was at each step of the sweep, first to last, when it moved during the sweep; empty: at probeToWorld all
  /// the time. The scanner does not know: it places every plane as if the probe had rested at probeToWorld. Coherent only.
  std::vector<Pose> stepPoses;
  /// The steps whose beams are made; the others have no echoes. -1: to the last one.
  int firstStep = 0, lastStep = -1;

  int elements = 128, samples = 512;
  int steps = 96; ///< 1, whatever is given, of a probe that does not sweep

  Transducer transducer;
  Receiver receiver = DefaultReceiver();
  std::uint64_t seed = 1;
  double decorrelation = 0.0; ///< of the speckle; coherent only
  std::uint64_t changeSeed = 1;
  double scatterersPerMm3 = 0.0, invisibleDb = 12.0;
  static constexpr double scatterersPerCell = 10.0; ///< enough for speckle that is all but fully developed
  /// Where the tissue has gone: a scatterer at m in the material lies at m + u(m) in the world. The surfaces of the scene are
  /// those that the tissue has now. The default has not moved.
  DisplacementField displacement;

  /// A gain that makes up for 0.5 dB/cm/MHz at 3.5 MHz, there and back, and noise of electronics 65 dB below the reference
  /// tissue.
  static Receiver DefaultReceiver();

  /// What scatterersPerMm3 comes to.
  double ScatterersPerMm3() const;

  /// Samples, elements and steps of the beam volume.
  std::array<int, 3> BeamDimensions() const;
  /// The last of the steps whose beams are made.
  int LastStep() const { return lastStep < 0 ? BeamDimensions()[2] - 1 : lastStep; }

  /// All ranges, the probe and poses, and what goes together. \throws Error(InvalidParameter)
  void Check() const;
};

/// Which beam an element makes at a step of the sweep; its depth is 0, on the face.
BeamPoint BeamOf(const SynthesisParameters& p, int element, int step);

/// The ray of a beam's axis, in the world; what it starts inside of is left open.
RayStart AxisOf(const SynthesisParameters& p, int element, int step);

/// What the scanner sends and assumes. Sound is waited for a little longer than to the last sample, as later echoes reach it.
SoundConditions ConditionsOf(const SynthesisParameters& p);

/// With transducer, receiver, transport and counting, but transport's dynamic range: the receiver's has that name.
ParameterList Describe(SynthesisParameters& p);

/// What a run cost, stage by stage.
struct SynthesisCost {
  double raysSeconds = 0.0;       ///< following sound through the scene
  double scatterersSeconds = 0.0; ///< making the scatterers near the beams
  double echoesSeconds = 0.0;     ///< summing their echoes
  double detectionSeconds = 0.0;  ///< from baseband to grey
  std::int64_t rays = 0;          ///< how often the scene was asked
  std::int64_t segments = 0;      ///< straight pieces of the ways of sound
  std::int64_t surfaceEchoes = 0;
  std::int64_t scatterers = 0;
  std::size_t bytes = 0; ///< the largest of what was held at once: scene, ways, scatterers and samples

  SynthesisCost& operator+=(const SynthesisCost& other);
};

/// The echoes of a scene before detection, complex baseband: mode Coherent. The depth axis is finer than the volume's when its
/// samples lie further apart than the pulse is long; DetectEchoes brings it to the number of samples.
///
/// 1. Sound is followed from every element through the scene: one ray along the axis of the beam, or several over the
///    aperture (subRays). 2. Scatterers are made where those ways pass, nowhere else. 3. Each beam sums the
/// echoes of the scatterers around its ways, and of the surfaces that it meets. With several rays the ways of the axis stand for
/// the beam, the direct one with the mean amplitude of all rays at each depth: the edge of a shadow is as soft as the aperture is
/// wide. Surfaces echo to every ray, by its share. Wide beams go their own way, that of all their rays and of their neighbours'.
/// Side and grating lobes, if there are any, are further beams of an element, weak and aside: one ray each, whose ways and
/// surfaces echo as those of the main lobe, by the lobe's pattern. The result does not depend on the number of threads. \param
/// cache of scatterers from earlier calls for this scene, if any; it changes nothing but the time \throws as Check();
/// Error(TooLarge) when samples or scatterers would not fit; Error(Cancelled).
BeamEchoes SynthesizeEchoes(const AcousticScene& scene, const SynthesisParameters& parameters, const Progress& progress = {},
                            SynthesisCost* cost = nullptr, ScattererCache* cache = nullptr);

/// B-mode on the beams, of either mode: unsigned char, depth fastest, then fan, then sweep. Counted events are detected with the
/// same receiver: their number per sample stands for the power.
/// \throws as above.
Volume<unsigned char> SynthesizeBeams(const AcousticScene& scene, const SynthesisParameters& parameters,
                                      const Progress& progress = {}, SynthesisCost* cost = nullptr,
                                      ScattererCache* cache = nullptr);

/// One plane of a sweep: the same with a probe that does not sweep, held where the plane at \a sweep (-0.5 ... 0.5) lies.
/// \throws Error(InvalidParameter) for a place outside of the sweep.
SynthesisParameters SliceOf(const SynthesisParameters& parameters, double sweep);

/// All parameters as one JSON text, to go with the volume; of a displacement only whether there is one.
std::string DescribeSynthesis(const SynthesisParameters& parameters);

} // namespace echorama
