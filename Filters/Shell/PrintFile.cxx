// SPDX-License-Identifier: BSD-3-Clause
// A 3MF file is a zip archive of three texts: the types of its parts, which part is the model, and the model. Each is deflated;
// local headers, data and the directory at the end follow APPNOTE 6.3, without dates.
#include "PrintFile.h"
#include "Core/Base/Error.h"
#include "Core/Base/NumberText.h"
#include "Core/Base/TextFile.h"
#include <Eigen/Geometry>
#include <limits>
#include <zlib.h>

namespace echorama {
namespace {

class ZipArchive {
public:
  void Add(const std::string& name, const std::string& text)
  {
    constexpr auto most = std::numeric_limits<std::uint32_t>::max();
    if (text.size() >= most || bytes_.size() + text.size() >= most)
      throw Error(Error::Kind::TooLarge, "a 3MF file of this size needs more than 4 GB; write STL");
    const std::string packed = Deflated(text);
    std::string common;    // to both headers
    Number(common, 20, 2); // the version that is needed
    Number(common, 0, 2);
    Number(common, 8, 2); // deflated
    Number(common, 0, 2);
    Number(common, 33, 2); // the first of January 1980: the earliest there is
    Number(common, crc32(0, reinterpret_cast<const Bytef*>(text.data()), static_cast<uInt>(text.size())), 4);
    Number(common, packed.size(), 4);
    Number(common, text.size(), 4);
    Number(common, name.size(), 2);
    Number(common, 0, 2);
    Number(directory_, 0x02014b50, 4);
    Number(directory_, 20, 2);
    directory_ += common;
    Number(directory_, 0, 10); // no comment, first disk, no attributes
    Number(directory_, bytes_.size(), 4);
    directory_ += name;
    Number(bytes_, 0x04034b50, 4);
    bytes_ += common + name + packed;
    ++entries_;
  }

  std::string Closed() const
  {
    std::string all = bytes_ + directory_;
    Number(all, 0x06054b50, 4);
    Number(all, 0, 4);
    Number(all, entries_, 2);
    Number(all, entries_, 2);
    Number(all, directory_.size(), 4);
    Number(all, bytes_.size(), 4);
    Number(all, 0, 2);
    return all;
  }

private:
  static void Number(std::string& text, std::uint64_t number, int bytes)
  {
    for (int i = 0; i < bytes; ++i)
      text += static_cast<char>(i < 8 ? number >> 8 * i & 0xff : 0);
  }

  static std::string Deflated(const std::string& text)
  {
    z_stream stream{};
    if (deflateInit2(&stream, 6, Z_DEFLATED, -15, 8, Z_DEFAULT_STRATEGY) != Z_OK) // raw, as archives have it
      throw Error(Error::Kind::TooLarge, "there is not enough memory to compress a 3MF file");
    std::string packed(deflateBound(&stream, static_cast<uLong>(text.size())), '\0');
    stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(text.data()));
    stream.avail_in = static_cast<uInt>(text.size());
    stream.next_out = reinterpret_cast<Bytef*>(packed.data());
    stream.avail_out = static_cast<uInt>(packed.size());
    const int result = deflate(&stream, Z_FINISH);
    packed.resize(stream.total_out);
    deflateEnd(&stream);
    if (result != Z_STREAM_END)
      throw Error(Error::Kind::TooLarge, "a 3MF file could not be compressed");
    return packed;
  }

  std::string bytes_, directory_;
  std::uint64_t entries_ = 0;
};

std::string ModelOf(const std::vector<PrintedBody>& bodies)
{
  std::string model = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<model unit=\"millimeter\" xml:lang=\"en-US\" "
                      "xmlns=\"http://schemas.microsoft.com/3dmanufacturing/core/2015/02\">\n<resources>\n";
  std::string items;
  double right = 0.0;
  for (std::size_t n = 0; n < bodies.size(); ++n) {
    const std::string id = std::to_string(n + 1);
    Eigen::AlignedBox3d box;
    model += "<object id=\"" + id + "\" type=\"model\" name=\"" + bodies[n].name + "\"><mesh><vertices>\n";
    for (const Eigen::Vector3f& point : bodies[n].surface.points) {
      if (!point.allFinite())
        throw Error(Error::Kind::BadInput, "the " + bodies[n].name + " has a point that is not finite");
      box.extend(point.cast<double>());
      model += "<vertex x=\"" + NumberText(point.x()) + "\" y=\"" + NumberText(point.y()) + "\" z=\"" + NumberText(point.z()) +
               "\"/>\n";
    }
    model += "</vertices><triangles>\n";
    for (const auto& [a, b, c] : bodies[n].surface.triangles)
      model += "<triangle v1=\"" + std::to_string(a) + "\" v2=\"" + std::to_string(b) + "\" v3=\"" + std::to_string(c) + "\"/>\n";
    model += "</triangles></mesh></object>\n";
    items += "<item objectid=\"" + id + "\" transform=\"1 0 0 0 1 0 0 0 1 " + NumberText(right - box.min().x()) + " " +
             NumberText(-box.min().y()) + " " + NumberText(-box.min().z()) + "\"/>\n";
    right += box.sizes().x() + 10.0;
  }
  return model + "</resources>\n<build>\n" + items + "</build>\n</model>\n";
}

} // namespace

void WritePrintFile(const std::string& path, const std::vector<PrintedBody>& bodies)
{
  if (bodies.empty())
    throw Error(Error::Kind::BadInput, "there is nothing to write to " + path);
  ZipArchive archive;
  archive.Add(
      "[Content_Types].xml",
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<Types xmlns=\"http://schemas.openxmlformats.org/package/2006/content-types\">"
      "<Default Extension=\"rels\" ContentType=\"application/vnd.openxmlformats-package.relationships+xml\"/>"
      "<Default Extension=\"model\" ContentType=\"application/vnd.ms-package.3dmanufacturing-3dmodel+xml\"/></Types>\n");
  archive.Add("_rels/.rels",
              "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<Relationships "
              "xmlns=\"http://schemas.openxmlformats.org/package/2006/relationships\"><Relationship Target=\"/3D/3dmodel.model\" "
              "Id=\"rel0\" Type=\"http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel\"/></Relationships>\n");
  archive.Add("3D/3dmodel.model", ModelOf(bodies));
  WriteTextFile(path, archive.Closed());
}

} // namespace echorama
