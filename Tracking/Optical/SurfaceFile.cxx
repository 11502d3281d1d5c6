// SPDX-License-Identifier: BSD-3-Clause
// The mesh lies beside the calibration as binary STL, which every program for meshes reads; its checksum is in the calibration,
// so that a mesh which was replaced is noticed. STL repeats the points of every triangle: they are joined again.
#include "SurfaceFile.h"
#include "Core/Base/Checksum.h"
#include "Core/Base/DescribedJson.h"
#include "Core/Base/FileReplacement.h"
#include "Core/Base/FormatText.h"
#include "Core/Base/TextFile.h"
#include "Filters/Tissue/StlFile.h"
#include <cmath>
#include <filesystem>
#include <fstream>
#include <system_error>

namespace echorama {
namespace {

using described::Json;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr const char* surfaceSchema = "echorama-surface-1";
constexpr ParameterRange surfacePlaces{-1e5, 1e5}, surfacePixels{-1e5, 1e5}, surfaceLengths{0, 1e5}, anyNumber{};
constexpr std::size_t largestMeshBytes = std::size_t{512} << 20;

[[noreturn]] void RefuseSurface(const std::string& reason)
{
  throw Error(Error::Kind::InvalidParameter, reason);
}

template <class A>
void EachIsNeeded(A& a, const ParameterList& parameters)
{
  for (const Parameter& parameter : parameters)
    a.Value(parameter, Presence::Needed);
}

// Structs as their keys: pixels and places as numbers, x, y (and z) in turns, symmetric matrices as their rows up to the
// diagonal.

struct MeshKeys {
  std::string file, checksum;
  double wallMm = 0.0;
};

struct CameraPlaceKeys {
  Vector3d position = Vector3d::Zero(), x = Vector3d::UnitX(), y = Vector3d::UnitY(), z = Vector3d::UnitZ();
};

struct ResidualKeys {
  double middleX = 0.0, middleY = 0.0, scale = 1.0;
  std::vector<double> centres, weights;
};

struct CoveredKeys {
  std::vector<double> pixels, reach, hull;
};

struct LightsKeys {
  SurfaceLights lights;
  SpotTracksParameters tracks;
  std::string words;
};

struct SurfaceKeys {
  CalibratedSurface surface; // what needs no other form
  MeshKeys mesh;
  FisheyeLens lens;
  ResidualKeys residual;
  CoveredKeys covered;
  CameraPlaceKeys place;
  std::vector<double> marks, covariance;
  LightsKeys lights;
};

template <class A>
void Describe(A& a, MeshKeys& mesh)
{
  EachIsNeeded(a, {Parameter("File", mesh.file, "The skin's mesh, beside this file."),
                   Parameter("Checksum", mesh.checksum, "Of that file."),
                   Parameter("WallMm", mesh.wallMm, surfaceLengths, "mm", "From the skin to what the camera sees of it.")});
}

template <class A>
void Describe(A& a, FisheyeLens& lens)
{
  EachIsNeeded(a, Describe(lens));
}

template <class A>
void Describe(A& a, ResidualKeys& residual)
{
  EachIsNeeded(a, {Parameter("MiddleX", residual.middleX, surfacePixels, "px", "Of the plate."),
                   Parameter("MiddleY", residual.middleY, surfacePixels, "px", "Of the plate."),
                   Parameter("Scale", residual.scale, {0, 1e5, true}, "px", "What makes numbers near 1 of pixels.")});
  a.Numbers("centres", residual.centres, surfacePixels, "px", "Of the plate.");
  a.Numbers("weights", residual.weights, anyNumber, "px", "Of each centre, then of 1, x and y.");
}

template <class A>
void Describe(A& a, CoveredKeys& covered)
{
  a.Numbers("pixels", covered.pixels, surfacePixels, "px", "Of the marks.", Presence::Needed);
  a.Numbers("reach", covered.reach, surfaceLengths, "px", "Of each, how far others may be from it.", Presence::Needed);
  a.Numbers("hull", covered.hull, surfacePixels, "px", "About them.", Presence::Needed);
}

template <class A>
void Describe(A& a, CameraPlaceKeys& place)
{
  EachIsNeeded(a, {Parameter("Position", place.position, surfacePlaces, "mm", "The optical centre, in the shell's frame."),
                   Parameter("X", place.x, {-1, 1}, "", "To the right of the picture."),
                   Parameter("Y", place.y, {-1, 1}, "", "Down in the picture."),
                   Parameter("Z", place.z, {-1, 1}, "", "The way it looks.")});
}

template <class A>
void Describe(A& a, LightsKeys& keys)
{
  EachIsNeeded(a, {Parameter("Lights", keys.lights.lights, {1, 4}, "", "Of the code."),
                   Parameter("OffSlots", keys.lights.offSlots, {1, 2}, "", "In which all are off."),
                   Parameter("Alternating", keys.lights.alternating, "One after the other, for a camera that is triggered."),
                   Parameter("Words", keys.words, "Of each light, a digit per slot.")});
  EachIsNeeded(a, Describe(keys.tracks));
}

template <class A>
void Describe(A& a, SpotDetectorParameters& detector)
{
  EachIsNeeded(a, Describe(detector));
}

template <class A>
void Describe(A& a, BrightnessCalibration& brightness)
{
  EachIsNeeded(a, {Parameter("Columns", brightness.columns, {2, 1000}, "", "Of nodes."),
                   Parameter("Rows", brightness.rows, {2, 1000}, "", "Of nodes."),
                   Parameter("Width", brightness.width, {2, 100000}, "px", "Of the picture."),
                   Parameter("Height", brightness.height, {2, 100000}, "px", "Of the picture.")});
  a.Numbers("peak", brightness.peak, {0, 1e9, true}, "grey levels", "Of a light that touches, at each node.", Presence::Needed);
  a.Numbers("size", brightness.size, {0, 1e5, true}, "px", "The same.", Presence::Needed);
}

template <class A>
void Describe(A& a, SurfaceAccuracy& accuracy)
{
  EachIsNeeded(a, {Parameter("Marks", accuracy.marks, {0, 1e6}, "", "That were visited."),
                   Parameter("Inliers", accuracy.inliers, {0, 1e6}, "", "Of them, those that agree."),
                   Parameter("MedianMm", accuracy.medianMm, surfaceLengths, "mm", "At marks that were left out."),
                   Parameter("Mm95", accuracy.mm95, surfaceLengths, "mm", "The same, in 95% of them."),
                   Parameter("MostMm", accuracy.mostMm, surfaceLengths, "mm", "The same, at most."),
                   Parameter("ScatterMm", accuracy.scatterMm, surfaceLengths, "mm", "Of lights that were put down."),
                   Parameter("OwnMm", accuracy.ownMm, surfaceLengths, "mm", "Of the map itself, in 95% of places."),
                   Parameter("Coverage", accuracy.coverage, {0, 1}, "", "Of the skin's picture.")});
}

template <class A>
void Describe(A& a, SurfaceKeys& keys)
{
  a.Constant("schema", surfaceSchema);
  Each(a, {Parameter("Date", keys.surface.date, "When it was calibrated."),
           Parameter("Camera", keys.surface.camera, "How it was opened."),
           Parameter("Shell", keys.surface.shell, "What its marker says.")});
  a.Object("mesh", keys.mesh, "The skin.", Presence::Needed);
  a.Object("accuracy", keys.surface.accuracy, "How good it was then.", Presence::Needed);
  a.Object("lights", keys.lights, "How they blink, and how the camera sees that.", Presence::Needed);
  a.Object("detector", keys.surface.detector, "How they are found in the picture.", Presence::Needed);
  a.Object("lens", keys.lens, "By Kannala and Brandt.", Presence::Needed);
  a.Object("cameraToShell", keys.place, "Where the camera is.", Presence::Needed);
  a.Object("residual", keys.residual, "What the lens leaves over: a thin plate.", Presence::Needed);
  a.Object("covered", keys.covered, "Where it was calibrated.", Presence::Needed);
  std::optional<BrightnessCalibration> brightness;
  if (!keys.surface.brightness.Empty())
    brightness = keys.surface.brightness;
  a.MaybeObject("brightness", brightness, "Of lights that touch.");
  if (brightness)
    keys.surface.brightness = *brightness;
  a.Numbers("marks", keys.marks, surfacePlaces, "mm", "In their order.");
  a.Numbers("covariance", keys.covariance, anyNumber, "", "Of lens, residual and place of the camera.", Presence::Needed);
}

std::vector<double> Flat(const std::vector<Vector2d>& pixels)
{
  std::vector<double> flat;
  for (const Vector2d& pixel : pixels)
    flat.insert(flat.end(), {pixel.x(), pixel.y()});
  return flat;
}

std::vector<Vector2d> Pixels(const std::vector<double>& flat, const char* what)
{
  if (flat.size() % 2 != 0)
    RefuseSurface(std::string(what) + " are pairs of numbers");
  std::vector<Vector2d> pixels;
  for (std::size_t i = 0; i < flat.size(); i += 2)
    pixels.emplace_back(flat[i], flat[i + 1]);
  return pixels;
}

Pose PoseOf(const CameraPlaceKeys& keys)
{
  Pose pose = Pose::Identity();
  pose.linear() << keys.x, keys.y, keys.z;
  pose.translation() = keys.position;
  return pose;
}

// "1011000": what a driver of lights would show. A version of this program with other words must not read them as its own.
std::string WordsOf(const BlinkCode& code)
{
  std::string words;
  for (int light = 0; light < code.Lights(); ++light) {
    words += light > 0 ? " " : "";
    for (int slot = 0; slot < code.Length(); ++slot)
      words += code.On(light, slot) ? '1' : '0';
  }
  return words;
}

struct NoSurfaceContext {};

class SurfaceReader : public described::Reader<SurfaceReader, NoSurfaceContext> {
public:
  using Reader::Reader;
  template <class T>
  static void Validate(const T&)
  {
  }
  static void Validate(const MeshKeys& mesh)
  {
    if (!IsChecksum(mesh.checksum))
      RefuseSurface("the checksum must be of 16 hexadecimal digits");
    if (std::filesystem::path(mesh.file).filename() != mesh.file || mesh.file == "..")
      RefuseSurface("the mesh must lie in the same folder: a name without a folder is needed");
  }
  static void Validate(const FisheyeLens& lens) { lens.Check(); }
  static void Validate(const CameraPlaceKeys& place)
  {
    if (!IsRotation(PoseOf(place).linear()))
      RefuseSurface("x, y and z must be unit vectors at right angles");
  }
  static void Validate(const BrightnessCalibration& b)
  {
    const std::size_t nodes = static_cast<std::size_t>(b.columns) * static_cast<std::size_t>(b.rows);
    if (b.peak.size() != nodes || b.size.size() != nodes)
      RefuseSurface("each node needs a peak and a size");
  }
  static void Validate(const LightsKeys& keys)
  {
    const std::string ours = WordsOf(keys.lights.Code());
    if (ours != keys.words)
      RefuseSurface("the lights blinked \"" + keys.words + "\", and this version knows \"" + ours +
                    "\" for so many: one light would be taken for another");
    SpotTracks(keys.tracks, keys.lights.Code()); // says what does not fit together
  }
  template <class T>
  static void Inherit(NoSurfaceContext&, T&)
  {
  }
};

class SurfaceWriter : public described::Writer<SurfaceWriter> {};

SurfaceKeys KeysOf(const CalibratedSurface& surface)
{
  SurfaceKeys keys;
  const SurfaceMapState& state = surface.map.State();
  keys.surface = surface;
  keys.surface.map = {};
  keys.lens = state.optics.lens;
  const ThinPlate& residual = state.optics.residual;
  keys.residual = {residual.middle.x(), residual.middle.y(), residual.scale, Flat(residual.centres), Flat(residual.weights)};
  keys.covered = {Flat(state.covered.pixels), state.covered.reach, Flat(state.covered.hull)};
  const Pose& pose = state.cameraToShell;
  keys.place = {pose.translation(), pose.linear().col(0), pose.linear().col(1), pose.linear().col(2)};
  for (Eigen::Index row = 0; row < state.covariance.rows(); ++row)
    for (Eigen::Index column = 0; column <= row; ++column)
      keys.covariance.push_back(state.covariance(row, column));
  for (const Vector3d& mark : surface.marks)
    keys.marks.insert(keys.marks.end(), {mark.x(), mark.y(), mark.z()});
  keys.lights = {surface.lights, surface.tracks, WordsOf(surface.lights.Code())};
  return keys;
}

SurfaceMapState StateOf(const SurfaceKeys& keys)
{
  SurfaceMapState state;
  state.optics.lens = keys.lens;
  ThinPlate& residual = state.optics.residual;
  residual.middle = {keys.residual.middleX, keys.residual.middleY};
  residual.scale = keys.residual.scale;
  residual.centres = Pixels(keys.residual.centres, "centres");
  residual.weights = Pixels(keys.residual.weights, "weights");
  state.covered = {Pixels(keys.covered.pixels, "pixels"), keys.covered.reach, Pixels(keys.covered.hull, "corners")};
  state.cameraToShell = PoseOf(keys.place);
  const Eigen::Index size = state.optics.Unknowns() + 6;
  if (keys.covariance.size() != static_cast<std::size_t>(size * (size + 1) / 2))
    RefuseSurface(Format("the covariance must have %d numbers, and has %d", static_cast<int>(size * (size + 1) / 2),
                         static_cast<int>(keys.covariance.size())));
  state.covariance.resize(size, size);
  std::size_t at = 0;
  for (Eigen::Index row = 0; row < size; ++row)
    for (Eigen::Index column = 0; column <= row; ++column)
      state.covariance(row, column) = state.covariance(column, row) = keys.covariance[at++];
  return state;
}

} // namespace

BlinkCode SurfaceLights::Code() const
{
  return alternating ? BlinkCode::Alternating() : BlinkCode::Make(lights, offSlots);
}

void CalibratedSurface::CheckPicture(int width, int height, const std::string& name) const
{
  const FisheyeLens& lens = map.State().optics.lens;
  if (width != lens.width || height != lens.height)
    throw Error(Error::Kind::BadInput,
                name +
                    Format(": the camera was calibrated with pictures of %d x %d and now gives %d x %d: set it to that size, or "
                           "calibrate again",
                           lens.width, lens.height, width, height));
}

void CalibratedSurface::CheckShell(const std::string& mounted, const std::string& name) const
{
  if (mounted != shell)
    throw Error(Error::Kind::BadInput, name + ": it was made in the shell \"" + shell + "\", and \"" + mounted +
                                           "\" is mounted: mount that one, or calibrate this one");
}

std::string SurfaceMeshFile(const std::string& path)
{
  std::filesystem::path file(path);
  if (file.extension() != ".json")
    RefuseSurface(path + ": a calibration is written as .json");
  return file.replace_extension(".mesh.stl").string();
}

void WriteSurface(const std::string& path, const CalibratedSurface& surface)
{
  const std::filesystem::path meshFile = SurfaceMeshFile(path);
  if (!surface.map.Skin())
    RefuseSurface("a calibration without a map cannot be written");
  SurfaceKeys keys = KeysOf(surface);
  const std::string mesh = StlOf(surface.map.Skin()->Surface());
  keys.mesh = {meshFile.filename().string(), Checksum(mesh.data(), mesh.size()), surface.map.Skin()->WallMm()};
  const Json json = SurfaceWriter::Write(keys);
  try { // what could not be read again
    NoSurfaceContext none;
    SurfaceKeys again;
    SurfaceReader::Read(path, none, json, "", again);
  } catch (const Error& error) {
    RefuseSurface(error.what());
  }
  FileReplacement files;
  const auto put = [&](const std::string& target, const std::string& content) {
    const std::string staged = files.Stage(target);
    std::ofstream out(staged, std::ios::binary);
    out.write(content.data(), static_cast<std::streamsize>(content.size()));
    out.close();
    if (!out)
      throw Error(Error::Kind::FileSystem, target + ": cannot be written");
  };
  put(meshFile.string(), mesh);
  put(path, json.dump(1, ' ', false, Json::error_handler_t::replace) + "\n");
  files.Commit();
}

CalibratedSurface ReadSurface(const std::string& path)
{
  SurfaceKeys keys;
  NoSurfaceContext none;
  const Json json = JsonPlace(path).Parse(ReadTextFile(path));
  SurfaceReader::Read(path, none, json, "", keys);
  const std::string meshPath = (std::filesystem::path(path).parent_path() / keys.mesh.file).string();
  std::error_code unknown; // of a name that no file can have
  if (!std::filesystem::exists(meshPath, unknown))
    throw Error(Error::Kind::FileSystem, path + ": its mesh " + meshPath + " is missing: both files belong together");
  const std::string mesh = ReadTextFile(meshPath, largestMeshBytes);
  if (Checksum(mesh.data(), mesh.size()) != keys.mesh.checksum)
    FailFile(path, "its mesh " + meshPath + " is not the one that it was calibrated with, or is damaged");
  CalibratedSurface surface = std::move(keys.surface);
  surface.lights = keys.lights.lights;
  surface.tracks = keys.lights.tracks;
  if (keys.marks.size() % 3 != 0)
    FailFile(path, "marks: places are triples of numbers");
  for (std::size_t i = 0; i < keys.marks.size(); i += 3)
    surface.marks.emplace_back(keys.marks[i], keys.marks[i + 1], keys.marks[i + 2]);
  try {
    const auto skin = std::make_shared<const TrackedSkin>(SurfaceOfStl(meshPath, mesh), keys.mesh.wallMm);
    surface.map = SurfaceMap(StateOf(keys), skin);
  } catch (const Error& error) {
    if (error.GetKind() == Error::Kind::BadFile)
      throw;
    FailFile(path, error.what());
  }
  return surface;
}

} // namespace echorama
