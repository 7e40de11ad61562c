// SPDX-License-Identifier: Apache-2.0
/// @file
/// Confidence regions that stay valid when the noise reacts to past probes, at any time.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/region/guarantee.hpp"
#include "trammel/region/residuals.hpp"

namespace trammel::inline TRAMMEL_ABI::region {

/// The set of p for which, in every channel i = 1 ... c,
///
///   S(p)^2 <= (V(p) + rho2) ln( (V(p) + rho2) / (rho2 delta^2) ),   S = sum_n x_n^(i),  V = sum_n
///   (x_n^(i))^2,
///
/// | symbol | meaning                                                    | range |
/// |--------|------------------------------------------------------------|-------|
/// | x_n    | probe times residual, affine in p (residuals.hpp)          |       |
/// | delta  | probability of error of one channel                        | (0,1) |
/// | rho2   | scale fixed before the data are seen, best near V          | > 0   |
///
/// Method: self-normalised bound for sums of conditionally symmetric numbers by the method of mixtures (de la
/// Pena, Klass and Lai 2004).
/// Guarantee: the probability that a channel's condition ever fails at the true p, for any number of probes,
/// is at most delta; all channels together hold with at least 1 - c delta. It needs only that each probe is
/// symmetric given the past: feedback and later noise may react to past probes. Both residual forms are
/// allowed. No random strings. Wider than LSCR (1.45 times in the published example).
/// Far away, where V is larger than rho2 delta^2 e^N, the condition always holds; sections state this too.
/// Cost: building O(N c d^2), `contains` O(c d^2).
class SelfNormalisedRegion {
 public:
  /// Error unless 0 < delta < 1 and rho2 > 0.
  void assign(const ProbedResiduals& residuals, double delta, double rho2);

  [[nodiscard]] Eigen::Index dimension() const { return dimension_; }
  [[nodiscard]] int channels() const { return static_cast<int>(channel_.size()); }
  [[nodiscard]] bool channel_contains(int channel, const Eigen::Ref<const Eigen::VectorXd>& p) const;
  [[nodiscard]] bool contains(const Eigen::Ref<const Eigen::VectorXd>& p) const;
  /// Exact up to |t| = 1e150, beyond which nothing is distinguished from infinity.
  void channel_section(int channel, const Eigen::Ref<const Eigen::VectorXd>& p,
                       const Eigen::Ref<const Eigen::VectorXd>& direction, IntervalList& out) const;
  void section(const Eigen::Ref<const Eigen::VectorXd>& p, const Eigen::Ref<const Eigen::VectorXd>& direction,
               IntervalList& out) const;
  [[nodiscard]] bool excludes(const Eigen::Ref<const Eigen::VectorXd>& centre,
                              const Eigen::Ref<const Eigen::MatrixXd>& generators) const;
  [[nodiscard]] Guarantee guarantee() const;

 private:
  struct Channel {
    Eigen::VectorXd sum;     ///< S = sum . (1, -p)
    Eigen::MatrixXd square;  ///< V = (1, -p)' square (1, -p)
  };
  std::vector<Channel> channel_;
  int dimension_ = 0;
  double delta_ = 0.0;
  double rho2_ = 0.0;
};

}  // namespace trammel::inline TRAMMEL_ABI::region

#ifndef TRAMMEL_COMPILED
#include "trammel/region/self_normalised_impl.hpp"
#endif
