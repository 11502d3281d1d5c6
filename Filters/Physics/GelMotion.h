// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Filters/Physics/GelCoat.h"
#include "Filters/Tissue/TissueSurface.h"
#include <memory>
#include <vector>

namespace echorama {

/// Gel on a probe and on skin, followed along a motion. It may be copied: copies go on from the same state.
///
/// Gel that stays on the skin goes with it, and is met again when the probe comes back. Results do not depend on how often one
/// looks without settling.
class GelMotion {
public:
  /// Puts a cap of gel on the face of a probe that is clear of \a tissue: it starts behind \a first, along its axis.
  /// \throws Error(InvalidParameter), Error(BadInput) for tissue that is none, Error(NotPossible) where the probe has no clear
  /// way to its first pose, Error(TooLarge)
  GelMotion(const TissueSurface& tissue, const PlacedProbe& first, const ProbeHead& head, const GelMaterial& material,
            const GelCoatParameters& parameters);
  GelMotion(const GelMotion& other);
  GelMotion& operator=(const GelMotion& other);
  GelMotion(GelMotion&&) noexcept;
  GelMotion& operator=(GelMotion&&) noexcept;
  ~GelMotion();

  /// Moves the probe evenly, rotation included, to \a probeToWorld in \a seconds (NaN or 0: as long as SpeedMmPerS takes), while
  /// tissue goes evenly from what it was to \a tissue: the same points moved; nullptr: it stays. A face that is clear of tissue
  /// at first moves it from when they meet; one that is clear in the end, until they part.
  /// \throws Error(InvalidParameter), Error(BadInput), Error(NotPossible) where the gel gets unstable, Error(TooLarge),
  /// Error(Cancelled): the motion is then of no more use
  void Move(const Pose& probeToWorld, double seconds, const TissueSurface* tissue = nullptr, const Progress& progress = {});

  /// What lies between face and skin now. \param settle gel flows on for SettleS before, as under a probe that stopped
  GelCoat Look(bool settle, const Progress& progress = {});

  double Seconds() const; ///< simulated since the beginning
  const Pose& ProbeToWorld() const;
  const TissueSurface& Tissue() const; ///< as it is now

private:
  struct State;
  std::unique_ptr<State> state_;
};

/// The short way: gel on the face of a probe that comes to the first pose and goes on from each to the next, where it settles.
/// \param rest tissue before the probe came \param pressed the same with the probe at its last pose; none: it does not yield
/// \throws what GelMotion throws, and Error(BadInput) for poses of several probes
GelCoat SpreadGel(const TissueSurface& rest, const TissueSurface* pressed, const std::vector<PlacedProbe>& probes,
                  const ProbeHead& head, const GelMaterial& material, const GelCoatParameters& parameters,
                  const Progress& progress = {});

} // namespace echorama
