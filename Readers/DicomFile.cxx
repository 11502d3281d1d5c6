// SPDX-License-Identifier: BSD-3-Clause
// Whatever the object, it ends as pictures with a place each. They are parted by time, sorted along their normal and must
// then lie on a grid: same directions, same spacing, and one step from each to the next. So one function makes the geometry
// of enhanced objects and of folders of slices alike. A world of LPS comes with the patient's planes; the volume's planes are
// a frame of the scanner's own.
#include "Readers/DicomFile.h"
#include "Core/Base/Error.h"
#include "Core/Base/NumberText.h"
#include "Readers/DataFile.h"
#include "Readers/DicomHeader.h"
#include "Readers/DicomPixels.h"
#include "Readers/KretzFile.h"
#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <utility>

namespace fs = std::filesystem;

namespace echorama {
namespace {

constexpr double evenness = 1e-3; // of a step; and in mm, because files round
constexpr double sameDirection = 1e-4;
constexpr std::size_t filesLookedAt = 32; // of a folder, to tell what it holds

bool BeginsLikeDicom(const std::string& path)
{
  std::error_code error;
  if (!fs::is_regular_file(path, error))
    return false;
  std::ifstream stream(path, std::ios::binary);
  std::string start(132, '\0');
  return stream.read(start.data(), 132) && LooksLikeDicom(start);
}

std::vector<std::string> FilesOf(const std::string& folder)
{
  std::vector<std::string> files;
  std::error_code error, ofEntry; // such as that of a link to nowhere, which is no fault of the folder
  for (fs::directory_iterator entry(folder, error), end; entry != end; entry.increment(error))
    if (entry->is_regular_file(ofEntry))
      files.push_back(entry->path().string());
  if (error)
    throw Error(Error::Kind::FileSystem, folder + ": " + error.message());
  std::sort(files.begin(), files.end());
  return files;
}

// For messages.
std::string Mm(double length)
{
  return NumberText(std::round(length * 1e5) / 1e5) + " mm";
}

std::string NameOf(const std::string& path)
{
  return fs::path(path).filename().string();
}

// A picture and where its pixels are.
struct Slice {
  std::size_t file = 0, picture = 0;
  double along = 0.0; // its normal, mm
};

class DicomSource : public VolumeSource {
public:
  explicit DicomSource(const std::string& path) : VolumeSource(path, FileFormat::Dicom) { FindFiles(); }

  // A Kretz file in the only file is for its own reader.
  const DicomHeader* Kretz() const { return files_.size() == 1 && files_[0].kretzBytes > 0 ? &files_[0] : nullptr; }

  void Place()
  {
    TakeColoursOfStreams();
    CheckAlike();
    const DicomHeader& first = files_[0];
    if (files_.size() == 1 && first.volumeSlices > 0)
      PlacePhilips();
    else if (const bool patient = AllPlaced(&DicomPicture::patient); patient || AllPlaced(&DicomPicture::volume))
      PlaceByPlanes(patient ? &DicomPicture::patient : &DicomPicture::volume);
    else if (files_.size() == 1)
      PlaceUnplaced();
    else
      Fail("its " + std::to_string(files_.size()) + " pictures do not say where they lie");
    ChooseType();
    CheckGeometry(content_.path, content_.geometry);
    const double decoded = first.storage != DicomStorage::Plain
                               ? static_cast<double>(first.PictureBytes()) * static_cast<double>(first.pictures.size())
                               : 0.0;
    CheckMemory(content_.path,
                static_cast<double>(content_.geometry.VoxelCount()) * static_cast<double>(SizeOf(content_.type)) + decoded);
    content_.fields = first.fields;
    if (first.burnedIn)
      Note("The file says that annotations are burned into its pictures; they may name people.");
    if (first.samples == 3)
      Note("Its colours have become luminance.");
    if (first.photometric == "MONOCHROME1")
      Note(content_.type == VoxelType::Float32
               ? "Small values are meant to be shown bright (MONOCHROME1): its values are kept as they are."
               : "Its grey levels were stored inverted (MONOCHROME1) and are turned back.");
    if (first.holdsMovieGroup)
      Note("Beside these pictures " + MovieGroup() + ".");
  }

  void Read(std::size_t index, void* voxels, unsigned char*, const Progress& progress) override
  {
    const std::size_t perVolume = slices_.size() / content_.Volumes();
    const auto& n = content_.geometry.dimensions;
    const std::size_t sliceBytes = static_cast<std::size_t>(n[0]) * n[1] * SizeOf(content_.type);
    const std::size_t slicesOfPicture = static_cast<std::size_t>(n[2]) / perVolume; // of QLAB's, which are volumes
    std::vector<char> stored, decoded;
    std::size_t decodedFile = files_.size();
    for (std::size_t i = 0; i < perVolume; ++i) {
      const Slice& slice = slices_[index * perVolume + i];
      const DicomHeader& file = files_[slice.file];
      const std::uint64_t bytes = file.PictureBytes();
      for (std::size_t k = 0; k < slicesOfPicture; ++k) {
        const char* pixels = nullptr;
        const std::uint64_t place = (slice.picture * slicesOfPicture + k) * bytes;
        if (file.storage != DicomStorage::Plain) {
          if (decodedFile != slice.file)
            decoded = DecodeDicomPixels(file, progress, static_cast<double>(i * slicesOfPicture + k) / n[2]);
          decodedFile = slice.file;
          pixels = decoded.data() + place;
        } else {
          stored.resize(bytes);
          std::ifstream stream(file.path, std::ios::binary);
          stream.seekg(static_cast<std::streamoff>(file.pixelOffset + place));
          if (!stream.read(stored.data(), static_cast<std::streamsize>(bytes)))
            FailFile(file.path, "the data end early: the file has changed since it was opened");
          pixels = stored.data();
        }
        char* out = static_cast<char*>(voxels) + (i * slicesOfPicture + k) * sliceBytes;
        DispatchVoxelType(StoredType(file),
                          [&](auto zero) { Convert<decltype(zero)>(file, file.pictures[slice.picture], pixels, out); });
        progress(static_cast<double>(i * slicesOfPicture + k + 1) / n[2]);
      }
    }
  }

private:
  void FindFiles()
  {
    const std::string& path = content_.path;
    std::error_code error;
    if (fs::is_directory(path, error)) {
      std::map<std::string, std::vector<std::string>> series;
      for (const std::string& file : FilesOf(path)) {
        if (!BeginsLikeDicom(file))
          continue;
        DicomHeader header = ReadDicomHeader(file);
        if (header.pictures.empty() && header.kretzBytes == 0)
          continue; // a report, a directory
        series[header.series].push_back(NameOf(file));
        files_.push_back(std::move(header));
      }
      if (files_.empty())
        FailFile(path, "it holds no DICOM pictures");
      if (series.size() > 1) {
        std::string list;
        for (const auto& [uid, names] : series)
          list += (list.empty() ? "" : ", ") + uid + " (" + std::to_string(names.size()) + " files, the first " + names[0] + ")";
        FailFile(path, "it holds " + std::to_string(series.size()) + " series; name one by one of its files: " + list);
      }
    } else {
      files_.push_back(ReadDicomHeader(path));
      const DicomHeader& header = files_[0];
      if (header.kretzBytes > 0)
        return;
      if (header.pictures.empty())
        FailFile(path, header.holdsMovieGroup ? MovieGroup() : "it holds no pictures");
      if (header.pictures.size() == 1 && !header.grouped && header.volumeSlices == 0 && header.pictures[0].patient.IsKnown() &&
          !header.series.empty())
        FindSiblings();
    }
    if (files_.size() > 1)
      for (const DicomHeader& header : files_)
        if (header.pictures.size() != 1 || header.volumeSlices > 0 || header.kretzBytes > 0)
          FailFile(path, "it holds several files of more than one picture; name one of them, such as " + NameOf(header.path));
  }

  // The other slices of the series of the one that was named.
  void FindSiblings()
  {
    const fs::path parent = fs::path(content_.path).parent_path();
    int broken = 0;
    for (const std::string& file : FilesOf(parent.empty() ? "." : parent.string())) {
      std::error_code error;
      if (fs::equivalent(file, content_.path, error) || !BeginsLikeDicom(file))
        continue;
      try {
        DicomHeader header = ReadDicomHeader(file);
        if (header.series == files_[0].series && header.pictures.size() == 1 && header.volumeSlices == 0)
          files_.push_back(std::move(header));
      } catch (const Error&) {
        ++broken; // of which series it was nobody can say; a slice that is missing shows
      }
    }
    if (broken > 0)
      Note(std::to_string(broken) + " files of its folder could not be read as DICOM.");
  }

  static std::string MovieGroup()
  {
    return "it holds a movie in GE's private format (GEMS_Ultrasound_MovieGroup_001), which is not publicly known; export it as "
           "a Cartesian or Kretz volume";
  }

  void TakeColoursOfStreams()
  {
    std::string note;
    for (DicomHeader& file : files_)
      if (file.storage == DicomStorage::Encapsulated && file.samples == 3)
        if (const auto header = std::exchange(file.photometric, ColoursOfDicomStream(file)); header != file.photometric)
          note = "Its header says that its colours are " + header + ", and its JPEG that they are " + file.photometric +
                 ", which is taken.";
    if (!note.empty())
      Note(note);
  }

  void CheckAlike() const
  {
    const DicomHeader& first = files_[0];
    for (const DicomHeader& file : files_)
      if (file.rows != first.rows || file.columns != first.columns || file.samples != first.samples ||
          file.bitsAllocated != first.bitsAllocated || file.isSigned != first.isSigned || file.photometric != first.photometric)
        FailFile(file.path, "its pictures are not like those of " + NameOf(first.path) + " in the same series (" +
                                std::to_string(file.columns) + " x " + std::to_string(file.rows) + " pixels and " +
                                std::to_string(first.columns) + " x " + std::to_string(first.rows) + ", or of another type)");
  }

  bool AllPlaced(DicomPlane DicomPicture::*plane) const
  {
    for (const DicomHeader& file : files_) {
      if (file.pictures.size() > 1 && !file.grouped)
        return false; // one place for several pictures
      for (const DicomPicture& picture : file.pictures)
        if (!(picture.*plane).IsKnown())
          return false;
    }
    return true;
  }

  const DicomPicture& PictureOf(const Slice& slice) const { return files_[slice.file].pictures[slice.picture]; }

  // For messages.
  std::string WhereIs(const Slice& slice) const
  {
    return files_.size() > 1 ? NameOf(files_[slice.file].path) : "frame " + std::to_string(slice.picture + 1);
  }

  using TimeOf = double (*)(const DicomPicture&);
  static double NumberOf(const DicomPicture& picture) { return *picture.timeIndex; }
  static double SecondsOf(const DicomPicture& picture) { return *picture.time; }
  static double AtOnce(const DicomPicture&) { return 0.0; }

  void PlaceByPlanes(DicomPlane DicomPicture::*plane)
  {
    std::vector<Slice> all;
    std::size_t others = 0;
    bool seconds = true, numbers = true;
    for (std::size_t f = 0; f < files_.size(); ++f)
      for (std::size_t p = 0; p < files_[f].pictures.size(); ++p) {
        const DicomPicture& picture = files_[f].pictures[p];
        if (!picture.dataType.empty() && picture.dataType != "TISSUE_INTENSITY") {
          ++others;
          continue;
        }
        seconds = seconds && picture.time;
        numbers = numbers && picture.timeIndex;
        all.push_back({f, p});
      }
    if (all.empty())
      Fail("none of its pictures holds tissue intensities");
    if (others > 0)
      Note(std::to_string(others) + " pictures that hold no tissue intensities are left out.");
    // The number of a volume is the same for its pictures; a trigger time may be each picture's own. Where numbers make no
    // volumes, times may.
    try {
      MakeVolumes(all, plane, numbers ? NumberOf : seconds ? SecondsOf : AtOnce);
    } catch (const Error&) {
      if (!numbers || !seconds)
        throw;
      MakeVolumes(all, plane, SecondsOf);
    }
    if (plane == &DicomPicture::volume)
      Note("The world is the scanner's volume frame of reference; the file does not say where the patient lies.");
    PlaceProbe(plane);
  }

  // Parts pictures into volumes by their time; these must lie on one grid.
  void MakeVolumes(const std::vector<Slice>& all, DicomPlane DicomPicture::*plane, TimeOf timeOf)
  {
    std::map<double, std::vector<Slice>> volumes;
    for (const Slice& slice : all)
      volumes[timeOf(PictureOf(slice))].push_back(slice);
    slices_.clear();
    std::vector<std::optional<double>> begins; // seconds
    for (auto& [time, slices] : volumes) {
      const ImageGeometry geometry = Arrange(slices, plane);
      if (slices_.empty())
        content_.geometry = geometry;
      else if (!content_.geometry.AgreesWith(geometry, 1e-2)) {
        if (volumes.size() == all.size())
          return MakeVolumes(all, plane, AtOnce); // one volume, whose pictures were taken one after the other
        Fail("its volumes at different times do not lie on one grid (the first has " +
             std::to_string(content_.geometry.dimensions[2]) + " slices, that at time " + NumberText(time) + " has " +
             std::to_string(geometry.dimensions[2]) + ")");
      }
      slices_.insert(slices_.end(), slices.begin(), slices.end());
      begins.push_back(PictureOf(slices[0]).time);
      for (const Slice& slice : slices)
        begins.back() = std::min(begins.back(), PictureOf(slice).time);
    }
    if (volumes.size() == 1)
      return;
    const bool inSeconds = begins[0] && std::adjacent_find(begins.begin(), begins.end(), std::greater_equal<>()) == begins.end();
    for (const auto& [time, slices] : volumes)
      content_.times.push_back(inSeconds ? *begins[content_.times.size()] : time);
    if (!inSeconds)
      Note("Its times are numbers of volumes, not seconds; the file does not say those.");
  }

  // Sorts the slices of one volume along their normal. \returns the grid that they make
  ImageGeometry Arrange(std::vector<Slice>& slices, DicomPlane DicomPicture::*plane) const
  {
    const DicomPicture& one = PictureOf(slices[0]);
    Eigen::Matrix<double, 3, 2> axes = *(one.*plane).directions;
    if (!(axes.transpose() * axes).isIdentity(1e-3))
      FailFile(files_[slices[0].file].path, "its image orientation is not two unit vectors at a right angle");
    Eigen::Vector3d x = axes.col(0).normalized(), y = axes.col(1);
    y = (y - x * x.dot(y)).normalized();
    const Eigen::Vector3d normal = x.cross(y);
    for (Slice& slice : slices) {
      const DicomPicture& picture = PictureOf(slice);
      if (!(picture.*plane).directions->isApprox(axes, sameDirection))
        Fail(WhereIs(slice) + " is turned against " + WhereIs(slices[0]) + ": the pictures are not parallel");
      if (!picture.spacing.isApprox(one.spacing, 1e-6))
        Fail(WhereIs(slice) + " has another pixel spacing than " + WhereIs(slices[0]));
      slice.along = normal.dot(*(picture.*plane).position);
    }
    std::stable_sort(slices.begin(), slices.end(), [](const Slice& a, const Slice& b) { return a.along < b.along; });

    ImageGeometry geometry;
    geometry.dimensions = {files_[0].columns, files_[0].rows, static_cast<int>(slices.size())};
    geometry.origin = *(PictureOf(slices[0]).*plane).position;
    geometry.direction << x, y, normal;
    if (!(one.spacing.minCoeff() > 0.0))
      FailFile(files_[slices[0].file].path, "its pixel spacing is missing or not positive");
    geometry.spacing << one.spacing, one.sliceSpacing > 0.0 ? one.sliceSpacing : 1.0;
    if (slices.size() == 1)
      return geometry;

    // The step is the median one, so that a gap stands out.
    std::vector<double> steps;
    for (std::size_t i = 1; i < slices.size(); ++i)
      steps.push_back(slices[i].along - slices[i - 1].along);
    std::vector<double> sorted = steps;
    std::nth_element(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2), sorted.end());
    const double median = sorted[sorted.size() / 2];
    const double step = (slices.back().along - slices.front().along) / static_cast<double>(steps.size());
    const double tolerance = std::max(evenness, evenness * median);
    for (std::size_t i = 0; i < steps.size(); ++i) {
      const std::string between = "between " + WhereIs(slices[i]) + " and " + WhereIs(slices[i + 1]);
      if (!(steps[i] > tolerance))
        Fail("two pictures lie at the same place (" + WhereIs(slices[i]) + " and " + WhereIs(slices[i + 1]) + ")");
      if (std::abs(steps[i] - median) > tolerance)
        Fail("its slices are unevenly spaced: " + Mm(steps[i]) + " " + between + ", " + Mm(median) +
             " elsewhere; are slices missing?");
      const Eigen::Vector3d there = geometry.origin + normal * (slices[i + 1].along - slices[0].along);
      const double aside = (*(PictureOf(slices[i + 1]).*plane).position - there).norm();
      if (aside > std::max(evenness, 1e-2 * one.spacing.minCoeff()))
        Fail(WhereIs(slices[i + 1]) + " lies " + Mm(aside) + " beside the normal of the others: the volume is sheared");
    }
    geometry.spacing[2] = step;
    return geometry;
  }

  // The transducer's frame has y into the tissue, where ours has z.
  void PlaceProbe(DicomPlane DicomPicture::*plane)
  {
    const auto& matrix = files_[0].volumeToTransducer;
    if (!matrix)
      return;
    const DicomPicture& one = PictureOf(slices_[0]);
    if (!IsRotation(matrix->topLeftCorner<3, 3>()) || !matrix->row(3).isApprox(Eigen::RowVector4d(0, 0, 0, 1))) {
      Note("Its Volume to Transducer Mapping Matrix is not a rigid transform and is left out.");
      return;
    }
    Pose volumeToTransducer;
    volumeToTransducer.matrix() = *matrix;
    Pose transducerFromProbe = Pose::Identity();
    transducerFromProbe.linear() << 1, 0, 0, 0, 0, 1, 0, -1, 0;
    Pose volumeToWorld = Pose::Identity();
    if (plane == &DicomPicture::patient) {
      if (!one.volume.IsKnown())
        return;
      volumeToWorld = PoseOf(one.patient) * PoseOf(one.volume).inverse();
    }
    content_.probeToWorld = volumeToWorld * volumeToTransducer.inverse() * transducerFromProbe;
  }

  static Pose PoseOf(const DicomPlane& plane)
  {
    const Eigen::Vector3d x = plane.directions->col(0).normalized();
    const Eigen::Vector3d y = (plane.directions->col(1) - x * x.dot(plane.directions->col(1))).normalized();
    Pose pose = Pose::Identity();
    pose.linear() << x, y, x.cross(y);
    pose.translation() = *plane.position;
    return pose;
  }

  void PlacePhilips()
  {
    const DicomHeader& file = files_[0];
    content_.geometry.dimensions = {file.columns, file.rows, file.volumeSlices};
    content_.geometry.spacing = file.volumeSpacing;
    if (file.storage != DicomStorage::Plain || file.samples != 1)
      FailFile(file.path, "it is a Cartesian volume of Philips whose pixels are compressed or coloured, which is not known");
    for (std::size_t i = 0; i < file.pictures.size(); ++i) {
      slices_.push_back({0, i});
      if (file.pictures.size() > 1)
        content_.times.push_back(static_cast<double>(i) * (file.frameTime > 0.0 ? file.frameTime : 1.0));
    }
    if (file.pictures.size() > 1 && !(file.frameTime > 0.0))
      Note("The file does not say how fast its volumes follow each other; they are one second apart.");
    Note("Its sizes come from private elements of Philips; its place in the patient is not known.");
  }

  // Pictures in one file that say nothing, or the same, of their place.
  void PlaceUnplaced()
  {
    const DicomHeader& file = files_[0];
    const DicomPicture& one = file.pictures[0];
    const int count = static_cast<int>(file.pictures.size());
    if (file.grouped && count > 1)
      FailFile(file.path, "not all of its pictures say where they lie (Plane Position and Orientation)");
    if (count > 1 && (file.frameIncrement == "time" || !(one.sliceSpacing > 0.0)))
      FailFile(file.path, file.holdsMovieGroup
                              ? MovieGroup()
                              : "it is a cine: " + std::to_string(count) +
                                    " pictures of a plane over time, not a volume; it does not say how far apart in space "
                                    "they lie");
    content_.geometry.dimensions = {file.columns, file.rows, count};
    Eigen::Vector2d spacing = one.spacing;
    if (spacing.isZero()) {
      if (count > 1)
        FailFile(file.path, "its pixel spacing is missing");
      spacing.setOnes();
      Note("The file does not say how large its pixels are; 1 mm is taken.");
    }
    content_.geometry.spacing << spacing, one.sliceSpacing > 0.0 ? one.sliceSpacing : 1.0;
    if (one.patient.IsKnown()) {
      const Pose pose = PoseOf(one.patient);
      content_.geometry.origin = pose.translation();
      content_.geometry.direction = pose.linear();
    } else
      Note("The file does not say where its pictures lie.");
    for (std::size_t i = 0; i < file.pictures.size(); ++i)
      slices_.push_back({0, i});
  }

  static VoxelType StoredType(const DicomHeader& file)
  {
    switch (file.bitsAllocated) {
    case 8:
      return file.isSigned ? VoxelType::Int8 : VoxelType::UInt8;
    case 16:
      return file.isSigned ? VoxelType::Int16 : VoxelType::UInt16;
    default:
      return file.isSigned ? VoxelType::Int32 : VoxelType::UInt32;
    }
  }

  void ChooseType()
  {
    content_.type = StoredType(files_[0]);
    for (const Slice& slice : slices_)
      if (const DicomPicture& picture = PictureOf(slice); picture.slope != 1.0 || picture.intercept != 0.0)
        content_.type = VoxelType::Float32;
    if (content_.type == VoxelType::Float32)
      Note("Its stored numbers are rescaled to values by slope and intercept, and have become floats.");
  }

  // One slice of stored numbers to voxels.
  template <class T>
  void Convert(const DicomHeader& file, const DicomPicture& picture, const char* pixels, char* out) const
  {
    const std::size_t columns = static_cast<std::size_t>(file.columns), count = columns * static_cast<std::size_t>(file.rows);
    const bool floats = content_.type == VoxelType::Float32, inverted = !floats && file.photometric == "MONOCHROME1";
    const bool halved = file.storage != DicomStorage::Encapsulated && file.photometric == "YBR_FULL_422";
    const int spare = file.bitsAllocated - file.bitsStored;
    const std::int64_t highest = file.isSigned ? -1 : (std::int64_t{1} << file.bitsStored) - 1;
    for (std::size_t i = 0; i < count; ++i) {
      T stored;
      if (file.samples == 1) {
        std::memcpy(&stored, pixels + i * sizeof(T), sizeof(T));
        stored = Significant(stored, spare);
      } else
        stored = static_cast<T>(Luminance(file, pixels, i, count, columns, halved));
      if (inverted)
        stored = static_cast<T>(highest - static_cast<std::int64_t>(stored));
      if (floats) {
        const float value = static_cast<float>(picture.slope * static_cast<double>(stored) + picture.intercept);
        std::memcpy(out + i * sizeof value, &value, sizeof value);
      } else
        std::memcpy(out + i * sizeof(T), &stored, sizeof(T));
    }
  }

  // The bits that are used; those above may hold anything.
  template <class T>
  static T Significant(T stored, int spare)
  {
    if constexpr (std::is_integral_v<T>) {
      using U = std::make_unsigned_t<T>;
      return spare == 0 ? stored : static_cast<T>(static_cast<T>(static_cast<U>(static_cast<U>(stored) << spare)) >> spare);
    }
    return stored; // StoredType has none of these
  }

  static int Luminance(const DicomHeader& file, const char* pixels, std::size_t i, std::size_t count, std::size_t columns,
                       bool halved)
  {
    const auto* bytes = reinterpret_cast<const unsigned char*>(pixels);
    if (halved) { // two pixels as Y Y Cb Cr
      const std::size_t row = i / columns, column = i % columns;
      return bytes[row * ((columns + 1) / 2 * 4) + column / 2 * 4 + column % 2];
    }
    const bool planar = file.planar && file.storage != DicomStorage::Encapsulated; // decoded, they never are
    const unsigned char* first = bytes + (planar ? i : 3 * i);
    if (file.photometric.compare(0, 8, "YBR_FULL") == 0)
      return first[0];
    const std::size_t next = planar ? count : 1;
    return (299 * first[0] + 587 * first[next] + 114 * first[2 * next] + 500) / 1000;
  }

  std::vector<DicomHeader> files_;
  std::vector<Slice> slices_; // of all volumes, in their order
};

} // namespace

bool IsDicomFolder(const std::string& path)
{
  std::vector<std::string> files = FilesOf(path);
  files.resize(std::min(files.size(), filesLookedAt));
  return std::any_of(files.begin(), files.end(), BeginsLikeDicom);
}

std::unique_ptr<VolumeSource> OpenDicom(const std::string& path, const VolumeReadParameters& parameters)
{
  auto source = std::make_unique<DicomSource>(path);
  if (const DicomHeader* file = source->Kretz())
    return OpenKretzWithin(file->path, file->kretzOffset, file->kretzBytes, parameters);
  source->Place();
  return source;
}

} // namespace echorama
