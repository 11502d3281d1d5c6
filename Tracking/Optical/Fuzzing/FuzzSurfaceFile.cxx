// SPDX-License-Identifier: BSD-3-Clause
// Any bytes as a calibrated surface: JSON, a byte 0, and the mesh beside it. "CHECKSUM" in the JSON becomes that of the mesh,
// which nobody guesses. What is accepted is asked where pixels are.
#include "Core/Base/Checksum.h"
#include "Testing/Fuzzing.h"
#include "Tracking/Optical/SurfaceFile.h"
#include <filesystem>
#include <fstream>

using namespace echorama;

namespace {

struct Folder {
  std::filesystem::path path = std::filesystem::temp_directory_path() / ("fuzz-surface-" + std::to_string(getpid()));

  Folder() { std::filesystem::create_directory(path); }
  ~Folder()
  {
    std::error_code ignored;
    std::filesystem::remove_all(path, ignored);
  }
  void Put(const char* name, const std::string& content) const
  {
    std::ofstream out(path / name, std::ios::binary);
    if (!(out << content << std::flush))
      std::abort(); // the machine, not the reader
  }
};

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
  static const Folder folder;
  std::string json(reinterpret_cast<const char*>(data), size), mesh;
  if (const std::size_t end = json.find('\0'); end != std::string::npos) {
    mesh = json.substr(end + 1);
    json.resize(end);
  }
  const std::string placeholder = "CHECKSUM";
  if (const std::size_t at = json.find(placeholder); at != std::string::npos)
    json.replace(at, placeholder.size(), Checksum(mesh.data(), mesh.size()));
  folder.Put("s.json", json);
  folder.Put("s.mesh.stl", mesh);
  return Survives([&] {
    const CalibratedSurface surface = ReadSurface((folder.path / "s.json").string());
    surface.MakeTracker();
    for (double y = 0.0; y < 500.0; y += 70.0)
      for (double x = 0.0; x < 700.0; x += 70.0) {
        const MappedPoint found = surface.map.Map({x, y});
        if (found.status == MappedPoint::Status::Mapped && !(found.point.allFinite() && found.normal.allFinite()))
          std::abort();
      }
  });
}
