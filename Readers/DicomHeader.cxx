// SPDX-License-Identifier: BSD-3-Clause
// Which elements (DicomElements.h) say what. Pixels that are not compressed are later read straight from the file, picture by
// picture; the others by DicomPixels.h.
#include "Readers/DicomHeader.h"
#include "Core/Base/Error.h"
#include "Core/Base/FormatText.h"
#include "Core/Base/NumberText.h"
#include "Core/Geometry/MatrixRows.h"
#include "Readers/DataFile.h"
#include "Readers/DicomElements.h"
#include <algorithm>
#include <cmath>
#include <fstream>

namespace echorama {
namespace {

constexpr std::size_t mostPictures = 100000;

// No frame is compressed to less than this part of itself, but for empty ones.
constexpr double mostCompressed = 1e4;

// Calls functor with the first item of a sequence, if there is one.
template <class Functor>
bool WithItem(const DicomData& data, DicomTag tag, const Functor& functor)
{
  const std::vector<DicomData>* items = data.Sequence(tag);
  if (!items || items->empty())
    return false;
  functor(items->front());
  return true;
}

void SetPosition(DicomPlane& plane, const std::vector<double>& n)
{
  if (n.size() == 3)
    plane.position = Eigen::Vector3d(n[0], n[1], n[2]);
}

void SetDirections(DicomPlane& plane, const std::vector<double>& n)
{
  if (n.size() == 6) {
    plane.directions.emplace();
    *plane.directions << n[0], n[3], n[1], n[4], n[2], n[5];
  }
}

void SetSpacing(DicomPicture& picture, const DicomData& data)
{
  if (const auto n = data.Decimals(0x00280030, 2); !n.empty())
    picture.spacing = {n[1], n[0]}; // the file gives that of rows, then that of columns
  if (const auto n = data.Decimal(0x00180088))
    picture.sliceSpacing = *n;
}

void SetRescale(DicomPicture& picture, const DicomData& data)
{
  if (const auto n = data.Decimal(0x00281053))
    picture.slope = *n;
  if (const auto n = data.Decimal(0x00281052))
    picture.intercept = *n;
}

// The one spacing of the calibrated regions of an ultrasound picture; nothing where they disagree or are no lengths.
void SetRegionSpacing(DicomPicture& picture, const DicomData& data)
{
  constexpr int centimetres = 3, tissue = 1;
  constexpr double mmPerCm = 10.0;
  const std::vector<DicomData>* regions = data.Sequence(DicomRegions);
  Eigen::Vector2d found = Eigen::Vector2d::Zero();
  for (std::size_t i = 0; regions && i < regions->size(); ++i) {
    const DicomData& region = (*regions)[i];
    if (region.Short(0x00186014, tissue) != tissue || region.Short(0x00186024, 0) != centimetres ||
        region.Short(0x00186026, 0) != centimetres)
      continue;
    const Eigen::Vector2d spacing =
        mmPerCm * Eigen::Vector2d(region.Double(0x0018602C).value_or(0.0), region.Double(0x0018602E).value_or(0.0)).cwiseAbs();
    if (!found.isZero() && !found.isApprox(spacing, 1e-6))
      return;
    found = spacing;
  }
  picture.spacing = found;
}

// What an object without functional groups says of all its pictures.
DicomPicture PlainPicture(const DicomData& data)
{
  DicomPicture picture;
  SetPosition(picture.patient, data.Decimals(0x00200032, 3));
  SetDirections(picture.patient, data.Decimals(0x00200037, 6));
  SetSpacing(picture, data);
  if (picture.spacing.isZero())
    SetRegionSpacing(picture, data);
  SetRescale(picture, data);
  if (const auto n = data.Decimal(0x00200100))
    picture.timeIndex = static_cast<int>(*n);
  if (const auto n = data.Decimal(0x00181060); n && picture.timeIndex)
    picture.time = *n * 1e-3;
  return picture;
}

// One functional group is in the item of the picture or, for all, in the shared one.
DicomPicture GroupedPicture(const DicomData& shared, const DicomData& own)
{
  DicomPicture picture;
  const auto group = [&shared, &own](DicomTag tag, const auto& functor) {
    WithItem(own, tag, functor) || WithItem(shared, tag, functor);
  };
  using Data = const DicomData&;
  group(0x00209113, [&](Data d) { SetPosition(picture.patient, d.Decimals(0x00200032, 3)); });
  group(0x00209116, [&](Data d) { SetDirections(picture.patient, d.Decimals(0x00200037, 6)); });
  group(0x0020930E, [&](Data d) { SetPosition(picture.volume, d.Binary<double>(0x00209301, 3)); });
  group(0x0020930F, [&](Data d) { SetDirections(picture.volume, d.Binary<double>(0x00209302, 6)); });
  group(0x00289110, [&](Data d) { SetSpacing(picture, d); });
  group(0x00289145, [&](Data d) { SetRescale(picture, d); });
  group(0x00189807, [&](Data d) { picture.dataType = d.Text(0x00189808); });
  group(0x00209310, [&](Data d) { picture.time = d.Double(0x0020930D); });
  group(0x00209111, [&](Data d) {
    if (const auto n = d.Binary<std::uint32_t>(0x00209128, 1); !n.empty())
      picture.timeIndex = static_cast<int>(n[0] & 0x7FFFFFFF);
  });
  return picture;
}

class HeaderReader {
public:
  explicit HeaderReader(const std::string& path) : path_(path) { header_.path = path; }

  DicomHeader Read()
  {
    const DicomData data = Parse();
    ReadImage(data);
    if (header_.kretzBytes == 0 && header_.pixelBytes > 0) {
      ReadPictures(data);
      CheckPixels();
    }
    return header_;
  }

private:
  DicomData Parse()
  {
    const std::uint64_t bytes = FileSize(path_);
    std::ifstream stream = OpenToRead(path_);
    std::string start(DicomPreamble, '\0');
    stream.read(start.data(), static_cast<std::streamsize>(start.size()));
    if (!stream || !LooksLikeDicom(start))
      FailFile(path_, "it is not DICOM: DICM is missing after its first 128 bytes");
    DicomElements elements = ReadDicomElements(stream, bytes, path_);
    const DicomData& data = elements.data;
    header_.transferSyntax = elements.transferSyntax;
    header_.storage = elements.deflated       ? DicomStorage::Deflated
                      : elements.encapsulated ? DicomStorage::Encapsulated
                                              : DicomStorage::Plain;
    header_.pixelOffset = elements.pixels.offset;
    header_.pixelBytes = elements.pixels.bytes;
    if (data.Text(0x7FE10011) == "KRETZ_US" && !elements.deflated) { // else its offset is not one of the file
      header_.kretzOffset = elements.kretz.offset;
      header_.kretzBytes = elements.kretz.bytes;
    }
    header_.holdsMovieGroup = data.Text(0x7FE10010) == "GEMS_Ultrasound_MovieGroup_001";
    return std::move(elements.data);
  }

  void ReadImage(const DicomData& data)
  {
    header_.series = data.Text(0x0020000E);
    header_.photometric = data.Text(0x00280004);
    header_.rows = data.Short(0x00280010, 0);
    header_.columns = data.Short(0x00280011, 0);
    header_.samples = data.Short(0x00280002, 1);
    header_.planar = data.Short(0x00280006, 0) == 1;
    header_.bitsAllocated = data.Short(0x00280100, 0);
    header_.bitsStored = data.Short(0x00280101, header_.bitsAllocated);
    highBit_ = data.Short(0x00280102, header_.bitsStored - 1);
    header_.isSigned = data.Short(0x00280103, 0) == 1;
    header_.burnedIn = data.Text(0x00280301) == "YES";
    if (const auto n = data.Decimal(0x00181063))
      header_.frameTime = *n * 1e-3;
    if (const auto n = data.Binary<std::uint16_t>(0x00280009, 2); !n.empty())
      header_.frameIncrement = n[0] == 0x0018 && (n[1] == 0x1063 || n[1] == 0x1065) ? "time"
                               : (n[0] == 0x0018 && n[1] == 0x0088) || (n[0] == 0x0020 && (n[1] == 0x1041 || n[1] == 0x0032))
                                   ? "space"
                                   : "";
    if (const auto n = data.Binary<double>(0x00209309, 16); !n.empty())
      header_.volumeToTransducer = Eigen::Map<const MatrixRows>(n.data());
    for (const auto& [key, tag] :
         {std::pair("Modality", DicomTag(0x00080060)), std::pair("Manufacturer", DicomTag(0x00080070)),
          std::pair("ManufacturerModelName", DicomTag(0x00081090)), std::pair("TransducerType", DicomTag(0x00186031))}) {
      std::string text = data.Text(tag).substr(0, 256);
      std::replace_if(
          text.begin(), text.end(), [](char c) { return c < 32 || c > 126; }, '?');
      if (!text.empty())
        header_.fields.emplace_back(key, text);
    }
  }

  void ReadPictures(const DicomData& data)
  {
    std::size_t count = 1;
    if (const std::string text = data.Text(0x00280008); !text.empty()) {
      const auto n = data.Decimal(0x00280008);
      if (!n || !(*n >= 1.0 && *n <= static_cast<double>(mostPictures)) || *n != std::floor(*n))
        FailFile(path_,
                 "its number of frames is \"" + text.substr(0, 40) + "\"; it must be from 1 to " + std::to_string(mostPictures));
      count = static_cast<std::size_t>(*n);
    }
    if (count > header_.pixelBytes)
      FailFile(path_, "it says that it holds " + std::to_string(count) + " frames, more than it has bytes for");

    const std::vector<DicomData>* groups = data.Sequence(DicomPictureGroups);
    if (!groups) {
      const DicomPicture picture = PlainPicture(data);
      header_.pictures.assign(count, picture);
      ReadPhilips(data);
      return;
    }
    if (groups->size() != count)
      FailFile(path_,
               "it holds " + std::to_string(count) + " frames and functional groups for " + std::to_string(groups->size()));
    header_.grouped = true;
    const DicomData none, *shared = &none; // not copied: it may be large
    WithItem(data, DicomSharedGroups, [&shared](const DicomData& item) { shared = &item; });
    for (const DicomData& own : *groups)
      header_.pictures.push_back(GroupedPicture(*shared, own));
  }

  void ReadPhilips(const DicomData& data)
  {
    // QLAB's Cartesian export: depth of the volume and its third spacing in private elements, lengths in cm.
    constexpr double mmPerCm = 10.0;
    if (const auto slices = data.Binary<std::uint32_t>(0x30011001, 1); !slices.empty()) {
      const auto x = data.Double(0x0018602C), y = data.Double(0x0018602E), z = data.Double(0x30011003);
      if (slices[0] >= 1 && slices[0] <= 65535 && x && y && z) {
        header_.volumeSlices = static_cast<int>(slices[0]);
        header_.volumeSpacing = mmPerCm * Eigen::Vector3d(*x, *y, *z);
      }
    }
    // Affiniti: the pictures of the file are the slices of one volume, its three spacings a private text.
    if (const auto n = data.PrivateDecimals(0x200D, 0x03, "Philips US Imaging DD 036", 3); !n.empty()) {
      for (DicomPicture& picture : header_.pictures) {
        picture.spacing = {n[0], n[1]};
        picture.sliceSpacing = n[2];
      }
      header_.frameIncrement = "space";
    }
  }

  void CheckPixels()
  {
    if (header_.rows < 1 || header_.columns < 1)
      FailFile(path_, "its pictures have " + SizeText(header_.columns, header_.rows) + " pixels");
    if (header_.bitsAllocated != 8 && header_.bitsAllocated != 16 && header_.bitsAllocated != 32)
      FailFile(path_, "its pixels have " + std::to_string(header_.bitsAllocated) + " bits; 8, 16 or 32 are supported");
    if (header_.bitsStored < 1 || header_.bitsStored > header_.bitsAllocated || highBit_ != header_.bitsStored - 1)
      FailFile(path_, "its pixels use " + std::to_string(header_.bitsStored) + " bits up to bit " + std::to_string(highBit_) +
                          " of " + std::to_string(header_.bitsAllocated) + ", which is not supported");
    const std::string& colour = header_.photometric;
    const bool grey = colour == "MONOCHROME1" || colour == "MONOCHROME2";
    const bool coloured = colour == "RGB" || colour.compare(0, 4, "YBR_") == 0;
    if (!(grey && header_.samples == 1) && !(coloured && header_.samples == 3 && header_.bitsAllocated == 8))
      FailFile(path_, "its pixels are " + std::to_string(header_.samples) + " numbers of " +
                          std::to_string(header_.bitsAllocated) + " bits that mean " +
                          (colour.empty() ? "nothing known" : colour) + ", which is not supported");
    const double decoded = static_cast<double>(header_.PictureBytes()) * static_cast<double>(header_.pictures.size()) *
                           std::max(1, header_.volumeSlices);
    const double there = static_cast<double>(header_.pixelBytes);
    const bool encapsulated = header_.storage == DicomStorage::Encapsulated;
    if (encapsulated ? decoded > mostCompressed * there : decoded > there)
      FailFile(path_, "its " + std::to_string(header_.pictures.size()) + " frames of " + std::to_string(header_.columns) + " x " +
                          std::to_string(header_.rows) + " pixels need " + NumberText(decoded) + " bytes, " +
                          (encapsulated ? "more than can be compressed to the " : "and it holds ") + NumberText(there) +
                          ": it is truncated or its sizes are wrong");
  }

  std::string path_;
  DicomHeader header_;
  int highBit_ = 7;
};

} // namespace

std::uint64_t DicomHeader::PictureBytes() const
{
  const std::uint64_t pixels = static_cast<std::uint64_t>(rows) * static_cast<std::uint64_t>(columns);
  if (storage != DicomStorage::Encapsulated && photometric == "YBR_FULL_422")
    return (static_cast<std::uint64_t>(columns) + 1) / 2 * 4 * static_cast<std::uint64_t>(rows);
  return pixels * static_cast<std::uint64_t>(samples) * static_cast<std::uint64_t>(bitsAllocated / 8);
}

bool LooksLikeDicom(std::string_view start)
{
  return start.size() >= DicomPreamble && start.substr(128, 4) == "DICM";
}

DicomHeader ReadDicomHeader(const std::string& path)
{
  return HeaderReader(path).Read();
}

} // namespace echorama
