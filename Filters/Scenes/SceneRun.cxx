// SPDX-License-Identifier: BSD-3-Clause
// A view is made of one or several states of tissue and gel. Each state costs a step of the press, a piece of the gel's flow, and
// the synthesis of its planes; a scene without press and gel has one state for all views, and its acoustic scene is made once.
#include "SceneRun.h"
#include "Core/Base/ElapsedTime.h"
#include "Core/Base/NumberText.h"
#include "Filters/Phantoms/PhantomViews.h"
#include "Filters/Physics/DeformGeometry.h"
#include <algorithm>

namespace echorama {

// Tissue and gel as the probe has moved them.
struct SceneRun::Moved {
  std::unique_ptr<TissuePress> press;
  std::unique_ptr<GelMotion> gel;
  std::shared_ptr<const ProbeShape> shape;
  std::optional<LatticeMap> map;
  std::optional<TissueSurface> tissue; ///< what the probe presses, now
  std::optional<TimedPose> probe;
  std::size_t next = 0; ///< the view that comes next on a path
  double pressSeconds = 0.0, gelSeconds = 0.0;
};

namespace {

// Where probes press, with as much around as moves noticeably: some two widths of a face.
Eigen::AlignedBox3d PressedRegion(const SynthesisScene& scene, const ProbeGeometry& probe, const std::vector<SceneView>& views)
{
  Eigen::AlignedBox3d region;
  if (!scene.press)
    return region;
  const ProbeShape shape(probe, scene.press->head);
  const Eigen::Vector2d low = shape.Low(), high = shape.High();
  const double around = std::max(high.x() - low.x(), high.y() - low.y());
  const Eigen::AlignedBox3d box(Eigen::Vector3d(low.x() - around, low.y() - around, -around),
                                Eigen::Vector3d(high.x() + around, high.y() + around, 2.0 * around));
  const auto add = [&](const Pose& pose) {
    for (int corner = 0; corner < 8; ++corner)
      region.extend(pose * box.corner(static_cast<Eigen::AlignedBox3d::CornerType>(corner)));
  };
  for (const SceneView& view : views) {
    for (const SceneState& state : view.states)
      add(state.probe.pose);
    for (const TimedPose& moment : view.way)
      add(moment.pose);
  }
  return region;
}

} // namespace

SceneRun::~SceneRun() = default;

SceneRun::SceneRun(SynthesisScene scene, int landmarks, const MeshReader& readMesh, GelSurfacer surfacer,
                   const Progress& progress)
  : scene_(std::move(scene)), surfacer_(std::move(surfacer)), views_(ViewsOf(scene_)), parameters_(scene_.Parameters()),
    tissue_(std::make_unique<SceneTissue>(scene_, PressedRegion(scene_, parameters_.probe, views_), readMesh, notes_,
                                          progress.Part(0.0, 0.9)))
{
  if (scene_.press || scene_.gel)
    pressed_ = tissue_->InAll(static_cast<int>(views_.size()));
  if (scene_.press)
    body_ = TissueBodyOf(pressed_, scene_.press->lattice, progress.Part(0.9, 1.0));
  std::vector<Pose> poses;
  for (const SceneView& view : views_)
    poses.push_back(view.probeToWorld);
  for (const SceneItem& item : scene_.tissue)
    if (const auto* rig = std::get_if<CalibrationRigParameters>(&item.what))
      for (const Landmark& ball : CalibrationLandmarks(*rig))
        places_.push_back(ball);
  const std::vector<Landmark> shared = SharedPlaces(scene_.seed, landmarks, parameters_.probe, poses);
  places_.insert(places_.end(), shared.begin(), shared.end());
  if (!places_.empty() && std::any_of(views_.begin(), views_.end(), [](const SceneView& view) { return !view.steps.empty(); })) {
    notes_.push_back("no landmarks are listed: the probe moves while it sweeps, so that a place is not seen where it lies");
    places_.clear();
  }
}

bool SceneRun::Continues() const
{
  return !views_.front().way.empty();
}

bool SceneRun::BodiesComeAndGo() const
{
  return std::any_of(scene_.tissue.begin(), scene_.tissue.end(), [this](const SceneItem& item) {
    return item.firstView > 1 || item.lastView < static_cast<int>(views_.size());
  });
}

void SceneRun::Begin()
{
  moved_ = std::make_unique<Moved>();
  if (scene_.press) {
    moved_->press = std::make_unique<TissuePress>(body_, scene_.press->tissue);
    moved_->shape = std::make_shared<const ProbeShape>(parameters_.probe, scene_.press->head);
  }
}

TissueSurface SceneRun::Deformed(TissueSurface tissue)
{
  DeformGeometryParameters parameters;
  parameters.outside = DeformGeometryParameters::Outside::Nearest; // a surface ends beside its cells
  parameters.maskFolds = true;                                     // where there is no tissue
  std::vector<Eigen::Vector3d> points(tissue.points.size());
  std::transform(tissue.points.begin(), tissue.points.end(), points.begin(),
                 [](const Eigen::Vector3f& point) { return point.cast<double>().eval(); });
  std::vector<unsigned char> valid;
  const DeformReport report = DeformPoints(parameters, *moved_->map, points, valid);
  std::transform(points.begin(), points.end(), tissue.points.begin(),
                 [](const Eigen::Vector3d& point) { return point.cast<float>().eval(); });
  if (report.folded > 0) {
    const std::string note = "the displacement of the tissue folds where " + NumberText(report.folded) + " of " +
                             NumberText(report.count) + " points of its surfaces lie";
    if (std::find(notes_.begin(), notes_.end(), note) == notes_.end())
      notes_.push_back(note);
  }
  return tissue;
}

void SceneRun::Move(const TimedPose& probe, const Progress& progress)
{
  Moved& moved = *moved_;
  const double after = moved.press && scene_.gel ? 0.6 : scene_.gel ? 0.0 : 1.0;
  Clock::time_point start = Clock::now();
  if (moved.press) {
    moved.press->Move(moved.shape, probe.pose, progress.Part(0.0, after));
    moved.map.emplace(body_.nodes, moved.press->Displacements());
    if (scene_.gel)
      moved.tissue = Deformed(pressed_);
    moved.pressSeconds += SecondsSince(start);
  }
  start = Clock::now();
  if (scene_.gel) {
    const ProbeHead head = scene_.press ? scene_.press->head : ProbeHead();
    const double seconds = moved.probe ? probe.time - moved.probe->time : 0.0;
    if (!moved.gel)
      moved.gel = std::make_unique<GelMotion>(pressed_, PlacedProbe{parameters_.probe, probe.pose}, head, scene_.gel->material,
                                              scene_.gel->coat);
    moved.gel->Move(probe.pose, seconds, moved.tissue ? &*moved.tissue : nullptr, progress.Part(after, 1.0));
    moved.gelSeconds += SecondsSince(start);
  }
  moved.probe = probe;
}

// Moves tissue and gel through a view; its states are made on the way where \a scan is wanted.
void SceneRun::Drive(std::size_t number, SceneScan& scan, const Progress& progress)
{
  const SceneView& view = views_[number];
  std::vector<TimedPose> way;
  if (Continues())
    way = view.way;
  else
    for (const SceneState& state : view.states)
      way.push_back(state.probe);
  const bool moves = scene_.press || scene_.gel;
  const double pieces = static_cast<double>(way.size()) + static_cast<double>(view.states.size());
  double done = 0.0;
  std::size_t state = 0;
  for (const TimedPose& probe : way) {
    if (moves)
      Move(probe, progress.Part(done / pieces, (done + 1.0) / pieces));
    done += 1.0;
    if (state < view.states.size() && probe.time == view.states[state].probe.time) {
      Scan(number, state, scan, progress.Part(done / pieces, (done + 1.0) / pieces));
      ++state;
      done += 1.0;
    }
  }
}

void SceneRun::Scan(std::size_t number, std::size_t index, SceneScan& scan, const Progress& progress)
{
  const SceneView& view = views_[number];
  const SceneState& state = view.states[index];
  const bool isMiddle = index == view.states.size() / 2;
  SynthesisParameters p = scan.parameters;
  p.firstStep = state.firstStep;
  p.lastStep = state.lastStep;

  // What sound meets.
  std::optional<AcousticScene> ownScene;
  const AcousticScene* acoustic = acoustic_.get();
  if (!acoustic) {
    TissueSurface tissue;
    if (moved_ && moved_->tissue && !BodiesComeAndGo())
      tissue = *moved_->tissue; // the gel has met it already
    else {
      tissue = tissue_->In(static_cast<int>(number) + 1);
      if (moved_ && moved_->press)
        tissue = Deformed(std::move(tissue));
    }
    if (moved_ && moved_->press)
      p.displacement = DisplacementField::Interpolating(body_.nodes, moved_->press->Displacements());
    if (moved_ && moved_->gel) {
      const Clock::time_point start = Clock::now();
      GelCoat coat = moved_->gel->Look(view.states.size() == 1 && view.steps.empty() && !Continues(), progress.Part(0.0, 0.1));
      TissueSurface gel = surfacer_(coat, scene_.MaterialOf("gel"), scene_.MaterialOf(scene_.background));
      TissueSurface all = gel;
      all.Append(tissue);
      tissue = std::move(all);
      moved_->gelSeconds += SecondsSince(start);
      if (isMiddle) {
        scan.gel = std::move(coat);
        scan.gelSurface = std::move(gel);
      }
    }
    if (scene_.change.ribShare > 0.0 && number > 0)
      AddRib(tissue, p.probe, view.probeToWorld, scene_.change.ribShare);
    ownScene.emplace(tissue, progress.Part(0.1, 0.15));
    acoustic = &*ownScene;
    if (isMiddle)
      scan.tissue = std::move(tissue);
  }

  SynthesisCost cost;
  const Volume<unsigned char> made = SynthesizeBeams(*acoustic, p, progress.Part(0.15, 1.0), &cost);
  const std::array<int, 3> size = p.BeamDimensions();
  if (scan.beams.View().Size() == 0)
    scan.beams = Volume<unsigned char>(size);
  const std::ptrdiff_t plane = static_cast<std::ptrdiff_t>(size[0]) * size[1];
  std::copy(made.View().begin() + plane * p.firstStep, made.View().begin() + plane * (p.LastStep() + 1),
            scan.beams.View().begin() + plane * p.firstStep);
  scan.cost += cost;

  if (isMiddle) {
    if (moved_ && moved_->press)
      scan.pressed = moved_->press->Now();
    for (const Landmark& place : places_) {
      const Eigen::Vector3d now = place.position + p.displacement.At(place.position);
      if (BeamPointAt(p.probe, view.probeToWorld.inverse() * now))
        scan.landmarks.push_back({place.label, now});
    }
  }
}

SceneScan SceneRun::Make(std::size_t number, const Progress& progress)
{
  if (number >= views_.size())
    throw Error(Error::Kind::InvalidParameter,
                "there is no view " + std::to_string(number + 1) + "; the scene has " + std::to_string(views_.size()));
  try {
    const bool changes = scene_.press || scene_.gel || scene_.change.ribShare > 0.0 || BodiesComeAndGo();
    if (!changes && !acoustic_)
      acoustic_ = std::make_unique<const AcousticScene>(tissue_->All(), progress.Part(0.0, 0.05));
    const bool continues = Continues();
    if ((scene_.press || scene_.gel) && (!continues || !moved_ || moved_->next > number))
      Begin();
    // Views that were left out are passed all the same.
    std::size_t first = continues ? moved_->next : number;
    const double count = static_cast<double>(number - first + 1);
    std::vector<TimedPose> passed;
    for (; continues && first < number; ++first)
      passed.insert(passed.end(), views_[first].way.begin(), views_[first].way.end());
    const double begin = std::max(0.05, 1.0 - 1.0 / count), moments = static_cast<double>(passed.size());
    for (std::size_t n = 0; n < passed.size(); ++n)
      Move(passed[n], progress.Part(begin * static_cast<double>(n) / moments, begin * static_cast<double>(n + 1) / moments));
    SceneScan scan;
    scan.parameters = parameters_;
    SynthesisParameters& p = scan.parameters;
    p.probeToWorld = views_[number].probeToWorld;
    p.stepPoses = views_[number].steps;
    p.receiver.noiseSeed = scene_.receiver.noiseSeed + number;
    if (number % 2 == 1)
      p.receiver.gainDb += scene_.change.gainDb;
    p.decorrelation = scene_.change.decorrelation;
    p.changeSeed = number + 1;
    if (moved_)
      moved_->pressSeconds = moved_->gelSeconds = 0.0;
    Drive(number, scan, progress.Part(begin, 1.0));
    if (moved_) {
      moved_->next = number + 1;
      scan.pressSeconds = moved_->pressSeconds;
      scan.gelSeconds = moved_->gelSeconds;
    }
    return scan;
  } catch (const Error& error) {
    moved_.reset(); // it may be anywhere
    if (error.GetKind() == Error::Kind::Cancelled)
      throw;
    throw Error(error.GetKind(), "view " + std::to_string(number + 1) + ": " + error.what());
  }
}

} // namespace echorama
