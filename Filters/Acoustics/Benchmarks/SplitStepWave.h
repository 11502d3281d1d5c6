// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// A contestant that knows nothing of rays: the wave of one beam, stepped through the scene.
#include "Core/Base/Angles.h"
#include "Filters/Acoustics/Synthesize.h"
#include <algorithm>
#include <cmath>
#include <complex>
#include <unsupported/Eigen/FFT>
#include <vector>

namespace echorama::benchmark {

/// The sound of the centre frequency that an aperture with its apodisation and focus sends, by the angular spectrum: from plane
/// to plane through water, and in each the phase and loss of the media there (split steps). Waves that turn back are not
/// followed. It is received the way it was sent, as without dynamic focusing.
class SplitStepWave {
public:
  SplitStepWave(const AcousticScene& scene, const SynthesisParameters& p) : scene_(scene), p_(p)
  {
    const double k = WaveNumber();
    for (const Material& material : scene.Materials()) {
      const double neper = std::log(10.0) / 20.0 * material.AttenuationDbPerMm(p.transducer.frequencyMHz);
      slowness_.push_back(p.transducer.assumedSoundSpeed / material.soundSpeed);
      phase_.push_back(std::exp(
          std::complex<float>(static_cast<float>(-neper * stepMm), static_cast<float>(k * (slowness_.back() - 1.0) * stepMm))));
      backscatter_.push_back(material.scattererDensity > 0.0 ? std::pow(10.0, 0.1 * material.backscatterDb) : 0.0);
    }
    for (int j = 0; j < high; ++j)
      for (int i = 0; i < wide; ++i) {
        const auto wave = [](int n, int count) { return 2.0 * Pi * (n < count / 2 ? n : n - count) / (count * spacingMm); };
        const double square = k * k - std::pow(wave(i, wide), 2) - std::pow(wave(j, high), 2);
        onward_.push_back(std::exp(std::complex<double>(0.0, (std::sqrt(std::max(square, 0.0)) - k) * stepMm)) /
                          static_cast<double>(wide * high)); // and what the transform back lacks
        const auto edge = [](int n, int count) {
          const double in = std::min(n, count - 1 - n) / (0.12 * count);
          return in < 1.0 ? std::pow(std::sin(0.5 * Pi * in), 0.25) : 1.0;
        };
        edge_.push_back(static_cast<float>(edge(i, wide) * edge(j, high)));
      }
    open_ = Follow(nullptr);
  }

  /// Mean power of speckle at scan depths, as of SynthesizeEchoes: that of reference tissue without loss is 1.
  std::vector<double> MeanPower(const RayStart& axis, const DepthAxis& depths) const
  {
    const std::vector<Plane> planes = Follow(&axis);
    std::vector<double> power;
    std::size_t next = 1;
    for (int i = 0; i < depths.count; ++i) {
      const double depth = depths.first + i * depths.step;
      while (next + 1 < planes.size() && planes[next].scanDepth < depth)
        ++next;
      const Plane &a = planes[next - 1], &b = planes[next];
      const double share = std::clamp((depth - a.scanDepth) / (b.scanDepth - a.scanDepth), 0.0, 1.0);
      power.push_back((1.0 - share) * a.heard / open_[next - 1].heard + share * b.heard / open_[next].heard);
    }
    return power;
  }

private:
  static constexpr int wide = 128, high = 96;
  static constexpr double spacingMm = 0.3, stepMm = 0.25;
  struct Plane {
    double scanDepth, heard;
  };

  double WaveNumber() const { return 2.0 * Pi / p_.transducer.WavelengthMm(); }
  static double X(int i) { return (i - wide / 2) * spacingMm; }
  static double Y(int j) { return (j - high / 2) * spacingMm; }

  // Without an axis: through reference tissue that loses nothing.
  std::vector<Plane> Follow(const RayStart* axis) const
  {
    using Complex = std::complex<float>;
    const Transducer& t = p_.transducer;
    std::vector<Complex> field;
    for (int j = 0; j < high; ++j)
      for (int i = 0; i < wide; ++i) {
        const double u = X(i) / t.lateralApertureMm * Transducer::sigmasPerAperture,
                     v = Y(j) / t.elevationApertureMm * Transducer::sigmasPerAperture;
        const double early =
            std::hypot(t.lateralFocusMm, X(i)) - t.lateralFocusMm + std::hypot(t.elevationFocusMm, Y(j)) - t.elevationFocusMm;
        field.emplace_back(std::exp(std::complex<double>(-0.5 * (u * u + v * v), -WaveNumber() * early)));
      }
    std::vector<Plane> planes;
    std::vector<Eigen::Vector3f> points(field.size());
    std::vector<std::int32_t> media(field.size());
    const Eigen::Vector3d out = axis ? Eigen::Vector3d(axis->direction.cross(axis->across)) : Eigen::Vector3d::UnitY();
    double scanDepth = 0.0;
    for (double depth = 0.0; scanDepth <= p_.probe.depthMax + (axis ? 1.0 : 40.0); depth += stepMm) {
      if (axis) {
        for (int j = 0; j < high; ++j)
          for (int i = 0; i < wide; ++i)
            points[static_cast<std::size_t>(j * wide + i)] =
                (axis->origin + depth * axis->direction + X(i) * axis->across + Y(j) * out).cast<float>();
        scene_.MediumAt(points.data(), points.size(), media.data());
      }
      double heard = 0.0, all = 0.0, slow = 0.0;
      for (std::size_t i = 0; i < field.size(); ++i) {
        const double power = std::norm(std::complex<double>(field[i]));
        const auto medium = static_cast<std::size_t>(media[i]);
        heard += power * power * (axis ? backscatter_[medium] : 1.0);
        all += power;
        slow += power * (axis ? slowness_[medium] : 1.0);
      }
      planes.push_back({scanDepth, heard});
      scanDepth += stepMm * (all > 0.0 ? slow / all : 1.0);
      Transform(field, false);
      for (std::size_t i = 0; i < field.size(); ++i)
        field[i] *= Complex(onward_[i]);
      Transform(field, true);
      for (std::size_t i = 0; i < field.size(); ++i)
        field[i] *= edge_[i] * (axis ? phase_[static_cast<std::size_t>(media[i])] : Complex(1.0f));
    }
    return planes;
  }

  // Along both axes; neither way is scaled.
  static void Transform(std::vector<std::complex<float>>& field, bool back)
  {
    thread_local Eigen::FFT<float> transform(Eigen::FFT<float>::impl_type(), Eigen::FFT<float>::Unscaled);
    std::complex<float> line[wide], changed[wide];
    const auto change = [&](std::size_t first, std::size_t stride, int count) {
      for (int i = 0; i < count; ++i)
        line[i] = field[first + static_cast<std::size_t>(i) * stride];
      if (back)
        transform.inv(changed, line, count);
      else
        transform.fwd(changed, line, count);
      for (int i = 0; i < count; ++i)
        field[first + static_cast<std::size_t>(i) * stride] = changed[i];
    };
    for (int j = 0; j < high; ++j)
      change(static_cast<std::size_t>(j * wide), 1, wide);
    for (int i = 0; i < wide; ++i)
      change(static_cast<std::size_t>(i), wide, high);
  }

  const AcousticScene& scene_;
  const SynthesisParameters& p_;
  std::vector<double> slowness_, backscatter_;
  std::vector<std::complex<float>> phase_;
  std::vector<std::complex<double>> onward_;
  std::vector<float> edge_;
  std::vector<Plane> open_;
};

} // namespace echorama::benchmark
