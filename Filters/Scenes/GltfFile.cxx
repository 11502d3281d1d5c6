// SPDX-License-Identifier: BSD-3-Clause
// Format: https://registry.khronos.org/glTF/specs/2.0/glTF-2.0.html. Materials, textures, lights and animation are passed over.
//
// Places and counts in a file are believed only as far as its buffers go. A mesh may be shown by many nodes, which few bytes ask
// for: what comes of a file is limited by its size.
#include "Core/Base/Error.h"
#include "Core/Base/JsonPlace.h"
#include "MeshFile.h"
#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstring>
#include <Eigen/Geometry>
#include <filesystem>
#include <map>
#include <set>

namespace echorama {
namespace {

constexpr std::size_t LargestRatio = 16; // of points and corners to the bytes of the files
constexpr std::size_t LongestUri = 4096; // of a file: each accessor looks at it

// Extensions that change no triangle begin with these.
constexpr std::array<std::string_view, 4> Harmless{"KHR_materials_", "KHR_texture_", "EXT_texture_", "KHR_lights_"};

std::uint32_t Word(const char* bytes)
{
  std::uint32_t word = 0;
  for (int i = 3; i >= 0; --i)
    word = word << 8 | static_cast<unsigned char>(bytes[i]);
  return word;
}

// Up to the first that is no digit of it.
std::string FromBase64(std::string_view text)
{
  constexpr auto digitOf = [] { // 64: none
    constexpr std::string_view digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::array<unsigned char, 256> values{};
    for (std::size_t c = 0; c < values.size(); ++c)
      values[c] = static_cast<unsigned char>(std::min(digits.find(static_cast<char>(c)), digits.size()));
    return values;
  }();
  std::string bytes;
  bytes.reserve(text.size() / 4 * 3 + 3);
  std::uint32_t bits = 0;
  int held = 0;
  for (const char c : text) {
    const std::uint32_t digit = digitOf[static_cast<unsigned char>(c)];
    if (digit > 63)
      break;
    bits = bits << 6 | digit;
    held += 6;
    if (held >= 8) {
      held -= 8;
      bytes.push_back(static_cast<char>(bits >> held & 0xFF));
    }
  }
  return bytes;
}

// %20 becomes a blank.
std::string FromUri(const std::string& uri)
{
  std::string text;
  for (std::size_t i = 0; i < uri.size(); ++i) {
    const auto isHex = [&](std::size_t at) { return at < uri.size() && std::isxdigit(static_cast<unsigned char>(uri[at])) != 0; };
    if (uri[i] == '%' && isHex(i + 1) && isHex(i + 2)) {
      text.push_back(static_cast<char>(std::stoi(uri.substr(i + 1, 2), nullptr, 16)));
      i += 2;
    } else {
      text.push_back(uri[i]);
    }
  }
  return text;
}

class GltfDecoder {
  using Json = JsonPlace::Json;

public:
  explicit GltfDecoder(const std::string& path) : path_(path), place_(path), content_(ReadMeshContent(path)) {}

  PolygonMesh Run()
  {
    file_ = place_.Parse(JsonOf(content_));
    if (!file_.is_object())
      place_.Fail("it is no glTF file");
    for (const Json& required : List(file_, "extensionsRequired")) {
      const std::string name = place_.Text(required);
      if (std::none_of(Harmless.begin(), Harmless.end(),
                       [&name](std::string_view begin) { return name.compare(0, begin.size(), begin) == 0; }))
        place_.Fail("it needs the extension " + name + ", which is not read");
    }
    std::vector<std::pair<std::size_t, Eigen::Affine3d>> open;
    const Json& scenes = List(file_, "scenes");
    if (scenes.empty())
      place_.Fail("it has no scene");
    const auto add = [&](const Json& nodes, const Eigen::Affine3d& parent) {
      for (auto node = nodes.rbegin(); node != nodes.rend(); ++node) // the first is taken first
        open.emplace_back(Whole(*node), parent);
    };
    add(List(Item("scenes", Whole(file_, "scene", 0)), "nodes"), Eigen::Affine3d::Identity());
    std::set<std::size_t> seen;
    while (!open.empty()) {
      const auto [index, parent] = open.back();
      open.pop_back();
      if (!seen.insert(index).second)
        place_.Fail("node " + std::to_string(index) + " occurs twice in its scene");
      const Json& node = Item("nodes", index);
      const Eigen::Affine3d place = parent * PlaceOf(node);
      if (node.contains("mesh")) {
        const Json& mesh = Item("meshes", Whole(node["mesh"]));
        bool isBent = node.contains("skin");
        for (const Json* weights : {&List(mesh, "weights"), &List(node, "weights")}) {
          Show(weights->size());
          for (const Json& weight : *weights)
            isBent = isBent || place_.Number(weight) != 0.0;
        }
        if (isBent)
          place_.Fail("node " + std::to_string(index) + " bends its mesh by a skin or morph targets, which are not read");
        for (const Json& primitive : List(mesh, "primitives"))
          Add(primitive, place);
      }
      add(List(node, "children"), place);
    }
    return std::move(mesh_);
  }

private:
  // Of the two kinds of file; the one that is not text holds a buffer, too.
  std::string_view JsonOf(std::string_view content)
  {
    if (content.substr(0, 4) != "glTF")
      return content;
    if (content.size() < 12 || Word(content.data() + 4) != 2)
      place_.Fail("it is no binary glTF 2");
    content = content.substr(0, Word(content.data() + 8)); // what follows is not of it
    std::string_view json;
    for (std::size_t at = 12; at + 8 <= content.size();) {
      const std::size_t size = Word(content.data() + at);
      const std::string_view kind = content.substr(at + 4, 4);
      if (size > content.size() - at - 8)
        place_.Fail("it is truncated or damaged");
      if (kind == "JSON" && json.empty())
        json = content.substr(at + 8, size);
      else if (kind == std::string_view("BIN\0", 4) && !embedded_.data())
        embedded_ = content.substr(at + 8, size);
      at += 8 + size;
    }
    return json;
  }

  // A list that may be missing.
  const Json& List(const Json& object, const char* key) const
  {
    static const Json none = Json::array();
    if (!object.is_object() || !object.contains(key))
      return none;
    if (!object[key].is_array())
      place_.Fail(std::string(key) + " is no list");
    return object[key];
  }

  // What is counted from 0 in one of the lists of the file.
  const Json& Item(const char* list, std::size_t index) const
  {
    const Json& all = List(file_, list);
    if (index >= all.size())
      place_.Fail("it names " + std::string(list) + " " + std::to_string(index) + " (from 0); there are " +
                  std::to_string(all.size()));
    if (!all[index].is_object())
      place_.Fail(std::string(list) + " " + std::to_string(index) + " is no object");
    return all[index];
  }

  std::size_t Whole(const Json& value) const
  {
    const double number = place_.Number(value);
    if (!(number >= 0.0 && number <= 1e15 && number == std::floor(number)))
      place_.Fail("a number in it is no count and no place");
    return static_cast<std::size_t>(number);
  }
  std::size_t Whole(const Json& object, const char* key, std::size_t missing) const
  {
    return object.contains(key) ? Whole(object[key]) : missing;
  }

  Eigen::Affine3d PlaceOf(const Json& node) const
  {
    Eigen::Affine3d place = Eigen::Affine3d::Identity();
    if (node.contains("matrix")) {
      const auto columns = place_.Vector<16>(node["matrix"]);
      place.matrix() = Eigen::Map<const Eigen::Matrix4d>(columns.data());
      place.makeAffine();
      return place;
    }
    if (node.contains("translation"))
      place.translate(place_.Vector<3>(node["translation"]));
    if (node.contains("rotation")) {
      const Eigen::Quaterniond rotation(place_.Vector<4>(node["rotation"])); // x, y, z, w
      if (!(rotation.norm() > 0.0))
        place_.Fail("the rotation of a node is 0");
      place.rotate(rotation.normalized());
    }
    if (node.contains("scale"))
      place.scale(place_.Vector<3>(node["scale"]));
    return place;
  }

  std::string_view Buffer(std::size_t index)
  {
    const Json& buffer = Item("buffers", index);
    if (!buffer.contains("uri"))
      return embedded_;
    if (!buffer["uri"].is_string())
      place_.Fail("the uri of a buffer is no text");
    const auto& uri = buffer["uri"].get_ref<const std::string&>(); // not a copy for each accessor: it may hold all the data
    const bool isData = uri.compare(0, 5, "data:") == 0;
    if (!isData && (uri.size() > LongestUri || uri.find(':') != std::string::npos))
      place_.Fail("its data lie at " + JsonPlace::Shown(uri) + ", which is no file beside it");
    const std::string file = isData ? "data:" + std::to_string(index)
                                    : (std::filesystem::path(path_).parent_path() / FromUri(uri)).lexically_normal().string();
    const auto [found, isNew] = buffers_.try_emplace(file);
    if (isNew) {
      found->second =
          isData ? FromBase64(std::string_view(uri).substr(std::min(uri.find(','), uri.size() - 1) + 1)) : ReadMeshContent(file);
      bytes_ += found->second.size();
      if (bytes_ > LargestMeshFile)
        place_.Fail("it has more than 2 GiB, with the files that it names");
    }
    return found->second;
  }

  // The bytes of each of some numbers, all of which are there.
  struct Numbers {
    const char* first;
    std::size_t count, stride, type;

    const char* operator[](std::size_t i) const { return first + i * stride; }
  };
  Numbers Accessor(std::size_t index, const char* shape)
  {
    const Json& accessor = Item("accessors", index);
    if (!accessor.contains("bufferView") || accessor.contains("sparse"))
      place_.Fail("accessor " + std::to_string(index) + " is sparse, or has no bufferView, which is not read");
    if (place_.Text(place_.Member(accessor, "type")) != shape)
      place_.Fail("accessor " + std::to_string(index) + " is no " + shape);
    const std::size_t type = Whole(place_.Member(accessor, "componentType")), count = Whole(place_.Member(accessor, "count"));
    const std::size_t size = std::strcmp(shape, "VEC3") == 0 ? 12 : type == 5121 ? 1 : type == 5123 ? 2 : 4;
    const Json& view = Item("bufferViews", Whole(accessor["bufferView"]));
    std::string_view bytes = Buffer(Whole(place_.Member(view, "buffer")));
    const auto cut = [&](std::size_t begin, std::size_t length) {
      if (begin > bytes.size() || length > bytes.size() - begin)
        place_.Fail("accessor " + std::to_string(index) + " reaches beyond its buffer: the file is truncated or damaged");
      bytes = bytes.substr(begin, length);
    };
    cut(Whole(view, "byteOffset", 0), Whole(place_.Member(view, "byteLength")));
    const std::size_t said = Whole(view, "byteStride", 0), stride = said == 0 ? size : said,
                      begin = Whole(accessor, "byteOffset", 0);
    if (stride < size || stride > 252)
      place_.Fail("the byteStride of a bufferView is " + std::to_string(stride));
    cut(begin, count == 0 ? 0 : std::min(count - 1, bytes.size()) * stride + size);
    return {bytes.data(), count, stride, type};
  }

  // What nodes show of a mesh takes time, though no triangle may come of it.
  void Show(std::size_t parts)
  {
    shown_ += parts;
    if (shown_ > bytes_)
      place_.Fail("it asks for far more than its size can hold");
  }

  void Add(const Json& primitive, const Eigen::Affine3d& place)
  {
    if (!primitive.is_object())
      place_.Fail("a primitive of a mesh is no object");
    const std::size_t mode = Whole(primitive, "mode", 4); // 4: triangles, 5: strips, 6: fans; others are no surfaces
    Show(1);
    const Json& attributes = place_.Member(primitive, "attributes");
    if (mode < 4 || mode > 6 || !attributes.is_object() || !attributes.contains("POSITION"))
      return;
    const Numbers points = Accessor(Whole(attributes["POSITION"]), "VEC3");
    if (points.type != 5126)
      place_.Fail("the points of a mesh are no floats");
    std::vector<std::uint32_t> corners;
    const auto room = [&](std::size_t more) {
      const std::size_t most = std::min<std::size_t>(LargestRatio * bytes_, 4000000000);
      if (more > most - std::min(most, mesh_.points.size() + mesh_.corners.size()))
        place_.Fail("it asks for far more than its size can hold");
    };
    room(points.count);
    const auto first = static_cast<std::uint32_t>(mesh_.points.size());
    if (primitive.contains("indices")) {
      const Numbers indices = Accessor(Whole(primitive["indices"]), "SCALAR");
      if (indices.type != 5121 && indices.type != 5123 && indices.type != 5125)
        place_.Fail("the indices of a mesh are no whole numbers");
      room(3 * indices.count);
      const std::size_t size = indices.type == 5121 ? 1 : indices.type == 5123 ? 2 : 4;
      for (std::size_t i = 0; i < indices.count; ++i) {
        char bytes[4] = {0, 0, 0, 0};
        std::memcpy(bytes, indices[i], size);
        const std::uint32_t corner = Word(bytes);
        if (corner >= points.count)
          place_.Fail("a triangle names point " + std::to_string(corner) + " (from 0); there are " +
                      std::to_string(points.count));
        corners.push_back(first + corner);
      }
    } else {
      room(3 * points.count);
      for (std::size_t i = 0; i < points.count; ++i)
        corners.push_back(first + static_cast<std::uint32_t>(i));
    }
    for (std::size_t i = 0; i < points.count; ++i) {
      Eigen::Vector3f point;
      for (int axis = 0; axis < 3; ++axis) {
        const std::uint32_t bits = Word(points[i] + 4 * axis);
        std::memcpy(&point[axis], &bits, 4);
      }
      mesh_.points.emplace_back((place * point.cast<double>()).cast<float>());
    }
    const bool mirrored = place.linear().determinant() < 0.0;
    const std::size_t step = mode == 4 ? 3 : 1;
    for (std::size_t i = 0; i + 2 < corners.size(); i += step) {
      const std::uint32_t a = corners[mode == 6 ? 0 : i];
      std::uint32_t b = corners[i + 1], c = corners[i + 2];
      if (mirrored != (mode == 5 && i % 2 == 1))
        std::swap(b, c);
      mesh_.corners.insert(mesh_.corners.end(), {a, b, c});
      mesh_.ends.push_back(mesh_.corners.size());
    }
  }

  const std::string& path_;
  JsonPlace place_;
  std::string content_;
  std::string_view embedded_;
  Json file_;
  std::map<std::string, std::string> buffers_; // by file
  std::size_t bytes_ = content_.size();        // with those buffers
  std::size_t shown_ = 0;                      // primitives and weights
  PolygonMesh mesh_;
};

} // namespace

PolygonMesh ReadGltf(const std::string& path)
{
  return GltfDecoder(path).Run();
}

} // namespace echorama
