// SPDX-License-Identifier: BSD-3-Clause
// A Kretz file is 16 bytes of signature and a list of items: group and element (2 bytes each), length (4), value, all little
// endian. One pass over the heads of the items finds the few that matter; each value is checked against the end of the file
// before it is read, and the voxels are left where they are.
//
// The samples lie on a torus: radius r = (offset + i) * resolution from the centre of the array's arc, at the angle theta of
// the beam; the plane of the fan is turned by phi about a line parallel to the array at the distance b from that centre (the
// second offset, counted towards the housing). With both angles counted from 90 degrees,
//
//     x = r sin(theta)     y = -(r cos(theta) - b) sin(phi)     z = b + (r cos(theta) - b) cos(phi)
//
// That is ProbeGeometry with a fan of any radius R >= b, a sweep of radius R - b and depth = r - R, seen from the centre of
// the arc. Where the face is, and so where depths count from, is a matter of taste to the map; the file has a further radius
// that fits: with it the depth of the last sample is the one that the scanner printed on its screen.
//
// What is known of the format is what open readers of it (SlicerHeart, kretz by P. Looney) found out.
#include "Readers/KretzFile.h"
#include "Core/Base/Angles.h"
#include "Core/Base/Error.h"
#include "Core/Base/FormatText.h"
#include "Core/Base/NumberText.h"
#include "Core/Imaging/ScanConversion.h"
#include "Readers/DataFile.h"
#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>
#include <map>

namespace echorama {
namespace {

constexpr std::string_view Signature = "KRETZFILE 1.0   ";
constexpr double mmPerMetre = 1000.0;

// Angles this near to even spacing (in steps) are even.
constexpr double unevenSteps = 0.01;

// Far more items than any file has; a file of nothing but empty items must not keep us for minutes.
constexpr int mostItems = 100000;

struct KretzTag {
  std::uint16_t group, element;
  bool operator<(const KretzTag& other) const { return std::pair(group, element) < std::pair(other.group, other.element); }
};

constexpr KretzTag ProbeName{0x0130, 1}, Manufacturer{0x0140, 2}, ModelName{0x0150, 0x29}, CartesianSpacing{0x0010, 0x22},
    DimensionI{0xC000, 1}, DimensionJ{0xC000, 2}, DimensionK{0xC000, 3}, Resolution{0xC100, 1}, FirstRadius{0xC200, 1},
    AxisOffset{0xC200, 2}, FaceRadius{0xC200, 4}, SweepAngles{0xC300, 1}, FanAngles{0xC300, 2}, Samples{0xD000, 1},
    MovieCount{0xD400, 1}, MovieTimes{0xD400, 5}, MovieSamples{0xD600, 1}, End{0xFFFF, 0xFFFF};

std::string TextOf(KretzTag tag)
{
  constexpr char digits[] = "0123456789ABCDEF";
  std::string text = "(";
  for (const std::uint16_t half : {tag.group, tag.element}) {
    for (int shift = 12; shift >= 0; shift -= 4)
      text += digits[half >> shift & 15];
    text += text.size() == 5 ? "," : ")";
  }
  return text;
}

// Where the value of an item lies in the file.
struct Item {
  std::uint64_t offset = 0, bytes = 0;
};

template <class T>
T LittleEndian(const unsigned char* bytes)
{
  std::uint64_t bits = 0;
  for (std::size_t i = 0; i < sizeof(T); ++i)
    bits |= std::uint64_t{bytes[i]} << 8 * i;
  T value;
  if constexpr (std::is_same_v<T, double>)
    std::memcpy(&value, &bits, sizeof value);
  else
    value = static_cast<T>(bits);
  return value;
}

// One axis of angles: evenly spaced, or where each of the even places lies among the uneven ones.
struct Angles {
  double first = 0.0, last = 0.0;
  std::vector<double> places; ///< empty when the file's are even; else a fractional index per even angle

  int Count(int n) const { return places.empty() ? n : static_cast<int>(places.size()); }
};

class KretzSource : public VolumeSource {
public:
  KretzSource(const std::string& path, std::uint64_t offset, std::uint64_t bytes, const VolumeReadParameters& parameters)
    : VolumeSource(path, FileFormat::Kretz), stream_(OpenToRead(path)), begin_(offset), end_(offset + bytes)
  {
    FindItems();
    dimensions_ = {Dimension(DimensionI), Dimension(DimensionJ), Dimension(DimensionK)};
    FindSamples();
    KeepWhatIsKnown();
    if (Has(FanAngles) || Has(SweepAngles))
      PlaceBeams(parameters);
    else
      PlaceVoxels();
  }

  void Read(std::size_t index, void* voxels, unsigned char* valid, const Progress& progress) override
  {
    auto* out = static_cast<unsigned char*>(voxels);
    if (!content_.beams) {
      ReadSamples(index, out, progress);
      return;
    }
    Volume<unsigned char> samples(content_.beams->dimensions);
    ReadBeams(index, samples.View().Data(), progress.Part(0.0, 0.3));
    const auto& grid = content_.geometry;
    ScanConvert<unsigned char>(samples.View(), *content_.probe, *content_.probeToWorld, grid, {out, grid.dimensions},
                               {valid, grid.dimensions}, progress.Part(0.3, 1.0));
  }

  void ReadBeams(std::size_t index, void* samples, const Progress& progress) override
  {
    if (!content_.beams)
      Fail("it holds voxels, not beams");
    auto* out = static_cast<unsigned char*>(samples);
    ReadSamples(index, out, progress);
    const VolumeView<unsigned char> view(out, dimensions_);
    for (int front = 0, back = dimensions_[2] - 1; front < back; ++front, --back)
      std::swap_ranges(view.Row(0, front), view.Row(0, front) + view.SliceStride(), view.Row(0, back));
    if (!fan_.places.empty() || !sweep_.places.empty())
      Resample(view);
  }

private:
  void FindItems()
  {
    std::string start(Signature.size(), '\0');
    stream_.seekg(static_cast<std::streamoff>(begin_));
    stream_.read(start.data(), static_cast<std::streamsize>(start.size()));
    if (!stream_ || !LooksLikeKretz(start))
      Fail("it does not begin like a Kretz file");
    std::uint64_t at = begin_ + Signature.size();
    int items = 0;
    while (at < end_) {
      unsigned char head[8];
      if (end_ - at < sizeof head || ++items > mostItems)
        Fail(items > mostItems ? "it holds more than 100000 items" : "the data end early, in the head of an item");
      stream_.seekg(static_cast<std::streamoff>(at));
      if (!stream_.read(reinterpret_cast<char*>(head), sizeof head))
        Fail("the data end early, in the head of an item");
      const KretzTag tag{LittleEndian<std::uint16_t>(head), LittleEndian<std::uint16_t>(head + 2)};
      const std::uint64_t bytes = LittleEndian<std::uint32_t>(head + 4);
      at += sizeof head;
      if (!(tag < End))
        break;
      if (bytes > end_ - at)
        Fail("item " + TextOf(tag) + " says that it is " + std::to_string(bytes) + " bytes long, and only " +
             std::to_string(end_ - at) + " follow: the file is truncated or damaged");
      if (!items_.emplace(tag, Item{at, bytes}).second && (tag.group & 0xF000) == 0xC000)
        Fail("item " + TextOf(tag) + " is there twice");
      at += bytes;
    }
  }

  bool Has(KretzTag tag) const { return items_.count(tag) > 0; }

  const Item& Find(KretzTag tag, const char* what) const
  {
    const auto found = items_.find(tag);
    if (found == items_.end())
      Fail(std::string(what) + " is missing: there is no item " + TextOf(tag));
    return found->second;
  }

  // The value of an item of at most a few kilobytes.
  std::vector<unsigned char> Bytes(const Item& item, std::uint64_t limit)
  {
    std::vector<unsigned char> bytes(std::min(item.bytes, limit));
    stream_.seekg(static_cast<std::streamoff>(item.offset));
    if (!stream_.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size())))
      Fail("it cannot be read");
    return bytes;
  }

  int Dimension(KretzTag tag)
  {
    const Item& item = Find(tag, "a dimension");
    if (item.bytes != 2)
      Fail("the dimension " + TextOf(tag) + " is " + std::to_string(item.bytes) + " bytes long; 2 are needed");
    const int n = LittleEndian<std::uint16_t>(Bytes(item, 2).data());
    if (n < 1)
      Fail("the dimension " + TextOf(tag) + " is 0");
    return n;
  }

  std::vector<double> Doubles(KretzTag tag, const char* what, std::size_t count)
  {
    const Item& item = Find(tag, what);
    if (item.bytes != count * sizeof(double))
      Fail(std::string(what) + " " + TextOf(tag) + ": " + std::to_string(item.bytes) + " bytes, where " + std::to_string(count) +
           " numbers of 8 bytes are needed");
    const std::vector<unsigned char> bytes = Bytes(item, item.bytes);
    std::vector<double> numbers(count);
    for (std::size_t i = 0; i < count; ++i) {
      numbers[i] = LittleEndian<double>(bytes.data() + i * sizeof(double));
      if (!std::isfinite(numbers[i]))
        Fail(std::string(what) + " " + TextOf(tag) + " holds a number that is not finite");
    }
    return numbers;
  }

  double Number(KretzTag tag, const char* what) { return Doubles(tag, what, 1)[0]; }

  // Latin-1 without its end, as UTF-8.
  std::string Text(KretzTag tag)
  {
    const auto found = items_.find(tag);
    std::string text;
    if (found != items_.end())
      for (const unsigned char c : Bytes(found->second, 256)) {
        if (c < 32)
          break;
        if (c >= 128)
          text += static_cast<char>(0xC0 | c >> 6);
        text += static_cast<char>(c < 128 ? c : 0x80 | (c & 63));
      }
    while (!text.empty() && text.back() == ' ')
      text.pop_back();
    return text.substr(std::min(text.find_first_not_of(' '), text.size()));
  }

  // One volume, or the volumes of an uncompressed movie.
  void FindSamples()
  {
    const double count = static_cast<double>(dimensions_[0]) * dimensions_[1] * dimensions_[2];
    if (count > std::numeric_limits<int>::max())
      Fail("its dimensions (" + SizeText(dimensions_) + ") need more than 2^31 - 1 samples");
    const std::uint64_t bytes = static_cast<std::uint64_t>(count);
    const auto single = items_.find(Samples), movie = items_.find(MovieSamples);
    if (movie != items_.end() && movie->second.bytes > 0) {
      const std::uint64_t volumes = movie->second.bytes / bytes;
      if (volumes > 0 && volumes * bytes == movie->second.bytes && volumes == SaidVolumes()) {
        first_ = movie->second.offset;
        FindTimes(static_cast<std::size_t>(volumes));
        return;
      }
      if (single == items_.end())
        Fail("its movie " + TextOf(MovieSamples) + " is compressed; save it uncompressed on the scanner");
      Note("Its movie " + TextOf(MovieSamples) + " is compressed and is left out; the single volume beside it is read.");
    }
    if (single == items_.end())
      Fail("it holds no samples " + TextOf(Samples) + "; compressed files must be saved uncompressed on the scanner");
    if (single->second.bytes != bytes)
      Fail("its dimensions (" + SizeText(dimensions_) + ") need " + std::to_string(bytes) + " bytes, and the samples " +
           TextOf(Samples) + " are " + std::to_string(single->second.bytes) +
           ": they are compressed or the dimensions are wrong");
    first_ = single->second.offset;
  }

  std::uint64_t SaidVolumes()
  {
    const auto found = items_.find(MovieCount);
    if (found == items_.end() || (found->second.bytes != 2 && found->second.bytes != 4))
      return 0;
    std::vector<unsigned char> bytes = Bytes(found->second, 4);
    bytes.resize(4);
    return LittleEndian<std::uint32_t>(bytes.data());
  }

  void FindTimes(std::size_t volumes)
  {
    if (volumes == 1)
      return;
    const auto found = items_.find(MovieTimes);
    if (found != items_.end() && found->second.bytes == volumes * sizeof(double)) {
      content_.times = Doubles(MovieTimes, "the times of the movie", volumes);
      if (std::adjacent_find(content_.times.begin(), content_.times.end(), std::greater_equal<>()) == content_.times.end())
        return;
    }
    content_.times.resize(volumes);
    for (std::size_t i = 0; i < volumes; ++i)
      content_.times[i] = static_cast<double>(i);
    Note("The times of its movie cannot be told; the volumes are one second apart.");
  }

  // Of all that is said in words, what names neither a person nor a place nor a day.
  void KeepWhatIsKnown()
  {
    for (const auto& [key, tag] : {std::pair("Manufacturer", Manufacturer), std::pair("ManufacturerModelName", ModelName),
                                   std::pair("TransducerType", ProbeName)})
      if (const std::string text = Text(tag); !text.empty())
        content_.fields.emplace_back(key, text);
  }

  Angles ReadAngles(KretzTag tag, const char* what, int count)
  {
    const std::vector<double> angles = Doubles(tag, what, static_cast<std::size_t>(count));
    if (std::adjacent_find(angles.begin(), angles.end(), std::greater_equal<>()) != angles.end())
      Fail(std::string(what) + " " + TextOf(tag) + " do not increase");
    Angles axis{angles.front(), angles.back(), {}};
    const double step = count > 1 ? (axis.last - axis.first) / (count - 1) : 0.0;
    double deviation = 0.0;
    for (int i = 0; i < count; ++i)
      deviation = std::max(deviation, std::abs(angles[static_cast<std::size_t>(i)] - (axis.first + i * step)));
    if (deviation <= unevenSteps * step)
      return axis;
    for (int i = 0; i < count; ++i) {
      const double wanted = axis.first + i * step;
      const auto above = std::upper_bound(angles.begin() + 1, angles.end() - 1, wanted);
      const double place = static_cast<double>(above - angles.begin()) - 1.0 + (wanted - above[-1]) / (above[0] - above[-1]);
      axis.places.push_back(std::min(std::max(place, 0.0), count - 1.0));
    }
    Note("The beams are resampled to even angles: " + std::string(what) + " deviate from them by up to " +
         NumberText(deviation * DegreesPerRadian) + " degrees, " + NumberText(deviation / step) + " steps.");
    return axis;
  }

  void PlaceBeams(const VolumeReadParameters& parameters)
  {
    fan_ = ReadAngles(FanAngles, "the angles of the fan", dimensions_[1]);
    sweep_ = ReadAngles(SweepAngles, "the angles of the sweep", dimensions_[2]);
    std::reverse(sweep_.places.begin(), sweep_.places.end()); // as the planes are
    for (double& place : sweep_.places)
      place = dimensions_[2] - 1 - place;
    const double step = mmPerMetre * Number(Resolution, "the resolution");
    if (!(step > 0.0))
      Fail("the resolution " + TextOf(Resolution) + " is " + NumberText(step) + " mm; it must be positive");
    const double first = step * Number(FirstRadius, "the radius of the first sample");
    if (!(first >= 0.0))
      Fail("the radius of the first sample " + TextOf(FirstRadius) + " is " + NumberText(first) + " mm; it must be at least 0");
    const double axis = Has(AxisOffset) ? -step * Number(AxisOffset, "the offset of the sweep axis") : 0.0;
    double face = Has(FaceRadius) ? step * Number(FaceRadius, "the radius of the face") : 0.0;
    if (!(face > 0.0 && face <= first)) {
      face = first;
      Note("The radius of the array's face is not known; depths count from the first sample.");
    }
    face = std::max(face, axis); // the sweep turns about a line behind the face

    ProbeGeometry probe;
    probe.fanAngle = fan_.last - fan_.first;
    probe.fanWidth = probe.fanAngle * face;
    probe.fanOffset = (0.5 * (fan_.first + fan_.last) - (0.5 * Pi)) / probe.fanAngle;
    if (std::abs(probe.fanOffset) < 1e-12)
      probe.fanOffset = 0.0;
    probe.sweepAngle = sweep_.last - sweep_.first;
    probe.sweepWidth = probe.sweepAngle * (face - axis);
    probe.depthMin = first - face;
    probe.depthMax = probe.depthMin + step * (dimensions_[0] - 1);

    Pose probeToWorld = Pose::Identity();
    probeToWorld.translation().z() = face;
    const double turned = 0.5 * (sweep_.first + sweep_.last) - (0.5 * Pi);
    if (std::abs(turned) > 1e-12)
      probeToWorld = MotionAbout({0, 0, axis}, {turned, 0, 0}, {0, 0, 0}) * probeToWorld;

    content_.beams = BeamContent{dimensions_, VoxelType::UInt8, probe};
    content_.probe = probe;
    content_.probeToWorld = probeToWorld;
    content_.holdsValidRegion = true;
    const double samples = static_cast<double>(dimensions_[0]) * dimensions_[1] * dimensions_[2];
    try {
      CheckBeamVolume(dimensions_, probe);
      // A fan fills a good part of its box; angles and radii that leave it all but empty are those of a damaged file.
      const bool asked = parameters.spacingMm > 0.0;
      const double most = asked ? std::numeric_limits<int>::max() : 100.0 * samples + 1e6;
      content_.geometry =
          ScanConversionGrid(probe, probeToWorld, asked ? parameters.spacingMm : SampleSpacing(dimensions_, probe),
                             static_cast<std::size_t>(std::min(most, 2147483647.0)));
      content_.geometry.Check("the grid of the scan conversion");
    } catch (const Error& error) {
      const bool large = error.GetKind() == Error::Kind::TooLarge;
      throw Error(large ? Error::Kind::TooLarge : Error::Kind::BadFile, content_.path + ": " + error.what());
    }
    CheckMemory(content_.path, 2.0 * static_cast<double>(content_.geometry.VoxelCount()) + samples);
  }

  // Without angles the samples are voxels. Their spacing is where others have found it; nobody has confirmed it.
  void PlaceVoxels()
  {
    if (!Has(CartesianSpacing))
      Fail("the angles of the beams " + TextOf(FanAngles) + " are missing");
    const double spacing = Number(CartesianSpacing, "the spacing of the voxels");
    content_.geometry.dimensions = dimensions_;
    content_.geometry.spacing.setConstant(spacing);
    CheckGeometry(content_.path, content_.geometry);
    Note("It holds voxels, not beams; that their spacing is " + NumberText(spacing) +
         " mm is inferred, not confirmed: measure something of known size.");
    CheckMemory(content_.path, static_cast<double>(content_.geometry.VoxelCount()));
  }

  // The samples as the file has them.
  void ReadSamples(std::size_t index, unsigned char* out, const Progress& progress)
  {
    const std::uint64_t total = static_cast<std::uint64_t>(VolumeView<unsigned char>(out, dimensions_).Size());
    stream_.clear();
    stream_.seekg(static_cast<std::streamoff>(first_ + index * total));
    if (const std::uint64_t there = ReadPieces(stream_, out, total, progress); there < total)
      Fail("the data end early, after " + std::to_string(there) + " of " + std::to_string(total) + " samples");
  }

  // From the file's angles to even ones, linearly between neighbours.
  void Resample(const VolumeView<unsigned char>& samples) const
  {
    const Volume<unsigned char> copy = [&samples] {
      Volume<unsigned char> volume(samples.Dimensions());
      std::copy(samples.begin(), samples.end(), volume.View().begin());
      return volume;
    }();
    const auto split = [](const Angles& axis, int i, int count, double& fraction) {
      const double place = axis.places.empty() ? i : axis.places[static_cast<std::size_t>(i)];
      const int before = std::max(0, std::min(static_cast<int>(place), count - 2));
      fraction = place - before;
      return before;
    };
    const auto& n = samples.Dimensions();
    for (int k = 0; k < n[2]; ++k)
      for (int j = 0; j < n[1]; ++j) {
        double s = 0.0, f = 0.0;
        const int plane = split(sweep_, k, n[2], s), beam = split(fan_, j, n[1], f);
        const int nextPlane = std::min(plane + 1, n[2] - 1), nextBeam = std::min(beam + 1, n[1] - 1);
        const auto view = copy.View();
        const unsigned char *a = view.Row(beam, plane), *b = view.Row(nextBeam, plane), *c = view.Row(beam, nextPlane),
                            *d = view.Row(nextBeam, nextPlane);
        unsigned char* out = samples.Row(j, k);
        for (int i = 0; i < n[0]; ++i)
          out[i] = static_cast<unsigned char>((1 - s) * ((1 - f) * a[i] + f * b[i]) + s * ((1 - f) * c[i] + f * d[i]) + 0.5);
      }
  }

  std::ifstream stream_;
  std::uint64_t begin_, end_;
  std::map<KretzTag, Item> items_;
  std::array<int, 3> dimensions_{0, 0, 0};
  std::uint64_t first_ = 0; // where the samples of the first volume begin
  Angles fan_, sweep_;
};

} // namespace

bool LooksLikeKretz(std::string_view start)
{
  return start.substr(0, Signature.size()) == Signature;
}

std::unique_ptr<VolumeSource> OpenKretz(const std::string& path, const VolumeReadParameters& parameters)
{
  return OpenKretzWithin(path, 0, FileSize(path), parameters);
}

std::unique_ptr<VolumeSource> OpenKretzWithin(const std::string& path, std::uint64_t offset, std::uint64_t bytes,
                                              const VolumeReadParameters& parameters)
{
  return std::make_unique<KretzSource>(path, offset, bytes, parameters);
}

} // namespace echorama
