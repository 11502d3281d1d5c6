// SPDX-License-Identifier: BSD-3-Clause
// Lights that are known, with the phase of their code, explain spots. Those that are near each other do so together: all ways to
// give their spots to them are compared by where the spots are and how bright; a cost is a squared number of standard deviations.
//
// The light of two in one spot is as bright as both codes say, its middle the mean of both places, weighted by brightness; that
// is a measurement of both, so the filters of all lights are one, with covariances between them. As the weights change from frame
// to frame by the code, both places stay known, and so does who is who, while the spots are one. Where two ways explain a frame
// nearly as well, only what both have in common is believed: the middle of all of it, or nothing. What is brighter or longer than
// it should be has somebody else in it.
//
// Lights that met may have turned back, however fast they were. So they are not claimed until what they show since then has told
// them apart.
#include "SpotTracks.h"
#include <algorithm>
#include <cmath>
#include <Eigen/LU>
#include <tuple>

namespace echorama {

namespace {

constexpr double DarkShare = 0.1;  // less than this of the exposure is off
constexpr double Confusion = 6.0;  // as Doubt, where other lights or spots would be involved
constexpr double Rival = 4.0;      // the same, where it may be nobody's
constexpr double Unexpected = 9.0; // what it costs: a spot of a light that is off,
constexpr double Missing = 9.0;    // a light that is on and has no spot,
constexpr double Unseen = 3.0;     // what is nobody's, and there is no spot for it,
constexpr double Leftover = 9.0;   // a spot near lights that is none of theirs,
constexpr double Split = 6.0;      // spots that are together the light of several, but each nobody's
constexpr double Strange = 6.0;    // a brightness that is none of the light's; no more where it is alone and may change
constexpr double ToldApart = 12.0; // by how much brightness tells two lights from each other
constexpr double OwnChange = 0.15, ShareError = 0.07; // of brightness: what a light may change, what its share may be wrong by
constexpr double MergedReach = 3.2;  // standard deviations of their light, from each other: further apart two are not one
constexpr std::size_t SpotLimit = 6; // of spots that lights explain together

} // namespace

// Lights that are so near each other that their spots may be one, and how they may explain spots.
struct SpotTracks::Company {
  std::vector<Track*> lights;
  std::vector<double> least, most; // of the exposure, in which each is on, as well as the phase is known
  std::vector<double> shiftError;
  std::vector<double> shift; // how far a rolling shutter that sees it being switched shifts its spot along y, px
  std::vector<std::size_t> spots;
  bool isAlone = false; // one light, and nothing else near it
};

void SpotTracks::ExplainByLights(double time, const std::vector<Spot>& spots, std::vector<bool>& taken)
{
  std::vector<Track*> lights;
  for (Track& track : tracks_)
    if (track.light >= 0) {
      Move(track, MiddleOf(time, track.state.y()));
      lights.push_back(&track);
    }
  const auto areNear = [this](Track& a, Track& b) {
    const Eigen::Vector2d off = a.state.head<2>() - b.state.head<2>();
    const double doubt = SpreadOf({{&a, 1.0}, {&b, -1.0}}).trace();
    return off.norm() < 2.5 * (a.spot.size + b.spot.size) + 3.0 * std::sqrt(0.5 * std::max(doubt, 0.0));
  };
  std::vector<bool> done(lights.size(), false);
  for (std::size_t first = 0; first < lights.size(); ++first) {
    if (done[first])
      continue;
    Company company;
    company.lights.push_back(lights[first]);
    done[first] = true;
    for (std::size_t member = 0; member < company.lights.size(); ++member)
      for (std::size_t i = 0; i < lights.size(); ++i)
        if (!done[i] && areNear(*company.lights[member], *lights[i])) {
          done[i] = true;
          company.lights.push_back(lights[i]);
        }
    ExplainBy(company, time, spots, taken);
  }
}

double SpotTracks::VarianceOf(const Track& light)
{
  return light.amplitude * light.amplitude * (std::pow(OwnChange * light.share, 2) + std::pow(light.shareError, 2));
}

// Lights that came so near each other that each may have gone on as the other are told apart by what they show since then: where
// each is as bright as its own code says, not as the other's does.
void SpotTracks::TellApart()
{
  for (Track& a : tracks_)
    for (Track& b : tracks_) {
      if (a.light < 0 || b.light <= a.light)
        continue;
      double& evidence = Evidence(a.light, b.light);
      if (!(evidence < HUGE_VAL) || !std::isfinite(a.newest) || !std::isfinite(b.newest))
        continue;
      const auto strange = [](const Track& light, double brightness) {
        return std::pow(brightness - light.amplitude * light.share, 2) / VarianceOf(light);
      };
      evidence += strange(b, a.newest) + strange(a, b.newest) - strange(a, a.newest) - strange(b, b.newest);
      if (evidence > ToldApart)
        evidence = HUGE_VAL;
      else if (evidence < -ToldApart) {
        statistics_.revoked += 2;
        Release(a);
        Release(b);
        break;
      }
    }
}

bool SpotTracks::IsToldApart(const Track& track) const
{
  return std::none_of(tracks_.begin(), tracks_.end(), [&](const Track& other) {
    return other.light >= 0 && other.light != track.light &&
           evidence_[static_cast<std::size_t>(std::min(track.light, other.light) * code_.Lights() +
                                              std::max(track.light, other.light))] < HUGE_VAL;
  });
}

double& SpotTracks::Evidence(int light, int other)
{
  return evidence_[static_cast<std::size_t>(std::min(light, other) * code_.Lights() + std::max(light, other))];
}

void SpotTracks::ExplainBy(Company& company, double time, const std::vector<Spot>& spots, std::vector<bool>& taken)
{
  const std::size_t count = company.lights.size();
  for (Track* light : company.lights) {
    const double row = light->state.y(), share = ExpectedShare(*light, time, row), size = light->spot.size;
    const double margin = parameters_.triggered ? 0.0 : PhaseError;
    const double earlier = ExpectedShare(*light, time, row, -margin), later = ExpectedShare(*light, time, row, margin);
    const auto slopeAt = [&](double slots) {
      return 0.5 * (ExpectedShare(*light, time, row + 1.0, slots) - ExpectedShare(*light, time, row - 1.0, slots));
    };
    const double slope = slopeAt(0.0),
                 steepest = std::max({std::abs(slope), std::abs(slopeAt(-margin)), std::abs(slopeAt(margin))});
    company.least.push_back(std::min({share, earlier, later}));
    company.most.push_back(std::max({share, earlier, later}));
    // Of a bell times an exponential function; as well as the share is known.
    company.shift.push_back(std::clamp(size * size * slope / std::max(share, 0.05), -size, size));
    company.shiftError.push_back(std::min(size * size * steepest / std::max(company.least.back(), 0.05), size));
    light->share = share;
    light->shareError = ShareError + 0.5 * (company.most.back() - company.least.back());
    light->newest = std::nan("");
  }
  for (std::size_t s = 0; s < spots.size() && company.spots.size() < SpotLimit; ++s) {
    const bool isNear = std::any_of(company.lights.begin(), company.lights.end(), [&](const Track* light) {
      const double sigma = std::sqrt(light->covariance.topLeftCorner<2, 2>().trace() + spots[s].covariance.trace());
      const double when = MiddleOf(time, spots[s].position.y());
      return (spots[s].position - light->state.head<2>()).norm() <
                 3.5 * sigma + 2.0 + (count > 1 ? 2.5 * light->spot.size : 0.0) &&
             (spots[s].position - light->spot.position).norm() < parameters_.maximumSpeed * (when - light->lastSeen) + 2.0;
    });
    if (!taken[s] && isNear)
      company.spots.push_back(s);
  }
  company.isAlone =
      count == 1 && company.spots.size() < 2 && std::none_of(tracks_.begin(), tracks_.end(), [&](const Track& track) {
        return track.light < 0 &&
               (track.state.head<2>() - company.lights[0]->state.head<2>()).norm() < 5.0 * company.lights[0]->spot.size;
      });

  std::vector<double> rivals(company.spots.size(), HUGE_VAL); // squared distances of spots from what is nobody's
  for (const Track& track : tracks_)
    for (std::size_t k = 0; track.light < 0 && k < company.spots.size(); ++k)
      rivals[k] = std::min(rivals[k], DistanceFrom(track, spots[company.spots[k]], time));

  // What a set of lights, by bits, makes of a set of spots.
  struct Sum {
    Eigen::Vector2d place = Eigen::Vector2d::Zero();
    Eigen::Matrix2d noise = Eigen::Matrix2d::Zero();
    double brightness = 0.0;
  };
  const auto sumOf = [&](unsigned set) {
    Sum sum;
    for (std::size_t k = 0; k < company.spots.size(); ++k)
      if (set >> k & 1u) {
        const Spot& spot = spots[company.spots[k]];
        sum.place += spot.Brightness() * spot.position;
        sum.noise += spot.Brightness() * spot.covariance;
        sum.brightness += spot.Brightness();
      }
    sum.place /= sum.brightness;
    sum.noise /= sum.brightness;
    return sum;
  };
  const auto partsOf = [&](unsigned lights) {
    std::vector<Part> parts;
    double total = 0.0;
    for (std::size_t i = 0; i < count; ++i)
      if (lights >> i & 1u) {
        parts.push_back({company.lights[i], company.lights[i]->amplitude * std::max(company.lights[i]->share, 0.05)});
        total += parts.back().weight;
      }
    for (Part& part : parts)
      part.weight /= total;
    return parts;
  };
  // What a set of lights makes of a set of spots.
  struct Fit {
    std::vector<Part> parts;
    Sum sum;
    Eigen::Matrix2d noise;
    bool isShared;  // several make it, or there is light in it that is none of theirs
    double strange; // how much of it that is
    double cost;
  };
  const auto fitOf = [&](unsigned lights, unsigned spotSet) {
    Fit fit{partsOf(lights), sumOf(spotSet), Eigen::Matrix2d::Zero(), false, 0.0, 0.0};
    const bool isOneSpot = (spotSet & (spotSet - 1u)) == 0;
    double expected = 0.0, variance = 0.0, widest = 0.0, size = 0.0;
    auto part = fit.parts.begin();
    for (std::size_t i = 0; i < count; ++i) {
      if (!(lights >> i & 1u))
        continue;
      const double shift = part->weight * company.shift[i];
      fit.sum.place.y() -= shift;
      fit.sum.noise(1, 1) += std::pow(part->weight * company.shiftError[i], 2);
      ++part;
      Track& light = *company.lights[i];
      expected += light.amplitude * light.share;
      variance += VarianceOf(light);
      fit.cost += company.most[i] < DarkShare ? Unexpected : 0.0;
      size = std::max(size, light.spot.size);
      for (std::size_t j = 0; j < i; ++j) {
        if (!(lights >> j & 1u))
          continue;
        Track& other = *company.lights[j];
        const double apart = (light.state.head<2>() - other.state.head<2>()).norm();
        const double doubt = std::sqrt(0.5 * std::max(SpreadOf({{&light, 1.0}, {&other, -1.0}}).trace(), 0.0));
        widest = std::max(widest, apart);
        const double tooFar = apart - MergedReach * std::max(light.spot.size, other.spot.size);
        if (isOneSpot && tooFar > 0.0) // then one of them is not where it is expected
          fit.cost += std::pow(tooFar / std::max(doubt, 0.1), 2);
      }
    }
    Eigen::Vector2d off = fit.sum.place;
    for (const Part& p : fit.parts)
      off -= p.weight * p.track->state.head<2>();
    const double excess = fit.sum.brightness - expected, strange = excess * excess / variance;
    double place = ModelSigma * ModelSigma;
    if (fit.parts.size() > 1 || !isOneSpot) { // none of them is quite round, none of the weights quite known
      place += std::pow(0.05 * size, 2) + std::pow(0.07 * widest, 2);
      fit.isShared = true;
    }
    if (excess > 0.0 && strange > Strange) { // somebody else is in it, and draws its middle towards itself
      fit.strange = excess / fit.sum.brightness;
      place += std::pow(fit.strange * size, 2);
      fit.isShared = true;
    }
    if (fit.parts.size() == 1 && isOneSpot) {
      const Track& light = *fit.parts.front().track;
      const Spot& spot = spots[company.spots[static_cast<std::size_t>(std::log2(spotSet))]];
      const double longer = LongerThan(light, spot, 2.0);
      place += std::pow(LongerThan(light, spot, 0.0) * size, 2);
      fit.strange = std::max(fit.strange, longer);
      fit.isShared = fit.isShared || longer > 0.0;
    }
    fit.noise = fit.sum.noise + Eigen::Matrix2d::Identity() * place;
    const Eigen::Matrix2d spread = SpreadOf(fit.parts) + fit.noise + Eigen::Matrix2d::Identity() * 0.04;
    const double distance = off.dot(spread.inverse() * off);
    fit.cost += distance > Gate ? HUGE_VAL : distance + (company.isAlone ? std::min(strange, Strange) : strange);
    return fit;
  };

  // All ways to give each light one spot, or none.
  const std::size_t spotCount = company.spots.size();
  std::vector<std::vector<double>> costs(spotCount, std::vector<double>(1u << count, -1.0)); // of lights in a spot, once known
  struct Way {
    std::vector<int> spotOf;
    double cost;
  };
  std::vector<Way> ways;
  std::vector<int> choice(count, -1);
  for (;;) {
    Way way{choice, 0.0};
    std::vector<unsigned> lightsIn(spotCount, 0u);
    for (std::size_t i = 0; i < count; ++i) {
      if (choice[i] >= 0)
        lightsIn[static_cast<std::size_t>(choice[i])] |= 1u << i;
      else if (company.least[i] >= DarkShare)
        way.cost += Missing * std::min(1.0, 2.0 * company.least[i]);
    }
    for (std::size_t k = 0; k < spotCount; ++k) {
      if (lightsIn[k] == 0) {
        way.cost += std::min(Leftover, rivals[k]);
        continue;
      }
      way.cost += rivals[k] < Gate ? Unseen : 0.0;
      double& cost = costs[k][lightsIn[k]];
      if (cost < 0.0)
        cost = fitOf(lightsIn[k], 1u << k).cost;
      way.cost += cost;
    }
    if (way.cost < HUGE_VAL)
      ways.push_back(way);
    std::size_t i = 0;
    while (i < count && ++choice[i] == static_cast<int>(spotCount))
      choice[i++] = -1;
    if (i == count)
      break;
  }
  const Way best = *std::min_element(ways.begin(), ways.end(), [](const Way& a, const Way& b) { return a.cost < b.cost; });

  // Lights and spots of which only the sum is believed; lights of which nothing is.
  unsigned together = 0, ofSpots = 0, unsure = 0, on = 0;
  for (std::size_t i = 0; i < count; ++i)
    on |= company.most[i] >= DarkShare ? 1u << i : 0u;
  if ((on & (on - 1u)) != 0 && spotCount > 1) {
    const unsigned all = (1u << spotCount) - 1u;
    if (fitOf(on, all).cost + Split < best.cost) {
      together = on;
      ofSpots = all;
    }
  }
  const auto usedBy = [&](const Way& way) { // lights, then spots
    std::pair<unsigned, unsigned> used(0u, 0u);
    for (std::size_t i = 0; i < count; ++i)
      if (way.spotOf[i] >= 0) {
        used.first |= 1u << i;
        used.second |= 1u << way.spotOf[i];
      }
    return used;
  };
  if (together == 0)
    for (const Way& way : ways) {
      const bool isExchange = usedBy(way) == usedBy(best);
      for (std::size_t i = 0; i < count; ++i)
        if (way.spotOf[i] >= 0 && best.spotOf[i] >= 0 && way.spotOf[i] != best.spotOf[i] &&
            way.cost < best.cost + (isExchange ? Doubt : Confusion))
          (isExchange ? together : unsure) |= 1u << i;
      for (std::size_t k = 0; k < spotCount; ++k) // it may as well be what is nobody's
        if (rivals[k] < Gate && way.cost < best.cost + Rival && (usedBy(way).second >> k & 1u) == 0)
          for (std::size_t i = 0; i < count; ++i)
            if (best.spotOf[i] == static_cast<int>(k))
              unsure |= 1u << i;
    }
  const bool isAnExchange = ofSpots == 0 && together != 0;
  if (isAnExchange)
    std::tie(together, ofSpots) = usedBy(best);
  if (unsure != 0 || (together != 0 && fitOf(together, ofSpots).cost >= HUGE_VAL)) {
    unsure |= together;
    together = 0;
  }

  const auto mayBeExchanged = [&](std::size_t i, std::size_t j) {
    double& evidence = Evidence(company.lights[i]->light, company.lights[j]->light);
    statistics_.met += !(evidence < HUGE_VAL);
    evidence = 0.0;
  };
  for (std::size_t i = 0; i < count; ++i)
    for (std::size_t j = 0; j < i; ++j) {
      // Each may turn back at once: then they are where they are expected, but the other way round.
      const HandState off = company.lights[i]->state - company.lights[j]->state;
      const double doubt =
          std::sqrt(0.5 * std::max(SpreadOf({{company.lights[i], 1.0}, {company.lights[j], -1.0}}).trace(), 0.0));
      const double turn = off.segment<2>(2).norm() * parameters_.frameMs * 1e-3;
      if (off.head<2>().norm() < 2.5 * turn + 3.0 * doubt + 1.0 || (isAnExchange && (together >> i & together >> j & 1u) != 0))
        mayBeExchanged(i, j);
    }

  const auto measureTogether = [&](unsigned lights, const Fit& fit) {
    const double when = MiddleOf(time, fit.sum.place.y());
    for (std::size_t i = 0; i < count; ++i)
      if (lights >> i & 1u) {
        Track& light = *company.lights[i];
        Move(light, when);
        light.isMerged = true;
        light.alone = 0;
        light.strange = fit.strange;
        light.length *= LengthGrows;
        light.unseen = 0;
      }
    Measure(fit.parts, fit.sum.place, fit.noise);
  };
  if (together != 0)
    measureTogether(together, fitOf(together, ofSpots));
  for (std::size_t k = 0; k < spotCount; ++k) {
    unsigned lights = 0;
    for (std::size_t i = 0; i < count; ++i)
      lights |= best.spotOf[i] == static_cast<int>(k) ? 1u << i : 0u;
    taken[company.spots[k]] = lights != 0 || (ofSpots >> k & 1u) != 0;
    if ((lights & unsure) != 0)
      unsure |= lights;
    if (lights == 0 || (lights & (together | unsure)) != 0)
      continue;
    const auto first =
        static_cast<std::size_t>(std::find(best.spotOf.begin(), best.spotOf.end(), static_cast<int>(k)) - best.spotOf.begin());
    Track& light = *company.lights[first];
    Spot spot = spots[company.spots[k]];
    const Fit fit = fitOf(lights, 1u << k);
    if (fit.isShared)
      measureTogether(lights, fit);
    else {
      const double when = MiddleOf(time, spot.position.y());
      spot.position = fit.sum.place;
      spot.covariance = fit.sum.noise;
      light.newest = spot.Brightness();
      Correct(light, spot, when);
    }
    if (!fit.isShared || (count == 1 && light.isProven))
      Remember(light, RowTime(time, spot.position.y()), spot.Brightness());
    if (count == 1)
      light.amplitude += (fit.isShared ? 0.1 : 0.3) * light.share * (spot.Brightness() - light.amplitude * light.share);
  }
  for (std::size_t i = 0; i < count; ++i) {
    Track& light = *company.lights[i];
    const unsigned bit = 1u << i;
    if ((unsure & bit) == 0 && (best.spotOf[i] >= 0 || (together & bit) != 0))
      continue;
    ++light.unseen;
    if (unsure == 0)
      light.newest = 0.0;
    if (count == 1 && unsure == 0)
      Remember(light, RowTime(time, light.state.y()), 0.0);
  }
}

} // namespace echorama
