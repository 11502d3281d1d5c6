// SPDX-License-Identifier: BSD-3-Clause
// Reading and writing one volume, ours and VTK's in turn. Error: voxels that differ from those that were written.
#include "Core/Base/Random.h"
#include "Readers/NiftiFile.h"
#include "Readers/VdbFile.h"
#include "Readers/VolumeFile.h"
#include "Readers/VolumeWriter.h"
#include "Testing/Benchmark.h"
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <tuple>
#include <unistd.h>
#ifdef ECHORAMA_WITH_VTK
#include "vtkDataArray.h"
#include "vtkImageData.h"
#include "vtkMetaImageReader.h"
#include "vtkMetaImageWriter.h"
#include "vtkNew.h"
#include "vtkNIFTIImageReader.h"
#include "vtkNIFTIImageWriter.h"
#include "vtkPointData.h"
#endif

using namespace echorama;
using namespace echorama::benchmark;
namespace fs = std::filesystem;

namespace {

using Voxels = std::vector<unsigned char>;

// A fan of speckle in a box of zeros: about as compressible as scan-converted ultrasound.
Voxels Fan(int n)
{
  Voxels voxels(static_cast<std::size_t>(n) * n * n);
  for (int k = 0; k < n; ++k) {
    Random random(1, static_cast<std::uint64_t>(k));
    for (int j = 0; j < n; ++j)
      for (int i = 0; i < n; ++i)
        if (std::abs(i - n / 2) < j / 2 + n / 16 && std::abs(k - n / 2) < j / 3)
          voxels[(static_cast<std::size_t>(k) * n + j) * n + i] =
              static_cast<unsigned char>(std::clamp(70.0 + 25.0 * random.Normal(), 0.0, 255.0));
  }
  return voxels;
}

double Different(const Voxels& a, const unsigned char* b)
{
  double different = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i)
    different += a[i] != b[i];
  return different;
}

Voxels Read(const std::string& path)
{
  const ImageHeader header = ReadImageHeader(path);
  CheckVolume(header);
  Voxels voxels(header.ByteCount());
  ReadVoxels(header, voxels.data());
  return voxels;
}

double Megabytes(const std::string& path)
{
  return static_cast<double>(fs::file_size(path)) / 1e6;
}

// NIfTI, OpenVDB: written, and read through the seam of all formats. VTK has a peer for the first.
void OtherFormats(const fs::path& folder, int n, const Voxels& voxels)
{
  ImageHeader header;
  header.geometry.dimensions = {n, n, n};
  Voxels valid(voxels.size());
  std::transform(voxels.begin(), voxels.end(), valid.begin(), [](unsigned char v) { return v != 0 ? 1 : 0; });
  for (const char* extension : {".nii", ".nii.gz", ".vdb"}) {
    const std::string ours = (folder / ("ours" + std::string(extension))).string(), name = std::to_string(n) + " " + extension;
    const bool vdb = FormatOfName(ours) == FileFormat::Vdb;
    const auto write = [&] {
      FileReplacement files;
      if (vdb)
        WriteVdb(ours, header, voxels.data(), valid.data(), true, files);
      else
        WriteVolume(ours, header, voxels.data(), true, files);
      files.Commit();
    };
    Voxels back(voxels.size()), backValid(voxels.size());
    const auto read = [&](const std::string& path) { OpenVolume(path)->Read(0, back.data(), backValid.data()); };
    double writeSeconds = 0.0, readSeconds = 0.0;
#ifdef ECHORAMA_WITH_VTK
    if (!vdb) {
      const std::string theirs = (folder / ("theirs" + std::string(extension))).string();
      const vtkNew<vtkImageData> image;
      image->SetDimensions(n, n, n);
      image->AllocateScalars(VTK_UNSIGNED_CHAR, 1);
      std::copy(voxels.begin(), voxels.end(), static_cast<unsigned char*>(image->GetScalarPointer()));
      const vtkNew<vtkNIFTIImageWriter> writer;
      writer->SetInputData(image);
      writer->SetFileName(theirs.c_str());
      const vtkNew<vtkNIFTIImageReader> reader;
      reader->SetFileName(theirs.c_str());
      double vtkSeconds = 0.0;
      std::tie(writeSeconds, vtkSeconds) = Duel(write, [&] { writer->Write(); });
      read(theirs);
      Report("volume_file", name + " write", "VTK", vtkSeconds, Different(voxels, back.data()), "voxels",
             {{"file_mb", Megabytes(theirs)}});
      std::tie(readSeconds, vtkSeconds) = Duel([&] { read(theirs); },
                                               [&] {
                                                 reader->Modified();
                                                 reader->Update();
                                               });
      Report("volume_file", name + " read", "VTK", vtkSeconds,
             Different(voxels, static_cast<unsigned char*>(reader->GetOutput()->GetScalarPointer())), "voxels");
    }
#endif
    if (writeSeconds == 0.0) {
      writeSeconds = MedianSeconds(write);
      readSeconds = MedianSeconds([&] { read(ours); });
    }
    read(ours);
    const double different = Different(voxels, back.data()) + (vdb ? Different(valid, backValid.data()) : 0.0);
    Report("volume_file", name + " write", "echorama", writeSeconds, different, "voxels", {{"file_mb", Megabytes(ours)}});
    Report("volume_file", name + " read", "echorama", readSeconds, different, "voxels");
  }
}

} // namespace

int main()
{
  const fs::path folder = fs::temp_directory_path() / ("echorama-bench-" + std::to_string(getpid()));
  fs::create_directories(folder);
  const int n = 256;
  const Voxels voxels = Fan(n);
  ImageHeader header;
  header.geometry.dimensions = {n, n, n};
  for (const bool compressed : {true, false}) {
    const std::string ours = (folder / "ours.mha").string(), theirs = (folder / "theirs.mha").string();
    const std::string name = compressed ? "256 compressed" : "256 raw";
    const auto write = [&] {
      FileReplacement files;
      WriteVolume(ours, header, voxels.data(), compressed, files);
      files.Commit();
    };
    Voxels back;
    const auto read = [&] { back = Read(ours); };
    const auto megabytes = [](const std::string& path) { return nlohmann::ordered_json{{"file_mb", Megabytes(path)}}; };
#ifdef ECHORAMA_WITH_VTK
    const vtkNew<vtkImageData> image;
    image->SetDimensions(n, n, n);
    image->AllocateScalars(VTK_UNSIGNED_CHAR, 1);
    std::copy(voxels.begin(), voxels.end(), static_cast<unsigned char*>(image->GetScalarPointer()));
    const vtkNew<vtkMetaImageWriter> writer;
    writer->SetInputData(image);
    writer->SetFileName(theirs.c_str());
    writer->SetCompression(compressed);
    const auto vtkWrite = [&] { writer->Write(); };
    const auto [writeSeconds, vtkWriteSeconds] = Duel(write, vtkWrite);
    // Both read the file that VTK wrote; the check of our own file comes after.
    const vtkNew<vtkMetaImageReader> reader;
    reader->SetFileName(theirs.c_str());
    const auto vtkRead = [&] {
      reader->Modified();
      reader->Update();
    };
    const auto [readSeconds, vtkReadSeconds] = Duel([&] { back = Read(theirs); }, vtkRead);
    Report("volume_file", name + " write", "VTK", vtkWriteSeconds, Different(voxels, Read(theirs).data()), "voxels",
           megabytes(theirs));
    Report("volume_file", name + " read", "VTK", vtkReadSeconds,
           Different(voxels, static_cast<unsigned char*>(reader->GetOutput()->GetScalarPointer())), "voxels");
#else
    const double writeSeconds = MedianSeconds(write), readSeconds = MedianSeconds(read);
#endif
    Report("volume_file", name + " read", "echorama", readSeconds, Different(voxels, back.data()), "voxels");
    read();
    Report("volume_file", name + " write", "echorama", writeSeconds, Different(voxels, back.data()), "voxels", megabytes(ours));
  }
  OtherFormats(folder, n, voxels);
  fs::remove_all(folder);
  return 0;
}
