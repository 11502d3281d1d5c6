// SPDX-License-Identifier: BSD-3-Clause
// From a pixel to the skin, on an invented abdomen that a camera looks at from inside, whose optics are not the nominal ones and
// not quite those of any model: the error at places that no mark is at, beside the dissertation's map through a proxy and beside
// OpenCV, which fits the pose and takes the lens as it is said to be. Where errors are: by the slant of the skin and the angle to
// the axis. A lens that two domes calibrated, in a third shell. What a question takes, and its ray by Embree.
#include "Core/Base/Percentile.h"
#include "Filters/Acoustics/EmbreeQuery.h"
#include "Filters/Shell/Benchmarks/InventedAbdomen.h"
#include "Filters/Shell/ShellMarks.h"
#include "Testing/Benchmark.h"
#include "Tracking/Optical/ProxyMap.h"
#include "Tracking/Optical/Testing/SurfaceTruth.h"
#include <algorithm>
#include <functional>

#ifdef ECHORAMA_WITH_OPENCV
#include <opencv2/calib3d.hpp>
#endif

using namespace echorama;
using namespace echorama::truth;

namespace {

using Skin = std::shared_ptr<const TrackedSkin>;

// Above a height: what is printed of it.
TriangleSurface Upper(TriangleSurface surface, float height)
{
  auto& triangles = surface.triangles;
  triangles.erase(
      std::remove_if(triangles.begin(), triangles.end(),
                     [&](const auto& t) {
                       return std::min({surface.points[t[0]].z(), surface.points[t[1]].z(), surface.points[t[2]].z()}) < height;
                     }),
      triangles.end());
  return surface;
}

// As many pixels per radian as a good 640 x 480 camera has; off its nominal values, its axis off by some degrees.
TrueCamera CameraAt(double topMm, double asideMm = 0.0)
{
  TrueCamera camera;
  camera.lens.focal = 183.0;
  camera.lens.centreX = 326.3;
  camera.lens.centreY = 233.8;
  camera.lens.k1 = -0.033;
  camera.lens.k2 = 0.005;
  camera.lens.k3 = -0.0012;
  camera.decentringX = 0.002;
  camera.decentringY = -0.0015;
  camera.tiltX = 0.006;
  camera.tiltY = -0.008;
  camera.cameraToShell.linear() = ExpRotation(Vector3d(2.0, -3.0, 8.0) / DegreesPerRadian);
  camera.cameraToShell.translation() = Vector3d(4.0 + asideMm, -3.0, 120.0 - topMm);
  return camera;
}

Pose NominalAt(double topMm, double asideMm = 0.0)
{
  Pose pose = Pose::Identity();
  pose.translation() = Vector3d(asideMm, 0.0, 120.0 - topMm);
  return pose;
}

// Places of the skin that the camera sees within what its lens is for, with what makes them hard.
struct Place {
  Vector3d point;
  Vector2d pixel;
  double incidence, angle; // degrees: of the skin, from the axis
};

std::vector<Place> PlacesOf(const TrueCamera& camera, const TrackedSkin& skin, int count, double mostDegrees)
{
  std::vector<Place> places;
  for (int i = 0; i < count; ++i) {
    Random random(17, static_cast<std::uint64_t>(i));
    const double cosine = random.Uniform(std::cos(mostDegrees / DegreesPerRadian), 1.0), turn = random.Uniform(0.0, 6.283185307);
    const double sine = std::sqrt(1.0 - cosine * cosine);
    const Vector3d direction = camera.cameraToShell.linear() * Vector3d(sine * std::cos(turn), sine * std::sin(turn), cosine);
    const auto hit = skin.Along(camera.cameraToShell.translation(), direction);
    const auto pixel = hit ? camera.PixelOf(hit->seen) : std::nullopt;
    if (pixel && camera.lens.Covers(*pixel))
      places.push_back({hit->point, *pixel, std::acos(std::min(1.0, std::abs(hit->normal.dot(direction)))) * DegreesPerRadian,
                        std::acos(cosine) * DegreesPerRadian});
  }
  return places;
}

struct Case {
  std::string name;
  double topMm = 120.0;
  int divisions = 9; // of the proxy, whose points are the marks
  double noisePx = 0.02, placementMm = 0.0, outliers = 0.0;
  double asideMm = 0.0, mostDegrees = 88.0;
};

struct Scene {
  TrueCamera camera;
  Skin skin;
  TriangleSurface proxy;
  std::vector<SurfaceObservation> observations; ///< marks are the proxy's points
  std::vector<Place> places;
  std::size_t outliers = 0;
};

Scene SceneOf(const Case& c, const Skin& skin, double foldMm = 0.0)
{
  Scene scene;
  scene.camera = CameraAt(c.topMm, c.asideMm);
  scene.skin = skin;
  scene.proxy = InventedAbdomen(c.divisions, foldMm);
  for (std::size_t i = 0; i < scene.proxy.points.size(); ++i) {
    const auto nearest = skin->NearestTo(scene.proxy.points[i].cast<double>());
    if (nearest->distanceMm > 1.0)
      continue; // below what is printed
    const Vector3d mark = nearest->point;
    scene.proxy.points[i] = mark.cast<float>();
    const Vector3d inCamera = scene.camera.cameraToShell.inverse() * mark;
    if (!scene.camera.Sees(*skin, mark) || std::atan2(inCamera.head<2>().norm(), inCamera.z()) > c.mostDegrees / DegreesPerRadian)
      continue;
    Random random(31, i);
    SurfaceObservation o;
    const Vector3d off = c.placementMm * Vector3d(random.Normal(), random.Normal(), random.Normal());
    o.pixel = *scene.camera.PixelOf(skin->NearestTo(mark + off)->point) + c.noisePx * Vector2d(random.Normal(), random.Normal());
    if (random.Uniform() < c.outliers) {
      const double turn = random.Uniform(0.0, 6.283185307);
      o.pixel += random.Uniform(4.0, 30.0) * Vector2d(std::cos(turn), std::sin(turn));
      ++scene.outliers;
    }
    o.covariance = c.noisePx * c.noisePx * Eigen::Matrix2d::Identity();
    o.point = mark;
    o.mark = static_cast<int>(i);
    if (scene.camera.lens.Covers(o.pixel))
      scene.observations.push_back(o);
  }
  scene.places = PlacesOf(scene.camera, *skin, 4000, c.mostDegrees);
  return scene;
}

using Map = std::function<MappedPoint(const Vector2d& pixel)>;

// Errors at the places that a map answers for, of those that \a which chooses. No map says anything of too few.
nlohmann::ordered_json ErrorsAt(const Scene& scene, const Map& map, const std::function<bool(const Place&)>& which)
{
  std::vector<double> errors, relative;
  std::size_t asked = 0, atEdge = 0;
  for (const Place& place : scene.places) {
    if (!which(place))
      continue;
    ++asked;
    const MappedPoint mapped = map(place.pixel);
    if (mapped.status != MappedPoint::Status::Mapped)
      continue;
    atEdge += mapped.isAtEdge;
    errors.push_back((mapped.point - place.point).norm());
    if (mapped.SigmaMm() > 0.0)
      relative.push_back(errors.back() / mapped.SigmaMm());
  }
  if (errors.empty())
    return {};
  nlohmann::ordered_json told{{"median", Median(errors)},
                              {"p95", Percentile(errors, 0.95)},
                              {"most", *std::max_element(errors.begin(), errors.end())},
                              {"asked", asked},
                              {"answered", static_cast<double>(errors.size()) / static_cast<double>(asked)},
                              {"at_edge", atEdge}};
  if (!relative.empty())
    told["over_sigma"] = Median(relative);
  return told;
}

void Tell(const std::string& name, const std::string& method, const std::string& group, double seconds, const Scene& scene,
          const Map& map, const std::function<bool(const Place&)>& which, nlohmann::ordered_json more = {})
{
  nlohmann::ordered_json errors = ErrorsAt(scene, map, which);
  if (errors.empty())
    return;
  errors["group"] = group;
  errors["marks"] = scene.observations.size();
  if (more.is_object())
    errors.update(more);
  benchmark::Report("surface_map", name, method, seconds, errors["p95"], "mm", errors);
}

#ifdef ECHORAMA_WITH_OPENCV
// The pose by solvePnP over the nominal lens; then our ray to the same mesh.
std::optional<SurfaceMapState> ByOpenCv(const Scene& scene)
{
  const FisheyeLens lens;
  const cv::Matx33d camera(lens.focal, 0.0, lens.centreX, 0.0, lens.focal, lens.centreY, 0.0, 0.0, 1.0);
  const cv::Vec4d distortion(lens.k1, lens.k2, lens.k3, lens.k4);
  std::vector<cv::Point2d> pixels;
  std::vector<cv::Point3d> points;
  for (const SurfaceObservation& o : scene.observations) {
    const auto direction = lens.Unproject(o.pixel);
    if (!direction || direction->z() < 0.17) // beyond 80 degrees a plane of pixels is no picture
      continue;
    pixels.emplace_back(o.pixel.x(), o.pixel.y());
    points.emplace_back(o.point.x(), o.point.y(), o.point.z());
  }
  std::vector<cv::Point2d> plane;
  cv::fisheye::undistortPoints(pixels, plane, camera, distortion);
  cv::Vec3d turn, place;
  if (!cv::solvePnPRansac(points, plane, cv::Matx33d::eye(), cv::noArray(), turn, place, false, 300, 0.05F, 0.99, cv::noArray(),
                          cv::SOLVEPNP_ITERATIVE))
    return std::nullopt;
  Pose shellToCamera = Pose::Identity();
  shellToCamera.linear() = ExpRotation({turn[0], turn[1], turn[2]});
  shellToCamera.translation() = Vector3d(place[0], place[1], place[2]);
  std::vector<Vector2d> covered;
  for (const SurfaceObservation& o : scene.observations)
    covered.push_back(o.pixel);
  SurfaceMapState state;
  state.optics.lens = lens;
  state.covered = PixelCoverage::Of(covered);
  state.cameraToShell = shellToCamera.inverse();
  state.covariance = Eigen::MatrixXd::Zero(13, 13);
  return state;
}
#endif

const auto All = [](const Place&) { return true; };

void Compare(const Case& c, const Skin& skin, bool withSlants)
{
  const Scene scene = SceneOf(c, skin);
  SurfaceMapParameters p;
  p.placementMm = c.placementMm;
  FittedSurfaceMap fitted;
  double seconds = benchmark::Seconds(
      [&] { fitted = FitSurfaceMap(scene.observations, skin, FisheyeLens(), NominalAt(c.topMm, c.asideMm), p); });
  std::size_t named = 0;
  const SurfaceMap& map = fitted.map;
  const Map ours = [&map](const Vector2d& pixel) { return map.Map(pixel); };
  named = fitted.report.outliers.size();
  Tell(c.name, "camera and residual", "errors", seconds, scene, ours, All,
       {{"outliers", scene.outliers},
        {"named", named},
        {"left_px", fitted.report.residualPx},
        {"freedoms", fitted.report.residualFreedoms},
        {"held_median", fitted.report.heldOutMedianMm},
        {"held_p95", fitted.report.heldOut95Mm},
        {"held_most", fitted.report.heldOutMostMm}});

  p.residualCentres = 0;
  FittedSurfaceMap bare;
  seconds = benchmark::Seconds(
      [&] { bare = FitSurfaceMap(scene.observations, skin, FisheyeLens(), NominalAt(c.topMm, c.asideMm), p); });
  Tell(c.name, "camera alone", "errors", seconds, scene, [&bare](const Vector2d& pixel) { return bare.map.Map(pixel); }, All,
       {{"left_px", bare.report.residualPx}, {"named", bare.report.outliers.size()}, {"outliers", scene.outliers}});

  std::vector<Vector2d> pixels(scene.proxy.points.size(), Vector2d::Constant(std::nan("")));
  for (const SurfaceObservation& o : scene.observations)
    pixels[static_cast<std::size_t>(o.mark)] = o.pixel;
  const ProxyMap proxy(scene.proxy, pixels, scene.camera.cameraToShell.translation(), skin);
  const Map byProxy = [&proxy](const Vector2d& pixel) { return proxy.Map(pixel); };
  Tell(c.name, "proxy (7.6)", "errors", 0.0, scene, byProxy, All);
#ifdef ECHORAMA_WITH_OPENCV
  std::optional<SurfaceMapState> state;
  seconds = benchmark::Seconds([&] { state = ByOpenCv(scene); });
  if (state) {
    const SurfaceMap peer(*state, skin);
    Tell(
        c.name, "solvePnP (OpenCV), nominal lens", "errors", seconds, scene,
        [&peer](const Vector2d& pixel) { return peer.Map(pixel); }, All);
  }
#endif
  if (!withSlants)
    return;
  for (const auto& [from, to] : {std::pair{0, 30}, {30, 50}, {50, 65}, {65, 80}}) {
    const auto between = [from = from, to = to](const Place& place) { return place.incidence >= from && place.incidence < to; };
    const std::string name = c.name + ", skin seen at " + std::to_string(from) + " to " + std::to_string(to) + " degrees";
    Tell(name, "camera and residual", "slants", 0.0, scene, ours, between);
    Tell(name, "proxy (7.6)", "slants", 0.0, scene, byProxy, between);
  }
  const auto horizon = [](const Place& place) { return place.angle > 75.0; };
  Tell(c.name + ", beyond 75 degrees from the axis", "camera and residual", "slants", 0.0, scene, ours, horizon);
  Tell(c.name + ", beyond 75 degrees from the axis", "proxy (7.6)", "slants", 0.0, scene, byProxy, horizon);
}

// A fold: what lies behind its brink is not seen.
void Fold()
{
  const Skin skin = std::make_shared<TrackedSkin>(Upper(InventedAbdomen(benchmark::Smoke() ? 40 : 200, 6.0), -20.0f));
  const Case c{"fold of 6 mm, 120 mm", 120.0};
  const Scene scene = SceneOf(c, skin, 6.0);
  const auto fitted = FitSurfaceMap(scene.observations, skin, FisheyeLens(), NominalAt(c.topMm, c.asideMm));
  const Map ours = [&fitted](const Vector2d& pixel) { return fitted.map.Map(pixel, 4e-4 * Eigen::Matrix2d::Identity()); };
  Tell(c.name, "camera and residual", "fold", 0.0, scene, ours, All);
  const auto nearFold = [](const Place& place) {
    const double aside = std::acos(place.point.normalized().dot(Vector3d(-0.08, 0.0, 1.0).normalized()));
    return std::abs(110.0 * (aside - 0.6)) < 6.0;
  };
  Tell(c.name + ", its places alone", "camera and residual", "fold", 0.0, scene, ours, nearFold);
}

// Two domes, then the abdomen with what its file knows of the camera, and some marks.
void Universal(const Skin& skin)
{
  std::vector<LensObservations> shapes;
  std::uint64_t item = 0;
  for (const double radius : {70.0, 130.0}) {
    TrueCamera camera = CameraAt(120.0);
    camera.cameraToShell.translation() = Vector3d(1.0, -0.8, 6.0);
    LensObservations shape{{}, camera.cameraToShell};
    for (const Vector3d& mark : DomeMarks(250, radius)) {
      Random random(41, ++item);
      SurfaceObservation o;
      const Vector3d off = 0.1 * Vector3d(random.Normal(), random.Normal(), random.Normal());
      const auto pixel = camera.PixelOf((mark + off).normalized() * radius); // the hand slips along the dome
      if (!pixel)
        continue;
      o.pixel = *pixel + 0.02 * Vector2d(random.Normal(), random.Normal());
      o.covariance = 4e-4 * Eigen::Matrix2d::Identity();
      o.point = mark;
      o.mark = static_cast<int>(item);
      if (camera.lens.Covers(o.pixel))
        shape.observations.push_back(o);
    }
    shapes.push_back(shape);
  }
  FittedLens lens;
  const double seconds = benchmark::Seconds([&] { lens = FitLens(shapes, FisheyeLens()); });
  Case c{"lens of two domes, 120 mm", 120.0};
  c.placementMm = 0.1;
  c.mostDegrees = 80.0;
  const Scene scene = SceneOf(c, skin);
  for (const int few : {0, 6, 20}) {
    Scene shown = scene;
    shown.observations.clear();
    for (int i = 0; i < few; ++i)
      shown.observations.push_back(
          scene.observations[scene.observations.size() * static_cast<std::size_t>(i) / static_cast<std::size_t>(few)]);
    Random random(43);
    Twist off;
    for (Eigen::Index k = 0; k < 6; ++k)
      off[k] = random.Normal() * (k < 3 ? 0.2 : 0.2 / DegreesPerRadian);
    const SurfaceMap map = PlaceSurfaceMap(lens.lens, skin, scene.camera.cameraToShell * Exp(off), shown.observations).map;
    Tell(
        c.name + (few == 0 ? ", mount of 0.2 mm and 0.2 degrees" : ", and " + std::to_string(few) + " marks"),
        "camera and residual", "universal", seconds, shown, [&map](const Vector2d& pixel) { return map.Map(pixel); }, All);
  }
}

void Times(const Skin& skin)
{
  const Case c{"one question", 120.0};
  const Scene scene = SceneOf(c, skin);
  const SurfaceMap map = FitSurfaceMap(scene.observations, skin, FisheyeLens(), NominalAt(c.topMm, c.asideMm)).map;
  const double count = static_cast<double>(scene.places.size());
  double sum = 0.0;
  const double whole = benchmark::MedianSeconds([&] {
    for (const Place& place : scene.places)
      sum += map.Map(place.pixel, 4e-4 * Eigen::Matrix2d::Identity()).point.z();
  });
  const nlohmann::ordered_json more{{"group", "times"}, {"triangles", skin->Surface().triangles.size()}};
  benchmark::ReportTime("surface_map", "a question, all of it", "camera and residual", whole / count, more);

  RTCDevice device = rtcNewDevice(nullptr);
  RTCScene embree = rtcNewScene(device);
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  const TriangleSurface& surface = skin->Surface();
  auto* points = static_cast<float*>(
      rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), surface.points.size()));
  for (std::size_t i = 0; i < surface.points.size(); ++i)
    std::copy_n(surface.points[i].data(), 3, points + 3 * i);
  auto* triangles = static_cast<std::uint32_t*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                                                        3 * sizeof(std::uint32_t), surface.triangles.size()));
  for (std::size_t i = 0; i < surface.triangles.size(); ++i)
    std::copy_n(surface.triangles[i].data(), 3, triangles + 3 * i);
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(embree, geometry);
  rtcReleaseGeometry(geometry);
  rtcSetSceneFlags(embree, RTC_SCENE_FLAG_ROBUST);
  rtcCommitScene(embree);
  const Vector3d eye = scene.camera.cameraToShell.translation();
  std::vector<Vector3d> directions;
  for (const Place& place : scene.places)
    directions.push_back((place.point - eye).normalized());
  double worst = 0.0;
  std::vector<double> far(directions.size());
  const auto [ours, theirs] = benchmark::Duel(
      [&] {
        for (std::size_t i = 0; i < directions.size(); ++i)
          far[i] = skin->Along(eye, directions[i])->distanceMm;
      },
      [&] {
        EmbreeQuery query;
        for (std::size_t i = 0; i < directions.size(); ++i) {
          RTCRayHit ray{};
          ray.ray.org_x = static_cast<float>(eye.x());
          ray.ray.org_y = static_cast<float>(eye.y());
          ray.ray.org_z = static_cast<float>(eye.z());
          ray.ray.dir_x = static_cast<float>(directions[i].x());
          ray.ray.dir_y = static_cast<float>(directions[i].y());
          ray.ray.dir_z = static_cast<float>(directions[i].z());
          ray.ray.tfar = 1e6f;
          ray.ray.mask = 0xffffffffu;
          ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
          query.Ask(embree, ray);
          worst = std::max(worst, std::abs(static_cast<double>(ray.ray.tfar) - far[i]));
        }
      });
  rtcReleaseScene(embree);
  rtcReleaseDevice(device);
  benchmark::ReportTime("surface_map", "its ray", "TriangleTree", ours / count, more);
  benchmark::Report("surface_map", "its ray", "Embree", theirs / count, worst, "mm", more);
}

} // namespace

int main()
{
  const Skin skin = std::make_shared<TrackedSkin>(Upper(InventedAbdomen(benchmark::Smoke() ? 40 : 130), -20.0f));
  for (const double topMm : {60.0, 120.0, 200.0}) {
    const std::string at = std::to_string(static_cast<int>(topMm)) + " mm";
    const int divisions = topMm > 100.0 ? 11 : 14; // some 350 marks are seen
    Compare({at + ", spots of 0.02 px", topMm, divisions, 0.02, 0.0, 0.0}, skin, false);
    if (topMm == 60.0)
      Compare({"60 mm, 90 mm aside, spots of 0.02 px", topMm, 11, 0.02, 0.0, 0.0, 90.0}, skin, true);
    Compare({at + ", placed to 0.15 mm", topMm, divisions, 0.02, 0.15, 0.0}, skin, false);
    Compare({at + ", placed to 0.15 mm, 3% outliers", topMm, divisions, 0.02, 0.15, 0.03}, skin, false);
  }
  Fold();
  Universal(skin);
  Times(skin);
  return 0;
}
