// SPDX-License-Identifier: Apache-2.0
/// @file
/// Monte Carlo lower bound of the risk of every estimator, valid for any length of its Markov chains.
#pragma once

#include <cstdint>
#include <optional>

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/core/progress.hpp"
#include "trammel/problem/guaranteed_problem.hpp"

namespace trammel::inline TRAMMEL_ABI::certify {

/// Prior of the parameters.
enum class SampledPrior {
  kTruncatedGaussian,  ///< N(0, k L L') cut to the bounds
  kSpheres,            ///< every block on its bounding sphere, direction of N(0, L L'); disjoint blocks only
};

struct PalindromicSettings {
  double confidence = 0.999;  ///< probability that the value stated is a bound
  int samples = 12000;        ///< of the final estimate
  int pilot_samples = 600;    ///< that choose the prior and the truncation of the samples
  std::uint64_t seed = 1;
};

/// Result; `bound` is the lower confidence limit.
struct PalindromicBound {
  double bound = 0.0;  ///< squared error that no estimator can guarantee to undercut
  double mean = 0.0;
  double standard_error = 0.0;
  double acceptance = 1.0;   ///< share of Gaussian draws within the bounds
  double prior_scale = 1.0;  ///< k
  SampledPrior prior = SampledPrior::kTruncatedGaussian;
};

/// Draw theta_0 from a prior on the bounds and y given theta_0, then run a Markov chain K_1 .. K_n K_n .. K_1
/// of kernels that are reversible for the posterior, started at theta_0. Whatever n,
///
///   E |C theta_0 - C theta_2n|^2 / 2 <= Bayes risk <= worst error of every estimator,
///
/// because given y the left side is E|C theta|^2 - |K_n .. K_1 C theta|^2 in the posterior's inner product
/// and the last term is at least |E(C theta | y)|^2 (Jensen). Kernels: exact Gibbs steps along fixed
/// directions that whiten the posterior (truncated Gaussian), or preconditioned Crank-Nicolson steps
/// (spheres). Samples are independent and truncated at a level fixed by a pilot run; confidence limit by the
/// empirical Bernstein inequality (Maurer and Pontil 2009, theorem 4). Pseudo-random numbers; the confidence
/// is that of the Monte Carlo error alone. Absent where no prior can be sampled. prior_factor: p x k, <H_l, L
/// L'> <= 1. Cost: samples times p times 16 updates of p operations.
[[nodiscard]] std::optional<PalindromicBound> palindromic_bound(const GuaranteedProblem& problem,
                                                                const Eigen::MatrixXd& prior_factor,
                                                                const PalindromicSettings& settings = {},
                                                                const ProgressObserver& observe = {});

}  // namespace trammel::inline TRAMMEL_ABI::certify

#ifndef TRAMMEL_COMPILED
#include "trammel/certify/palindromic_impl.hpp"
#endif
