// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// elastix (a Debian package, https://elastix.lumc.nl) as the peer of benchmarks: volumes and masks are handed over as files
// in a temporary folder, which is removed again. Who includes this has ECHORAMA_SOURCE_DIR: the rigid parameters are in
// Testing/elastix-rigid.txt.
#include "Core/Geometry/ImageGeometry.h"
#include "Core/Geometry/RigidTransform.h"
#include "Core/Imaging/VolumeView.h"
#include "Testing/Benchmark.h"
#include <algorithm>
#include <array>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <sys/resource.h>
#include <unistd.h>
#include <vector>

namespace echorama::benchmark {

/// Of this process, and of the programs that it started and that have ended.
inline double CpuSeconds()
{
  double seconds = 0.0;
  for (const int who : {RUSAGE_SELF, RUSAGE_CHILDREN}) {
    rusage usage{};
    getrusage(who, &usage);
    for (const timeval& time : {usage.ru_utime, usage.ru_stime})
      seconds += static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
  }
  return seconds;
}

class Elastix {
public:
  Elastix(const PosedVolume<unsigned char>& fixed, const PosedVolume<unsigned char>& moving)
  {
    char name[] = "/tmp/elastix-XXXXXX";
    if (mkdtemp(name))
      folder_ = name;
    Write("fixed.mha", Filled(fixed).View(), fixed.geometry);
    Write("fixed-mask.mha", fixed.valid, fixed.geometry);
    Write("moving.mha", Filled(moving).View(), moving.geometry);
    Write("moving-mask.mha", moving.valid, moving.geometry);
  }
  ~Elastix()
  {
    std::error_code ignored;
    if (!folder_.empty())
      std::filesystem::remove_all(folder_, ignored);
  }
  Elastix(const Elastix&) = delete;
  Elastix& operator=(const Elastix&) = delete;

  static bool IsInstalled() { return std::system("elastix --version >/dev/null 2>&1") == 0; }

  /// Runs it with the text of a parameter file. \returns the text of what was found, or nothing when it failed.
  std::optional<std::string> Run(const std::string& parameters)
  {
    std::ofstream(Path("parameters.txt")) << parameters;
    const std::string command = "cd " + folder_ +
                                " && rm -f TransformParameters.0.txt && elastix -f fixed.mha -m moving.mha -fMask fixed-mask.mha"
                                " -mMask moving-mask.mha -p parameters.txt -out . >/dev/null 2>&1";
    int status = 0;
    const double before = benchmark::CpuSeconds();
    seconds_ = benchmark::Seconds([&] { status = std::system(command.c_str()); });
    cpuSeconds_ = benchmark::CpuSeconds() - before;
    if (status != 0)
      return std::nullopt;
    return TextOf(Path("TransformParameters.0.txt"));
  }

  /// Of the last run: of its program alone, reading the volumes included.
  double Seconds() const { return seconds_; }
  double CpuSeconds() const { return cpuSeconds_; }

  /// How the moving volume has to be moved from where its geometry has it. \a metric is one of elastix, as
  /// "AdvancedMattesMutualInformation"; \a iterations are made on each level.
  std::optional<Pose> RunRigid(const std::string& metric, int iterations)
  {
    const auto parameters = TextOf(ECHORAMA_SOURCE_DIR "/Testing/elastix-rigid.txt");
    if (!parameters)
      throw std::runtime_error("there is no " ECHORAMA_SOURCE_DIR "/Testing/elastix-rigid.txt");
    const auto text =
        Run(*parameters + "(Metric \"" + metric + "\")\n(MaximumNumberOfIterations " + std::to_string(iterations) + ")\n");
    if (!text)
      return std::nullopt;
    const std::vector<double> p = Numbers(*text, "TransformParameters"), c = Numbers(*text, "CenterOfRotationPoint");
    if (p.size() != 6 || c.size() != 3)
      return std::nullopt;
    // ITK's Euler transform turns about y, then x, then z, and maps the fixed volume's world to the moving one's.
    const Eigen::Vector3d x = Eigen::Vector3d::UnitX(), y = Eigen::Vector3d::UnitY(), z = Eigen::Vector3d::UnitZ();
    const Eigen::Vector3d centre(c[0], c[1], c[2]);
    Pose toMoving = Pose::Identity();
    toMoving.linear() = (Eigen::AngleAxisd(p[2], z) * Eigen::AngleAxisd(p[0], x) * Eigen::AngleAxisd(p[1], y)).toRotationMatrix();
    toMoving.translation() = centre - toMoving.linear() * centre + Eigen::Vector3d(p[3], p[4], p[5]);
    return toMoving.inverse();
  }

  /// The numbers after a key of elastix' parameter files.
  static std::vector<double> Numbers(const std::string& text, const std::string& key)
  {
    std::vector<double> numbers;
    const std::size_t at = text.find("(" + key + " ");
    if (at == std::string::npos)
      return numbers;
    std::istringstream values(text.substr(at + key.size() + 2, text.find(')', at) - at - key.size() - 2));
    for (double value = 0.0; values >> value;)
      numbers.push_back(value);
    return numbers;
  }

private:
  std::string Path(const std::string& name) const { return folder_ + "/" + name; }

  static std::optional<std::string> TextOf(const std::string& path)
  {
    std::ifstream file(path);
    if (!file)
      return std::nullopt;
    std::stringstream text;
    text << file.rdbuf();
    return text.str();
  }

  // Its pyramids know no masks: black outside would be smoothed into the fan, so what is not real gets the mean of what is.
  static Volume<unsigned char> Filled(const PosedVolume<unsigned char>& volume)
  {
    double sum = 0.0, count = 0.0;
    for (std::ptrdiff_t i = 0; i < volume.intensity.Size(); ++i) {
      sum += volume.valid[i] ? volume.intensity[i] : 0.0;
      count += volume.valid[i] ? 1.0 : 0.0;
    }
    Volume<unsigned char> filled(volume.intensity.Dimensions());
    const VolumeView<unsigned char> view = filled.View();
    for (std::ptrdiff_t i = 0; i < view.Size(); ++i)
      view[i] = volume.valid[i] ? volume.intensity[i] : static_cast<unsigned char>(sum / std::max(1.0, count));
    return filled;
  }

  void Write(const std::string& name, VolumeView<const unsigned char> voxels, const ImageGeometry& geometry) const
  {
    std::ofstream file(Path(name), std::ios::binary);
    const auto& n = geometry.dimensions;
    file.precision(17);
    file << "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\nCompressedData = False\n"
         << "TransformMatrix =";
    for (int axis = 0; axis < 3; ++axis)
      for (int row = 0; row < 3; ++row)
        file << ' ' << geometry.direction(row, axis);
    file << "\nOffset = " << geometry.origin.transpose()
         << "\nCenterOfRotation = 0 0 0\nElementSpacing = " << geometry.spacing.transpose() << "\nDimSize = " << n[0] << ' '
         << n[1] << ' ' << n[2] << "\nElementType = MET_UCHAR\nElementDataFile = LOCAL\n";
    file.write(reinterpret_cast<const char*>(voxels.Data()), static_cast<std::streamsize>(voxels.Size()));
  }

  std::string folder_;
  double seconds_ = 0.0, cpuSeconds_ = 0.0;
};

} // namespace echorama::benchmark
