// SPDX-License-Identifier: Apache-2.0
/// @file
/// Joint confidence regions from sign-perturbed sums.
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

/// The set of p for which
///
///   #{ j : |S_j(p)|^2 > |S_0(p)|^2 } >= q,   S_j(p) = sum_n alpha_{j,n} (x_n^(1)(p), ..., x_n^(c)(p)),
///
/// | symbol  | meaning                                                        | shape |
/// |---------|----------------------------------------------------------------|-------|
/// | x_n     | probe times residual of the plant equation (residuals.hpp)     |       |
/// | alpha_j | random signs, j = 1 ... m-1 (bit set: +1); alpha_0 is all +1    |       |
/// | m       | members                                                        |       |
/// | q       | members left out, 1 <= q < m                                   |       |
///
/// Method: sign-perturbed sums (Csaji, Campi and Weyer 2015) with the probe as instrument; ties are decided
/// by a random order of all members.
/// Guarantee: contains the true p with probability exactly 1 - q/m, all parameters together, for any feedback
/// and any noise independent of the probes. The instrumental estimate always belongs to it.
/// Cost: as LscrRegion.
class SpsRegion {
 public:
  /// Takes the sums of these residuals; `after_reference` as for LscrRegion.
  void assign(const ProbedResiduals& residuals, const BinaryStrings& signs,
              std::span<const char> after_reference, int excluded);

  [[nodiscard]] Eigen::Index dimension() const { return dimension_; }
  [[nodiscard]] int channels() const { return channels_; }
  /// m.
  [[nodiscard]] int members() const { return strings_ + 1; }
  /// q.
  [[nodiscard]] int excluded() const { return excluded_; }

  /// Number of j with |S_j(p)| > |S_0(p)|, ties decided.
  [[nodiscard]] int count_greater(const Eigen::Ref<const Eigen::VectorXd>& p) const;
  [[nodiscard]] bool contains(const Eigen::Ref<const Eigen::VectorXd>& p) const;
  void section(const Eigen::Ref<const Eigen::VectorXd>& p, const Eigen::Ref<const Eigen::VectorXd>& direction,
               IntervalList& out) const;
  [[nodiscard]] bool excludes(const Eigen::Ref<const Eigen::VectorXd>& centre,
                              const Eigen::Ref<const Eigen::MatrixXd>& generators) const;
  [[nodiscard]] Guarantee guarantee() const;
  [[nodiscard]] InstrumentalEstimate estimate() const {
    return instrumental_estimate(sums_.row(strings_), channels_, dimension_);
  }
  /// S_j = constant - matrix p for j = 0 (the unperturbed sum) to m - 1.
  void affine_sum(int j, Eigen::VectorXd& constant, Eigen::MatrixXd& matrix) const;

 private:
  /// Sum over the bits set (plus) and not set (minus) of string j, as affine functions: entry 0 constant,
  /// then slopes. |S_j|^2 - |S_0|^2 = -4 sum_i plus_i minus_i, a difference without cancellation.
  [[nodiscard]] double plus(int j, int channel, int k) const {
    return sums_(j, channel * (dimension_ + 1) + k);
  }
  [[nodiscard]] double minus(int j, int channel, int k) const {
    return sums_(strings_, channel * (dimension_ + 1) + k) - plus(j, channel, k);
  }
  /// plus and minus of one channel at p.
  struct Pair {
    double plus = 0.0;
    double minus = 0.0;
    double plus_scale = 0.0;
    double minus_scale = 0.0;
  };
  [[nodiscard]] Pair pair_at(int j, int channel, const Eigen::Ref<const Eigen::VectorXd>& p) const;
  [[nodiscard]] bool is_greater(int j, double product, double scale) const;

  RowMatrix sums_;
  SubsetSumWork work_;
  std::vector<char> after_reference_;
  int strings_ = 0;
  int channels_ = 0;
  int dimension_ = 0;
  int excluded_ = 0;
};

/// { p : |M (p - centre)|^2 <= gamma }.
class EllipsoidRegion {
 public:
  EllipsoidRegion() = default;
  EllipsoidRegion(Eigen::VectorXd centre, Eigen::MatrixXd matrix, double gamma, double level);

  [[nodiscard]] Eigen::Index dimension() const { return centre_.size(); }
  [[nodiscard]] const Eigen::VectorXd& centre() const { return centre_; }
  /// M, square.
  [[nodiscard]] const Eigen::MatrixXd& matrix() const { return matrix_; }
  /// Infinite where the region it encloses could not be bounded.
  [[nodiscard]] double gamma() const { return gamma_; }
  /// Half width along each parameter.
  [[nodiscard]] Eigen::VectorXd half_widths() const;
  /// Area (d = 2), volume, ...
  [[nodiscard]] double volume() const;
  [[nodiscard]] bool contains(const Eigen::Ref<const Eigen::VectorXd>& p) const;
  void section(const Eigen::Ref<const Eigen::VectorXd>& p, const Eigen::Ref<const Eigen::VectorXd>& direction,
               IntervalList& out) const;
  [[nodiscard]] bool excludes(const Eigen::Ref<const Eigen::VectorXd>& centre,
                              const Eigen::Ref<const Eigen::MatrixXd>& generators) const;
  [[nodiscard]] Guarantee guarantee() const;

 private:
  Eigen::VectorXd centre_;
  Eigen::MatrixXd matrix_;
  double gamma_ = 0.0;
  double level_ = 0.0;
};

/// Ellipsoid around a region of sign-perturbed sums: |S_0|^2 <= gamma, gamma the q-th largest of
///   gamma_j = max { |z|^2 : |d_j - B_j z|^2 >= |z|^2 },  z = M_0 (p - p^),  B_j = M_j M_0^-1,
/// each by the one-dimensional convex dual of the S-lemma (in the manner of Csaji, Campi and Weyer 2015,
/// section VI, without a semidefinite solver). Infinite for short records. Error unless there are as many
/// channels as parameters; a singular M_0 gives an infinite ellipsoid around NaN.
[[nodiscard]] EllipsoidRegion outer_ellipsoid(const SpsRegion& region);

/// Largest q with level of at least `level` for m members, or 0 if there is none.
[[nodiscard]] int excluded_for_joint_level(double level, int members);

}  // namespace trammel::inline TRAMMEL_ABI::region

#ifndef TRAMMEL_COMPILED
#include "trammel/region/sps_impl.hpp"
#endif
