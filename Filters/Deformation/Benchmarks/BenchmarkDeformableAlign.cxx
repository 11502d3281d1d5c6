// SPDX-License-Identifier: BSD-3-Clause
// Two views of the phantom under different angles, so that their speckle is only partly the same; the tissue in the second one
// is pressed by 0 to 3 mm. Both lie where they belong, so that what is left is the deformation alone. The error is the
// distance, over the overlap, between where the second volume shows a point and where the displacement reads it.
// The peer is the B-spline transform of elastix with the same spacing of its grid, masks and normalised correlation;
// its penalty, longest step and iterations were tuned on pairs of pressed bodies. Its transform becomes a field of our own kind,
// so both are measured alike.
#include "Core/Imaging/Sampling.h"
#include "Filters/Deformation/DeformableAlign.h"
#include "Filters/Phantoms/Phantom.h"
#include "Filters/Phantoms/PhantomViews.h"
#include "Testing/Benchmark.h"
#include "Testing/ElastixPeer.h"
#include <optional>

using namespace echorama;

namespace {

struct View {
  PhantomParameters parameters;
  ImageGeometry geometry;
  Volume<unsigned char> voxels, valid;
  PosedVolume<unsigned char> Posed() const { return {voxels.View(), valid.View(), geometry}; }
};

View See(const PhantomView& view, double pressMm)
{
  View seen;
  seen.parameters.probeToWorld = view.probeToWorld;
  seen.parameters.gainDb = view.gainDb;
  seen.parameters.press.mm = pressMm;
  seen.geometry = PhantomGeometry(seen.parameters);
  seen.voxels = Volume<unsigned char>(seen.geometry.dimensions);
  seen.valid = Volume<unsigned char>(seen.geometry.dimensions);
  MakePhantom(seen.parameters, seen.voxels.View(), seen.valid.View());
  return seen;
}

struct Errors {
  double mean = 0.0, percentile95 = 0.0, largest = 0.0;
};

Errors ErrorsOf(const View& fixed, const View& moving, const DisplacementField& field)
{
  const Sampler<unsigned char> inFixed(fixed.voxels.View(), fixed.valid.View()),
      inMoving(moving.voxels.View(), moving.valid.View());
  const Eigen::Affine3d toWorld = fixed.geometry.IndexToWorld(), toMoving = moving.geometry.WorldToIndex();
  const Pose& probe = moving.parameters.probeToWorld;
  std::vector<double> errors;
  const auto& n = fixed.geometry.dimensions;
  for (int k = 0; k < n[2]; k += 3)
    for (int j = 0; j < n[1]; j += 3)
      for (int i = 0; i < n[0]; i += 3) {
        const Eigen::Vector3d x = toWorld * Eigen::Vector3d(i, j, k);
        const Eigen::Vector3d truth = probe * moving.parameters.press.Seen(probe.inverse() * x), there = toMoving * truth;
        if (inFixed.NearestIndex(i, j, k) >= 0 && inMoving.NearestIndex(there[0], there[1], there[2]) >= 0)
          errors.push_back((x + field.At(x) - truth).norm());
      }
  std::sort(errors.begin(), errors.end());
  Errors result;
  for (const double e : errors)
    result.mean += e / static_cast<double>(errors.size());
  result.percentile95 = errors[errors.size() * 95 / 100];
  result.largest = errors.back();
  return result;
}

std::string BSplineParameters(double spacingMm)
{
  return "(FixedInternalImagePixelType \"float\")\n(MovingInternalImagePixelType \"float\")\n(UseDirectionCosines \"true\")\n"
         "(Registration \"MultiMetricMultiResolutionRegistration\")\n(Interpolator \"LinearInterpolator\")\n"
         "(ResampleInterpolator \"FinalBSplineInterpolator\")\n(Resampler \"DefaultResampler\")\n"
         "(FixedImagePyramid \"FixedSmoothingImagePyramid\")\n(MovingImagePyramid \"MovingSmoothingImagePyramid\")\n"
         "(Optimizer \"AdaptiveStochasticGradientDescent\")\n(Transform \"BSplineTransform\")\n"
         "(Metric \"AdvancedNormalizedCorrelation\" \"TransformBendingEnergyPenalty\")\n(Metric0Weight 1.0)\n(Metric1Weight "
         "1000.0)\n(MaximumStepLength 0.25)\n"
         "(FinalGridSpacingInPhysicalUnits " +
         std::to_string(spacingMm) +
         ")\n(NumberOfResolutions 3)\n(MaximumNumberOfIterations 500)\n(NumberOfSpatialSamples 5000)\n"
         "(NewSamplesEveryIteration \"true\")\n(ImageSampler \"RandomCoordinate\")\n(ErodeMask \"false\")\n"
         "(RequiredRatioOfValidSamples 0.05)\n(HowToCombineTransforms \"Compose\")\n(WriteResultImage \"false\")\n"
         "(DefaultPixelValue 0)\n(RandomSeed 1)\n";
}

// Its transform as one of our fields: it maps points of the fixed volume to where the moving one shows them, too.
std::optional<DisplacementField> FieldOf(const std::string& text)
{
  const auto size = benchmark::Elastix::Numbers(text, "GridSize"), spacing = benchmark::Elastix::Numbers(text, "GridSpacing"),
             origin = benchmark::Elastix::Numbers(text, "GridOrigin"),
             direction = benchmark::Elastix::Numbers(text, "GridDirection"),
             numbers = benchmark::Elastix::Numbers(text, "TransformParameters");
  if (size.size() != 3 || spacing.size() != 3 || origin.size() != 3 || direction.size() != 9)
    return std::nullopt;
  ImageGeometry lattice;
  for (std::size_t axis = 0; axis < 3; ++axis)
    lattice.dimensions[axis] = static_cast<int>(size[axis]);
  lattice.spacing = Eigen::Map<const Eigen::Vector3d>(spacing.data());
  lattice.origin = Eigen::Map<const Eigen::Vector3d>(origin.data());
  lattice.direction = Eigen::Map<const Eigen::Matrix3d>(direction.data()); // written column by column
  const std::size_t count = lattice.VoxelCount();
  if (numbers.size() != 3 * count)
    return std::nullopt;
  std::vector<Eigen::Vector3d> coefficients;
  for (std::size_t i = 0; i < count; ++i)
    coefficients.emplace_back(numbers[i], numbers[count + i], numbers[2 * count + i]);
  return DisplacementField(lattice, coefficients);
}

void Report(const std::string& testCase, const std::string& method, double seconds, const Errors& errors,
            nlohmann::ordered_json more = {})
{
  more["percentile_95"] = errors.percentile95;
  more["largest"] = errors.largest;
  benchmark::Report("deformable_align", testCase, method, seconds, errors.mean, "mm", more);
}

} // namespace

int main()
{
  const std::vector<PhantomView> views = PhantomViews(PhantomParameters().probe, 2, 0.6);
  const bool hasPeer = benchmark::Elastix::IsInstalled();
  if (!hasPeer)
    std::cerr << "elastix is not installed: no peer\n";
  const View fixed = See(views[0], 0.0);
  const auto fixedPyramid = BuildPyramid(fixed.Posed());
  const auto fixedFeatures = BuildMetricPyramid({&fixedPyramid, Pose::Identity(), "fixed"}, "local-ncc");
  for (const double mm : {0.0, 1.0, 2.0, 3.0}) {
    const View moving = See(views[1], mm);
    const std::string testCase = "phantom, pressed by " + std::to_string(static_cast<int>(mm)) + " mm";
    Report(testCase, "rigid (the truth)", 0.0, ErrorsOf(fixed, moving, DisplacementField()));
    const auto pyramid = BuildPyramid(moving.Posed());
    const auto features = BuildMetricPyramid({&pyramid, Pose::Identity(), "moving"}, "local-ncc");
    DeformableAlignResult result;
    const double before = benchmark::CpuSeconds();
    const double seconds = benchmark::Seconds([&] {
      result = DeformableAlign({{fixedFeatures.get(), Pose::Identity(), nullptr}}, {features.get(), Pose::Identity(), nullptr});
    });
    Report(testCase, "deformable", seconds, ErrorsOf(fixed, moving, result.field),
           {{"cpu_seconds", benchmark::CpuSeconds() - before},
            {"similarity_before", result.similarityBefore},
            {"similarity_after", result.similarityAfter},
            {"gain", result.gain},
            {"applied", result.isApplied},
            {"bending_energy", result.bendingEnergy},
            {"smallest_determinant", result.smallestDeterminant},
            {"iterations", result.iterations}});
    if (!hasPeer)
      continue;
    benchmark::Elastix elastix(fixed.Posed(), moving.Posed());
    const auto text = elastix.Run(BSplineParameters(DeformableAlignParameters().controlSpacingMm));
    const auto field = text ? FieldOf(*text) : std::nullopt;
    if (field)
      Report(testCase, "elastix_bspline", elastix.Seconds(), ErrorsOf(fixed, moving, *field),
             {{"cpu_seconds", elastix.CpuSeconds()}, {"smallest_determinant", field->SmallestDeterminant()}});
    else
      std::cerr << testCase << ": elastix found nothing\n";
  }
  return 0;
}
