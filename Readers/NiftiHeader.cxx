// SPDX-License-Identifier: BSD-3-Clause
// A NIfTI header is a fixed block of 348 (version 1) or 540 bytes (version 2), in the byte order of whoever wrote it. Both
// versions hold the same fields in other places and types. Its affine maps indices to RAS; two signs make it LPS.
#include "Readers/NiftiHeader.h"
#include "Core/Base/Error.h"
#include "Core/Base/NumberText.h"
#include <algorithm>
#include <cctype>
#include <Eigen/Geometry>
#include <limits>
#include <type_traits>

namespace echorama {
namespace {

constexpr int SizeOfHeader[] = {0, 348, 540}; // by version

// Where each version has what. The types differ, too.
struct Layout {
  std::size_t dim, pixdim, datatype, offset, slope, intercept, timeOffset, units, description, qformCode, sformCode, quaternion,
      srow, intentName, magic;
};
constexpr Layout Layouts[] = {{},
                              {40, 76, 70, 108, 112, 116, 136, 123, 148, 252, 254, 256, 280, 328, 344},
                              {16, 104, 12, 168, 176, 184, 216, 500, 240, 344, 348, 352, 400, 508, 4}};

template <int Version>
struct Types {
  static constexpr bool one = Version == 1;
  using Real = std::conditional_t<one, float, double>;
  using Size = std::conditional_t<one, std::int16_t, std::int64_t>;
  using Code = std::conditional_t<one, std::int16_t, std::int32_t>;
  using Offset = std::conditional_t<one, float, std::int64_t>;
};

struct TypeCode {
  int code;
  VoxelType type;
};
constexpr TypeCode TypeCodes[] = {{256, VoxelType::Int8},   {2, VoxelType::UInt8},     {4, VoxelType::Int16},
                                  {512, VoxelType::UInt16}, {8, VoxelType::Int32},     {768, VoxelType::UInt32},
                                  {1024, VoxelType::Int64}, {1280, VoxelType::UInt64}, {16, VoxelType::Float32},
                                  {64, VoxelType::Float64}};

template <int Version>
NiftiHeader Parse(const NiftiBytes& bytes)
{
  using Real = typename Types<Version>::Real;
  using Size = typename Types<Version>::Size;
  using Code = typename Types<Version>::Code;
  using Offset = typename Types<Version>::Offset;
  const Layout& at = Layouts[Version];
  const auto reals = [&](std::size_t offset, auto& target) {
    for (std::size_t i = 0; i < target.size(); ++i)
      target[i] = static_cast<double>(bytes.At<Real>(offset + i * sizeof(Real)));
  };
  NiftiHeader f;
  f.magic.resize(4);
  for (std::size_t i = 0; i < f.magic.size(); ++i)
    f.magic[i] = bytes.At<char>(at.magic + i);
  for (std::size_t i = 0; i < 8; ++i)
    f.dim[i] = bytes.At<Size>(at.dim + i * sizeof(Size));
  reals(at.pixdim, f.pixdim);
  reals(at.quaternion, f.quaternion);
  reals(at.srow, f.srow);
  f.datatype = bytes.At<std::int16_t>(at.datatype);
  f.offset = static_cast<double>(bytes.At<Offset>(at.offset));
  f.slope = static_cast<double>(bytes.At<Real>(at.slope));
  f.intercept = static_cast<double>(bytes.At<Real>(at.intercept));
  f.timeOffset = static_cast<double>(bytes.At<Real>(at.timeOffset));
  f.units = Version == 1 ? bytes.At<unsigned char>(at.units) : bytes.At<std::int32_t>(at.units);
  f.qformCode = bytes.At<Code>(at.qformCode);
  f.sformCode = bytes.At<Code>(at.sformCode);
  f.description = bytes.Text(at.description, 80);
  f.intentName = bytes.Text(at.intentName, 16);
  return f;
}

// Puts numbers into a header of zeros.
class HeaderBytes {
public:
  explicit HeaderBytes(int version) : bytes_(NiftiHeaderSize(version), '\0') { Put<std::int32_t>(0, SizeOfHeader[version]); }
  template <class T>
  void Put(std::size_t offset, T value)
  {
    std::memcpy(bytes_.data() + offset, &value, sizeof value);
  }
  void PutText(std::size_t offset, const std::string& text) { bytes_.replace(offset, text.size(), text); }
  const std::string& Content() const { return bytes_; }

private:
  std::string bytes_;
};

template <int Version>
std::string HeaderText(const ImageHeader& header, const std::string& description, std::size_t offset, double& loss)
{
  using Real = typename Types<Version>::Real;
  using Size = typename Types<Version>::Size;
  using Code = typename Types<Version>::Code;
  using Offset = typename Types<Version>::Offset;
  const Layout& at = Layouts[Version];
  const ImageGeometry& g = header.geometry;
  HeaderBytes bytes(Version);
  const auto size = [&](std::size_t i, int value) { bytes.Put(at.dim + i * sizeof(Size), static_cast<Size>(value)); };
  const auto real = [&](std::size_t offset0, std::size_t i, double value) {
    bytes.Put(offset0 + i * sizeof(Real), static_cast<Real>(value));
  };
  size(0, 3);
  real(at.pixdim, 0, 1.0); // right-handed
  for (std::size_t i = 1; i < 8; ++i) {
    size(i, i <= 3 ? g.dimensions[i - 1] : 1);
    real(at.pixdim, i, i <= 3 ? g.spacing[static_cast<Eigen::Index>(i) - 1] : 0.0);
  }
  const auto* code =
      std::find_if(std::begin(TypeCodes), std::end(TypeCodes), [&](const TypeCode& known) { return known.type == header.type; });
  bytes.Put(at.datatype, static_cast<std::int16_t>(code->code));
  bytes.Put(at.datatype + 2, static_cast<std::int16_t>(8 * SizeOf(header.type)));
  bytes.Put(at.offset, static_cast<Offset>(offset));
  real(at.slope, 0, 1.0);
  if (Version == 1)
    bytes.Put(at.units, static_cast<unsigned char>(2)); // mm
  else
    bytes.Put(at.units, std::int32_t{2});
  bytes.PutText(at.description, description);
  bytes.Put(at.qformCode, static_cast<Code>(1)); // coordinates of the scanner
  bytes.Put(at.sformCode, static_cast<Code>(1));

  Eigen::Affine3d ras = g.IndexToWorld();
  ras.matrix().topRows<2>() = -ras.matrix().topRows<2>().eval();
  Eigen::Matrix3d rotation = g.direction;
  rotation.topRows<2>() = -rotation.topRows<2>().eval();
  Eigen::Quaterniond q(rotation);
  q.normalize();
  if (q.w() < 0.0)
    q.coeffs() = -q.coeffs();
  for (int row = 0; row < 3; ++row) {
    const std::size_t r = static_cast<std::size_t>(row);
    real(at.quaternion, r, q.vec()[row]);
    real(at.quaternion, 3 + r, ras.translation()[row]);
    for (int column = 0; column < 4; ++column)
      real(at.srow, 4 * r + static_cast<std::size_t>(column), ras(row, column));
  }
  // The loss, from the header as others will read it.
  const std::array<double, 12> srow = Parse<Version>(NiftiBytes(bytes.Content(), false)).srow;
  Eigen::Matrix<double, 3, 4> rounding = Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>>(srow.data());
  rounding -= ras.matrix().topRows<3>();
  loss = 0.0;
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector4d index(corner & 1 ? g.dimensions[0] - 1 : 0, corner & 2 ? g.dimensions[1] - 1 : 0,
                                corner & 4 ? g.dimensions[2] - 1 : 0, 1.0);
    loss = std::max(loss, (rounding * index).norm());
  }
  bytes.PutText(at.magic, Version == 1 ? std::string("n+1\0", 4) : std::string("n+2\0\r\n\032\n", 8));
  return bytes.Content();
}

} // namespace

std::string NiftiBytes::Text(std::size_t offset, std::size_t length) const
{
  std::string text(bytes_.substr(offset, length));
  text.erase(std::min(text.find('\0'), text.size()));
  while (!text.empty() && std::isspace(static_cast<unsigned char>(text.back())))
    text.pop_back();
  return text;
}

int NiftiVersion(std::string_view start, bool& swap)
{
  if (start.size() < 4)
    return 0;
  for (const bool swapped : {false, true})
    for (const int version : {1, 2})
      if (NiftiBytes(start, swapped).At<std::int32_t>(0) == SizeOfHeader[version]) {
        swap = swapped;
        return version;
      }
  return 0;
}

std::size_t NiftiHeaderSize(int version)
{
  return static_cast<std::size_t>(SizeOfHeader[version]);
}

NiftiHeader ParseNiftiHeader(int version, const NiftiBytes& bytes)
{
  return version == 1 ? Parse<1>(bytes) : Parse<2>(bytes);
}

std::optional<VoxelType> NiftiVoxelType(int code)
{
  for (const TypeCode& known : TypeCodes)
    if (known.code == code)
      return known.type;
  return std::nullopt;
}

const char* NiftiTypeName(int code)
{
  switch (code) {
  case 1:
    return "single bits";
  case 32:
  case 1792:
  case 2048:
    return "complex numbers";
  case 128:
  case 2304:
    return "colours";
  case 1536:
    return "128-bit numbers";
  default:
    return "an unknown type";
  }
}

std::string NiftiHeaderText(const std::string& path, const ImageHeader& header, double& roundingMm)
{
  const ImageGeometry& g = header.geometry;
  if (!(std::max(g.origin.norm(), g.spacing.norm()) < static_cast<double>(std::numeric_limits<float>::max())))
    throw Error(Error::Kind::BadInput,
                path + ": its geometry is beyond the range of 32-bit floats, which is all that NIfTI-1 has");
  std::string description = NiftiDescription;
  std::string comment = NiftiCommentStart + " " + GeometryText(g) + "\n";
  for (const HeaderField& field : header.fields) {
    if (field.first == "descrip" && field.second.size() < 80)
      description = field.second;
    else
      comment += field.first + "=" + field.second + "\n";
  }
  comment.resize((comment.size() + 8 + 15) / 16 * 16 - 8, '\0');
  if (comment.size() > (1u << 27)) // vox_offset is a float
    throw Error(Error::Kind::BadInput, path + ": its fields are too long for a header");

  const int version = *std::max_element(g.dimensions.begin(), g.dimensions.end()) > 32767 ? 2 : 1;
  const std::size_t offset = NiftiHeaderSize(version) + 4 + 8 + comment.size();
  std::string start = version == 1 ? HeaderText<1>(header, description, offset, roundingMm)
                                   : HeaderText<2>(header, description, offset, roundingMm);
  start += std::string("\1\0\0\0", 4);
  for (const std::int32_t number : {static_cast<std::int32_t>(comment.size() + 8), std::int32_t{NiftiCommentCode}})
    start.append(reinterpret_cast<const char*>(&number), sizeof number);
  return start + comment;
}

} // namespace echorama
