// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// What the tests of sessions, projects and backups have in common.
#include "Core/Base/Random.h"
#include "Widgets/Session/ProjectFile.h"
#include <filesystem>
#include <fstream>
#include <gtest/gtest.h>
#include <iterator>
#include <string>
#include <unistd.h>

namespace echorama {

inline Pose SomePose(Random& random, double millimetres = 40.0)
{
  return MotionAbout(20.0 * random.Direction(), 2.5 * random.Direction(), millimetres * random.Direction());
}

inline SessionVolume SomeVolume(Random& random, const std::string& name, const std::string& file = {})
{
  SessionVolume volume;
  volume.name = name;
  volume.file = file;
  volume.geometry.dimensions = {30, 25, 20};
  volume.geometry.origin = 50.0 * random.Direction();
  volume.geometry.spacing = {0.2 + random.Uniform(), 0.2 + random.Uniform(), 0.2 + random.Uniform()};
  volume.geometry.direction = ExpRotation(2.0 * random.Direction());
  return volume;
}

inline Stroke SomeStroke(Random& random)
{
  Stroke stroke;
  stroke.brush.mode = static_cast<BrushMode>(random.Below(3));
  stroke.brush.radiusMm = 0.1 + 10.0 * random.Uniform();
  stroke.brush.intensity = random.Uniform(-100.0, 300.0);
  stroke.brush.opacity = random.Uniform();
  stroke.brush.hardness = random.Uniform();
  stroke.brush.insideValid = random.Below(2) == 0;
  for (std::uint64_t i = 0, count = 1 + random.Below(8); i < count; ++i)
    stroke.pathMm.push_back(30.0 * random.Direction());
  return stroke;
}

/// A project with everything in it; its files lie in \a folder, as ids from 1 tell.
inline Project SomeProject(std::uint64_t seed, const std::string& folder)
{
  Random random(seed);
  Project project;
  for (int i = 0; i < 3; ++i) {
    SessionVolume volume = SomeVolume(random, "volume \"" + std::to_string(i) + "\"", folder + "/v" + std::to_string(i) + ".mha");
    volume.id = i + 1;
    volume.volumeToWorld = SomePose(random);
    volume.colour = {random.Uniform(), random.Uniform(), 0.1};
    volume.opacity = random.Uniform();
    volume.visible = i != 1;
    volume.group = i == 0 ? 0 : 4;
    for (int stroke = 0; stroke < 3 * i; ++stroke)
      volume.strokes = Append(volume.strokes, SomeStroke(random));
    project.state.volumes.push_back(volume);
  }
  project.truth = folder + "/truth.json";
  project.comment = "seed " + std::to_string(seed);
  return project;
}

/// A folder of its own for each test.
class FolderTest : public ::testing::Test {
protected:
  void SetUp() override
  {
    folder =
        std::filesystem::canonical(std::filesystem::temp_directory_path()) /
        ("echorama-" + std::string(::testing::UnitTest::GetInstance()->current_test_info()->name()) + std::to_string(getpid()));
    std::filesystem::create_directories(folder);
  }
  void TearDown() override { std::filesystem::remove_all(folder); }
  std::string Path(const std::string& name = {}) const { return name.empty() ? folder.string() : (folder / name).string(); }
  static void Put(const std::string& path, const std::string& text) { std::ofstream(path, std::ios::binary) << text; }
  static std::string Text(const std::string& path)
  {
    std::ifstream stream(path, std::ios::binary);
    return std::string(std::istreambuf_iterator<char>(stream), {});
  }
  std::filesystem::path folder;
};

} // namespace echorama
