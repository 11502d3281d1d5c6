// SPDX-License-Identifier: BSD-3-Clause
#include "CalibrationStage.h"
#include "Core/Base/TextFile.h"
#include "Testing/TemporaryFolder.h"
#include "Tracking/Optical/SurfaceFile.h"
#include <regex>

namespace {

using namespace echorama;
using namespace echorama::calibration_stage;

class SurfaceFile : public echorama::testing::TemporaryFolder {
protected:
  // Made once: it is a whole calibration.
  static const CalibratedSurface& Surface()
  {
    static const CalibratedSurface surface = [] {
      Stage stage(60);
      SurfaceCalibration session(stage.marks, stage.skin, stage.nominal, stage.nominalPlace);
      stage.VisitAll(session);
      CalibratedSurface made;
      made.map = session.Fit().map;
      made.brightness = session.Brightness();
      made.shell = "belly-7";
      made.camera = "camera:0?exposureMs=8";
      made.date = "2026-11-26";
      made.lights = {3, 2, false};
      made.tracks.slotMs = made.tracks.frameMs = 10.0;
      made.detector.threshold = 12.5;
      made.marks = stage.marks;
      const CalibrationStatus& status = session.Status();
      made.accuracy = {60,
                       59,
                       status.report.heldOutMedianMm,
                       status.report.heldOut95Mm,
                       status.report.heldOutMostMm,
                       status.scatterMm,
                       status.ownMm,
                       status.coverage};
      return made;
    }();
    return surface;
  }

  // The file, with what \a pattern finds replaced, is refused with these words.
  void ExpectDamage(const std::string& pattern, const std::string& replacement, const std::string& words)
  {
    WriteSurface(Path("s.json"), Surface());
    const std::string text = ReadTextFile(Path("s.json"));
    const std::string damaged =
        std::regex_replace(text, std::regex(pattern), replacement, std::regex_constants::format_first_only);
    ASSERT_NE(damaged, text) << pattern;
    Put("s.json", damaged);
    echorama::testing::ExpectRefused([&] { ReadSurface(Path("s.json")); }, Error::Kind::BadFile, Path("s.json"), words);
  }
};

TEST_F(SurfaceFile, ComesBackToTheLastBit)
{
  const CalibratedSurface& before = Surface();
  WriteSurface(Path("s.json"), before);
  EXPECT_EQ(FileCount(), 2);
  const CalibratedSurface after = ReadSurface(Path("s.json"));
  const SurfaceMapState &a = before.map.State(), &b = after.map.State();
  EXPECT_EQ(a.optics.lens.focal, b.optics.lens.focal);
  EXPECT_EQ(a.optics.lens.k4, b.optics.lens.k4);
  EXPECT_EQ(a.optics.lens.maximumAngle, b.optics.lens.maximumAngle);
  EXPECT_EQ(a.cameraToShell.matrix(), b.cameraToShell.matrix());
  EXPECT_EQ(a.covariance.rows(), b.covariance.rows());
  EXPECT_EQ(Eigen::MatrixXd(a.covariance.triangularView<Eigen::Lower>()),
            Eigen::MatrixXd(b.covariance.triangularView<Eigen::Lower>()));
  EXPECT_EQ(b.covariance, b.covariance.transpose());
  EXPECT_EQ(a.optics.residual.weights, b.optics.residual.weights);
  EXPECT_EQ(a.covered.reach, b.covered.reach);
  EXPECT_EQ(before.brightness.peak, after.brightness.peak);
  EXPECT_EQ(after.brightness.columns, 9);
  EXPECT_EQ(after.shell, "belly-7");
  EXPECT_EQ(after.camera, before.camera);
  EXPECT_EQ(after.date, "2026-11-26");
  EXPECT_EQ(after.lights.lights, 3);
  EXPECT_EQ(after.lights.offSlots, 2);
  EXPECT_EQ(after.tracks.slotMs, 10.0);
  EXPECT_EQ(after.detector.threshold, 12.5);
  EXPECT_EQ(after.accuracy.mm95, before.accuracy.mm95);
  EXPECT_EQ(after.accuracy.inliers, 59);
  EXPECT_EQ(after.marks, before.marks);
  int mapped = 0;
  for (double y = 10.0; y < 480.0; y += 37.0) // through the mesh as well, whose points may come in another order
    for (double x = 10.0; x < 640.0; x += 41.0) {
      const MappedPoint p = before.map.Map({x, y}), q = after.map.Map({x, y});
      EXPECT_EQ(p.status, q.status);
      EXPECT_LT((p.point - q.point).norm(), 1e-5);
      EXPECT_LT((p.normal - q.normal).norm(), 1e-5);
      EXPECT_LT((p.covariance - q.covariance).norm(), 1e-6 * (1e-9 + p.covariance.norm()) + 1e-12);
      mapped += p.status == MappedPoint::Status::Mapped;
    }
  EXPECT_GT(mapped, 40);
  WriteSurface(Path("t.json"), after);
  EXPECT_EQ(std::regex_replace(ReadTextFile(Path("t.json")), std::regex("t\\.mesh\\.stl"), "s.mesh.stl"),
            ReadTextFile(Path("s.json")));
  EXPECT_EQ(after.MakeTracker().Lights().size(), 3u);
}

TEST_F(SurfaceFile, TwoLightsInTurnAndNoBrightnessComeBackToo)
{
  CalibratedSurface surface = Surface();
  surface.lights = {2, 2, true};
  surface.tracks.triggered = true;
  surface.brightness = {};
  WriteSurface(Path("s.json"), surface);
  const CalibratedSurface after = ReadSurface(Path("s.json"));
  EXPECT_TRUE(after.lights.Code().NeedsTrigger());
  EXPECT_TRUE(after.brightness.Empty());
}

TEST_F(SurfaceFile, AnotherPictureOrShellIsRefused)
{
  using echorama::testing::ExpectRefused;
  const CalibratedSurface& surface = Surface();
  surface.CheckPicture(640, 480, "s.json");
  surface.CheckShell("belly-7", "s.json");
  ExpectRefused([&] { surface.CheckPicture(1280, 720, "s.json"); }, Error::Kind::BadInput, "s.json",
                "calibrated with pictures of 640 x 480 and now gives 1280 x 720");
  ExpectRefused([&] { surface.CheckPicture(480, 640, "s.json"); }, Error::Kind::BadInput, "s.json", "480 x 640");
  ExpectRefused([&] { surface.CheckShell("belly-8", "s.json"); }, Error::Kind::BadInput, "s.json",
                "made in the shell \"belly-7\", and \"belly-8\" is mounted");
}

TEST_F(SurfaceFile, AMeshThatIsMissingOrAnotherIsRefused)
{
  using echorama::testing::ExpectRefused;
  WriteSurface(Path("s.json"), Surface());
  std::string mesh = ReadTextFile(Path("s.mesh.stl"));
  mesh[1000] = static_cast<char>(mesh[1000] ^ 1);
  Put("s.mesh.stl", mesh);
  ExpectRefused([&] { ReadSurface(Path("s.json")); }, Error::Kind::BadFile, Path("s.json"),
                "is not the one that it was calibrated with");
  std::filesystem::remove(Path("s.mesh.stl"));
  ExpectRefused([&] { ReadSurface(Path("s.json")); }, Error::Kind::FileSystem, Path("s.json"),
                Path("s.mesh.stl") + " is missing");
  ExpectRefused([&] { ReadSurface(Path("t.json")); }, Error::Kind::FileSystem, Path("t.json"), "cannot be read");
  // Nor is a name that no file can have anything worse than missing.
  const std::string text = ReadTextFile(Path("s.json")), name = "s.mesh.stl", longName(300, 'm');
  ASSERT_NE(text.find(name), std::string::npos);
  Put("s.json", std::string(text).replace(text.find(name), name.size(), longName));
  ExpectRefused([&] { ReadSurface(Path("s.json")); }, Error::Kind::FileSystem, Path("s.json"), longName + " is missing");
}

TEST_F(SurfaceFile, DamageIsNamedByItsKey)
{
  ExpectDamage("echorama-surface-1", "echorama-surface-2", "schema: \"echorama-surface-2\" is not known");
  ExpectDamage("\"focal\": [0-9.]*", "\"focal\": \"long\"", "lens.focal: a number is needed");
  ExpectDamage("\"focal\": [0-9.]*", "\"focal\": -3", "lens.focal: -3");
  ExpectDamage("\"lens\"", "\"lense\"", "\"lens\" is missing");
  ExpectDamage("\"date\"", "\"day\"", "day: there is no such key");
  ExpectDamage("\"words\": \"[01]", "\"words\": \"1111", "one light would be taken for another");
  ExpectDamage("\"file\": \"", "\"file\": \"../", "a name without a folder is needed");
  ExpectDamage("\"checksum\": \"..", "\"checksum\": \"", "16 hexadecimal digits");
  ExpectDamage("\"covariance\": \\[\\s*[-0-9.e]*,", "\"covariance\": [", "the covariance must have");
  ExpectDamage("\"reach\": \\[\\s*[-0-9.e]*,", "\"reach\": [", "the part of the picture that it covers is none");
  ExpectDamage("\"peak\": \\[\\s*[-0-9.e]*,", "\"peak\": [", "each node needs a peak and a size");
  ExpectDamage("\"pixels\": \\[\\s*[-0-9.e]*,", "\"pixels\": [", "pixels are pairs of numbers");
  ExpectDamage("\"x\": \\[\\s*[-0-9.e]*,", "\"x\": [ 0.5,", "unit vectors at right angles");
  ExpectDamage("\\}\\s*$", "", "");
}

TEST_F(SurfaceFile, WhatItCannotHoldIsNotWritten)
{
  CalibratedSurface surface = Surface();
  surface.tracks.exposureMs = 50.0; // longer than a frame
  EXPECT_THROW(WriteSurface(Path("s.json"), surface), Error);
  surface = Surface();
  surface.marks[3].x() = std::nan("");
  EXPECT_THROW(WriteSurface(Path("s.json"), surface), Error);
  EXPECT_THROW(WriteSurface(Path("s.txt"), Surface()), Error);
  EXPECT_THROW(WriteSurface(Path("s.json"), CalibratedSurface()), Error);
  EXPECT_EQ(FileCount(), 0);
  WriteSurface(Path("s.json"), Surface());
  const std::string before = ReadTextFile(Path("s.json"));
  EXPECT_THROW(WriteSurface(Path("s.json"), surface), Error);
  EXPECT_EQ(ReadTextFile(Path("s.json")), before) << "a failure leaves what was there";
  EXPECT_THROW(WriteSurface(Path("no/s.json"), Surface()), Error);
}

} // namespace
