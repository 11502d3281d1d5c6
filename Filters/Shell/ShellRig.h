// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Shell.h"

namespace echorama {

/// Two domes about one centre that stand on a shell's base in its place, with marks in the same directions (dissertation 7.3): a
/// lens is calibrated with them once, for every shell of that base.
struct RigParameters {
  double largeDomeMm = 0.0, smallDomeMm = 0.0; ///< radii; 0: the largest that the base has room for, and 0.6 of the large one

  /// \throws Error(InvalidParameter)
  void Check() const;
};
ParameterList Describe(RigParameters& p);

struct CalibrationRig {
  struct Dome {
    std::string name; ///< "large-dome", "small-dome"
    double radiusMm = 0.0;
    ShellPart part;               ///< in the body's frame
    std::vector<PrintedPart> cut; ///< what it is cut into; empty when it fits
    std::vector<ShellMark> marks; ///< in the body's frame; those of both domes lie in the same directions, in the same order
  };
  std::array<Dome, 2> domes;
  Pose bodyToShell = Pose::Identity(),
       bodyToCamera = Pose::Identity(); ///< of the camera's frame +z is Up, its x that of the shell

  std::vector<PrintedPart> Prints() const;
  std::string Text() const;
};

/// The foot of each dome is that of the skin: its wall up to a plate over the base's lip, its flange and its screws. On the plate
/// stands the upper part of a sphere about the camera's optical centre, as thick as the skin. Marks are holes, or bumps where
/// Marks says so, three times denser at the horizon than at the top, and as many as \a points, or as have room on the small dome.
/// Domes carry no marker. The result does not depend on the number of threads. \throws as MakeShell; Error(InvalidParameter) for
/// domes that the base has no room for
CalibrationRig MakeRig(const BodySurface& body, const ShellParameters& shell, const RigParameters& rig, int points,
                       const Progress& progress = {});

} // namespace echorama
