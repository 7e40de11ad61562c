// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of solve.hpp.
#pragma once

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>
#include <vector>

#include "trammel/minimax/reduced_solution.hpp"
#include "trammel/window/enclosed_band.hpp"
#include "trammel/window/local_window.hpp"
#include "trammel/window/solve.hpp"

namespace trammel::inline TRAMMEL_ABI::window {

namespace solve_detail {

using linalg::BandedMatrix;

/// Gap asked of the windows' own solvers: the error of the multipliers enters only squared.
inline constexpr double kLocalGap = 1e-6;
/// The same where the least favourable prior is nearly singular: stopping early keeps it away from that, so
/// that what windows disagree about is small beside its eigenvalues.
inline constexpr double kSingularGap = 1e-3;
/// Multipliers below this share of their mean are raised to it: their square roots are divided by.
inline constexpr double kLeastShare = 1e-8;
/// Block traces above this share of what the bound allows are scaled to all of it.
inline constexpr double kActive = 0.9;

/// Added to the moments of a window that its own solver may have left singular.
inline constexpr double kLeastMoment = 1e-9;
/// Coefficient j of an axis belongs to segment j - 1, bound l to segment l - 2.
inline constexpr Eigen::Index kCoefficientShift = 1;
inline constexpr Eigen::Index kBoundShift = 2;

/// Segment of a coefficient or bound.
inline Eigen::Index segment_of(Eigen::Index index, Eigen::Index shift, Eigen::Index segments) {
  return std::clamp<Eigen::Index>(index - shift, 0, segments - 1);
}

/// Adds `rows`, times the weights of their segments, from row 3 `first` on, their columns from 3 `column` on.
inline void add(const Eigen::MatrixXd& rows, const WindowRange& range, Eigen::Index shift, Eigen::Index first,
                Eigen::Index column, BandedMatrix& band) {
  for (Eigen::Index i = 0; i < rows.rows(); ++i) {
    const double weight = range.weight(segment_of(first + i / 3, shift, range.segments));
    band.add(3 * first + i, 3 * column, weight * rows.row(i));
  }
}

/// The work of solve_windows, step by step.
class Windows {
 public:
  Windows(const BandedProblem& problem, const WindowSettings& settings, const ProgressObserver& observe)
      : problem_(problem),
        ranges_(make_windows(problem.segments(), settings)),
        observe_(observe),
        reach_(3 * (settings.core + settings.overlap + ranges_.front().blend + 2)),
        lambda_(Eigen::VectorXd::Zero(problem.segments() + 2)),
        moments_(problem.parameters(), reach_, reach_),
        solved_apart_(ranges_.size(), false) {}

  [[nodiscard]] WindowSolution run() {
    WindowSolution solution;
    solution.windows = static_cast<Eigen::Index>(ranges_.size());
    estimator_.bias = band();
    find_multipliers();
    from_multipliers();
    repair_moments();
    BandedPrior prior{.moments = {}, .posterior = band(), .image = band()};
    from_moments(prior);
    prior.moments = std::move(moments_);
    solution.iterations = iterations_;
    solution.nearly_singular = std::count(solved_apart_.begin(), solved_apart_.end(), true);
    tell(3.0 * static_cast<double>(ranges_.size()));
    solution.certificate = certify_bands(problem_, estimator_, prior);
    solution.estimator = std::move(estimator_);
    return solution;
  }

 private:
  [[nodiscard]] BandedMatrix band() const { return {problem_.parameters(), reach_, reach_}; }

  void tell(double windows_done) const {
    if (observe_) {
      constexpr double kSolveShare = 0.8;  // of the time is spent on multipliers
      const auto count = static_cast<double>(ranges_.size());
      observe_({.phase = "solving windows",
                .fraction = windows_done <= count
                                ? kSolveShare * windows_done / count
                                : kSolveShare + (1.0 - kSolveShare) * (windows_done / count - 1.0) / 3.0});
    }
  }

  void find_multipliers() {
    for (std::size_t w = 0; w < ranges_.size(); ++w) {
      const LocalWindow window(problem_, ranges_[w]);
      WindowMultipliers found = window.solve({.relative_gap = kLocalGap});
      if (found.multipliers.size() == 0) {
        iterations_ += found.iterations;
        found = window.solve_fully({.relative_gap = kSingularGap});
      }
      for (Eigen::Index l = window.core_bound_first(); l < window.core_bound_behind(); ++l) {
        lambda_(l) += ranges_[w].weight(segment_of(l, kBoundShift, problem_.segments())) *
                      found.multipliers(l - window.first_bound());
      }
      take(window, found, w);
      tell(static_cast<double>(w + 1));
    }
    lambda_ = lambda_.cwiseMax(kLeastShare * lambda_.mean());
    estimator_.root.resize(problem_.parameters());
    for (Eigen::Index l = 0; l < lambda_.size(); ++l) {
      estimator_.root.segment<3>(3 * l).setConstant(std::sqrt(lambda_(l)));
    }
  }

  /// Counts the iterations of a window and, where it found moments, takes its rows of V and W Sigma.
  void take(const LocalWindow& window, const WindowMultipliers& found, std::size_t w) {
    iterations_ += found.iterations;
    if (found.moments.size() == 0) {
      return;
    }
    solved_apart_[w] = true;
    add_moments(window,
                found.moments.middleRows(3 * (window.core_bound_first() - window.first_bound()),
                                         3 * (window.core_bound_behind() - window.core_bound_first())),
                w);
    Eigen::MatrixXd regular = found.moments;
    regular.diagonal().array() += kLeastMoment;
    add_bias(window, -window.from_moments(regular).image, w);  // E = -X D'V^-1 D
  }

  void add_moments(const LocalWindow& window, const Eigen::MatrixXd& rows, std::size_t w) {
    add(rows, ranges_[w], kBoundShift, window.core_bound_first(), window.first_bound(), moments_);
  }

  void add_bias(const LocalWindow& window, const Eigen::MatrixXd& rows, std::size_t w) {
    add(rows, ranges_[w], kCoefficientShift, window.core_first(), window.first_bound(), estimator_.bias);
  }

  void from_multipliers() {
    for (std::size_t w = 0; w < ranges_.size(); ++w) {
      if (!solved_apart_[w]) {
        const LocalWindow window(problem_, ranges_[w]);
        const Eigen::VectorXd root = estimator_.root.segment(3 * window.first_bound(), 3 * window.bounds());
        const std::optional<EstimatorRows> rows = window.from_multipliers(root);
        if (rows) {
          add_bias(window, rows->bias * root.asDiagonal(), w);
          add_moments(window, rows->moments, w);
        } else {
          take(window, window.solve_fully({.relative_gap = kSingularGap}), w);
        }
      }
      tell(static_cast<double>(ranges_.size() + w + 1));
    }
    for (Eigen::Index i = 0; i < estimator_.bias.size(); ++i) {  // W from W Sigma
      for (Eigen::Index j = estimator_.bias.first(i); j < estimator_.bias.behind(i); ++j) {
        estimator_.bias.at(i, j) /= estimator_.root(j);
      }
    }
  }

  /// Makes V symmetric, gives it the block traces the bounds allow, and makes it positive definite.
  void repair_moments() {
    moments_ = linalg::combine(0.5, moments_, 0.5, moments_.transpose());
    scale_moments();
    constexpr double kFirstShift = 1e-6;
    constexpr double kShiftGrowth = 2.0;
    for (double shift = kFirstShift; shift < 1.0; shift *= kShiftGrowth) {
      if (positive_definite(moments_, shift / 2.0)) {
        return;
      }
      for (Eigen::Index i = 0; i < moments_.size(); ++i) {
        moments_.at(i, i) += shift;
      }
      scale_moments();
    }
  }

  void scale_moments() {
    Eigen::VectorXd scale(moments_.size());
    for (Eigen::Index l = 0; l < moments_.size() / 3; ++l) {
      double trace = 0.0;
      for (Eigen::Index i = 3 * l; i < 3 * l + 3; ++i) {
        if (problem_.bounds.row(i).isZero(0.0)) {
          moments_.at(i, i) = std::max(moments_.at(i, i), 1.0);  // no bound: any moment does
        } else {
          trace += moments_.at(i, i);
        }
      }
      scale.segment<3>(3 * l).setConstant(trace > kActive ? 1.0 / std::sqrt(trace) : 1.0);
    }
    for (Eigen::Index i = 0; i < moments_.size(); ++i) {
      for (Eigen::Index j = moments_.first(i); j < moments_.behind(i); ++j) {
        moments_.at(i, j) *= scale(i) * scale(j);
      }
    }
  }

  void from_moments(BandedPrior& prior) {
    for (std::size_t w = 0; w < ranges_.size(); ++w) {
      const LocalWindow window(problem_, ranges_[w]);
      const Eigen::Index at = 3 * window.first_bound();
      const Eigen::Index size = 3 * window.bounds();
      const PriorRows rows = window.from_moments(moments_.block(at, at, size, size));
      add(rows.posterior, ranges_[w], kCoefficientShift, window.core_first(), window.first(),
          prior.posterior);
      add(rows.image, ranges_[w], kCoefficientShift, window.core_first(), window.first_bound(), prior.image);
      tell(static_cast<double>(2 * ranges_.size() + w + 1));
    }
  }

  const BandedProblem& problem_;
  std::vector<WindowRange> ranges_;
  const ProgressObserver& observe_;
  Eigen::Index reach_;
  Eigen::VectorXd lambda_;
  BandedMatrix moments_;
  BandedEstimator estimator_;
  std::vector<bool> solved_apart_;  ///< windows whose W and V are those of their own solution
  int iterations_ = 0;
};

}  // namespace solve_detail

TRAMMEL_INLINE WindowSolution solve_windows(const BandedProblem& problem, const WindowSettings& settings,
                                            const ProgressObserver& observe) {
  validate(settings, "settings");
  const auto start = std::chrono::steady_clock::now();
  WindowSolution solution = solve_detail::Windows(problem, settings, observe).run();
  const BandedCertificate& proved = solution.certificate;
  const bool narrow =
      proved.claim != Claim::kNone && proved.upper - proved.lower <= settings.relative_gap * proved.upper;
  solution.status = narrow ? SolveStatus::kOptimal : SolveStatus::kNumericalTrouble;
  solution.solve_time_s = minimax::seconds_since(start);
  return solution;
}

TRAMMEL_INLINE Eigen::VectorXd least_squares(const BandedProblem& problem) {
  Eigen::MatrixXd c = problem.information_factor.transpose() * Eigen::MatrixXd(problem.rhs);
  linalg::solve_normal_in_place(problem.information_factor, c);
  return c;
}

TRAMMEL_INLINE Eigen::VectorXd estimate_coefficients(const BandedProblem& problem,
                                                     const BandedEstimator& estimator) {
  const Eigen::MatrixXd c = least_squares(problem);
  const Eigen::MatrixXd seen = estimator.root.asDiagonal() * (problem.bounds * c);
  return c + estimator.bias * seen;
}

}  // namespace trammel::inline TRAMMEL_ABI::window
