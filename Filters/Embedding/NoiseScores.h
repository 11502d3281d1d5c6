// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "LocalStatistics.h"
#include <optional>
#include <vector>

namespace echorama {

/// What stands for each sample of a beam volume where its grain is measured; NaN where it takes no part. For MatchBeams alone.
class NoiseScores {
public:
  /// \param valid where samples are real (not 0); empty: everywhere. Those that are not finite are not.
  NoiseScores(VolumeView<const float> beams, VolumeView<const unsigned char> valid);

  ///@{
  /// Of the samples that take part; the deviation is that about local means, of the last Standardise().
  double Real() const { return real_; }
  double Mean() const { return mean_; }
  double Deviation() const { return deviation_; }
  float Least() const { return least_; }
  float Greatest() const { return greatest_; }
  ///@}
  VolumeView<const float> View() const { return scores_.View(); }

  /// Where samples take part (not 0); empty: everywhere.
  VolumeView<const unsigned char> Valid() const { return valid_; }

  /// Samples less their local mean, over their local deviation. Where that is next to nothing none takes part.
  /// \param window standard deviations in samples \param local those of the last time, and then of this one
  void Standardise(const Eigen::Vector3d& window, std::optional<LocalStatistics>& local, const Progress& progress);

  /// Leaves out what is no developed speckle, from here on. \param local of the samples \param step of the intensities: that of
  /// whole numbers is 1
  void KeepSpeckle(const LocalStatistics& local, double step);

  /// How many samples took part in the last of these.
  std::ptrdiff_t Used() const { return used_; }

  /// The standardised value below which a part \a probability of the samples lies.
  double Quantile(double probability) const;

  /// Ranks in place of values: the Rayleigh number with the same rank, less the mean of that distribution.
  void Rank();

private:
  void CountReal();
  void Count();
  bool IsReal(std::ptrdiff_t i) const;

  VolumeView<const float> beams_;
  VolumeView<const unsigned char> valid_;
  Volume<float> scores_;
  Volume<unsigned char> speckle_;
  std::vector<std::ptrdiff_t> histogram_;
  std::ptrdiff_t used_ = 0;
  double mean_ = 0.0, deviation_ = 0.0, real_ = 0.0;
  float least_ = 0.0f, greatest_ = 0.0f;
};

} // namespace echorama
