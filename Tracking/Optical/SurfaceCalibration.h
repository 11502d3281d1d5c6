// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Tracking/Optical/LightRest.h"
#include "Tracking/Optical/SurfaceDrift.h"
#include "Tracking/Optical/SurfaceMap.h"
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace echorama {

struct SurfaceCalibrationParameters {
  LightRestParameters rest;
  SurfaceMapParameters map;
  int passes = 4;
  int marksForMap = 24;
  double nearMm = 3.0;
  double wantedMm = 0.5;
};
ParameterList Describe(SurfaceCalibrationParameters& p);

/// What a frame has brought.
struct CalibrationStep {
  enum class Event {
    None,
    Taken,       ///< the light rested on the mark that was asked for
    TakenFor,    ///< it rested on another mark, of which that is clear: taken for it
    Nobodys,     ///< it rested where no mark is: not taken. When it rests there again it is taken for the mark that was asked for
    NotTouching, ///< too dark or too wide for a light that touches the skin there: as Nobodys
  };
  Event event = Event::None;
  int mark = 0;                     ///< the one that it was taken for, or that was asked for
  std::optional<double> distanceMm; ///< of the mark from where all others have it, before it was taken
  std::string message;              ///< what to tell the person
};

/// A mark that is not where the others put it.
struct CalibrationOutlier {
  int mark = 0;
  double distanceMm = 0.0;
  bool wasRepeated = false;
};

/// How far a calibration is. Of what a map is needed for, as of when it was fitted last.
struct CalibrationStatus {
  int marks = 0, taken = 0;
  bool hasMap = false;
  std::string complaint; ///< why there is no map although there are marks enough
  SurfaceMapReport report;
  std::vector<CalibrationOutlier> outliers; ///< furthest first
  double scatterMm = 0.0;                   ///< root mean square per axis of marks about the map: how well the light was put down
  double ownMm = 0.0;                       ///< that the map itself is off at marks, by its covariance: radius of 95%
  double coverage = 0.0;                    ///< share of the picture of the skin in which the map answers
  int gapMark = 0;                          ///< in the middle of the largest gap; 0: there is none
  double gapPx = 0.0;                       ///< from there to the nearest mark that was taken
  /// More marks would not help: the map answers in 90% of the picture of the skin, marks that were left out are as far off as
  /// they were with three quarters of the marks (within 5%), and the map itself makes less than half of that.
  bool isEnough = false;

  /// What to do, and how good it is: lines for people.
  std::vector<std::string> Lines(double wantedMm) const;
};

/// Calibration of a camera in a printed skin (dissertation 7.3) as a dialogue with a person who puts a light on numbered marks:
/// it says which mark comes next, notices when the light rests, and how good the map has become.
///
/// Marks come in their order, thinned out: with 4 passes the 1st, 5th, 9th ... first, then those halfway between, then the
/// others; so all of the skin has been visited after a quarter of the way. The map does not depend on the order in which marks
/// were taken.
class SurfaceCalibration {
public:
  /// \param marks in their order; the first has the number 1 \param lens nominal \param cameraToShell roughly; how the camera is
  /// turned about its axis need not be known \throws Error(InvalidParameter), Error(BadInput) for fewer marks than a map needs,
  /// or one that is not finite or not on the skin
  SurfaceCalibration(std::vector<Eigen::Vector3d> marks, std::shared_ptr<const TrackedSkin> skin, const FisheyeLens& lens,
                     const Pose& cameraToShell, const SurfaceCalibrationParameters& parameters = {});

  /// The light in the newest frame.
  CalibrationStep Update(const TrackedLight& light);

  /// The number of the mark to go to; 0: all were taken.
  int Next() const { return todo_.empty() ? 0 : todo_.front(); }
  const Eigen::Vector3d& PlaceOf(int mark) const { return marks_[static_cast<std::size_t>(mark) - 1]; }
  void Skip();         ///< the next one comes last
  void Back();         ///< the last one that was taken is to be done again
  void GoTo(int mark); ///< next; when it was taken it is done again. \throws Error(InvalidParameter)

  /// The map of all that was taken so far. Fitted anew only when marks have come since. \throws as FitSurfaceMap
  const FittedSurfaceMap& Fit(const Progress& progress = {});
  /// The last one that succeeded, while Status().hasMap.
  const FittedSurfaceMap& Fitted() const { return fitted_; }
  const CalibrationStatus& Status() const { return status_; }
  /// Of all that were taken. \throws Error(BadInput) when there are none
  BrightnessCalibration Brightness() const;
  std::vector<SurfaceObservation> Observations() const; ///< by number

private:
  struct Taken {
    SurfaceObservation observation;
    ContactSample contact;
  };
  bool LooksLifted(const RestingLight& rest) const;
  int OwnerOf(const MappedPoint& mapped, int asked) const;
  void Take(int mark, const RestingLight& rest);
  void Refit(const Progress& progress);
  Pose RoughPose(const std::vector<SurfaceObservation>& observations) const;
  void MeasureMap();
  void MeasureCoverage();
  void JudgeEnough();

  std::vector<Eigen::Vector3d> marks_;
  std::shared_ptr<const TrackedSkin> skin_;
  FisheyeLens lens_;
  Pose cameraToShell_;
  SurfaceCalibrationParameters parameters_;
  LightRest rest_;
  std::deque<int> todo_;
  std::map<int, Taken> taken_;
  std::vector<int> history_; // marks as they were taken
  std::vector<bool> wasRepeated_;
  std::optional<Eigen::Vector2d> refused_; // where a rest was not taken
  FittedSurfaceMap fitted_;
  bool isFresh_ = false; // it holds all that was taken
  std::size_t fittedMarks_ = 0;
  std::vector<std::pair<std::size_t, double>> heldOut_; // by the number of marks, mm
  CalibrationStatus status_;
};

/// Marks for a drift check: \a count of \a marks (numbers, of \a map's shell) that lie far from each other in the picture.
std::vector<int> DriftMarks(const SurfaceMap& map, const std::vector<Eigen::Vector3d>& marks, int count);

/// Marks that were visited again, against a map. \param scatterMm how well lights are put down, per axis. Those that the map does
/// not see are left out.
std::vector<DriftPoint> DriftPoints(const SurfaceMap& map, const std::vector<SurfaceObservation>& again, double scatterMm);

} // namespace echorama
