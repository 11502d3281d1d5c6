// SPDX-License-Identifier: BSD-3-Clause
// Frames of a sequence, forwards and in any order, beside taking the whole file into memory as Plus and VTK do. Error: pixels
// that differ from those that were written.
#include "Core/Base/NumberText.h"
#include "Core/Base/Random.h"
#include "Readers/Compression.h"
#include "Readers/SequenceWriter.h"
#include "Testing/Benchmark.h"
#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <unistd.h>
#ifdef ECHORAMA_WITH_VTK
#include "vtkImageData.h"
#include "vtkMetaImageReader.h"
#include "vtkNew.h"
#endif

using namespace echorama;
using namespace echorama::benchmark;
namespace fs = std::filesystem;

namespace {

constexpr int Width = 820, Height = 616, Frames = 150; // as the recordings of Plus
constexpr std::size_t FrameBytes = std::size_t{Width} * Height;

// A fan of speckle that drifts from frame to frame: about as compressible as scan-converted ultrasound.
std::vector<char> Pixels()
{
  std::vector<char> pixels(FrameBytes * Frames);
  for (int frame = 0; frame < Frames; ++frame) {
    Random random(1, static_cast<std::uint64_t>(frame));
    for (int y = 0; y < Height; ++y)
      for (int x = 0; x < Width; ++x)
        if (std::abs(x - Width / 2) < y / 2 + 60)
          pixels[(static_cast<std::size_t>(frame) * Height + y) * Width + x] =
              static_cast<char>(static_cast<unsigned char>(std::clamp(70.0 + 25.0 * random.Normal(), 0.0, 255.0)));
  }
  return pixels;
}

double Different(const char* a, const char* b, std::size_t count)
{
  double different = 0.0;
  for (std::size_t i = 0; i < count; ++i)
    different += a[i] != b[i];
  return different;
}

} // namespace

int main()
{
  const fs::path folder = fs::temp_directory_path() / ("echorama-bench-" + std::to_string(getpid()));
  fs::create_directories(folder);
  // The memory of our reader, before anything large is there: a header of 100,000 frames of poses.
  const std::string poses = (folder / "poses.igs.mha").string();
  {
    FileReplacement files;
    SequenceContent content;
    SequenceWriter writer(poses, content, false, files);
    SequenceFrame frame;
    frame.transforms.resize(3);
    frame.transforms[0].name = "ProbeToTracker";
    frame.transforms[1].name = "ReferenceToTracker";
    frame.transforms[2].name = "StylusToTracker";
    Random random(2);
    for (int i = 0; i < 100000; ++i) {
      frame.time = i / 30.0;
      frame.fields = {{"FrameNumber", std::to_string(i)}};
      for (SequenceTransform& transform : frame.transforms)
        transform.matrix = Eigen::Translation3d(random.Normal(), random.Normal(), random.Normal()) *
                           Eigen::AngleAxisd(random.Uniform(0.0, 3.0), random.Direction());
      writer.Append(frame, nullptr);
    }
    writer.Finish();
    files.Commit();
  }
  const MemoryPeak memory;
  double atTheEnd = 0.0;
  const double opening = Seconds([&] {
    const SequenceFile file(poses);
    atTheEnd = file.Frame(99999).time;
  });
  Report("sequence", "header of 100000 frames", "ours", opening, std::fabs(atTheEnd - 99999 / 30.0), "seconds",
         {{"file_mb", static_cast<double>(fs::file_size(poses)) / 1e6}, {"memory_mb", memory.Beyond() / 1e6}});

  const std::vector<char> pixels = Pixels();
  for (const bool compressed : {true, false}) {
    const std::string path = (folder / "frames.igs.mha").string(), name = compressed ? "150 frames compressed" : "150 frames raw";
    const double writing = MedianSeconds(
        [&] {
          FileReplacement files;
          SequenceContent content;
          content.dimensions = {Width, Height, 1};
          SequenceWriter writer(path, content, compressed, files);
          for (int i = 0; i < Frames; ++i)
            writer.Append({}, pixels.data() + FrameBytes * static_cast<std::size_t>(i));
          writer.Finish();
          files.Commit();
        },
        3);
    const auto more = [&](double seconds, int frames) {
      return nlohmann::ordered_json{{"frames_per_second", std::round(frames / seconds)},
                                    {"file_mb", static_cast<double>(fs::file_size(path)) / 1e6}};
    };
    ReportTime("sequence", name, "ours, written", writing, more(writing, Frames));

    std::vector<char> frame(FrameBytes), whole(pixels.size());
    const auto forward = [&] {
      SequenceFile file(path);
      for (int i = 0; i < Frames; ++i)
        file.ReadFrame(i, frame.data());
    };
    // As Plus: all compressed bytes, then all pixels, in memory.
    const auto inOnePiece = [&] {
      std::ifstream stream(path, std::ios::binary);
      const std::uintmax_t size = fs::file_size(path);
      std::vector<char> all(size);
      stream.read(all.data(), static_cast<std::streamsize>(size));
      const std::string mark = "ElementDataFile = LOCAL\n";
      const auto begin = std::search(all.begin(), all.end(), mark.begin(), mark.end()) + static_cast<std::ptrdiff_t>(mark.size());
      if (compressed) {
        stream.clear();
        stream.seekg(begin - all.begin());
        Decompress(stream, path, 0, whole.data(), whole.size());
      } else
        std::copy(begin, all.end(), whole.begin());
    };
    const auto [ours, theirs] = Duel(forward, inOnePiece, 3);
    SequenceFile file(path);
    double differences = 0.0;
    for (int i = 0; i < Frames; ++i) {
      file.ReadFrame(i, frame.data());
      differences += Different(frame.data(), pixels.data() + FrameBytes * static_cast<std::size_t>(i), FrameBytes);
    }
    Report("sequence", name, "ours, forwards", ours, differences, "pixels", more(ours, Frames));
    Report("sequence", name, "whole file, ours", theirs, Different(whole.data(), pixels.data(), pixels.size()), "pixels",
           more(theirs, Frames));

    Random random(6);
    double wrongJumps = 0.0;
    std::vector<int> jumps(100);
    for (int& index : jumps)
      index = static_cast<int>(random.Below(Frames));
    const double jumping = MedianSeconds(
        [&] {
          for (const int index : jumps)
            file.ReadFrame(index, frame.data());
        },
        3);
    for (const int index : jumps) {
      file.ReadFrame(index, frame.data());
      wrongJumps += Different(frame.data(), pixels.data() + FrameBytes * static_cast<std::size_t>(index), FrameBytes);
    }
    Report("sequence", name, "ours, any order", jumping, wrongJumps, "pixels", more(jumping, 100));
#ifdef ECHORAMA_WITH_VTK
    const vtkNew<vtkMetaImageReader> reader;
    reader->SetFileName(path.c_str());
    const double vtk = MedianSeconds(
        [&] {
          reader->Modified();
          reader->Update();
        },
        3);
    const auto* read = static_cast<const char*>(reader->GetOutput()->GetScalarPointer());
    Report("sequence", name, "vtkMetaImageReader", vtk, Different(read, pixels.data(), pixels.size()), "pixels",
           more(vtk, Frames));
#endif
  }
  fs::remove_all(folder);
}
