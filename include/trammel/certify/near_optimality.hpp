// SPDX-License-Identifier: Apache-2.0
/// @file
/// How good a guarantee is: attained by an admissible motion, and compared with what any estimator could do.
#pragma once

#include <concepts>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>

#include <Eigen/Core>

#include "trammel/certify/palindromic.hpp"
#include "trammel/core/config.hpp"
#include "trammel/core/progress.hpp"
#include "trammel/core/settings.hpp"
#include "trammel/minimax/solution.hpp"
#include "trammel/problem/guaranteed_problem.hpp"

namespace trammel::inline TRAMMEL_ABI::certify {

struct NearOptimalitySettings {
  int starts = 64;            ///< of the search for the worst motion
  bool monte_carlo = false;   ///< also the Monte Carlo bound: sharper, seconds to a minute
  int samples = 12000;        ///< of the Monte Carlo bound
  double confidence = 0.999;  ///< of the Monte Carlo bound
  std::uint64_t seed = 1;     ///< of all random numbers
};

template <class Settings, class Visitor>
requires std::same_as<std::remove_const_t<Settings>, NearOptimalitySettings>
void visit_fields(Settings& settings, Visitor&& visit) {
  visit(FieldDoc{.name = "starts",
                 .unit = "",
                 .meaning = "random starts of the search for the worst admissible motion",
                 .minimum = 1.0,
                 .maximum = 1e6},
        settings.starts);
  visit(FieldDoc{.name = "monte_carlo",
                 .unit = "",
                 .meaning = "sharpen the bound over all estimators by Monte Carlo"},
        settings.monte_carlo);
  visit(FieldDoc{.name = "samples",
                 .unit = "",
                 .meaning = "samples of the Monte Carlo bound; four times as many halve its error",
                 .minimum = 100.0,
                 .maximum = 1e9},
        settings.samples);
  visit(FieldDoc{.name = "confidence",
                 .unit = "",
                 .meaning = "confidence of the Monte Carlo bound",
                 .minimum = 0.5,
                 .maximum = 1.0 - 1e-12},
        settings.confidence);
  visit(FieldDoc{.name = "seed", .unit = "", .meaning = "seed of the random numbers", .minimum = 0.0},
        settings.seed);
}

/// Which argument gave the bound over all estimators.
enum class AnyEstimatorBound {
  kNone,             ///< nothing better than zero
  kBox,              ///< weighted van Trees, boxes in the blocks
  kBall,             ///< weighted van Trees, radial priors on the blocks
  kCoherentGroups,   ///< weighted van Trees, neighbouring blocks moved together
  kCorrelatedPrior,  ///< correlated Gaussian with smooth cut-offs
  kMonteCarlo,       ///< palindromic Monte Carlo: holds at the confidence stated only
};

/// Name as in result files.
[[nodiscard]] constexpr std::string_view to_string(AnyEstimatorBound kind) noexcept {
  switch (kind) {
    case AnyEstimatorBound::kBox:
      return "van_trees_box";
    case AnyEstimatorBound::kBall:
      return "van_trees_ball";
    case AnyEstimatorBound::kCoherentGroups:
      return "van_trees_coherent_groups";
    case AnyEstimatorBound::kCorrelatedPrior:
      return "correlated_prior";
    case AnyEstimatorBound::kMonteCarlo:
      return "palindromic_monte_carlo";
    case AnyEstimatorBound::kNone:
      break;
  }
  return "none";
}

/// Squared errors in the units of the criterion.
struct NearOptimality {
  double attained = std::numeric_limits<double>::quiet_NaN();  ///< error at worst_case
  /// attained / upper bound; 1: the guarantee is not pessimistic.
  double attained_fraction = std::numeric_limits<double>::quiet_NaN();
  Eigen::VectorXd worst_case;  ///< admissible theta with that error
  /// No function of the measurements guarantees a smaller error (Gaussian noise of the covariance given;
  /// linear measurement model).
  double any_estimator = std::numeric_limits<double>::quiet_NaN();
  AnyEstimatorBound kind = AnyEstimatorBound::kNone;
  std::optional<PalindromicBound> monte_carlo;
  double confidence = std::numeric_limits<double>::quiet_NaN();  ///< of monte_carlo

  /// The Monte Carlo bound exists and is larger than the proved one.
  [[nodiscard]] bool sharpened() const { return monte_carlo && monte_carlo->bound > any_estimator; }
  /// The larger of the proved and the Monte Carlo bound, and which of them it is.
  [[nodiscard]] double best_any_estimator() const { return sharpened() ? monte_carlo->bound : any_estimator; }
  [[nodiscard]] AnyEstimatorBound best_kind() const {
    return sharpened() ? AnyEstimatorBound::kMonteCarlo : kind;
  }
};

/// Judges a solution: the worst admissible parameters of its estimator (find_attained_error), and the largest
/// of the bounds over all estimators (box_bound, ball_bound, group_bound where the ellipsoids confine
/// disjoint blocks; correlated_bound always). Both are proved by exhibiting a point or a prior; they are
/// evaluated in double precision. Fields are NaN where the solution is unbounded. Cost: some hundred
/// factorisations of p x p matrices, ten to twenty more per block.
[[nodiscard]] NearOptimality assess_near_optimality(const GuaranteedProblem& problem,
                                                    const minimax::Solution& solution,
                                                    const NearOptimalitySettings& settings = {},
                                                    const ProgressObserver& observe = {});

/// One sentence for a user, rms values with their unit: "Guaranteed rms error 940.5 m, attained by an
/// admissible motion; no estimator of any kind, however computed, can guarantee less than 779.9 m (proved):
/// at most 18 % can be gained."
[[nodiscard]] std::string describe(const NearOptimality& near, double guaranteed_squared_error,
                                   std::string_view unit);

}  // namespace trammel::inline TRAMMEL_ABI::certify

#ifndef TRAMMEL_COMPILED
#include "trammel/certify/near_optimality_impl.hpp"
#endif
