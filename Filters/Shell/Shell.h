// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "ShellDesign.h"
#include <optional>

namespace echorama {

/// A solid to print.
struct ShellPart {
  TriangleSurface surface; ///< in the body's frame
  SurfaceReport check;
  Eigen::Vector3d sizeMm = Eigen::Vector3d::Zero(); ///< as it stands on the printer, Up upwards
  bool fits = false;                                ///< the printer, turned by a quarter or not

  /// "300.1 x 240.2 x 150.0 mm, 1200 triangles, 45.2 cm^3".
  std::string Text() const;
};

/// The wall as it came out, at random places of the inner surface where it is plain: away from rim, flange and marks.
struct WallThickness {
  std::size_t places = 0;
  double leastMm = 0.0, mostMm = 0.0, meanMm = 0.0; ///< as Measured says
  double leastWallMm = 0.0;                         ///< to the nearest place of the surface, whatever Measured says
};

/// What a printer makes at once.
struct PrintedPart {
  std::string name; ///< "skin", or "skin 2" of those that it is cut into
  ShellPart part;
};

struct Shell {
  ShellPart skin, base;
  std::vector<PrintedPart> cut; ///< what skin or base, or both, are cut into for the printer
  WallThickness thickness;
  Eigen::Vector3d camera = Eigen::Vector3d::Zero(); ///< its optical centre, in the body's frame; it looks along Up
  Pose bodyToShell = Pose::Identity();
  std::optional<std::uint32_t> markerId;
  std::vector<ShellMark> marks;  ///< those given, on the surface, in the body's frame
  std::vector<std::size_t> left; ///< which of those given they are

  /// What was made and found, line by line.
  std::string Text() const;
  /// All that is to be printed: skin and base, or what they are cut into.
  std::vector<PrintedPart> Prints() const;
};

/// Makes both parts. The outer surface is the body's: its points lie on it, and the triangles between them are off by
/// about resolution^2 / (2 radius of curvature); the inner one likewise lies at the thickness below it.
///
/// Cost: grows about with the square of 1 / resolution; BenchmarkShell measures it (Documentation/shell.md). The result does not
/// depend on the number of threads. \param marks in the body's frame; they are moved onto its surface, and those below the plane
/// of the opening are left out \throws Error(InvalidParameter) as ShellParameters::Check and BodyToShell; Error(BadInput) for a
/// mark that is not finite; Error(NotPossible) when the body is too thin for the wall, a part falls into pieces or does not come
/// out sound; Error(TooLarge); Error(Cancelled)
Shell MakeShell(const BodySurface& body, const ShellParameters& parameters = {}, const std::vector<Eigen::Vector3d>& marks = {},
                const Progress& progress = {});

/// The body, moved. \throws as BodySurface
BodySurface MovedBody(const BodySurface& body, const Pose& pose, const Progress& progress = {});

/// Measures a part that stands upright, moves it back to the body's frame, and checks it. \throws Error(NotPossible) when it is
/// empty, not sound or in pieces
void FinishPart(ShellPart& part, const std::string& name, const Pose& back, const Eigen::Vector3d& printerMm,
                const Progress& progress = {});

/// \throws Error(NotPossible) that says how large the parts to print and the printer are, when one does not fit
void CheckPrinter(const std::vector<PrintedPart>& prints, const ShellParameters& parameters);

} // namespace echorama
