// SPDX-License-Identifier: BSD-3-Clause
//
// A surface is a field s over the voxels: mm in front of it (positive inside, negative outside), NaN where a voxel takes no part.
// The border, planes, spheres and moved borders differ in their s alone; what is measured of them is the same code. Cells of the
// lattice that cuts a surface into patches are joined into layers of slices; each task owns a layer and sums what its voxels give
// to its own cells and to those of the two layers beside it; these sums are added in order. So nothing depends on threads.
#include "EmbedQuality.h"
#include "Core/Base/Parallel.h"
#include "Core/Base/Random.h"
#include "Core/Imaging/DistanceMap.h"
#include "Core/Imaging/Sampling.h"
#include "Core/Imaging/VoxelTypes.h"
#include "Feather.h"
#include <algorithm>
#include <cmath>
#include <cstring>
#include <Eigen/Eigenvalues>
#include <functional>
#include <string>

namespace echorama {

namespace {

using Size = std::size_t;
using RowOfSurface = std::function<void(int j, int k, float* s)>;

constexpr double notMeasured = std::numeric_limits<double>::quiet_NaN();
constexpr float noPart = std::numeric_limits<float>::quiet_NaN();
constexpr double leastFill = 0.1; // of a full shell
constexpr double leastVoxels = 8.0;

bool Is(unsigned char label, EmbeddedVoxel what)
{
  return label == static_cast<unsigned char>(what);
}

bool IsSeen(unsigned char label)
{
  return Is(label, EmbeddedVoxel::Data) || Is(label, EmbeddedVoxel::Blend);
}

// Numbers that count by their weights.
struct Weighted {
  struct Item {
    double number, weight;
  };
  std::vector<Item> items;
  double total = 0.0;

  void Add(double number, double weight)
  {
    items.push_back({number, weight});
    total += weight;
  }

  double Mean() const
  {
    double sum = 0.0;
    for (const Item& item : items)
      sum += item.weight * item.number;
    return items.empty() ? notMeasured : sum / total;
  }

  // The least number that a share of the weight does not exceed; the items are sorted.
  double Percentile(double share) const
  {
    double weight = 0.0;
    for (const Item& item : items) {
      weight += item.weight;
      if (weight >= share * total)
        return item.number;
    }
    return items.empty() ? notMeasured : items.back().number;
  }

  void Sort()
  {
    std::sort(items.begin(), items.end(), [](const Item& a, const Item& b) { return a.number < b.number; });
  }
};

// What was measured at the patches of one or several surfaces.
struct Patches {
  Weighted jumps, ratios;
  double near = 0.0; // voxels next to the surface, in all patches

  SurfaceJumps Summary()
  {
    SurfaceJumps summary;
    summary.patches = static_cast<std::ptrdiff_t>(jumps.items.size());
    summary.bias = jumps.Mean();
    for (Weighted::Item& item : jumps.items)
      item.number = std::abs(item.number);
    summary.mean = jumps.Mean();
    jumps.Sort();
    summary.median = jumps.Percentile(0.5);
    summary.percentile95 = jumps.Percentile(0.95);
    ratios.Sort();
    summary.deviationRatio = ratios.Percentile(0.5);
    summary.deviationRatio5 = ratios.Percentile(0.05);
    summary.deviationRatio95 = ratios.Percentile(0.95);
    return summary;
  }
};

template <class T>
class PatchMeter {
public:
  // \param shift of the lattice, in cells, [0, 0.5)
  PatchMeter(VolumeView<const T> values, const ImageGeometry& grid, double shellMm, double level, double shift)
    : values_(values), n_(grid.dimensions), spacing_(grid.spacing), shell_(shellMm), level_(level), shift_(shift)
  {
    double full = 1.0;
    for (Size axis = 0; axis < 3; ++axis) {
      cells_[axis] = CellOf(n_[axis] - 1, axis) + 1;
      if (n_[axis] > 1) {
        near_ = std::max(near_, 1.001 * spacing_[static_cast<int>(axis)]);
        full *= shell_ / spacing_[static_cast<int>(axis)];
      }
    }
    least_ = std::max(leastVoxels, leastFill * full);
    first_.assign(static_cast<Size>(cells_[2]) + 1, n_[2]);
    for (int k = n_[2] - 1; k >= 0; --k)
      first_[static_cast<Size>(CellOf(k, 2))] = k;
  }

  void Measure(const RowOfSurface& surface, Patches& patches, const Progress& progress) const
  {
    // 1. the middles of the patches
    const Size perLayer = static_cast<Size>(cells_[0]) * static_cast<Size>(cells_[1]), layers = static_cast<Size>(cells_[2]);
    std::vector<Middle> middles(perLayer * layers);
    OverRows(surface, progress.Part(0.0, 0.5), [&](int j, int k, const float* s) {
      for (int i = 0; i < n_[0]; ++i)
        if (std::abs(s[i]) <= near_)
          middles[Cell(CellOf(i, 0), CellOf(j, 1), CellOf(k, 2))].Add({i * spacing_[0], j * spacing_[1], k * spacing_[2]});
    });
    for (Middle& middle : middles)
      if (middle.count > 0.0)
        middle.position /= middle.count;

    // 2. sums over the voxels that are nearest to each
    std::vector<std::vector<Sides>> parts(layers); // of the layer before, the own, and the next
    OverRows(surface, progress.Part(0.5, 1.0), [&](int j, int k, const float* s) {
      std::vector<Sides>& part = parts[static_cast<Size>(CellOf(k, 2))];
      const T* row = values_.Row(j, k);
      for (int i = 0; i < n_[0]; ++i) {
        if (!(std::abs(s[i]) <= shell_) || !std::isfinite(static_cast<double>(row[i])))
          continue;
        const std::ptrdiff_t nearest = Nearest(middles, i, j, k);
        if (nearest < 0)
          continue;
        if (part.empty())
          part.resize(3 * perLayer);
        const std::ptrdiff_t before = (static_cast<std::ptrdiff_t>(CellOf(k, 2)) - 1) * static_cast<std::ptrdiff_t>(perLayer);
        const Eigen::Vector3d at(i * spacing_[0], j * spacing_[1], k * spacing_[2]);
        part[static_cast<Size>(nearest - before)].Add(s[i] > 0.0f, static_cast<double>(row[i]) - level_,
                                                      at - middles[static_cast<Size>(nearest)].position);
      }
    });
    for (Size layer = 0; layer < layers; ++layer)
      for (Size at = 0; at < perLayer; ++at) {
        const Middle& middle = middles[layer * perLayer + at];
        if (middle.count == 0.0)
          continue;
        Sides sides;
        for (Size other = layer > 0 ? layer - 1 : 0; other < std::min(layers, layer + 2); ++other)
          if (!parts[other].empty())
            sides += parts[other][(layer + 1 - other) * perLayer + at];
        patches.near += middle.count;
        if (sides.count[0] < least_ || sides.count[1] < least_)
          continue;
        patches.jumps.Add(sides.Mean(0) - sides.Mean(1), middle.count);
        const double outside = sides.Deviation(0), inside = sides.Deviation(1);
        if (outside > 0.0 || inside > 0.0)
          patches.ratios.Add(outside / inside, middle.count);
      }
  }

private:
  struct Middle {
    Eigen::Vector3d position = Eigen::Vector3d::Zero();
    double count = 0.0;
    void Add(const Eigen::Vector3d& at)
    {
      position += at;
      ++count;
    }
  };

  // Moments of the values and their places (about the middle of the patch), 0: outside, 1: inside.
  struct Sides {
    double count[2] = {0.0, 0.0}, sum[2] = {0.0, 0.0}, squares[2] = {0.0, 0.0};
    Eigen::Vector3d place[2] = {Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()}, product[2] = {place[0], place[0]};
    Eigen::Matrix3d places[2] = {Eigen::Matrix3d::Zero(), Eigen::Matrix3d::Zero()};

    void Add(bool inside, double value, const Eigen::Vector3d& at)
    {
      ++count[inside];
      sum[inside] += value;
      squares[inside] += value * value;
      place[inside] += at;
      product[inside] += value * at;
      places[inside] += at * at.transpose();
    }
    void operator+=(const Sides& other)
    {
      for (int side = 0; side < 2; ++side) {
        count[side] += other.count[side];
        sum[side] += other.sum[side];
        squares[side] += other.squares[side];
        place[side] += other.place[side];
        product[side] += other.product[side];
        places[side] += other.places[side];
      }
    }
    double Mean(int side) const { return sum[side] / count[side]; }

    // Of what is left when the slope that fits best is taken off.
    double Deviation(int side) const
    {
      const double n = count[side];
      const Eigen::Vector3d middle = place[side] / n, along = product[side] / n - Mean(side) * middle;
      const Eigen::Matrix3d spread = places[side] / n - middle * middle.transpose();
      const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(spread);
      double variance = squares[side] / n - Mean(side) * Mean(side), freedom = n - 1.0;
      for (int axis = 0; axis < 3; ++axis)
        if (axes.eigenvalues()[axis] > 1e-3 * axes.eigenvalues()[2]) { // else the side is flat this way
          const double part = axes.eigenvectors().col(axis).dot(along);
          variance -= part * part / axes.eigenvalues()[axis];
          --freedom;
        }
      return variance > 1e-9 * squares[side] / n ? std::sqrt(variance * n / freedom) : 0.0; // below is rounding
    }
  };

  // Cells are shells wide, or voxels where these are wider.
  int CellOf(int voxel, Size axis) const
  {
    return static_cast<int>((voxel + 0.5) / std::max(1.0, shell_ / spacing_[static_cast<int>(axis)]) + shift_);
  }

  Size Cell(int i, int j, int k) const
  {
    return (static_cast<Size>(k) * static_cast<Size>(cells_[1]) + static_cast<Size>(j)) * static_cast<Size>(cells_[0]) +
           static_cast<Size>(i);
  }

  // Layers of cells are parallel, their rows are visited in order. Rows beyond the shells are passed over.
  template <class Visit>
  void OverRows(const RowOfSurface& surface, const Progress& progress, const Visit& visit) const
  {
    ParallelFor(cells_[2], progress, [&](std::ptrdiff_t layer) {
      std::vector<float> s(static_cast<Size>(n_[0]));
      for (int k = first_[static_cast<Size>(layer)]; k < first_[static_cast<Size>(layer) + 1]; ++k)
        for (int j = 0; j < n_[1]; ++j) {
          surface(j, k, s.data());
          if (std::any_of(s.begin(), s.end(), [this](float mm) { return std::abs(mm) <= shell_; }))
            visit(j, k, s.data());
        }
    });
  }

  std::ptrdiff_t Nearest(const std::vector<Middle>& middles, int i, int j, int k) const
  {
    const std::array<int, 3> own{CellOf(i, 0), CellOf(j, 1), CellOf(k, 2)};
    std::array<int, 3> from{}, to{};
    for (Size axis = 0; axis < 3; ++axis) {
      from[axis] = std::max(0, own[axis] - 1);
      to[axis] = std::min(cells_[axis] - 1, own[axis] + 1);
    }
    const Eigen::Vector3d at(i * spacing_[0], j * spacing_[1], k * spacing_[2]);
    std::ptrdiff_t nearest = -1;
    double least = std::numeric_limits<double>::infinity();
    for (int ck = from[2]; ck <= to[2]; ++ck)
      for (int cj = from[1]; cj <= to[1]; ++cj)
        for (int ci = from[0]; ci <= to[0]; ++ci) {
          const Middle& middle = middles[Cell(ci, cj, ck)];
          if (middle.count == 0.0)
            continue;
          const double square = (middle.position - at).squaredNorm();
          if (square < least) {
            least = square;
            nearest = static_cast<std::ptrdiff_t>(Cell(ci, cj, ck));
          }
        }
    return nearest;
  }

  VolumeView<const T> values_;
  std::array<int, 3> n_, cells_{};
  Eigen::Vector3d spacing_;
  double shell_, level_, shift_, near_ = 0.0, least_ = 0.0;
  std::vector<int> first_; // first slice of each layer of cells, and the end
};

// Distances across the border: of seen voxels to what is invented, and the other way round; 0 elsewhere.
Volume<float> AcrossBorder(VolumeView<const unsigned char> labels, const Eigen::Vector3d& spacing, const Progress& progress)
{
  const auto& n = labels.Dimensions();
  Volume<float> across(n), squares(n);
  Volume<unsigned char> mask(n);
  for (const bool fromSeen : {false, true}) {
    ParallelFor(n[2], [&](std::ptrdiff_t k) {
      const std::ptrdiff_t begin = k * labels.SliceStride();
      for (std::ptrdiff_t at = begin; at < begin + labels.SliceStride(); ++at)
        mask.View()[at] = fromSeen ? IsSeen(labels[at]) : Is(labels[at], EmbeddedVoxel::Invented);
    });
    SquaredDistanceMap(mask.View(), spacing, squares.View(), progress.Part(fromSeen ? 0.5 : 0.0, fromSeen ? 1.0 : 0.5));
    ParallelFor(n[2], [&](std::ptrdiff_t k) {
      const std::ptrdiff_t begin = k * labels.SliceStride();
      for (std::ptrdiff_t at = begin; at < begin + labels.SliceStride(); ++at)
        if (fromSeen ? Is(labels[at], EmbeddedVoxel::Invented) : IsSeen(labels[at]))
          across.View()[at] = std::sqrt(squares.View()[at]);
    });
  }
  return across;
}

struct Counts {
  std::ptrdiff_t data = 0, blend = 0, invented = 0, finite = 0;
  double sum = 0.0;
  Counts& operator+=(const Counts& other)
  {
    data += other.data;
    blend += other.blend;
    invented += other.invented;
    finite += other.finite;
    sum += other.sum;
    return *this;
  }
};

// A surface through a random voxel of the data; empty if there is none of its kind.
RowOfSurface RandomSurface(int number, const EmbedQualityParameters& parameters, VolumeView<const unsigned char> labels,
                           const std::vector<std::ptrdiff_t>& dataBefore, VolumeView<const float> across,
                           const Eigen::Vector3d& spacing)
{
  const auto n = labels.Dimensions();
  Random random(parameters.seed, static_cast<std::uint64_t>(number));
  auto rank = static_cast<std::ptrdiff_t>(random.Below(static_cast<std::uint64_t>(dataBefore.back())));
  const auto slice = std::upper_bound(dataBefore.begin(), dataBefore.end(), rank) - dataBefore.begin() - 1;
  rank -= dataBefore[static_cast<Size>(slice)];
  std::ptrdiff_t at = slice * labels.SliceStride();
  while (!Is(labels[at], EmbeddedVoxel::Data) || rank-- > 0)
    ++at;
  const std::ptrdiff_t inSlice = at % labels.SliceStride();
  const Eigen::Vector3d through = spacing.cwiseProduct(
      Eigen::Vector3d(static_cast<double>(inSlice % n[0]), static_cast<double>(inSlice / n[0]), static_cast<double>(slice)));

  Eigen::Vector3d normal;
  do {
    normal = random.Direction();
    for (Size axis = 0; axis < 3; ++axis)
      if (n[axis] == 1)
        normal[static_cast<int>(axis)] = 0.0;
  } while (normal.norm() < 1e-3);
  normal.normalize();
  const double radius = parameters.shellMm * random.Uniform(2.0, 10.0);
  const Eigen::Vector3d centre = through + radius * normal;

  const int kind = number % 3;
  const float depth = across[at];
  if (kind == 2 && !std::isfinite(depth))
    return {};
  return [=](int j, int k, float* s) {
    const unsigned char* label = labels.Row(j, k);
    const float* depths = across.Row(j, k);
    const double y = j * spacing[1], z = k * spacing[2];
    const double before = normal[1] * (y - through[1]) + normal[2] * (z - through[2]);
    const double aside = (y - centre[1]) * (y - centre[1]) + (z - centre[2]) * (z - centre[2]);
    for (int i = 0; i < n[0]; ++i) {
      const double x = i * spacing[0];
      const double mm = kind == 0   ? before + normal[0] * (x - through[0])
                        : kind == 1 ? std::sqrt(aside + (x - centre[0]) * (x - centre[0])) - radius
                                    : static_cast<double>(depths[i]) - static_cast<double>(depth);
      s[i] = Is(label[i], EmbeddedVoxel::Data) ? static_cast<float>(mm) : noPart;
    }
  };
}

// Whether labels tell the truth about the original.
template <class T>
void CompareWithOriginal(VolumeView<const T> embedded, VolumeView<const unsigned char> labels, const ImageGeometry& grid,
                         const PosedVolume<T>& original, double featherMm, EmbedQualityReport& report, const Progress& progress)
{
  original.geometry.Check("the original");
  const auto& n = original.geometry.dimensions;
  if (original.intensity.Dimensions() != n || (!original.valid.Empty() && original.valid.Dimensions() != n))
    throw Error(Error::Kind::BadInput, "the original: its voxels are not of the size that its geometry says");
  const Eigen::Vector3d corner = grid.WorldToIndex() * original.geometry.origin;
  const Eigen::Array3d whole = corner.array().round();
  ImageGeometry shifted = grid;
  shifted.dimensions = n;
  shifted.origin = grid.IndexToWorld() * Eigen::Vector3d(whole.matrix());
  if (!(whole.abs() < 1e9).all() || !shifted.AgreesWith(original.geometry))
    throw Error(Error::Kind::BadInput, "the original does not lie on the voxels of the embedded volume");
  const std::array<int, 3> shift{static_cast<int>(whole[0]), static_cast<int>(whole[1]), static_cast<int>(whole[2])};

  const Volume<unsigned char> real = RealRegionOf(original);
  Volume<float> squaredDepth(n);
  SquaredDepthMap(real.View(), grid.spacing, squaredDepth.View(), progress);
  const double farSquared = featherMm * featherMm * (1.0 + 1e-5); // beyond rounding

  struct Lies {
    std::ptrdiff_t altered = 0, pretended = 0, lost = 0;
  };
  const auto& m = grid.dimensions;
  std::vector<Lies> slices(static_cast<Size>(m[2]));
  ParallelFor(m[2], [&](std::ptrdiff_t slice) {
    const int k = static_cast<int>(slice);
    Lies& lies = slices[static_cast<Size>(slice)];
    for (int j = 0; j < m[1]; ++j)
      for (int i = 0; i < m[0]; ++i) {
        const std::array<int, 3> p{i - shift[0], j - shift[1], k - shift[2]};
        const bool within = p[0] >= 0 && p[1] >= 0 && p[2] >= 0 && p[0] < n[0] && p[1] < n[1] && p[2] < n[2];
        const bool known = within && real.View()(p[0], p[1], p[2]);
        const unsigned char label = labels(i, j, k);
        lies.pretended += IsSeen(label) && !known;
        if (!known)
          continue;
        const bool isData = Is(label, EmbeddedVoxel::Data);
        lies.altered += isData && std::memcmp(&embedded(i, j, k), &original.intensity(p[0], p[1], p[2]), sizeof(T)) != 0;
        // What is met here is taken off those that are lost.
        lies.lost -= isData && squaredDepth.View()(p[0], p[1], p[2]) > farSquared;
      }
  });
  Lies all;
  for (const Lies& lies : slices) {
    all.altered += lies.altered;
    all.pretended += lies.pretended;
    all.lost += lies.lost;
  }
  for (const float square : squaredDepth.View())
    all.lost += square > farSquared;
  report.altered = all.altered;
  report.pretended = all.pretended;
  report.lost = all.lost;
}

} // namespace

ParameterList Describe(EmbedQualityParameters& p)
{
  return {
      Parameter("ShellMm", p.shellMm, {0, Unlimited, true}, "mm",
                "How thick the shells on either side of the border are, and how wide its patches."),
      Parameter("LeastJump", p.leastJump, {0, Unlimited}, "grey levels", "Jumps up to this are not seen by anyone."),
      Parameter("MostDeviation", p.mostDeviation, {0, 1}, "", "How far from 1 the ratio of deviations may be."),
      Parameter("FeatherMm", p.featherMm, {0, Unlimited}, "mm",
                "The embedder's feather: data deeper than this must be shown as they are."),
      Parameter("RandomSurfaces", p.randomSurfaces, {0, 1000}, "",
                "With how many random surfaces inside the data the border is compared."),
      Parameter("Seed", p.seed, {0, 9223372036854775807.0}, "", "The same seed makes the same random surfaces.").Advanced(),
  };
}

template <class T>
EmbedQualityReport MeasureEmbedding(VolumeView<const T> embedded, VolumeView<const unsigned char> labels,
                                    const ImageGeometry& grid, const PosedVolume<T>* original, const PlacedProbe* fan,
                                    const EmbedQualityParameters& parameters, const Progress& progress)
{
  CheckRanges(parameters);
  grid.Check("the embedded volume");
  if (embedded.Dimensions() != grid.dimensions || labels.Dimensions() != grid.dimensions)
    throw Error(Error::Kind::BadInput, "the embedded volume: its voxels and labels are not of the size that its geometry says");
  EmbedQualityReport report;

  // 1. what is where
  std::vector<Counts> counts(static_cast<Size>(grid.dimensions[2]));
  ParallelFor(grid.dimensions[2], [&](std::ptrdiff_t k) {
    Counts& c = counts[static_cast<Size>(k)];
    for (std::ptrdiff_t at = k * labels.SliceStride(); at < (k + 1) * labels.SliceStride(); ++at) {
      c.data += Is(labels[at], EmbeddedVoxel::Data);
      c.blend += Is(labels[at], EmbeddedVoxel::Blend);
      c.invented += Is(labels[at], EmbeddedVoxel::Invented);
      if (IsSeen(labels[at]) && std::isfinite(static_cast<double>(embedded[at]))) {
        ++c.finite;
        c.sum += static_cast<double>(embedded[at]);
      }
    }
  });
  Counts all;
  std::vector<std::ptrdiff_t> dataBefore{0};
  for (const Counts& slice : counts) {
    all += slice;
    dataBefore.push_back(all.data);
  }
  report.data = all.data;
  report.blend = all.blend;
  report.invented = all.invented;
  if (original)
    CompareWithOriginal(embedded, labels, grid, *original, parameters.featherMm, report, progress.Part(0.0, 0.1));
  if (fan) {
    Volume<unsigned char> seen(grid.dimensions);
    std::transform(labels.begin(), labels.end(), seen.View().begin(), IsSeen);
    report.crop = LargestCrop(seen.View(), grid, *fan, 80, progress.Part(0.1, 0.2));
  }

  // 2. the border
  const Volume<float> acrossBorder = AcrossBorder(labels, grid.spacing, progress.Part(0.2, 0.4));
  const VolumeView<const float> across = acrossBorder.View();
  const double level = all.finite ? std::round(all.sum / static_cast<double>(all.finite)) : 0.0;
  const RowOfSurface surfaceOfBorder = [&](int j, int k, float* s) {
    const unsigned char* label = labels.Row(j, k);
    const float* mm = across.Row(j, k);
    for (int i = 0; i < grid.dimensions[0]; ++i)
      s[i] = IsSeen(label[i]) ? mm[i] : Is(label[i], EmbeddedVoxel::Invented) ? -mm[i] : noPart;
  };
  PatchMeter<T> meter(embedded, grid, parameters.shellMm, level, 0.0);
  Patches border;
  meter.Measure(surfaceOfBorder, border, progress.Part(0.4, 0.45));
  // A flat border between two layers of the lattice makes patches of one side each, which are not measured: shift the lattice.
  if (border.jumps.total < 0.5 * border.near) {
    PatchMeter<T> shifted(embedded, grid, parameters.shellMm, level, 0.45);
    Patches again;
    shifted.Measure(surfaceOfBorder, again, progress.Part(0.45, 0.5));
    if (again.jumps.total > border.jumps.total) {
      meter = shifted;
      border = again;
    }
  }
  report.border = border.Summary();
  if (border.near > 0.0)
    report.borderMeasured = border.jumps.total / border.near;

  // 3. the same inside the data
  Patches inside;
  const Progress rest = progress.Part(0.5, 1.0);
  for (int number = 0; number < parameters.randomSurfaces && all.data > 1; ++number) {
    const double step = 1.0 / parameters.randomSurfaces;
    const RowOfSurface surface = RandomSurface(number, parameters, labels, dataBefore, across, grid.spacing);
    if (surface)
      meter.Measure(surface, inside, rest.Part(number * step, (number + 1) * step));
  }
  report.reference = inside.Summary();

  // 4. the verdict
  report.jumpLimit =
      std::max(parameters.leastJump, std::isnan(report.reference.percentile95) ? 0.0 : report.reference.percentile95);
  report.jumpPasses = report.border.percentile95 <= report.jumpLimit;
  report.deviationPasses = std::abs(report.border.deviationRatio - 1.0) <= parameters.mostDeviation;
  return report;
}

#define ECHORAMA_INSTANTIATE(T)                                                                                                  \
  template EmbedQualityReport MeasureEmbedding<T>(VolumeView<const T>, VolumeView<const unsigned char>, const ImageGeometry&,    \
                                                  const PosedVolume<T>*, const PlacedProbe*, const EmbedQualityParameters&,      \
                                                  const Progress&);
ECHORAMA_FOR_EACH_VOXEL_TYPE(ECHORAMA_INSTANTIATE)
#undef ECHORAMA_INSTANTIATE

} // namespace echorama
