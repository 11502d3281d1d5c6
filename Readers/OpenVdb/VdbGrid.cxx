// SPDX-License-Identifier: BSD-3-Clause
// An OpenVDB tree holds voxels in leaves of 8^3, x slowest; what is not in a leaf is in a larger tile or the background. So
// both directions go by blocks of 8^3: one look-up per block, then a copy of 512 voxels in another order. Blocks of a layer are
// made in parallel and hung into the tree one after the other, in their order, so the file does not depend on the threads.
//
// OpenVDB trusts its files, so the file is taken into memory and walked through first (VdbWalk.h). Then the library reads from a
// stream that throws at the end, through io::Archive, the base class of its own readers.
#include "Core/Base/Error.h"
#include "Core/Base/JoinedText.h"
#include "Core/Base/Parallel.h"
#include "Readers/AffinePose.h"
#include "Readers/DataFile.h"
#include "Readers/OpenVdb/VdbWalk.h"
#include "Readers/VdbFile.h"
#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <openvdb/io/Archive.h>
#include <openvdb/openvdb.h>

namespace echorama {
namespace {

constexpr int Edge = 8; // of a leaf
const char* const GridName = "Intensity";
const char* const TypeKey = "echorama:type";
const char* const DimensionsKey = "echorama:dimensions";
const std::string FieldPrefix = "field:"; // keeps our fields apart from the keys of OpenVDB and other programs

constexpr const char* VdbTypeNames[] = {"int8",   "uint8", "int16",  "uint16",  "int32",
                                        "uint32", "int64", "uint64", "float32", "float64"};

// Calls function, and turns what OpenVDB and the stream throw into errors of ours.
template <class Function>
void Guarded(const std::string& path, const Function& function)
{
  try {
    function();
  } catch (const Error&) {
    throw;
  } catch (const openvdb::LookupError& error) {
    FailFile(path, std::string("it holds a grid of a type that is not known (") + error.what() + ")");
  } catch (const openvdb::Exception& error) {
    FailFile(path, std::string("OpenVDB cannot read it (") + error.what() + ")");
  } catch (const std::ios_base::failure&) {
    FailFile(path, "the data end early: it is truncated or damaged");
  } catch (const std::bad_alloc&) {
    FailFile(path, "it asks for more memory than there is: it is damaged");
  } catch (const std::length_error&) {
    FailFile(path, "it asks for more memory than there is: it is damaged");
  }
}

void Initialize()
{
  static const bool done = (openvdb::initialize(), true);
  static_cast<void>(done);
}

class Archive : public openvdb::io::Archive {
public:
  // The grid to take, whole. \a others: the names of the rest.
  openvdb::GridBase::Ptr Read(std::istream& stream, const std::string& path, std::vector<std::string>& others)
  {
    readHeader(stream);
    setFormatVersion(stream); // the stream carries them to what is read from it
    setLibraryVersion(stream);
    setDataCompression(stream);
    openvdb::MetaMap().readMeta(stream);
    const std::int32_t count = readGridCount(stream);
    openvdb::io::GridDescriptor chosen;
    openvdb::GridBase::Ptr grid;
    std::string last;
    for (std::int32_t i = 0; i < count; ++i) {
      openvdb::io::GridDescriptor descriptor;
      const openvdb::GridBase::Ptr empty = descriptor.read(stream);
      const bool takes = empty->isType<openvdb::FloatGrid>() || empty->isType<openvdb::DoubleGrid>() ||
                         empty->isType<openvdb::Int32Grid>() || empty->isType<openvdb::Int64Grid>();
      last = descriptor.gridName() + " (" + descriptor.gridType() + ")";
      if (takes && !descriptor.isInstance() && (!grid || (descriptor.gridName() == GridName && chosen.gridName() != GridName))) {
        if (grid)
          others.push_back(chosen.gridName());
        grid = empty;
        chosen = descriptor;
      } else
        others.push_back(last);
      descriptor.seekToEnd(stream);
    }
    if (!grid)
      FailFile(path, "it holds no grid of single numbers: the last of " + std::to_string(count) + " is " + last);
    // Up to the tree, then through it, before it is read.
    chosen.seekToGrid(stream);
    readGridCompression(stream);
    grid->readMeta(stream);
    const std::streampos transform = stream.tellg();
    if (openvdb::readString(stream) == openvdb::math::NonlinearFrustumMap::mapType())
      FailFile(path, "its grid lies in a frustum; only affine transforms have a pose");
    stream.seekg(transform);
    grid->readTransform(stream);
    const std::size_t valueBytes = grid->isType<openvdb::FloatGrid>() || grid->isType<openvdb::Int32Grid>() ? 4 : 8;
    const bool real = grid->isType<openvdb::FloatGrid>() || grid->isType<openvdb::DoubleGrid>();
    if (chosen.saveFloatAsHalf() && !real)
      FailFile(path, "its grid " + chosen.gridName() + " holds halves of whole numbers");
    CheckVdbTree(stream, path, valueBytes, chosen.saveFloatAsHalf() ? 2 : valueBytes, openvdb::io::getDataCompression(stream));
    chosen.seekToGrid(stream);
    readGrid(grid, chosen, stream);
    return grid;
  }

  void Write(std::ostream& stream, const openvdb::GridBase::Ptr& grid)
  {
    openvdb::io::Archive::write(stream, openvdb::GridPtrVec{grid}, true);
  }
};

// Four types of grid hold the ten types of voxels. What touches trees is compiled for the four alone: it takes long. Grids come
// from the library's registry, with a background of zero: a constructor called here would compile all that they can do.
template <class T>
using StoredOf =
    std::conditional_t<sizeof(T) <= 2 || std::is_same_v<T, float>, float,
                       std::conditional_t<std::is_same_v<T, double> || std::is_same_v<T, std::int32_t>, T, std::int64_t>>;
template <class Stored>
using GridOf = std::conditional_t<
    std::is_same_v<Stored, float>, openvdb::FloatGrid,
    std::conditional_t<std::is_same_v<Stored, double>, openvdb::DoubleGrid,
                       std::conditional_t<std::is_same_v<Stored, std::int32_t>, openvdb::Int32Grid, openvdb::Int64Grid>>>;

VoxelType NativeType(const openvdb::GridBase& grid)
{
  return grid.isType<openvdb::FloatGrid>()    ? VoxelType::Float32
         : grid.isType<openvdb::DoubleGrid>() ? VoxelType::Float64
         : grid.isType<openvdb::Int32Grid>()  ? VoxelType::Int32
                                              : VoxelType::Int64;
}

// Whether a voxel of type T can hold value.
template <class T>
bool Holds(StoredOf<T> value)
{
  if constexpr (sizeof(T) <= 2)
    return value >= static_cast<float>(std::numeric_limits<T>::lowest()) &&
           value <= static_cast<float>(std::numeric_limits<T>::max()) && value == std::floor(value);
  else if constexpr (std::is_same_v<T, std::uint32_t>)
    return value >= 0 && value <= std::int64_t{std::numeric_limits<T>::max()};
  else
    return true; // the same type, or uint64 as the bits of int64
}

template <class Stored>
bool AllOf(const openvdb::GridBase& grid, bool (*holds)(Stored))
{
  for (auto value = static_cast<const GridOf<Stored>&>(grid).cbeginValueAll(); value; ++value)
    if (!holds(value.getValue()))
      return false;
  return true;
}

// The first multiple of 8 that is not above i.
std::int64_t BlockOf(std::int64_t i)
{
  return i & ~std::int64_t{Edge - 1};
}

// A box of index space.
struct Box {
  openvdb::Coord first;
  std::array<int, 3> size;
  std::size_t Slice() const { return static_cast<std::size_t>(size[0]) * static_cast<std::size_t>(size[1]); }
};

// Copies the slices of a box from z0 to end - 1, which lie in one layer of blocks, to values and active.
template <class Stored>
void CopyLayer(const openvdb::GridBase& base, const Box& box, std::int64_t z0, std::int64_t end, Stored* values,
               unsigned char* active)
{
  const auto& tree = static_cast<const GridOf<Stored>&>(base).tree();
  const std::int64_t endX = std::int64_t{box.first.x()} + box.size[0], endY = std::int64_t{box.first.y()} + box.size[1];
  for (std::int64_t by = BlockOf(box.first.y()); by < endY; by += Edge)
    for (std::int64_t bx = BlockOf(box.first.x()); bx < endX; bx += Edge) {
      const openvdb::Coord block(static_cast<int>(bx), static_cast<int>(by), static_cast<int>(BlockOf(z0)));
      const auto* leaf = tree.probeConstLeaf(block);
      const Stored tile = leaf ? Stored(0) : tree.getValue(block);
      const bool tileActive = !leaf && tree.isValueOn(block);
      const std::int64_t fromX = std::max<std::int64_t>(bx, box.first.x()), toX = std::min(bx + Edge, endX);
      for (std::int64_t z = z0; z < end; ++z)
        for (std::int64_t y = std::max<std::int64_t>(by, box.first.y()); y < std::min(by + Edge, endY); ++y) {
          std::size_t index = static_cast<std::size_t>(z - z0) * box.Slice() +
                              static_cast<std::size_t>(y - box.first.y()) * static_cast<std::size_t>(box.size[0]) +
                              static_cast<std::size_t>(fromX - box.first.x());
          for (std::int64_t x = fromX; x < toX; ++x, ++index) {
            const openvdb::Index at = static_cast<openvdb::Index>(((x - bx) * Edge + y - by) * Edge + z - block.z());
            values[index] = leaf ? leaf->getValue(at) : tile;
            active[index] = (leaf ? leaf->isValueOn(at) : tileActive) ? 1 : 0;
          }
        }
    }
}

class VdbSource : public VolumeSource {
public:
  explicit VdbSource(const std::string& path) : VolumeSource(path, FileFormat::Vdb)
  {
    stored_.path = path;
    content_.holdsValidRegion = true;
    Guarded(path, [this] { Open(); });
  }
  void Read(std::size_t, void* voxels, unsigned char* valid, const Progress& progress) override
  {
    DispatchVoxelType(content_.type, [&](auto zero) { Copy(static_cast<decltype(zero)*>(voxels), valid, progress); });
  }

private:
  void Open();
  bool IsOurs(const openvdb::CoordBBox& box);
  bool ValuesFit() const;
  template <class T>
  void Copy(T* voxels, unsigned char* valid, const Progress& progress) const;

  ImageHeader stored_;
  openvdb::GridBase::Ptr grid_;
  openvdb::Coord first_; // of the volume, in the index space of the grid
};

void VdbSource::Open()
{
  Initialize();
  const std::string& path = content_.path;
  std::string bytes;
  {
    std::ifstream file = OpenToRead(path);
    const std::uint64_t size = FileSize(path);
    CheckMemory(path, static_cast<double>(size));
    bytes.resize(size);
    bytes.resize(ReadPieces(file, bytes.data(), size));
  }
  CheckVdbHeader(bytes, path);
  MemoryStream stream(bytes);
  std::vector<std::string> others;
  grid_ = Archive().Read(stream, path, others);
  if (!others.empty())
    Note("of several grids " + grid_->getName() + " was taken; left out: " + Joined(others));
  if (grid_->getGridClass() == openvdb::GRID_LEVEL_SET)
    Fail("its grid " + grid_->getName() + " is a level set (distances from a surface), not a volume of intensities");

  const openvdb::CoordBBox box = grid_->evalActiveVoxelBoundingBox();
  const bool ours = IsOurs(box);
  if (ours) {
    first_ = openvdb::Coord(0);
    if (!ValuesFit()) {
      content_.type = NativeType(*grid_);
      Note("another program has changed the voxels: they no longer fit the type that they had");
    }
  } else {
    if (box.empty())
      Fail("its grid " + grid_->getName() + " has no active voxels");
    first_ = box.min();
    for (int axis = 0; axis < 3; ++axis) {
      const std::int64_t length = std::int64_t{box.max()[axis]} - box.min()[axis] + 1;
      if (length > std::numeric_limits<int>::max())
        Fail("its active voxels reach from " + std::to_string(box.min()[axis]) + " to " + std::to_string(box.max()[axis]) +
             ", too far for a volume");
      stored_.geometry.dimensions[static_cast<std::size_t>(axis)] = static_cast<int>(length);
    }
    content_.type = NativeType(*grid_);
    Note("the file does not name its unit of length or its frame: mm and LPS were assumed");
  }
  const auto& d = stored_.geometry.dimensions;
  CheckMemory(path, static_cast<double>(d[0]) * d[1] * d[2] * static_cast<double>(SizeOf(content_.type) + 1));

  // OpenVDB multiplies rows by matrices from the right.
  const openvdb::math::Mat4d map = grid_->transform().baseMap()->getAffineMap()->getMat4();
  Eigen::Matrix<double, 3, 4> affine;
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 4; ++column)
      affine(row, column) = map(column, row);
  affine.col(3) += affine.leftCols<3>() * Eigen::Vector3d(first_.x(), first_.y(), first_.z());
  PlaceAffine(stored_, affine);
  content_.notes.insert(content_.notes.end(), stored_.notes.begin(), stored_.notes.end());
  content_.geometry = stored_.geometry;
  for (auto entry = grid_->beginMeta(); entry != grid_->endMeta(); ++entry)
    if (entry->first.compare(0, FieldPrefix.size(), FieldPrefix) == 0)
      content_.fields.emplace_back(entry->first.substr(FieldPrefix.size()), entry->second->str());
}

// Whether WriteVdb made the grid and nobody has moved its voxels since; sets dimensions and type then.
bool VdbSource::IsOurs(const openvdb::CoordBBox& box)
{
  const auto dimensions = grid_->getMetadata<openvdb::Vec3IMetadata>(DimensionsKey);
  const auto type = grid_->getMetadata<openvdb::StringMetadata>(TypeKey);
  if (!dimensions || !type)
    return false;
  const auto* name = std::find(std::begin(VdbTypeNames), std::end(VdbTypeNames), type->value());
  if (name == std::end(VdbTypeNames))
    Fail("its metadata name the type \"" + type->value() + "\", which is none");
  for (int axis = 0; axis < 3; ++axis) {
    const int length = dimensions->value()[axis];
    if (length < 1)
      Fail("its metadata hold the dimension " + std::to_string(length));
    if (!box.empty() && (box.min()[axis] < 0 || box.max()[axis] >= length)) {
      Note("another program has made the volume larger or moved its voxels: the box of the active ones was taken");
      return false;
    }
    stored_.geometry.dimensions[static_cast<std::size_t>(axis)] = length;
  }
  content_.type = static_cast<VoxelType>(name - VdbTypeNames);
  // The grid must be one that holds the type without loss.
  const bool fits =
      DispatchVoxelType(content_.type, [this](auto zero) { return grid_->isType<GridOf<StoredOf<decltype(zero)>>>(); });
  if (!fits)
    content_.type = NativeType(*grid_);
  return true;
}

bool VdbSource::ValuesFit() const
{
  return DispatchVoxelType(content_.type, [this](auto zero) {
    using T = decltype(zero);
    if constexpr (sizeof(T) <= 2 || std::is_same_v<T, std::uint32_t>)
      return AllOf<StoredOf<T>>(*grid_, &Holds<T>);
    else
      return true;
  });
}

template <class T>
void VdbSource::Copy(T* voxels, unsigned char* valid, const Progress& progress) const
{
  const Box box{first_, stored_.geometry.dimensions};
  const std::int64_t first = first_.z(), end = first + box.size[2], begin = BlockOf(first);
  ParallelFor((end - begin + Edge - 1) / Edge, progress, [&](std::ptrdiff_t layer) {
    const std::int64_t z0 = std::max(first, begin + layer * Edge), z1 = std::min(end, begin + (layer + 1) * Edge);
    const std::size_t slice = box.Slice(), slices = static_cast<std::size_t>(z1 - z0);
    std::vector<StoredOf<T>> values(slice * slices);
    std::vector<unsigned char> active(values.size());
    CopyLayer(*grid_, box, z0, z1, values.data(), active.data());
    for (std::size_t z = 0; z < slices; ++z) {
      const std::size_t k = static_cast<std::size_t>(z0 - first) + z;
      const std::size_t target = (stored_.reverseSlices ? static_cast<std::size_t>(box.size[2]) - 1 - k : k) * slice;
      std::transform(values.data() + z * slice, values.data() + (z + 1) * slice, voxels + target,
                     [](StoredOf<T> value) { return static_cast<T>(value); });
      if (valid)
        std::copy_n(active.data() + z * slice, slice, valid + target);
    }
  });
}

// Hangs one layer of leaves into a tree, of \a slices slices from z0. Leaves of which nothing is active and everything zero
// are left out.
template <class Stored>
void AddLayer(openvdb::GridBase& base, const std::array<int, 3>& d, int z0, int slices, const Stored* values,
              const unsigned char* valid)
{
  auto& tree = static_cast<GridOf<Stored>&>(base).tree();
  using Leaf = typename GridOf<Stored>::TreeType::LeafNodeType;
  const std::ptrdiff_t blocksX = (d[0] + Edge - 1) / Edge, blocksY = (d[1] + Edge - 1) / Edge;
  std::vector<std::unique_ptr<Leaf>> leaves(static_cast<std::size_t>(blocksX * blocksY));
  ParallelFor(blocksY, [&](std::ptrdiff_t row) {
    for (std::ptrdiff_t column = 0; column < blocksX; ++column) {
      const int x0 = static_cast<int>(column) * Edge, y0 = static_cast<int>(row) * Edge;
      std::unique_ptr<Leaf>& leaf = leaves[static_cast<std::size_t>(row * blocksX + column)];
      for (int z = 0; z < slices; ++z)
        for (int y = y0; y < std::min(y0 + Edge, d[1]); ++y) {
          std::size_t index = (static_cast<std::size_t>(z) * static_cast<std::size_t>(d[1]) + static_cast<std::size_t>(y)) *
                                  static_cast<std::size_t>(d[0]) +
                              static_cast<std::size_t>(x0);
          for (int x = x0; x < std::min(x0 + Edge, d[0]); ++x, ++index) {
            const bool active = !valid || valid[index] != 0;
            if (!active && values[index] == Stored(0))
              continue;
            if (!leaf)
              leaf = std::make_unique<Leaf>(openvdb::Coord(x0, y0, z0), Stored(0));
            const openvdb::Index at = static_cast<openvdb::Index>(((x - x0) * Edge + y - y0) * Edge + z);
            if (active)
              leaf->setValueOn(at, values[index]);
            else
              leaf->setValueOff(at, values[index]);
          }
        }
    }
  });
  for (std::unique_ptr<Leaf>& leaf : leaves)
    if (leaf)
      tree.addLeaf(leaf.release());
}

template <class T>
openvdb::GridBase::Ptr MakeGrid(const ImageGeometry& g, const T* voxels, const unsigned char* valid, const Progress& progress)
{
  using Stored = StoredOf<T>;
  const openvdb::GridBase::Ptr grid = openvdb::GridBase::createGrid(GridOf<Stored>::gridType());
  const std::size_t slice = static_cast<std::size_t>(g.dimensions[0]) * static_cast<std::size_t>(g.dimensions[1]);
  std::vector<Stored> values(slice * Edge);
  for (int z0 = 0; z0 < g.dimensions[2]; z0 += Edge) {
    const int slices = std::min(Edge, g.dimensions[2] - z0);
    const std::size_t first = static_cast<std::size_t>(z0) * slice, count = static_cast<std::size_t>(slices) * slice;
    std::transform(voxels + first, voxels + first + count, values.begin(), [](T value) { return static_cast<Stored>(value); });
    AddLayer(*grid, g.dimensions, z0, slices, values.data(), valid ? valid + first : nullptr);
    progress(static_cast<double>(z0) / g.dimensions[2]);
  }
  return grid;
}

std::unique_ptr<VolumeSource> Open(const std::string& path)
{
  return std::make_unique<VdbSource>(path);
}

void Write(const std::string& path, const ImageHeader& header, const void* voxels, const unsigned char* valid, bool compress,
           FileReplacement& files, const Progress& progress)
{
  if (FormatOfName(path) != FileFormat::Vdb)
    throw Error(Error::Kind::InvalidParameter, path + ": the extension must be .vdb");
  const ImageGeometry& g = header.geometry;
  g.Check(path);
  for (const HeaderField& field : header.fields)
    if (!CanHold(field))
      throw Error(Error::Kind::BadInput, path + ": the metadata cannot hold the field \"" + field.first + "\"");
  Initialize();
  std::ofstream stream(files.Stage(path), std::ios::binary);
  const auto failed = [&path](const std::string& reason) {
    return Error(Error::Kind::FileSystem, path + ": it cannot be written (" + reason + "); what was there is left as it was");
  };
  try {
    const openvdb::GridBase::Ptr grid = DispatchVoxelType(header.type, [&](auto zero) {
      return MakeGrid(g, static_cast<const decltype(zero)*>(voxels), valid, progress.Part(0.0, 0.5));
    });
    const Eigen::Affine3d map = g.IndexToWorld();
    openvdb::math::Mat4d matrix = openvdb::math::Mat4d::identity();
    for (int row = 0; row < 3; ++row)
      for (int column = 0; column < 4; ++column)
        matrix(column, row) = map(row, column);
    grid->setTransform(openvdb::math::Transform::createLinearTransform(matrix));
    grid->setName(GridName);
    grid->setCreator("Echorama");
    grid->setGridClass(openvdb::GRID_FOG_VOLUME);
    grid->insertMeta(TypeKey, openvdb::StringMetadata(VdbTypeNames[static_cast<int>(header.type)]));
    grid->insertMeta(DimensionsKey, openvdb::Vec3IMetadata(openvdb::Vec3i(g.dimensions[0], g.dimensions[1], g.dimensions[2])));
    for (const HeaderField& field : FieldsInFile(header))
      grid->insertMeta(FieldPrefix + field.first, openvdb::StringMetadata(field.second));
    Archive archive;
    archive.setCompression(openvdb::io::COMPRESS_ACTIVE_MASK |
                           (!compress                                     ? openvdb::io::COMPRESS_NONE
                            : openvdb::io::Archive::hasBloscCompression() ? openvdb::io::COMPRESS_BLOSC
                                                                          : openvdb::io::COMPRESS_ZIP));
    progress(0.6);
    archive.Write(stream, grid);
    progress(1.0);
  } catch (const openvdb::Exception& error) {
    throw failed(error.what());
  }
  stream.close();
  if (!stream)
    throw failed("is the disk full?");
}

} // namespace
} // namespace echorama

extern "C" const echorama::VdbLibrary* EchoramaVdbLibrary()
{
  static const echorama::VdbLibrary library{echorama::Open, echorama::Write};
  return &library;
}
