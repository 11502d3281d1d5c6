// SPDX-License-Identifier: BSD-3-Clause
#include "BeamLobes.h"
#include "Core/Base/Angles.h"
#include <algorithm>
#include <cmath>

namespace echorama {
namespace {

constexpr double sigmasToHalfWidth = 2.3548200450309493; // full width at half maximum of a Gaussian
constexpr double finestPitch = 0.125;                    // wavelengths, of what stands for an aperture without elements
constexpr double grazing = 0.99;                         // beyond this sine nothing is heard

double Sinc(double x)
{
  return std::abs(x) < 1e-9 ? 1.0 : std::sin(Pi * x) / (Pi * x);
}

// The aperture's elements at one frequency after the other.
class Array {
public:
  Array(const BeamLobes& lobes, const Transducer& t) : wavelength_(t.WavelengthMm()), bandwidth_(t.bandwidth)
  {
    const double pitch = lobes.pitchMm > 0.0 ? lobes.pitchMm : finestPitch * wavelength_;
    const int count = std::max(2, static_cast<int>(std::lround(t.lateralApertureMm / pitch)));
    width_ = lobes.pitchMm > 0.0 ? lobes.elementWidth * lobes.pitchMm : 0.0;
    for (int i = 0; i < count; ++i) {
      const double place = (i + 0.5) / count - 0.5;
      double weight = 1.0;
      if (lobes.apodisation == Apodisation::Hann)
        weight = std::pow(std::cos(Pi * place), 2);
      else if (lobes.apodisation == Apodisation::Gaussian)
        weight = std::exp(-0.5 * std::pow(Transducer::sigmasPerAperture * place, 2));
      elements_.push_back({place * count * pitch, weight});
      sum_ += weight;
    }
  }

  // One way, of a tone at a frequency beside the centre frequency.
  double OneWay(double sine, double frequency) const
  {
    const double perMm = frequency * sine / wavelength_;
    double sum = 0.0;
    for (const Element& element : elements_)
      sum += element.weight * std::cos(2.0 * Pi * element.place * perMm);
    return sum / sum_ * Sinc(width_ * perMm) * std::sqrt(1.0 - sine * sine);
  }

  struct Band {
    double peak, bandwidth;
  };
  // Both ways: all frequencies of the pulse, in phase at the peak of the envelope.
  Band TwoWay(double sine) const
  {
    const double sigma = bandwidth_ / sigmasToHalfWidth;
    // Between neighbouring frequencies the ends of the aperture shall not come apart by more than a fraction of a period.
    const double periods = 2.0 * std::abs(elements_.back().place * sine) / wavelength_;
    const int count = 2 * static_cast<int>(std::ceil(20.0 + 40.0 * sigma * periods)) + 1;
    double all = 0.0, heard = 0.0, first = 0.0, second = 0.0;
    for (int i = 0; i < count; ++i) {
      const double off = (2.0 * i / (count - 1) - 1.0) * std::min(4.0 * sigma, 0.95);
      const double weight = std::exp(-0.5 * std::pow(off / sigma, 2)), both = weight * std::pow(OneWay(sine, 1.0 + off), 2);
      all += weight;
      heard += both;
      first += both * off;
      second += both * off * off;
    }
    const double variance = heard > 0.0 ? second / heard - std::pow(first / heard, 2) : sigma * sigma;
    return {heard / all, sigmasToHalfWidth * std::sqrt(std::max(variance, 0.0))};
  }

private:
  struct Element {
    double place, weight;
  };
  double wavelength_, bandwidth_, width_, sum_ = 0.0;
  std::vector<Element> elements_;
};

} // namespace

ParameterList Describe(BeamLobes& l)
{
  return {
      Parameter("SideLobes", l.sideLobes, {0, 20}, "",
                "Side lobes on either side of each beam along the fan; each costs about as much as the beam itself. 0: none.")
          .Advanced(),
      Parameter("Apodisation", Choice(l.apodisation, {"rectangular", "hann", "gaussian"}),
                "What side and grating lobes are those of: rectangular has loud side lobes, hann and gaussian (a fifth of the "
                "aperture) faint ones.")
          .Advanced(),
      Parameter(
          "PitchMm", l.pitchMm, {0, 10}, "mm",
          "From element to element of the array. Grating lobes lie where its sine of the angle is a multiple of wavelength / "
          "pitch. 0: no grating lobes.")
          .Advanced(),
      Parameter("ElementWidth", l.elementWidth, {0.01, 1}, "pitches",
                "How wide an element is; narrow ones hear more of grating lobes.")
          .Advanced()};
}

double TwoWayPattern(const BeamLobes& lobes, const Transducer& transducer, double sine)
{
  return Array(lobes, transducer).TwoWay(sine).peak;
}

std::vector<BeamLobe> LobesOf(const BeamLobes& lobes, const Transducer& transducer)
{
  std::vector<BeamLobe> all;
  const Array array(lobes, transducer);
  const auto add = [&](double sine, double aperture) {
    const auto band = array.TwoWay(sine);
    BeamLobe lobe{sine, band.peak, transducer};
    lobe.transducer.bandwidth = std::clamp(band.bandwidth, 0.01, transducer.bandwidth);
    lobe.transducer.lateralApertureMm = aperture * std::sqrt(1.0 - sine * sine); // as seen from there
    all.push_back(lobe);
    lobe.sine = -sine;
    all.push_back(lobe);
  };
  const double wavelength = transducer.WavelengthMm(), toGrating = lobes.pitchMm > 0.0 ? wavelength / lobes.pitchMm : 2.0;

  // From one minimum of the pattern to the next, of the aperture alone.
  const double perStep = 0.005 * wavelength / transducer.lateralApertureMm, end = std::min(grazing, 0.5 * toGrating);
  const auto sizeAt = [&](double sine) { return std::abs(array.OneWay(sine, 1.0)); };
  double minimum = 0.0, peak = 0.0;
  int made = 0;
  for (double sine = 2.0 * perStep; made < lobes.sideLobes && sine < end; sine += perStep) {
    const double before = sizeAt(sine - perStep), here = sizeAt(sine), after = sizeAt(sine + perStep);
    if (here > before && here >= after)
      peak = sine;
    if (!(here < before && here <= after))
      continue;
    if (minimum > 0.0 && peak > minimum) {
      // The square of half a wave between two minima, both ways: half as wide as they are apart. A Gaussian beam of that width:
      const double sigma = 0.5 * (sine - minimum) / sigmasToHalfWidth;
      add(peak, Transducer::sigmasPerAperture * wavelength / (2.0 * Pi * std::sqrt(2.0) * sigma));
      ++made;
    }
    minimum = sine;
  }

  for (double sine = toGrating; lobes.pitchMm > 0.0 && sine < grazing; sine += toGrating)
    add(sine, transducer.lateralApertureMm);
  return all;
}

} // namespace echorama
