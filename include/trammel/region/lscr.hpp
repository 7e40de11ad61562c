// SPDX-License-Identifier: Apache-2.0
/// @file
/// Confidence regions by leaving out sign-dominant correlations (LSCR).
#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/region/estimate.hpp"
#include "trammel/region/guarantee.hpp"
#include "trammel/region/residuals.hpp"
#include "trammel/region/strings.hpp"

namespace trammel::inline TRAMMEL_ABI::region {

/// Where the residuals of a region come from; decides what its level means.
enum class ResidualForm {
  kPlant,       ///< plant_residuals: equal to the noise at the true parameters
  kPrediction,  ///< prediction_residuals: contain past outputs
};

/// Positive and negative sums among the M - 1 of one channel, ties already decided.
struct SignCounts {
  int positive = 0;
  int negative = 0;
};

/// The set of p for which, in every channel i = 1 ... c,
///
///   #{ j : g_j(p) > 0 } >= q  and  #{ j : g_j(p) < 0 } >= q,   g_j(p) = sum_n h_{j,n} x_n^(i)(p),
///
/// | symbol  | meaning                                             | shape |
/// |---------|-----------------------------------------------------|-------|
/// | x_n     | probe times residual, affine in p (residuals.hpp)   |       |
/// | h_j     | random 0/1 strings, j = 1 ... M-1, distinct, not zero |     |
/// | M       | members: the strings and the zero string            |       |
/// | q       | members left out at either end, 1 <= q <= M/2       |       |
///
/// Method: Campi and Weyer (2010); with `kPrediction` residuals Amelin (2013), steps 1 to 6. Sums equal to
/// zero are decided by a random order of all members, without which lattice noise makes the level wrong.
/// Guarantee: with `kPlant` residuals the true p fulfils each channel's condition with probability exactly
/// 1 - 2q/M, all of them with at least 1 - 2cq/M, for any feedback and any noise independent of the probes.
/// With `kPrediction` residuals these numbers are approximations: |x_n| then depends on the signs of earlier
/// probes, and feedback exists for which the probability is 0.84 instead of 0.975.
/// Cost: building O(M N / 8) additions per column, `contains` O(M c d), `section` O(M c (d + log M)).
class LscrRegion {
 public:
  /// Takes the sums of these residuals; does not allocate once the sizes are the same.
  /// `after_reference`: one flag per string, see draw_tie_flags. Error if q is not in 1 ... M/2 or sizes
  /// do not fit.
  void assign(const ProbedResiduals& residuals, const BinaryStrings& strings,
              std::span<const char> after_reference, int excluded, ResidualForm form);

  [[nodiscard]] Eigen::Index dimension() const { return dimension_; }
  [[nodiscard]] int channels() const { return channels_; }
  /// M.
  [[nodiscard]] int members() const { return strings_ + 1; }
  /// q.
  [[nodiscard]] int excluded() const { return excluded_; }
  [[nodiscard]] ResidualForm form() const { return form_; }
  /// g_j^(i)(p) = constant(j, i) - slope(j, i, 0) p_1 - ...; j from 0 to M - 2.
  [[nodiscard]] double constant(int j, int channel) const { return sums_(j, channel * (dimension_ + 1)); }
  [[nodiscard]] double slope(int j, int channel, int k) const {
    return sums_(j, channel * (dimension_ + 1) + 1 + k);
  }

  /// Signs of the sums of one channel (from 0) at p.
  [[nodiscard]] SignCounts counts(int channel, const Eigen::Ref<const Eigen::VectorXd>& p) const;
  /// Whether one channel's condition holds at p.
  [[nodiscard]] bool channel_contains(int channel, const Eigen::Ref<const Eigen::VectorXd>& p) const;
  [[nodiscard]] bool contains(const Eigen::Ref<const Eigen::VectorXd>& p) const;
  /// One channel's part of the section, see ConfidenceRegion; `sweep` is work space.
  void channel_section(int channel, const Eigen::Ref<const Eigen::VectorXd>& p,
                       const Eigen::Ref<const Eigen::VectorXd>& direction, CountSweep& sweep,
                       IntervalList& out) const;
  void section(const Eigen::Ref<const Eigen::VectorXd>& p, const Eigen::Ref<const Eigen::VectorXd>& direction,
               IntervalList& out) const;
  [[nodiscard]] bool excludes(const Eigen::Ref<const Eigen::VectorXd>& centre,
                              const Eigen::Ref<const Eigen::MatrixXd>& generators) const;
  [[nodiscard]] Guarantee guarantee() const;
  [[nodiscard]] InstrumentalEstimate estimate() const {
    return instrumental_estimate(sums_.row(strings_), channels_, dimension_);
  }

 private:
  /// Sign of a sum with value and rounding scale: ties go where the random order puts them.
  [[nodiscard]] bool is_positive(int j, double value, double scale) const;

  RowMatrix sums_;
  SubsetSumWork work_;
  std::vector<char> after_reference_;
  int strings_ = 0;
  int channels_ = 0;
  int dimension_ = 0;
  int excluded_ = 0;
  ResidualForm form_ = ResidualForm::kPlant;
};

/// Largest q with joint level of at least `level` for M members and c channels, or 0 if there is none.
[[nodiscard]] int excluded_for_level(double level, int members, int channels);

}  // namespace trammel::inline TRAMMEL_ABI::region

#ifndef TRAMMEL_COMPILED
#include "trammel/region/lscr_impl.hpp"
#endif
