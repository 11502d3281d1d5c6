// SPDX-License-Identifier: BSD-3-Clause
// The global search from far off: how often a candidate is within reach of a local alignment (8 mm and 12 degrees), at which
// rank, and in what time. On pairs of phantom volumes that share 55, 40 and 25% (gains and speckle differ from pair to pair),
// and on two real volumes of a liver whose true alignment is known. A start is 20 degrees and 25 mm off, 25 degrees and 40 mm,
// or turned to any of all rotations. "error" is the mean displacement of the best candidate that is right, median of trials.
//
// Correlation of one rotation over all translations: beside Padfield's six sums by VTK's Fourier transform (double precision,
// padded alike) and by the definition; "error" is the largest difference of the correlations from the definition.
//
// Arguments: trials of each pair (3), pairs of phantoms (4), 1 to leave out full covers of rotations.
#include "Core/Base/Random.h"
#include "Core/Imaging/ValidPoints.h"
#include "Filters/Phantoms/Phantom.h"
#include "Filters/Phantoms/PhantomViews.h"
#include "Filters/Registration/GlobalSearch.h"
#include "Filters/Registration/MaskedCorrelation.h"
#include "Readers/BorderZeros.h"
#include "Readers/ImageHeader.h"
#include "Readers/VolumeFile.h"
#include "Testing/Benchmark.h"
#include <cstdlib>
#include <ctime>
#include <filesystem>
#ifdef ECHORAMA_WITH_VTK
#include <vtkImageData.h>
#include <vtkImageFFT.h>
#include <vtkImageRFFT.h>
#include <vtkNew.h>
#include <vtkSmartPointer.h>
#endif

using namespace echorama;

namespace {

constexpr double RadiansPerDegree = 0.017453292519943295;
using Complex = MaskedCorrelator::Complex;

double Median(std::vector<double> numbers)
{
  std::sort(numbers.begin(), numbers.end());
  return numbers.empty() ? std::nan("") : numbers[numbers.size() / 2];
}

// A volume that lies where it belongs.
struct Placed {
  Placed(const ImageGeometry& geometry, const Volume<unsigned char>& voxels, const Volume<unsigned char>& valid)
    : pyramid(BuildPyramid<unsigned char>({voxels.View(), valid.View(), geometry}))
  {
    std::ptrdiff_t count = 0;
    centre = geometry.IndexToWorld() * ValidCentroid<unsigned char>(voxels.View(), valid.View(), count);
    for (const Eigen::Vector3d& p : ValidPoints<unsigned char>(voxels.View(), valid.View(), 1000, 1))
      points.push_back(geometry.IndexToWorld() * p);
  }
  std::vector<PyramidLevel> pyramid;
  Eigen::Vector3d centre;
  std::vector<Eigen::Vector3d> points; // of the valid region, world
};
using Pair = std::pair<Placed, Placed>;

Placed Liver(const std::filesystem::path& path)
{
  const ImageHeader header = ReadImageHeader(path.string());
  Volume<unsigned char> voxels(header.geometry.dimensions), valid(header.geometry.dimensions);
  ReadVoxels(header, voxels.View().Data());
  ValidFromBorderZeros<unsigned char>(voxels.View(), valid.View());
  return {header.geometry, voxels, valid};
}

Pair Phantoms(double overlap, std::uint64_t seed)
{
  PhantomParameters p;
  p.seed = seed;
  p.spacingMm = 1.5;
  const auto views = PhantomViews(p.probe, 2, overlap);
  const Pose elsewhere = KnockedPose(seed, 5, 12.0, 15.0, {0.0, 0.0, 60.0}); // another part of the scene for each pair
  const auto make = [&](const PhantomView& view) {
    p.probeToWorld = elsewhere * view.probeToWorld;
    p.gainDb = view.gainDb;
    const ImageGeometry geometry = PhantomGeometry(p);
    Volume<unsigned char> voxels(geometry.dimensions), valid(geometry.dimensions);
    MakePhantom(p, voxels.View(), valid.View());
    return Placed(geometry, voxels, valid);
  };
  return {make(views[0]), make(views[1])};
}

// How far off the starts are; 180 degrees: anywhere.
struct Start {
  double degrees, mm;
  std::string name;
};

double Angle(const Start& start, Random& random)
{
  if (start.degrees < 180.0)
    return start.degrees * RadiansPerDegree;
  for (;;) { // uniform over all rotations: the density of the angle is 1 - cos
    const double angle = random.Uniform(0.0, 3.141592653589793);
    if (random.Uniform(0.0, 2.0) < 1.0 - std::cos(angle))
      return angle;
  }
}

void Search(const std::string& name, const std::vector<Pair>& pairs, const Start& start, int trials)
{
  GlobalSearchParameters p;
  if (start.degrees < 180.0) {
    p.coneDegrees = start.degrees + 5.0;
    p.reachMm = start.mm + 15.0;
  }
  std::vector<double> seconds, errors;
  int found = 0, first = 0, all = 0, rotations = 0;
  const std::clock_t started = std::clock();
  for (std::size_t q = 0; q < pairs.size(); ++q)
    for (int t = 0; t < trials; ++t, ++all) {
      const auto& [fixed, moving] = pairs[q];
      Random random(99, q * 1000 + static_cast<std::uint64_t>(t));
      const double angle = Angle(start, random);
      const Eigen::Vector3d axis = random.Direction(), way = random.Direction();
      const Pose pose = MotionAbout(moving.centre, angle * axis, start.mm * way);
      GlobalSearchResult result;
      seconds.push_back(benchmark::Seconds([&] {
        result = GlobalSearch({&fixed.pyramid, Pose::Identity(), "A"}, {&moving.pyramid, pose, "B"}, p);
      }));
      rotations = result.rotations;
      for (std::size_t i = 0; i < result.candidates.size(); ++i) {
        const Pose& wrong = result.candidates[i].volumeToWorld; // the truth is the identity
        double mm = 0.0;
        for (const Eigen::Vector3d& point : moving.points)
          mm += (wrong * point - point).norm() / static_cast<double>(moving.points.size());
        if (mm > 8.0 || RotationAngle(wrong) > 12.0 * RadiansPerDegree)
          continue;
        errors.push_back(mm);
        ++found;
        first += i == 0;
        break;
      }
    }
  benchmark::Report("global_search", name + ", " + start.name, "masked NCC", Median(seconds), Median(errors), "mm",
                    {{"trials", all},
                     {"found", found},
                     {"first", first},
                     {"rotations", rotations},
                     {"cpu_seconds", static_cast<double>(std::clock() - started) / CLOCKS_PER_SEC / all}});
}

// The correlation from six sums.
double Ncc(double n, double f, double m, double ff, double mm, double fm)
{
  return (fm - f * m / n) / std::sqrt((ff - f * f / n) * (mm - m * m / n));
}

double Weight(std::complex<double> c)
{
  return c.real();
}
double Value(std::complex<double> c)
{
  return c.imag();
}
double Square(std::complex<double> c)
{
  return c.real() > 0.0 ? c.imag() * c.imag() / c.real() : 0.0;
}

#ifdef ECHORAMA_WITH_VTK
// Sums over all shifts by VTK's Fourier transform.
class VtkSums {
public:
  explicit VtkSums(const std::array<int, 3>& size) : size_(size) {}

  /// The spectrum of one real quantity of the voxels.
  template <class Quantity>
  vtkSmartPointer<vtkImageData> Spectrum(VolumeView<const Complex> voxels, const Quantity& quantity) const
  {
    vtkNew<vtkImageData> image;
    image->SetDimensions(size_.data());
    image->AllocateScalars(VTK_DOUBLE, 1);
    double* values = static_cast<double*>(image->GetScalarPointer());
    std::fill_n(values, image->GetNumberOfPoints(), 0.0);
    const auto& n = voxels.Dimensions();
    for (int k = 0; k < n[2]; ++k)
      for (int j = 0; j < n[1]; ++j)
        for (int i = 0; i < n[0]; ++i)
          values[(static_cast<std::ptrdiff_t>(k) * size_[1] + j) * size_[0] + i] =
              quantity(std::complex<double>(voxels(i, j, k)));
    vtkNew<vtkImageFFT> transform;
    transform->SetInputData(image);
    transform->Update();
    return transform->GetOutput();
  }

  std::vector<double> Correlated(vtkImageData* fixed, vtkImageData* moving) const
  {
    vtkNew<vtkImageData> product;
    product->DeepCopy(fixed);
    auto* a = static_cast<std::complex<double>*>(product->GetScalarPointer());
    const auto* b = static_cast<const std::complex<double>*>(moving->GetScalarPointer());
    for (vtkIdType i = 0; i < product->GetNumberOfPoints(); ++i)
      a[i] *= std::conj(b[i]);
    vtkNew<vtkImageRFFT> back;
    back->SetInputData(product);
    back->Update();
    const auto* sums = static_cast<const std::complex<double>*>(back->GetOutput()->GetScalarPointer());
    std::vector<double> real;
    for (vtkIdType i = 0; i < product->GetNumberOfPoints(); ++i)
      real.push_back(sums[i].real());
    return real;
  }

private:
  std::array<int, 3> size_;
};

// The correlation where the weights sum to enough, else 0; shifts wrap around.
std::vector<double> PadfieldByVtk(VolumeView<const Complex> fixed, VolumeView<const Complex> moving,
                                  const std::array<int, 3>& size, double least)
{
  const VtkSums sums(size);
  const auto fw = sums.Spectrum(fixed, Weight), fv = sums.Spectrum(fixed, Value), fs = sums.Spectrum(fixed, Square),
             mw = sums.Spectrum(moving, Weight), mv = sums.Spectrum(moving, Value), ms = sums.Spectrum(moving, Square);
  const auto n = sums.Correlated(fw, mw), f = sums.Correlated(fv, mw), m = sums.Correlated(fw, mv), ff = sums.Correlated(fs, mw),
             mm = sums.Correlated(fw, ms), fm = sums.Correlated(fv, mv);
  std::vector<double> ncc(n.size(), 0.0);
  for (std::size_t i = 0; i < n.size(); ++i)
    if (n[i] >= least)
      ncc[i] = Ncc(n[i], f[i], m[i], ff[i], mm[i], fm[i]);
  return ncc;
}
#endif

// A ball of noise.
Volume<Complex> Ball(int side, std::uint64_t seed)
{
  Volume<Complex> volume({side, side, side});
  Random random(seed);
  const double middle = 0.5 * (side - 1);
  for (int k = 0; k < side; ++k)
    for (int j = 0; j < side; ++j)
      for (int i = 0; i < side; ++i) {
        const double value = random.Normal();
        const bool real = Eigen::Vector3d(i - middle, j - middle, k - middle).norm() < 0.5 * side;
        volume.View()(i, j, k) = real ? Complex(1.0f, static_cast<float>(value)) : Complex();
      }
  return volume;
}

void OneRotation(int side)
{
  const Volume<Complex> fixed = Ball(side, 1), moving = Ball(side, 2);
  const int reach = side - 5;
  const ShiftRange range{{-reach, -reach, -reach}, {reach, reach, reach}};
  const auto counts = range.Counts();
  const double least = 0.1 * side * side * side * 0.5236;
  const MaskedCorrelator correlator(fixed.View(), moving.Dimensions(), range);
  const auto size = correlator.TransformSize();
  MaskedCorrelator::Work work;
  Volume<Complex> products(counts), normalised(counts);
  const auto six = [&] { correlator.Normalised(moving.View(), least, normalised.View(), work); };
#ifdef ECHORAMA_WITH_VTK
  std::vector<double> byVtk;
  const auto [ours, vtk] = benchmark::Duel(
      six, [&] { byVtk = PadfieldByVtk(fixed.View(), moving.View(), size, least); }, 1);
#else
  const double ours = benchmark::MedianSeconds(six);
#endif
  const double quick = benchmark::MedianSeconds([&] { correlator.Products(moving.View(), products.View(), work); });

  // By the definition, at some of the shifts.
  double errorOurs = 0.0, errorQuick = 0.0, seconds = 0.0;
#ifdef ECHORAMA_WITH_VTK
  double errorVtk = 0.0;
#endif
  constexpr int shifts = 200;
  Random random(3);
  for (int s = 0; s < shifts; ++s) {
    std::array<int, 3> at{};
    for (int& number : at)
      number = static_cast<int>(random.Below(static_cast<std::uint64_t>(counts[0])));
    double n = 0.0, f = 0.0, m = 0.0, ff = 0.0, mm = 0.0, fm = 0.0;
    seconds += benchmark::Seconds([&] {
      for (int k = 0; k < side; ++k)
        for (int j = 0; j < side; ++j)
          for (int i = 0; i < side; ++i) {
            const int x = i + at[0] - reach, y = j + at[1] - reach, z = k + at[2] - reach;
            if (x < 0 || y < 0 || z < 0 || x >= side || y >= side || z >= side)
              continue;
            const std::complex<double> a = fixed.View()(x, y, z), b = moving.View()(i, j, k);
            n += a.real() * b.real();
            f += a.imag() * b.real();
            m += a.real() * b.imag();
            ff += Square(a) * b.real();
            mm += a.real() * Square(b);
            fm += a.imag() * b.imag();
          }
    });
    if (n < least + 0.01)
      continue;
    const double ncc = Ncc(n, f, m, ff, mm, fm);
    const Complex sums = products.View()(at[0], at[1], at[2]);
    errorOurs = std::max(errorOurs, std::abs(static_cast<double>(normalised.View()(at[0], at[1], at[2]).imag()) - ncc));
    errorQuick = std::max(errorQuick, std::abs(static_cast<double>(sums.imag() / sums.real()) - fm / n));
#ifdef ECHORAMA_WITH_VTK
    const auto wrapped = [&](int axis) { return (at[axis] - reach + size[axis]) % size[axis]; };
    const std::size_t place =
        static_cast<std::size_t>((static_cast<std::ptrdiff_t>(wrapped(2)) * size[1] + wrapped(1)) * size[0] + wrapped(0));
    errorVtk = std::max(errorVtk, std::abs(byVtk[place] - ncc));
#endif
  }
  const std::string name = "one rotation, " + std::to_string(side) + "^3 on " + std::to_string(side) + "^3";
  const double all = static_cast<double>(counts[0]) * counts[1] * counts[2] / shifts;
  const nlohmann::ordered_json transform{{"transform", size}};
  benchmark::Report("masked_correlation", name, "two sums, float", quick, errorQuick, "of the mean product", transform);
  benchmark::Report("masked_correlation", name, "six sums, float", ours, errorOurs, "of the NCC", transform);
#ifdef ECHORAMA_WITH_VTK
  benchmark::Report("masked_correlation", name, "six sums by vtkImageFFT, double", vtk, errorVtk, "of the NCC", transform);
#endif
  benchmark::ReportTime("masked_correlation", name, "by the definition", seconds * all, {{"shifts_timed", shifts}});
}

} // namespace

int main(int argc, char** argv)
{
  const int trials = argc > 1 ? std::max(1, std::atoi(argv[1])) : benchmark::Trials(3),
            count = argc > 2 ? std::max(0, std::atoi(argv[2])) : benchmark::Trials(4);
  const bool conesOnly = argc > 3 && std::atoi(argv[3]) != 0;
  OneRotation(24);
  std::vector<Start> starts{{20.0, 25.0, "20 degrees and 25 mm off"}, {25.0, 40.0, "25 degrees and 40 mm off"}};
  if (!conesOnly)
    starts.push_back({180.0, 40.0, "any rotation, 40 mm off"});
  for (const double overlap : {0.55, 0.4, 0.25}) {
    std::vector<Pair> pairs;
    for (int s = 0; s < count; ++s)
      pairs.push_back(Phantoms(overlap, static_cast<std::uint64_t>(s) + 1));
    for (const Start& start : starts)
      if (count > 0)
        Search("phantom, overlap " + std::to_string(static_cast<int>(100.0 * overlap + 0.5)) + "%", pairs, start, trials);
  }
  const std::filesystem::path folder = std::filesystem::path(ECHORAMA_SOURCE_DIR) / ".." / "shared" / "data" / "liver";
  if (!std::filesystem::exists(folder / "liver_volume_A.mha")) {
    std::cerr << "skipped: there are no liver volumes in " << folder << "\n";
    return 0;
  }
  std::vector<Pair> liver;
  liver.emplace_back(Liver(folder / "liver_volume_A.mha"), Liver(folder / "liver_volume_B.mha"));
  for (const Start& start : starts)
    Search("liver", liver, start, benchmark::Trials(20));
  return 0;
}
