// SPDX-License-Identifier: BSD-3-Clause
// What the speckle is like: the statistics of its envelope, and how it changes when the tissue slides or the beam turns.
#include "Core/Base/Random.h"
#include "SpeckleTools.h"
#include <gtest/gtest.h>

using namespace echorama;
using namespace echorama::testing;
using Eigen::Vector3d;

namespace {

constexpr double depth = 70.0;

// Parallel beams, some widths apart, and rows of a little depth about the focus.
struct Field {
  std::vector<SoundSegment> beams;
  DepthAxis axis;

  Field(const Transducer& transducer, int along, int over, double apart, int samples, double samplesApart)
  {
    const BeamWidth width = WidthAt(transducer, depth);
    axis = {depth, samplesApart * transducer.PulseSigmaMm(), samples};
    const double half = 0.5 * (samples - 1) * axis.step;
    axis.first = depth - half;
    for (int j = 0; j < over; ++j)
      for (int i = 0; i < along; ++i)
        beams.push_back(Beam({apart * width.lateralSigma * i, apart * width.elevationSigma * j, 0.0}, Vector3d::UnitZ(),
                             depth - half - 3.0, 2.0 * half + 6.0));
  }

  std::vector<Row> Rows(const Scatterers& scatterers, const Transducer& transducer) const
  {
    std::vector<Row> rows;
    for (const SoundSegment& beam : beams)
      rows.push_back(RowOf(beam, scatterers, transducer, axis));
    return rows;
  }
};

// Of all samples: signal-to-noise ratio of the envelope and <I^2> / <I>^2.
struct Statistics {
  double snr, intensityRatio;
};

Statistics StatisticsOf(const std::vector<Row>& rows)
{
  double n = 0.0, one = 0.0, two = 0.0, four = 0.0;
  for (const Row& row : rows)
    for (const auto& value : row) {
      const double power = static_cast<double>(std::norm(value));
      n += 1.0;
      one += std::sqrt(power);
      two += power;
      four += power * power;
    }
  const double mean = one / n, power = two / n;
  return {mean / std::sqrt(power - mean * mean), four / n / (power * power)};
}

// How alike two fields of echoes are: size of the correlation of the complex values.
double Correlation(const std::vector<Row>& a, const std::vector<Row>& b)
{
  std::complex<double> product;
  double aa = 0.0, bb = 0.0;
  for (std::size_t r = 0; r < a.size(); ++r)
    for (std::size_t i = 0; i < a[r].size(); ++i) {
      product += std::complex<double>(a[r][i]) * std::conj(std::complex<double>(b[r][i]));
      aa += static_cast<double>(std::norm(a[r][i]));
      bb += static_cast<double>(std::norm(b[r][i]));
    }
  return std::abs(product) / std::sqrt(aa * bb);
}

// Samples two and a half standard deviations of the response apart: nearly independent.
Statistics SpeckleWith(double perCell, double keep, int along)
{
  const Transducer transducer;
  const Field field(transducer, along, along, 2.5, 61, 2.5);
  ScattererParameters parameters;
  const double density = perCell / WidthAt(transducer, depth).ResolutionCellMm3(transducer.PulseSigmaMm());
  parameters.densityPerMm3 = density / keep;
  const Material tissue = Tissue(density);
  return StatisticsOf(field.Rows(HeardBy(field.beams, transducer, tissue, parameters), transducer));
}

// The same by brute force: one scatterer in every cell of a lattice around the response, in random places, with random phases.
double BruteForceSnr(double perCell)
{
  const Transducer transducer;
  const BeamWidth width = WidthAt(transducer, depth);
  const double cell = std::cbrt(width.ResolutionCellMm3(transducer.PulseSigmaMm()) / perCell);
  const double cells[3] = {cell / transducer.PulseSigmaMm(), cell / width.lateralSigma, cell / width.elevationSigma};
  Random random(9);
  double n = 0.0, one = 0.0, two = 0.0;
  for (int trial = 0; trial < 8000; ++trial) {
    // Along each axis: distance squared of jittered places, by cell.
    double offset[3];
    int count[3];
    for (int axis = 0; axis < 3; ++axis) {
      count[axis] = static_cast<int>(std::ceil(8.0 / cells[axis])) + 1;
      offset[axis] = -4.0 - random.Uniform() * cells[axis];
    }
    std::complex<double> sum;
    for (int k = 0; k < count[2]; ++k)
      for (int j = 0; j < count[1]; ++j)
        for (int i = 0; i < count[0]; ++i) {
          double square = 0.0;
          const int index[3] = {i, j, k};
          for (int axis = 0; axis < 3; ++axis)
            square += std::pow(offset[axis] + (index[axis] + random.Uniform()) * cells[axis], 2);
          sum += std::polar(std::exp(-0.5 * square), 2.0 * pi * random.Uniform());
        }
    n += 1.0;
    one += std::abs(sum);
    two += std::norm(sum);
  }
  return one / n / std::sqrt(two / n - one * one / (n * n));
}

// How evenly scatterers of a lattice lie that keeps a share of them, in units of the response: 1 for a fine and full lattice, 0
// for Poisson's. Per axis, the mean of the autocorrelation of the squared response over pairs of places in one cell.
double Evenness(double perCell, double keep)
{
  const Transducer transducer;
  const BeamWidth width = WidthAt(transducer, depth);
  const double cell = std::cbrt(keep * width.ResolutionCellMm3(transducer.PulseSigmaMm()) / perCell);
  double evenness = keep;
  for (const double sigma : {transducer.PulseSigmaMm(), width.lateralSigma, width.elevationSigma}) {
    double sum = 0.0;
    for (int i = 0; i < 1000; ++i) {
      const double part = (i + 0.5) / 1000.0, d = part * cell / sigma;
      sum += 2.0 * (1.0 - part) * std::exp(-0.5 * d * d) / 1000.0;
    }
    evenness *= sum;
  }
  return evenness;
}

} // namespace

TEST(Speckle, IsFullyDevelopedWithThirtyPerCell)
{
  EXPECT_NEAR(SpeckleWith(30.0, 1.0, 30).snr, 1.91, 0.03); // 55,000 samples
}

TEST(Speckle, FallsShortOfRayleighWithFewScatterers)
{
  // With n in the cell, <I^2> / <I>^2 = 2 + (1 - 2 evenness) / n.
  double before = 1.95;
  for (const double perCell : {10.0, 3.0, 1.0}) {
    const Statistics statistics = SpeckleWith(perCell, 1.0, 30);
    const double excess = (1.0 - 2.0 * Evenness(perCell, 1.0)) / perCell;
    EXPECT_NEAR(statistics.intensityRatio, 2.0 + excess, 0.05 + 0.05 / perCell) << perCell;
    EXPECT_NEAR(statistics.snr, BruteForceSnr(perCell), 0.04) << perCell;
    EXPECT_LT(statistics.snr, before);
    before = statistics.snr;
  }
  // Those that are left of a denser lattice lie as Poisson's.
  const double excess = (1.0 - 2.0 * Evenness(3.0, 0.1)) / 3.0;
  EXPECT_NEAR(excess, 1.0 / 3.0, 0.04);
  EXPECT_NEAR(SpeckleWith(3.0, 0.1, 30).intensityRatio, 2.0 + excess, 0.06);
}

TEST(Speckle, OfSlidingTissueDecorrelatesAsThePointSpread)
{
  const Transducer transducer;
  const BeamWidth width = WidthAt(transducer, depth);
  const double k = 2.0 * pi / transducer.WavelengthMm();
  const Field field(transducer, 18, 18, 3.0, 31, 2.0);
  ImageGeometry lattice;
  lattice.dimensions = {16, 16, 16};
  lattice.origin = {-40.0, -40.0, 0.0};
  lattice.spacing = {12.0, 15.0, 12.0};
  const double density = 10.0 / width.ResolutionCellMm3(transducer.PulseSigmaMm());
  const auto slide = [&](const Vector3d& by) {
    const DisplacementField shift(lattice, std::vector<Vector3d>(16 * 16 * 16, by));
    ScattererParameters parameters;
    parameters.displacement = &shift;
    return field.Rows(HeardBy(field.beams, transducer, Tissue(density), parameters), transducer);
  };
  const std::vector<Row> rest = slide(Vector3d::Zero());
  // The autocorrelation of exp(-x^2 / (2 sigma^2)) exp(-i k curvature x^2) is exp(-d^2 / (4 sigma^2) - (k curvature sigma d)^2).
  const auto across = [k](double d, double sigma, double curvature) {
    return std::exp(-d * d / (4.0 * sigma * sigma) - std::pow(k * curvature * sigma * d, 2));
  };
  for (const double part : {0.5, 1.0}) {
    const double x = part * width.lateralSigma, y = part * width.elevationSigma, z = 1.5 * part * transducer.PulseSigmaMm();
    EXPECT_NEAR(Correlation(rest, slide({x, 0.0, 0.0})) / across(x, width.lateralSigma, width.lateralCurvature), 1.0, 0.1);
    EXPECT_NEAR(Correlation(rest, slide({0.0, y, 0.0})) / across(y, width.elevationSigma, width.elevationCurvature), 1.0, 0.1);
    EXPECT_NEAR(Correlation(rest, slide({0.0, 0.0, z})) / across(z, transducer.PulseSigmaMm(), 0.0), 1.0, 0.1);
  }
}

TEST(Speckle, OfAPlaceSeenFromATurningDirectionDecorrelatesAsTheAperture)
{
  const Transducer transducer;
  const BeamWidth width = WidthAt(transducer, depth);
  // Many places, each in the middle of a beam that turns about it.
  std::vector<Vector3d> places;
  for (int j = 0; j < 40; ++j)
    for (int i = 0; i < 40; ++i)
      places.emplace_back(3.0 * width.lateralSigma * i, 3.0 * width.elevationSigma * j, depth);
  const auto look = [&](double angle) {
    std::vector<SoundSegment> beams;
    for (const Vector3d& place : places) {
      const Vector3d direction(std::sin(angle), 0.0, std::cos(angle));
      beams.push_back(Beam(place - depth * direction, direction, depth - 3.0, 6.0));
    }
    return beams;
  };
  std::vector<SoundSegment> all = look(0.0);
  const DepthAxis axis{depth, 0.1, 1};
  const double aperture = transducer.lateralApertureMm / 5.0;
  // At the focus the two-way aperture is the aperture folded with itself, a Gaussian of sqrt(2) its width, and a turn by an
  // angle shifts it by 2 depth sin(angle). Its autocorrelation, integrated numerically:
  const auto autocorrelation = [&](double shift) {
    double product = 0.0, square = 0.0;
    for (double u = -60.0; u <= 60.0; u += 0.02) {
      const auto weight = [&](double v) { return std::exp(-0.25 * v * v / (aperture * aperture)); };
      product += weight(u) * weight(u - shift);
      square += weight(u) * weight(u);
    }
    return product / square;
  };
  std::vector<double> angles{0.02, 0.04};
  for (const double angle : angles)
    for (const SoundSegment& beam : look(angle))
      all.push_back(beam);
  const Scatterers scatterers = HeardBy(all, transducer, Tissue(10.0 / width.ResolutionCellMm3(transducer.PulseSigmaMm())));
  const auto rows = [&](double angle) {
    std::vector<Row> list;
    for (const SoundSegment& beam : look(angle))
      list.push_back(RowOf(beam, scatterers, transducer, axis));
    return list;
  };
  const std::vector<Row> straight = rows(0.0);
  for (const double angle : angles)
    EXPECT_NEAR(Correlation(straight, rows(angle)) / autocorrelation(2.0 * depth * std::sin(angle)), 1.0, 0.1) << angle;
}

TEST(Speckle, StaysWhenNothingChangesAndIsNewWithANewSeed)
{
  const Transducer transducer;
  const Field field(transducer, 10, 10, 3.0, 31, 2.0);
  ScattererParameters other;
  other.seed = 77;
  const std::vector<Row> a = field.Rows(HeardBy(field.beams, transducer, Tissue(4.0)), transducer),
                         b = field.Rows(HeardBy(field.beams, transducer, Tissue(4.0)), transducer),
                         c = field.Rows(HeardBy(field.beams, transducer, Tissue(4.0), other), transducer);
  EXPECT_EQ(a, b);
  EXPECT_LT(Correlation(a, c), 0.08); // of 3,100 samples
}
