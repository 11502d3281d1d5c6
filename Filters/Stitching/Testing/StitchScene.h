// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Scenes of volumes to stitch, and their result, for the tests of stitching.
#include "Core/Base/Error.h"
#include "Filters/Stitching/Stitch.h"
#include "Filters/Stitching/StitchGrid.h"
#include <deque>
#include <gtest/gtest.h>

namespace echorama::testing_scene {

// Volumes of a test, which own their voxels.
template <class T>
struct Scene {
  std::deque<Volume<T>> values;
  std::deque<Volume<unsigned char>> masks;
  std::vector<StitchInput> inputs;
  std::vector<ImageGeometry> geometries;

  void Add(Volume<T> voxels, Volume<unsigned char> mask, const ImageGeometry& geometry)
  {
    values.push_back(std::move(voxels));
    masks.push_back(std::move(mask));
    geometries.push_back(geometry);
    const auto& valid = masks.back();
    inputs.push_back(
        {PosedVolume<T>{values.back().View(), valid.Dimensions()[0] ? valid.View() : VolumeView<const unsigned char>(), geometry},
         "volume " + std::to_string(inputs.size() + 1)});
  }

  // A box of voxels of one value, its first voxel at whole millimetres.
  void AddBox(std::array<int, 3> first, std::array<int, 3> size, T value)
  {
    ImageGeometry geometry;
    geometry.dimensions = size;
    geometry.origin = Eigen::Vector3d(first[0], first[1], first[2]);
    Add(Volume<T>(size, value), {}, geometry);
  }
};

template <class T>
struct Result {
  ImageGeometry grid;
  Volume<T> intensity;
  Volume<unsigned char> valid, coverage;
  std::vector<Volume<float>> weights;
};

inline StitchParameters With(StitchMethod method, double sharpness = 1.5)
{
  StitchParameters parameters;
  parameters.method = method;
  parameters.texture = StitchTexture::Mix;
  parameters.sharpness = sharpness;
  return parameters;
}

template <class T>
Result<T> Stitched(const Scene<T>& scene, const StitchParameters& parameters = With(StitchMethod::Distance), double spacing = 0.0,
                   const Progress& progress = {})
{
  Result<T> result;
  result.grid = StitchGrid(scene.geometries, spacing);
  const auto& n = result.grid.dimensions;
  result.intensity = Volume<T>(n, T(99));
  result.valid = Volume<unsigned char>(n, 99);
  result.coverage = Volume<unsigned char>(n, 99);
  result.weights.assign(scene.inputs.size(), Volume<float>(n, 99.0f));
  StitchOutput<T> output{result.intensity.View(), result.valid.View(), result.coverage.View(), {}};
  for (auto& weights : result.weights)
    output.weights.push_back(weights.View());
  Stitch(parameters, scene.inputs, result.grid, output, progress);
  return result;
}

template <class T>
std::string ErrorOf(const Scene<T>& scene, const StitchParameters& parameters = With(StitchMethod::Distance))
{
  try {
    Stitched(scene, parameters);
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

template <class T>
void ExpectSoundWeights(const Result<T>& result)
{
  for (std::ptrdiff_t i = 0; i < result.valid.View().Size(); ++i) {
    double sum = 0.0;
    for (const auto& weights : result.weights) {
      ASSERT_GE(weights.View()[i], 0.0f);
      ASSERT_LE(weights.View()[i], 1.0f);
      sum += weights.View()[i];
    }
    ASSERT_NEAR(sum, result.valid.View()[i] ? 1.0 : 0.0, 1e-5);
    ASSERT_EQ(result.valid.View()[i], result.coverage.View()[i] > 0);
  }
}

} // namespace echorama::testing_scene
