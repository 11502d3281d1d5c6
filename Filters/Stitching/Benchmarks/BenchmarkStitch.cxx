// SPDX-License-Identifier: BSD-3-Clause
// Stitching: time, and mean absolute error against the truth, inside and outside the overlap. `seam` compares how much the
// error changes from one voxel to the next where the number of volumes changes with how much it does elsewhere: 1 is no
// seam. The peer does the plain average with filters of VTK: reslice each volume and its mask onto the grid, multiply, sum,
// divide.
#include "Core/Base/Parallel.h"
#include "Core/Base/Random.h"
#include "Core/Imaging/Sampling.h"
#include "Filters/Stitching/Stitch.h"
#include "Filters/Stitching/StitchGrid.h"
#include "Testing/Benchmark.h"
#include <cmath>
#include <cstring>
#include <filesystem>
#include <functional>

#ifdef ECHORAMA_WITH_VTK
#include <vtkImageData.h>
#include <vtkImageMathematics.h>
#include <vtkImageReslice.h>
#include <vtkMatrix4x4.h>
#include <vtkMatrixToLinearTransform.h>
#include <vtkMetaImageReader.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkSmartPointer.h>
#include <vtkUnsignedCharArray.h>
#endif

using namespace echorama;

namespace {

using Byte = unsigned char;

struct Case {
  std::string name;
  std::vector<Volume<Byte>> values, masks;
  std::vector<ImageGeometry> geometries;
  ImageGeometry grid;
  Volume<float> truth; ///< NaN where it is not known

  std::vector<StitchInput> Inputs() const
  {
    std::vector<StitchInput> inputs;
    for (std::size_t v = 0; v < values.size(); ++v)
      inputs.push_back({PosedVolume<Byte>{values[v].View(), masks[v].View(), geometries[v]}, "volume " + std::to_string(v + 1)});
    return inputs;
  }
};

struct Result {
  Volume<Byte> intensity, valid, coverage;
};

// Smooth anatomy, and texture that is fixed to the material.
double Material(const Eigen::Vector3d& p)
{
  const double anatomy = std::sin(0.11 * p[0]) * std::sin(0.13 * p[1] + 0.5) + std::sin(0.07 * (p[0] + p[1] + p[2]));
  const double texture = std::sin(1.1 * p[0] + 0.9 * p[2]) * std::sin(0.8 * p[1] - 0.7 * p[2] + 0.3 * p[0]);
  return 110.0 + 30.0 * anatomy + 12.0 * texture;
}

// A row of fan-shaped views of the material, each turned a little, with gains that differ by up to ten grey levels.
Case Synthetic(const std::string& name, int count, int size, double step)
{
  Case result;
  result.name = name;
  for (int v = 0; v < count; ++v) {
    Random random(7, static_cast<std::uint64_t>(v));
    ImageGeometry geometry;
    geometry.dimensions = {size, size, size};
    geometry.spacing.setConstant(0.5);
    const Eigen::Vector3d turn = 0.15 * random.Direction();
    geometry = geometry.Moved(MotionAbout(geometry.Centre(), turn, {step * size * 0.5 * v, 0.0, 0.0}));
    const double gain = v % 2 ? 5.0 : -5.0;
    Volume<Byte> values(geometry.dimensions), mask(geometry.dimensions);
    const Eigen::Affine3d map = geometry.IndexToWorld();
    ParallelFor(size, [&](std::ptrdiff_t k) {
      Random noise(8 + static_cast<std::uint64_t>(v), static_cast<std::uint64_t>(k));
      for (int j = 0; j < size; ++j)
        for (int i = 0; i < size; ++i) {
          const double half = 0.5 * (size - 1), x = i - half, y = j - half, z = static_cast<double>(k) + 0.3 * size;
          mask.View()(i, j, static_cast<int>(k)) =
              std::hypot(x, y, z) < 1.28 * size && std::abs(x) < 0.4 * z && std::abs(y) < 0.4 * z;
          const double value = Material(map * Eigen::Vector3d(i, j, static_cast<double>(k))) + gain + 3.0 * noise.Normal();
          values.View()(i, j, static_cast<int>(k)) = static_cast<Byte>(std::lround(std::clamp(value, 0.0, 255.0)));
        }
    });
    result.values.push_back(std::move(values));
    result.masks.push_back(std::move(mask));
    result.geometries.push_back(geometry);
  }
  result.grid = StitchGrid(result.geometries);
  result.truth = Volume<float>(result.grid.dimensions);
  const Eigen::Affine3d map = result.grid.IndexToWorld();
  ParallelFor(result.grid.dimensions[2], [&](std::ptrdiff_t k) {
    for (int j = 0; j < result.grid.dimensions[1]; ++j)
      for (int i = 0; i < result.grid.dimensions[0]; ++i)
        result.truth.View()(i, j, static_cast<int>(k)) =
            static_cast<float>(Material(map * Eigen::Vector3d(i, j, static_cast<double>(k))));
  });
  return result;
}

Result Stitched(const Case& scene, StitchMethod method)
{
  const auto& n = scene.grid.dimensions;
  Result result{Volume<Byte>(n), Volume<Byte>(n), Volume<Byte>(n)};
  StitchParameters parameters;
  parameters.method = method;
  Stitch<Byte>(parameters, scene.Inputs(), scene.grid,
               {result.intensity.View(), result.valid.View(), result.coverage.View(), {}});
  return result;
}

void ReportErrors(const Case& scene, const std::string& method, double seconds, const Result& result)
{
  const auto& n = scene.grid.dimensions;
  const auto known = [&](std::ptrdiff_t at) { return result.valid.View()[at] && !std::isnan(scene.truth.View()[at]); };
  const auto error = [&](std::ptrdiff_t at) { return result.intensity.View()[at] - scene.truth.View()[at]; };
  double sums[2] = {0.0, 0.0}, steps[2] = {0.0, 0.0};
  std::ptrdiff_t counts[2] = {0, 0}, faces[2] = {0, 0};
  const std::ptrdiff_t strides[3] = {1, n[0], static_cast<std::ptrdiff_t>(n[0]) * n[1]};
  for (int k = 0; k < n[2]; ++k)
    for (int j = 0; j < n[1]; ++j)
      for (int i = 0; i < n[0]; ++i) {
        const std::ptrdiff_t at = k * strides[2] + j * strides[1] + i;
        if (!known(at))
          continue;
        const bool overlap = result.coverage.View()[at] > 1;
        sums[overlap] += std::abs(error(at));
        ++counts[overlap];
        const bool next[3] = {i + 1 < n[0], j + 1 < n[1], k + 1 < n[2]};
        for (int axis = 0; axis < 3; ++axis)
          if (next[axis] && known(at + strides[axis])) {
            const bool change = result.coverage.View()[at] != result.coverage.View()[at + strides[axis]];
            steps[change] += std::abs(error(at) - error(at + strides[axis]));
            ++faces[change];
          }
      }
  benchmark::Report("stitch", scene.name, method, seconds, (sums[0] + sums[1]) / static_cast<double>(counts[0] + counts[1]),
                    "grey",
                    {{"error_overlap", sums[1] / static_cast<double>(counts[1])},
                     {"error_outside", sums[0] / static_cast<double>(counts[0])},
                     {"seam", steps[1] / static_cast<double>(faces[1]) / (steps[0] / static_cast<double>(faces[0]))},
                     {"voxels", result.valid.View().Size()}});
}

#ifdef ECHORAMA_WITH_VTK

vtkSmartPointer<vtkImageData> VtkImageOf(const Volume<Byte>& voxels, const ImageGeometry& geometry)
{
  auto image = vtkSmartPointer<vtkImageData>::New();
  image->SetDimensions(geometry.dimensions.data());
  image->SetSpacing(geometry.spacing.data());
  vtkNew<vtkUnsignedCharArray> array;
  array->SetArray(const_cast<Byte*>(voxels.View().Data()), voxels.View().Size(), 1);
  image->GetPointData()->SetScalars(array);
  return image;
}

// The chain: voxels outside of a mask are 0 already, so that they add nothing to the sum.
Result VtkAverage(const Case& scene, const std::vector<vtkSmartPointer<vtkImageData>>& values,
                  const std::vector<vtkSmartPointer<vtkImageData>>& masks)
{
  const auto& n = scene.grid.dimensions;
  vtkSmartPointer<vtkImageData> sum, count;
  for (std::size_t v = 0; v < values.size(); ++v) {
    // From the grid to the volume's own axes and origin: the reslicer knows of no directions.
    const ImageGeometry& geometry = scene.geometries[v];
    Eigen::Affine3d map = geometry.WorldToIndex() * scene.grid.IndexToWorld() * scene.grid.spacing.cwiseInverse().asDiagonal();
    map = geometry.spacing.asDiagonal() * map;
    const Eigen::Matrix<double, 4, 4, Eigen::RowMajor> rows = map.matrix();
    vtkNew<vtkMatrix4x4> matrix;
    matrix->DeepCopy(rows.data());
    vtkNew<vtkMatrixToLinearTransform> transform;
    transform->SetInput(matrix);
    const auto reslice = [&](vtkImageData* image, bool linear, int type) {
      vtkNew<vtkImageReslice> filter;
      filter->SetInputData(image);
      filter->SetResliceTransform(transform);
      filter->SetOutputOrigin(0.0, 0.0, 0.0);
      filter->SetOutputSpacing(scene.grid.spacing.data());
      filter->SetOutputExtent(0, n[0] - 1, 0, n[1] - 1, 0, n[2] - 1);
      filter->SetInterpolationMode(linear ? VTK_RESLICE_LINEAR : VTK_RESLICE_NEAREST);
      filter->SetOutputScalarType(type);
      filter->Update();
      return vtkSmartPointer<vtkImageData>(filter->GetOutput());
    };
    const auto combine = [](vtkImageData* a, vtkImageData* b, int operation) {
      vtkNew<vtkImageMathematics> filter;
      filter->SetOperation(operation);
      filter->SetInput1Data(a);
      filter->SetInput2Data(b);
      filter->DivideByZeroToCOn();
      filter->SetConstantC(0.0);
      filter->Update();
      return vtkSmartPointer<vtkImageData>(filter->GetOutput());
    };
    const auto mask = reslice(masks[v], false, VTK_FLOAT);
    const auto part = combine(reslice(values[v], true, VTK_FLOAT), mask, VTK_MULTIPLY);
    sum = sum ? combine(sum, part, VTK_ADD) : part;
    count = count ? combine(count, mask, VTK_ADD) : mask;
    if (v + 1 == values.size())
      sum = combine(sum, count, VTK_DIVIDE);
  }
  Result result{Volume<Byte>(n), Volume<Byte>(n), Volume<Byte>(n)};
  const float* mean = static_cast<const float*>(sum->GetScalarPointer());
  const float* covered = static_cast<const float*>(count->GetScalarPointer());
  for (std::ptrdiff_t at = 0; at < result.valid.View().Size(); ++at) {
    result.intensity.View()[at] = static_cast<Byte>(mean[at] + 0.5f);
    result.coverage.View()[at] = static_cast<Byte>(covered[at]);
    result.valid.View()[at] = covered[at] > 0.0f;
  }
  return result;
}

// A MetaImage of bytes, axes along the world. Not real: the zeros that are connected to the border.
void ReadBytes(const std::string& path, Volume<Byte>& values, Volume<Byte>& mask, ImageGeometry& geometry)
{
  vtkNew<vtkMetaImageReader> reader;
  reader->SetFileName(path.c_str());
  reader->Update();
  vtkImageData* image = reader->GetOutput();
  image->GetDimensions(geometry.dimensions.data());
  image->GetSpacing(geometry.spacing.data());
  image->GetOrigin(geometry.origin.data());
  values = Volume<Byte>(geometry.dimensions);
  std::memcpy(values.View().Data(), image->GetScalarPointer(), geometry.VoxelCount());
  mask = Volume<Byte>(geometry.dimensions, 1);
  const auto& n = geometry.dimensions;
  std::vector<std::array<int, 3>> open;
  const auto visit = [&](int i, int j, int k) {
    if (i >= 0 && j >= 0 && k >= 0 && i < n[0] && j < n[1] && k < n[2] && mask.View()(i, j, k) && values.View()(i, j, k) == 0) {
      mask.View()(i, j, k) = 0;
      open.push_back({i, j, k});
    }
  };
  for (int k = 0; k < n[2]; ++k)
    for (int j = 0; j < n[1]; ++j)
      for (int i = 0; i < n[0]; ++i)
        if (i == 0 || j == 0 || k == 0 || i + 1 == n[0] || j + 1 == n[1] || k + 1 == n[2])
          visit(i, j, k);
  while (!open.empty()) {
    const auto [i, j, k] = open.back();
    open.pop_back();
    visit(i - 1, j, k);
    visit(i + 1, j, k);
    visit(i, j - 1, k);
    visit(i, j + 1, k);
    visit(i, j, k - 1);
    visit(i, j, k + 1);
  }
}

bool Liver(Case& scene)
{
  const std::filesystem::path folder = std::filesystem::path(ECHORAMA_SOURCE_DIR) / "../shared/data/liver";
  if (!std::filesystem::exists(folder / "liver_volume_full.mha"))
    return false;
  scene.name = "liver A + B";
  scene.values.resize(2);
  scene.masks.resize(2);
  scene.geometries.resize(2);
  ReadBytes(folder / "liver_volume_A.mha", scene.values[0], scene.masks[0], scene.geometries[0]);
  ReadBytes(folder / "liver_volume_B.mha", scene.values[1], scene.masks[1], scene.geometries[1]);
  scene.grid = StitchGrid(scene.geometries);
  Volume<Byte> values, mask;
  ImageGeometry geometry;
  ReadBytes(folder / "liver_volume_full.mha", values, mask, geometry);
  const Sampler<Byte> full(values.View(), mask.View());
  scene.truth = Volume<float>(scene.grid.dimensions, std::numeric_limits<float>::quiet_NaN());
  const Eigen::Affine3d map = geometry.WorldToIndex() * scene.grid.IndexToWorld();
  ParallelFor(scene.grid.dimensions[2], [&](std::ptrdiff_t k) {
    for (int j = 0; j < scene.grid.dimensions[1]; ++j)
      for (int i = 0; i < scene.grid.dimensions[0]; ++i) {
        const Eigen::Vector3d at = map * Eigen::Vector3d(i, j, static_cast<double>(k));
        double value = 0.0;
        if (full.Linear(at[0], at[1], at[2], value))
          scene.truth.View()(i, j, static_cast<int>(k)) = static_cast<float>(value);
      }
  });
  return true;
}

#endif

void Measure(const Case& scene)
{
  const std::pair<StitchMethod, const char*> methods[] = {{StitchMethod::Distance, "distance"},
                                                          {StitchMethod::Feather, "feather"},
                                                          {StitchMethod::Average, "average"},
                                                          {StitchMethod::Maximum, "maximum"}};
  for (const auto& [method, name] : methods) {
    Result result;
    const StitchMethod which = method;
    const auto ours = [&] { result = Stitched(scene, which); };
#ifdef ECHORAMA_WITH_VTK
    if (method == StitchMethod::Average) {
      std::vector<vtkSmartPointer<vtkImageData>> values, masks;
      for (std::size_t v = 0; v < scene.values.size(); ++v) {
        values.push_back(VtkImageOf(scene.values[v], scene.geometries[v]));
        masks.push_back(VtkImageOf(scene.masks[v], scene.geometries[v]));
      }
      Result theirs;
      const auto [seconds, theirSeconds] = benchmark::Duel(
          ours, [&] { theirs = VtkAverage(scene, values, masks); }, 3);
      ReportErrors(scene, name, seconds, result);
      ReportErrors(scene, "vtk reslice and average", theirSeconds, theirs);
      continue;
    }
#endif
    const double seconds = benchmark::MedianSeconds(ours, 3);
    ReportErrors(scene, name, seconds, result);
  }
}

} // namespace

int main()
{
  Measure(Synthetic("pair 160^3", 2, 160, 0.5));
  Measure(Synthetic("chain of 5, 96^3", 5, 96, 0.3));
#ifdef ECHORAMA_WITH_VTK
  Case liver;
  if (Liver(liver))
    Measure(liver);
  else
    std::cerr << "no liver volumes beside the project: that case is left out\n";
#endif
  return 0;
}
