// SPDX-License-Identifier: BSD-3-Clause
#include "vtkUltrasoundAligner.h"

#include "Core/Base/Json.h"
#include "Core/Imaging/ShadowMap.h"
#include "vtkImageData.h"
#include "vtkMatrix4x4.h"
#include "vtkNew.h"
#include "vtkObjectFactory.h"
#include "vtkUltrasoundAcquisition.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>

vtkStandardNewMacro(vtkUltrasoundAligner);

namespace {
using RowMajor = Eigen::Matrix<double, 4, 4, Eigen::RowMajor>;

// A volume at falling resolution, and how much its voxels count.
struct Prepared {
  std::vector<echorama::PyramidLevel> Pyramid, Reliability;
};

Prepared Prepare(const vtkUltrasoundVolume::Input& volume, bool withReliability, const echorama::Progress& progress)
{
  Prepared prepared;
  vtkUltrasoundVolume::Dispatch(volume.Intensity, [&](auto type) {
    const auto posed = vtkUltrasoundVolume::PosedVolumeOf<decltype(type)>(volume);
    prepared.Pyramid = echorama::BuildPyramid(posed, {}, progress.Part(0.0, 0.3));
    if (withReliability && prepared.Pyramid.front().realVoxels > 0) {
      const auto geometry = vtkUltrasoundAcquisition::ProbeGeometryOf(volume.Image);
      const auto pose = vtkUltrasoundAcquisition::ProbeToWorldOf(volume.Image);
      const auto probe = geometry && pose ? std::optional(echorama::PlacedProbe{*geometry, *pose}) : echorama::FindProbe(posed);
      const auto reliability = echorama::ReliabilityMap(posed, probe, {}, progress.Part(0.3, 0.8));
      prepared.Reliability = echorama::BuildPyramid(echorama::PosedVolume<float>{reliability.View(), posed.valid, posed.geometry},
                                                    {}, progress.Part(0.8, 1.0));
    }
  });
  return prepared;
}

nlohmann::ordered_json JsonOf(const echorama::Information& matrix)
{
  auto rows = nlohmann::ordered_json::array();
  for (int r = 0; r < 6; ++r) {
    rows.push_back(std::vector<double>{matrix(r, 0), matrix(r, 1), matrix(r, 2), matrix(r, 3), matrix(r, 4), matrix(r, 5)});
  }
  return rows;
}
} // namespace

//----------------------------------------------------------------------------
vtkUltrasoundAligner::vtkUltrasoundAligner()
{
  const echorama::AlignPairParameters pair;
  this->Start = echorama::NameOf(pair.start);
  this->Metric = pair.metric;
  this->Candidates = pair.candidates;
  this->FinestMm = pair.finestMm;
  this->MinimumSimilarity = pair.minimumSimilarity;
  this->MinimumPeakRatio = pair.minimumPeakRatio;
  this->MaximumErrorVoxels = pair.maximumErrorVoxels;
  this->MaximumSplitVoxels = pair.maximumSplitVoxels;
  this->Seed = static_cast<int>(pair.seed);
}

//----------------------------------------------------------------------------
vtkUltrasoundAligner::~vtkUltrasoundAligner() = default;

//----------------------------------------------------------------------------
bool vtkUltrasoundAligner::Choose(std::string& choice, const char* name, const char* what, const std::vector<std::string>& names)
{
  if (!name || std::find(names.begin(), names.end(), name) == names.end()) {
    std::string list;
    for (const std::string& one : names) {
      list += (list.empty() ? "" : ", ") + one;
    }
    vtkErrorMacro("there is no " << what << " named \"" << (name ? name : "") << "\"; there are: " << list);
    return false;
  }
  if (choice != name) {
    choice = name;
    this->Modified();
  }
  return true;
}

//----------------------------------------------------------------------------
void vtkUltrasoundAligner::AddHeldVolume(int volume)
{
  this->HeldVolumes.push_back(volume);
  this->Modified();
}

//----------------------------------------------------------------------------
void vtkUltrasoundAligner::ClearHeldVolumes()
{
  if (!this->HeldVolumes.empty()) {
    this->HeldVolumes.clear();
    this->Modified();
  }
}

//----------------------------------------------------------------------------
int vtkUltrasoundAligner::GetNumberOfHeldVolumes() const
{
  return static_cast<int>(this->HeldVolumes.size());
}

//----------------------------------------------------------------------------
void vtkUltrasoundAligner::SetStart(const char* name)
{
  this->Choose(this->Start, name, "start", echorama::AlignStartNames());
}

//----------------------------------------------------------------------------
void vtkUltrasoundAligner::SetMetric(const char* name)
{
  this->Choose(this->Metric, name, "metric", echorama::MetricNames());
}

//----------------------------------------------------------------------------
const char* vtkUltrasoundAligner::GetStart() const
{
  return this->Start.c_str();
}

//----------------------------------------------------------------------------
const char* vtkUltrasoundAligner::GetMetric() const
{
  return this->Metric.c_str();
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAligner::SetParameter(const char* name, double value)
{
  using Self = vtkUltrasoundAligner;
  struct Parameter {
    const char* Name;
    double From, To;
    void (Self::*SetReal)(double);
    void (Self::*SetWhole)(int);
    void (Self::*SetSwitch)(bool);
  };
  static const Parameter parameters[] = {
      {"MinimumOverlap", 0.01, 1.0, &Self::SetMinimumOverlap, nullptr, nullptr},
      {"Candidates", 1, 1000, nullptr, &Self::SetCandidates, nullptr},
      {"FinestMm", 0.0, 1000.0, &Self::SetFinestMm, nullptr, nullptr},
      {"UseReliability", 0, 1, nullptr, nullptr, &Self::SetUseReliability},
      {"MinimumSimilarity", 0.0, 1.0, &Self::SetMinimumSimilarity, nullptr, nullptr},
      {"MinimumPeakRatio", 1.0, 99.0, &Self::SetMinimumPeakRatio, nullptr, nullptr},
      {"MaximumErrorVoxels", 1e-3, 1000.0, &Self::SetMaximumErrorVoxels, nullptr, nullptr},
      {"MaximumSplitVoxels", 1e-3, 1000.0, &Self::SetMaximumSplitVoxels, nullptr, nullptr},
      {"Points", 1000, 1e7, nullptr, &Self::SetPoints, nullptr},
      {"Seed", 0, VTK_INT_MAX, nullptr, &Self::SetSeed, nullptr},
  };
  std::string names;
  for (const Parameter& p : parameters) {
    names += (names.empty() ? "" : ", ") + std::string(p.Name);
    if (!name || std::strcmp(name, p.Name) != 0) {
      continue;
    }
    if (!(value >= p.From && value <= p.To) || (!p.SetReal && value != std::floor(value))) {
      vtkErrorMacro(<< p.Name << " must be " << (p.SetReal ? "a number" : "a whole number") << " in [" << p.From << ", " << p.To
                    << "]; it is " << value);
      return false;
    }
    if (p.SetReal) {
      (this->*p.SetReal)(value);
    } else if (p.SetWhole) {
      (this->*p.SetWhole)(static_cast<int>(value));
    } else {
      (this->*p.SetSwitch)(value != 0.0);
    }
    return true;
  }
  vtkErrorMacro("there is no parameter named \"" << (name ? name : "") << "\"; there are: " << names);
  return false;
}

//----------------------------------------------------------------------------
echorama::AlignVolumesParameters vtkUltrasoundAligner::Parameters() const
{
  echorama::AlignVolumesParameters p;
  p.held = this->HeldVolumes;
  p.pair.start = echorama::AlignStartOf(this->Start);
  p.pair.metric = this->Metric;
  p.pair.minimumOverlap = this->MinimumOverlap > 0.0 ? this->MinimumOverlap : p.pair.minimumOverlap;
  p.pair.candidates = this->Candidates;
  p.pair.finestMm = this->FinestMm;
  p.pair.points = this->Points > 0 ? this->Points : p.pair.points;
  p.pair.minimumSimilarity = this->MinimumSimilarity;
  p.pair.minimumPeakRatio = this->MinimumPeakRatio;
  p.pair.maximumErrorVoxels = this->MaximumErrorVoxels;
  p.pair.maximumSplitVoxels = this->MaximumSplitVoxels;
  p.pair.seed = static_cast<std::uint64_t>(this->Seed);
  return p;
}

//----------------------------------------------------------------------------
std::vector<vtkUltrasoundAligner::Result> vtkUltrasoundAligner::AlignAll(const std::vector<echorama::PlacedVolume>& volumes,
                                                                         double prepareSeconds,
                                                                         const echorama::Progress& progress)
{
  const auto found = echorama::AlignVolumes(volumes, this->FixedVolume, this->Parameters(), progress);
  std::vector<Result> results;
  auto ofVolumes = nlohmann::ordered_json::array(), ofPairs = nlohmann::ordered_json::array();
  for (const auto& volume : found.volumes) {
    Result result;
    result.VolumeToWorld = volume.volumeToWorld;
    result.Similarity = volume.similarity;
    result.Overlap = volume.overlap;
    result.Verdict = echorama::NameOf(volume.verdict);
    result.Reason = volume.reason;
    result.Centre = volume.centre;
    // What nothing is known of is 1 km off.
    constexpr double radiusMm = 100.0;
    if (static_cast<int>(results.size()) != this->FixedVolume) {
      result.Covariance = echorama::CovarianceOf(volume.information, radiusMm);
    }
    ofVolumes.push_back({{"name", volumes[results.size()].name},
                         {"verdict", result.Verdict},
                         {"reason", result.Reason},
                         {"similarity", result.Similarity},
                         {"overlap", result.Overlap},
                         {"centre", {result.Centre.x(), result.Centre.y(), result.Centre.z()}},
                         {"covariance", JsonOf(result.Covariance)}});
    results.push_back(result);
  }
  for (const auto& pair : found.pairs) {
    const auto& a = pair.alignment;
    ofPairs.push_back(
        {{"fixed", pair.fixed},
         {"moving", pair.moving},
         {"verdict", echorama::NameOf(pair.verdict)},
         {"reason", pair.reason},
         {"score", a.score},
         {"similarity", a.similarity},
         {"overlap", a.overlap},
         {"peak_ratio", a.peakRatio},
         {"split_mm", a.splitMm},
         {"error_mm", a.errorMm},
         {"voted_down", pair.votedDown},
         {"stands", pair.stands},
         {"attempts", pair.attempts},
         {"residual_mm", pair.residualMm},
         {"anywhere", a.anywhere},
         {"seconds", {{"global", a.globalSeconds}, {"local", a.localSeconds}, {"confidence", a.confidenceSeconds}}}});
  }
  this->Report =
      nlohmann::ordered_json{
          {"volumes", ofVolumes},
          {"pairs", ofPairs},
          {"seconds",
           {{"prepare", prepareSeconds + found.featureSeconds}, {"pairs", found.pairSeconds}, {"graph", found.graphSeconds}}}}
          .dump();
  return results;
}

//----------------------------------------------------------------------------
void vtkUltrasoundAligner::Execute(vtkInformationVector** inputs, vtkInformationVector* outputs,
                                   const echorama::Progress& progress)
{
  this->Results.clear();
  this->Report.clear();
  const auto volumes = vtkUltrasoundVolume::CollectInputs(this, inputs[0]);
  this->Parameters().pair.Check();

  // 1. the resolutions of each volume
  const auto begin = std::chrono::steady_clock::now();
  std::vector<Prepared> prepared;
  std::vector<echorama::PlacedVolume> placed(volumes.size());
  for (std::size_t i = 0; i < volumes.size(); ++i) {
    const double count = static_cast<double>(volumes.size());
    prepared.push_back(Prepare(volumes[i], this->UseReliability,
                               progress.Part(0.1 * static_cast<double>(i) / count, 0.1 * static_cast<double>(i + 1) / count)));
  }
  for (std::size_t i = 0; i < volumes.size(); ++i) {
    placed[i].pyramid = &prepared[i].Pyramid;
    placed[i].reliability = prepared[i].Reliability.empty() ? nullptr : &prepared[i].Reliability;
    placed[i].name = volumes[i].Name;
  }
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - begin;

  // 2. where they belong
  const auto results = this->AlignAll(placed, seconds.count(), progress.Part(0.1, 1.0));

  // 3. the same voxels there
  for (std::size_t i = 0; i < volumes.size(); ++i) {
    const Result& result = results[i];
    vtkNew<vtkImageData> moved;
    moved->ShallowCopy(volumes[i].Image);
    if (static_cast<int>(i) != this->FixedVolume) {
      vtkUltrasoundVolume::Move(moved, result.VolumeToWorld);
      vtkUltrasoundVolume::AddField(moved, AlignmentOverlapName(), &result.Overlap, 1);
    }
    const RowMajor rows = result.VolumeToWorld.matrix();
    vtkUltrasoundVolume::AddField(moved, VolumeToWorldName(), rows.data(), 16);
    vtkUltrasoundVolume::AddField(moved, AlignmentVerdictName(), result.Verdict);
    vtkUltrasoundVolume::AddField(moved, AlignmentReasonName(), result.Reason);
    vtkUltrasoundVolume::AddField(moved, AlignmentSimilarityName(), &result.Similarity, 1);
    vtkUltrasoundVolume::AddField(moved, AlignmentCovarianceName(), result.Covariance.data(), 36); // symmetric: rows are columns
    vtkUltrasoundVolume::AddField(moved, AlignmentCentreName(), result.Centre.data(), 3);
    PutBlock(outputs, 0, i, moved, volumes[i].Name);
  }
  this->Results = results;
}

//----------------------------------------------------------------------------
const vtkUltrasoundAligner::Result* vtkUltrasoundAligner::ResultOf(int volume) const
{
  return volume >= 0 && volume < this->GetNumberOfVolumes() ? &this->Results[static_cast<std::size_t>(volume)] : nullptr;
}

//----------------------------------------------------------------------------
int vtkUltrasoundAligner::GetNumberOfVolumes() const
{
  return static_cast<int>(this->Results.size());
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAligner::GetPose(int volume, vtkMatrix4x4* pose) const
{
  const auto* result = this->ResultOf(volume);
  if (result) {
    const RowMajor rows = result->VolumeToWorld.matrix();
    pose->DeepCopy(rows.data());
  }
  return result != nullptr;
}

//----------------------------------------------------------------------------
double vtkUltrasoundAligner::GetOverlap(int volume) const
{
  const auto* result = this->ResultOf(volume);
  return result ? result->Overlap : 0.0;
}

//----------------------------------------------------------------------------
void vtkUltrasoundAligner::SetPoints(int points)
{
  points = points < 1 ? 0 : std::clamp(points, 1000, 10000000);
  if (points != this->Points) {
    this->Points = points;
    this->Modified();
  }
}

//----------------------------------------------------------------------------
double vtkUltrasoundAligner::GetSimilarity(int volume) const
{
  const auto* result = this->ResultOf(volume);
  return result ? result->Similarity : 0.0;
}

//----------------------------------------------------------------------------
std::string vtkUltrasoundAligner::GetVerdict(int volume) const
{
  const auto* result = this->ResultOf(volume);
  return result ? result->Verdict : std::string();
}

//----------------------------------------------------------------------------
std::string vtkUltrasoundAligner::GetReason(int volume) const
{
  const auto* result = this->ResultOf(volume);
  return result ? result->Reason : std::string();
}

//----------------------------------------------------------------------------
bool vtkUltrasoundAligner::GetAllAligned() const
{
  const std::string aligned = echorama::NameOf(echorama::Verdict::Aligned);
  return !this->Results.empty() && std::all_of(this->Results.begin(), this->Results.end(),
                                               [&aligned](const Result& result) { return result.Verdict == aligned; });
}

//----------------------------------------------------------------------------
void vtkUltrasoundAligner::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "FixedVolume: " << this->FixedVolume << "\n";
  os << indent << "HeldVolumes: " << this->HeldVolumes.size() << "\n";
  os << indent << "Start: " << this->Start << "\n";
  os << indent << "Metric: " << this->Metric << "\n";
  os << indent << "UseReliability: " << (this->UseReliability ? "on" : "off") << "\n";
  os << indent << "Candidates: " << this->Candidates << "\n";
  os << indent << "FinestMm: " << this->FinestMm << "\n";
  os << indent << "MinimumSimilarity: " << this->MinimumSimilarity << "\n";
  os << indent << "MinimumPeakRatio: " << this->MinimumPeakRatio << "\n";
  os << indent << "MaximumErrorVoxels: " << this->MaximumErrorVoxels << "\n";
  os << indent << "MaximumSplitVoxels: " << this->MaximumSplitVoxels << "\n";
  os << indent << "MinimumOverlap: " << this->MinimumOverlap << "\n";
  os << indent << "Points: " << this->Points << "\n";
  os << indent << "Seed: " << this->Seed << "\n";
  os << indent << "Volumes: " << this->Results.size() << "\n";
}
