// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "BodySurface.h"
#include "Core/Base/Parameters.h"
#include "Core/Geometry/RigidTransform.h"
#include "ShellCut.h"
#include "Tracking/Optical/MarkerPattern.h"

namespace echorama {

/// A printed skin that lights shine through, and the base on which it stands with a camera inside (dissertation 7.2).
struct ShellParameters {
  enum class Thickness { Surface, Camera };
  enum class MarkKind { None, Holes, Bumps };

  double thicknessMm = 2.0;
  Thickness measured = Thickness::Surface;
  double resolutionMm = 0.5;
  Eigen::Vector3d up{0.0, 0.0, 1.0};
  double openingMm = 10.0;
  double flangeMm = 12.0, flangeThicknessMm = 3.0;
  int screws = 8;
  double screwMm = 3.4;
  double baseMm = 5.0;
  double baffleMm = 8.0;
  double clearanceMm = 0.3;
  double lensHoleMm = 15.0;
  Eigen::Vector3d boardMm{25.0, 24.0, 3.0};
  double lensMm = 8.0;
  MarkKind marks = MarkKind::None;
  double markMm = 5.2;
  bool marker = false;
  Eigen::Vector3d printerMm{300.0, 300.0, 300.0};
  bool cutToFit = true;
  double seamMm = 6.0;

  /// \throws Error(InvalidParameter) for what is out of its range, and for what does not fit together
  void Check() const;
};
ParameterList Describe(ShellParameters& p);

/// A place on the skin that calibration goes to.
struct ShellMark {
  Eigen::Vector3d place = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ(); ///< outwards, unit
};

/// From the body's frame to that in which a shell is made: z is up, and the middle of the opening is the origin.
/// \throws Error(InvalidParameter) for an opening that is above the body, Error(NotPossible) where the body is not
Pose BodyToShell(const ShellParameters& parameters, const TriangleSurface& body);

/// The number that a shell's marker shows: a checksum of the body and of what the skin is made with.
std::uint32_t MarkerIdOf(const ShellParameters& parameters, const TriangleSurface& body);

/// A rod along a mark's normal, negative inside, from \a low to \a high as seen from its place.
double MarkRod(const Eigen::Vector3d& place, const ShellMark& mark, double radius, double low, double high);

/// The height above the plane of the opening that marks need.
double LowestMark(const ShellParameters& parameters);

/// The two parts as functions that are negative inside: exact distances from the body, with planes, cylinders and boxes, joined
/// and cut by minimum and maximum. In the frame of BodyToShell, mm. What the printer is too small for is cut into cells, when
/// CutToFit says so.
class ShellDesign {
public:
  enum class Part { Skin, Base };

  /// What they are given must outlive it. \param markerId what Marker shows
  /// \throws Error(NotPossible) when the printer is too small, or there is no place for the marker
  ShellDesign(const ShellParameters& parameters, const BodySurface& body, std::vector<ShellMark> marks,
              std::uint32_t markerId = 0);

  const ShellParameters& Parameters() const { return p_; }
  /// The optical centre: it looks up.
  Eigen::Vector3d Camera() const;
  /// Holds all of a part.
  Eigen::AlignedBox3d Bounds(Part part) const;
  std::vector<std::uint32_t> MarksNear(const Eigen::Vector3d& middle, double distanceMm) const;
  /// What a part is cut into; empty when it is left whole.
  const std::vector<CutCell>& Cells(Part part) const { return part == Part::Skin ? skinCells_ : baseCells_; }
  /// What domes that stand in the skin's place are cut into: where the base is, for their outline is the same.
  const std::vector<CutCell>& DomeCells() const { return domeCells_; }
  /// The upper side of a plate that covers the base's lip, a clearance above it.
  double PlateMm() const { return p_.baffleMm + p_.clearanceMm + p_.flangeThicknessMm; }
  /// The holes for screws, negative inside; as Skin has them.
  double ScrewHoles(const Eigen::Vector3d& place) const;

  /// The skin, or what lies of it in a cell, at a place that is \a distance from the body.
  double Skin(const Eigen::Vector3d& place, double distance, const std::vector<std::uint32_t>& marks,
              const CutCell* cell = nullptr) const;
  /// The base; \a foot is the distance of the place below or above it in the plane of the opening.
  double Base(const Eigen::Vector3d& place, double distance, double foot, const CutCell* cell = nullptr) const;
  /// How far below the surface there may be anything of the skin near a place: of laps behind its seams, too.
  double DeepestAt(const Eigen::Vector3d& place, const CutCell* cell) const;

  /// How far a place inside lies below the surface as thickness is measured.
  double Depth(const Eigen::Vector3d& place, double distance) const;
  /// The nearest place of the outer or inner surface of the skin that one near to it belongs on.
  Eigen::Vector3d Refined(const Eigen::Vector3d& place, const CutCell* cell = nullptr) const;
  /// Whether all around, as far as \a distanceMm, there is nothing but the wall: no rim, flange, base, mark or seam.
  bool IsPlainWall(const Eigen::Vector3d& place, double distanceMm, const CutCell* cell = nullptr) const;

private:
  double Screws(const Eigen::Vector3d& place) const;
  std::optional<Eigen::Vector3d> FromOutside(const Eigen::Vector3d& place, const Eigen::Vector3d& away, double distanceMm) const;
  Eigen::AlignedBox3d FlangeBox() const;
  void PlanSkinAndBase();
  void PlaceMarker(const CutPlanes& skin);
  bool IsNearMarker(const Eigen::Vector3d& place, double distanceMm) const;
  double MarkerCells(const Eigen::Vector3d& place) const;
  void PlaceScrews(const std::vector<const CutPlanes*>& planes);
  std::vector<CutPeg> FlangePegs(const CutPlanes& planes) const;
  std::vector<CutPeg> BasePegs(const CutPlanes& planes) const;

  ShellParameters p_;
  const BodySurface& body_;
  std::vector<ShellMark> marks_;
  std::vector<Eigen::Vector2d> screws_;
  MarkerPattern marker_;
  double markerAzimuth_ = 0.0; // where its first column begins, degrees
  std::vector<CutCell> skinCells_, baseCells_, domeCells_;
};

} // namespace echorama
