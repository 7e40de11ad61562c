// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of locate.hpp.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <span>
#include <utility>
#include <vector>

#include "trammel/core/random.hpp"
#include "trammel/linalg/cholesky.hpp"
#include "trammel/linalg/symmetric_eigen.hpp"
#include "trammel/localise/falling_barriers.hpp"
#include "trammel/localise/interior_motion.hpp"
#include "trammel/localise/locate.hpp"

namespace trammel::inline TRAMMEL_ABI::localise {

namespace detail {

/// Share of the ellipsoids that starts are pulled into.
inline constexpr double kStartShare = 0.95;

/// Barrier weights of a start far from any minimum ...
inline constexpr std::array kLong{30.0, 10.0, 3.0, 1.0, 0.3, kWeakBarrier};
/// ... and of one near the data.
inline constexpr std::array kLast{0.3, kWeakBarrier};

/// The search for minima of F with weak barriers.
class Search {
 public:
  /// `centre`: strictly inside.
  Search(const FitProblem& problem, const LocateSettings& settings, Eigen::VectorXd centre,
         const ProgressObserver& observe = {})
      : problem_(problem),
        settings_(settings.fit),
        minimise_(settings.minimise),
        centre_(std::move(centre)),
        observe_(observe) {}

  [[nodiscard]] const Eigen::VectorXd& centre() const { return centre_; }

  /// How many starts there will be: for the progress told.
  void expect(std::size_t starts) { expected_ = static_cast<double>(starts); }

  /// Fits with falling barrier weights from a start that is pulled inside first; keeps the last fit. Fits are
  /// coarse and end as soon as they come near a minimum known already; a last one that is near none is
  /// carried on, until it is clear that it does not come near the best.
  void descend(const Eigen::VectorXd& start, std::span<const double> weights) {
    if (observe_) {
      observe_({.phase = "searching for motions that explain the data",
                .fraction = static_cast<double>(starts_) / expected_});
    }
    ++starts_;
    Fit fit = fit_with_falling_barriers(problem_, problem_.pull_inside(start, kStartShare, centre_), weights,
                                        minimise_, coarse());
    systems_ += fit.systems;
    if (known(fit.z, minima_)) {
      return;
    }
    FitSettings last = settings_;
    last.target = least_cost() + kDecisiveCost / 2;
    fit = minimise_(problem_, fit.z, weights.back(), last);
    systems_ += fit.systems;
    minima_.push_back(std::move(fit));
  }

  /// The minima, best first, those that are the same only once.
  [[nodiscard]] std::vector<Fit> distinct() const {
    std::vector<Fit> sorted = minima_;
    std::sort(sorted.begin(), sorted.end(), [](const Fit& a, const Fit& b) { return a.cost < b.cost; });
    std::vector<Fit> result;
    for (Fit& fit : sorted) {
      if (!known(fit.z, result)) {
        result.push_back(std::move(fit));
      }
    }
    return result;
  }
  [[nodiscard]] const std::vector<Fit>& minima() const { return minima_; }
  [[nodiscard]] int starts() const { return starts_; }
  [[nodiscard]] int systems() const { return systems_; }

 private:
  [[nodiscard]] FitSettings coarse() const {
    constexpr int kSystems = 100;
    constexpr double kDecrease = 1e-4;  // of F: a hundredth where F is as large as noise makes it
    return {.max_systems = std::min(kSystems, settings_.max_systems),
            .relative_decrease = std::max(kDecrease, settings_.relative_decrease),
            .target = least_cost() + kDecisiveCost / 2,
            .stop = [this](const Eigen::VectorXd& z) { return known(z, minima_); }};
  }

  [[nodiscard]] double least_cost() const {
    double least = std::numeric_limits<double>::infinity();
    for (const Fit& fit : minima_) {
      least = std::min(least, fit.cost);
    }
    return least;
  }

  /// Whether z is at one of `others`.
  [[nodiscard]] bool known(const Eigen::VectorXd& z, const std::vector<Fit>& others) const {
    constexpr double kSame_m = 3.0;
    constexpr double kSameShare = 0.05;
    return std::any_of(others.begin(), others.end(), [&](const Fit& other) {
      const double size = problem_.distance_m(other.z, Eigen::VectorXd::Zero(other.z.size()));
      return problem_.distance_m(z, other.z) < std::max(kSame_m, kSameShare * size);
    });
  }

  const FitProblem& problem_;
  FitSettings settings_;
  Minimiser minimise_;
  Eigen::VectorXd centre_;
  ProgressObserver observe_;
  double expected_ = 1.0;
  std::vector<Fit> minima_;
  int starts_ = 0;
  int systems_ = 0;
};

/// Sum of a_l'a_l: three times it is the inverse of the ridge prior d^2/3.
inline Eigen::MatrixXd bound_gram(const FitProblem& problem) {
  Eigen::MatrixXd gram = Eigen::MatrixXd::Zero(problem.parameters(), problem.parameters());
  for (const Eigen::MatrixXd& a : problem.trajectory().problem.ellipsoids) {
    gram += a.transpose() * a;
  }
  return gram;
}

/// Displacements of one standard deviation along the two weakest directions at z.
inline Eigen::MatrixXd weak_directions(const FitProblem& problem, const Eigen::VectorXd& z) {
  const Eigen::MatrixXd& C = problem.trajectory().problem.criterion_factor;
  const linalg::PivotedCholesky information(3 * bound_gram(problem) + problem.expand(z, 0.0).hessian);
  const Eigen::MatrixXd spread = information.solve(C.transpose());
  const linalg::SymmetricEigen eigen(C * spread);
  const Eigen::Index count = std::min<Eigen::Index>(2, C.rows());
  Eigen::MatrixXd result(z.size(), count);
  for (Eigen::Index k = 0; k < count; ++k) {
    const Eigen::Index at = C.rows() - 1 - k;
    const double variance = std::max(eigen.eigenvalues()(at), std::numeric_limits<double>::min());
    result.col(k) = spread * eigen.eigenvectors().col(at) / std::sqrt(variance);
  }
  return result;
}

/// The motion whose path is mirrored in the plane of height `plane_m` where `mirrored(t)`: ridge least
/// squares on the grid.
template <class Where>
[[nodiscard]] Eigen::VectorXd mirror(const FitProblem& problem, const Eigen::VectorXd& z, double plane_m,
                                     Where&& mirrored) {
  constexpr double kWeight = 1e-4;  // 1/m^2: paths agree to about 100 m
  const TrajectoryProblem& trajectory = problem.trajectory();
  Eigen::MatrixXd normal = 3 * bound_gram(problem);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(z.size());
  for (const double t : problem.grid_s()) {
    const MotionCoordinates::Rows3 rows = trajectory.coordinates.position_rows(t);
    Eigen::Vector3d target = rows * z;
    if (mirrored(t)) {
      const double nominal = trajectory.nominal.position(t).z();
      target.z() = 2 * plane_m - (nominal + target.z()) - nominal;
    }
    const NonzeroColumns local = nonzero_columns(rows);
    const MotionCoordinates::Rows3 near = rows.middleCols(local.first, local.count);
    normal.block(local.first, local.first, local.count, local.count) += kWeight * near.transpose() * near;
    right.segment(local.first, local.count) += kWeight * near.transpose() * target;
  }
  return linalg::PivotedCholesky(normal).solve(right);
}

/// Heights of the stations, each once; of one that moves, the mean over its track.
inline std::vector<double> station_heights(const Scenario& scenario) {
  std::vector<double> heights;
  for (const Station& station : scenario.stations) {
    const std::vector<Eigen::Vector3d>& track = station.track.positions_m;
    const Eigen::Vector3d sum =
        std::accumulate(track.begin(), track.end(), Eigen::Vector3d(Eigen::Vector3d::Zero()));
    heights.push_back(track.empty() ? station.position_m.z() : sum.z() / static_cast<double>(track.size()));
  }
  std::sort(heights.begin(), heights.end());
  heights.erase(std::unique(heights.begin(), heights.end()), heights.end());
  return heights;
}

/// Starts from the path mirrored in a plane: all of it, before and after it comes closest, after thirds.
inline void descend_from_mirrors(const FitProblem& problem, Search& search, const Eigen::VectorXd& z,
                                 double plane_m) {
  const TrajectoryProblem& trajectory = problem.trajectory();
  const trajectory::SplineBasis& basis = trajectory.coordinates.basis();
  const trajectory::QuadraticSpline<double> deviation = trajectory.coordinates.spline(z);
  const auto gap = [&](double t) {
    return std::abs(trajectory.nominal.position(t).z() + deviation.position(t).z() - plane_m);
  };
  const double closest = *std::min_element(problem.grid_s().begin(), problem.grid_s().end(),
                                           [&](double a, double b) { return gap(a) < gap(b); });
  search.descend(mirror(problem, z, plane_m, [](double) { return true; }), kLast);
  std::vector<double> from_s{basis.begin_s() + basis.duration_s() / 3,
                             basis.begin_s() + basis.duration_s() / 2,
                             basis.begin_s() + basis.duration_s() * 2 / 3};
  if (closest > basis.begin_s()) {  // else there is nothing before it, and all after it
    search.descend(mirror(problem, z, plane_m, [&](double t) { return t < closest; }), kLast);
    from_s.insert(from_s.begin(), closest);
  }
  for (const double from : from_s) {
    search.descend(mirror(problem, z, plane_m, [&](double t) { return t >= from; }), kLast);
  }
}

/// A motion drawn within the bounds.
inline Eigen::VectorXd random_motion(const FitProblem& problem, RandomStream& stream) {
  const MotionBounds& bounds = problem.scenario().bounds;
  const MotionCoordinates& coordinates = problem.trajectory().coordinates;
  Eigen::VectorXd theta(coordinates.all_parameters());
  for (Eigen::Index place = 0; place < theta.size(); ++place) {
    const double axis = semi_axes(bounds, place / 3)(place % 3);
    theta(place) = std::isfinite(axis) ? axis * (2 * stream.uniform() - 1) : 0.0;
  }
  return coordinates.from_motion(theta);
}

inline void explore(const FitProblem& problem, Search& search) {
  constexpr std::array kShort{3.0, 1.0, 0.3, kWeakBarrier};
  constexpr std::array kSigmas{-7.0, -3.0, 3.0, 7.0};
  constexpr std::size_t kMirrors = 6;
  constexpr std::size_t kRandom = 2;
  const std::vector<double> heights = station_heights(problem.scenario());
  search.expect(2 + 2 * kSigmas.size() + kMirrors * heights.size() + kRandom);
  search.descend(search.centre(), kLong);
  search.descend(search.centre(), kShort);
  const Eigen::VectorXd first = search.distinct().front().z;
  const Eigen::MatrixXd weak = weak_directions(problem, first);
  for (Eigen::Index k = 0; k < weak.cols(); ++k) {
    for (const double sigmas : kSigmas) {
      search.descend(first + sigmas * weak.col(k), kLast);
    }
  }
  for (const double height : heights) {
    descend_from_mirrors(problem, search, first, height);
  }
  constexpr std::uint64_t kSeed = 1;
  RandomStream stream(kSeed);
  for (std::size_t i = 0; i < kRandom; ++i) {
    search.descend(random_motion(problem, stream), kLast);
  }
}

/// Twice F without the floor's barrier.
inline double free_cost(const FitProblem& problem, const Fit& fit, double mu) {
  return fit.chi2 + 2 * mu * problem.ellipsoid_barrier(fit.z);
}

/// The fit that a linearisation is made about, from a fit with weak barriers.
inline Fit fit_reference(const FitProblem& problem, const Eigen::VectorXd& minimum,
                         const Eigen::VectorXd& centre, const Minimiser& minimise) {
  constexpr double kStartScale = 0.9;  // away from the boundary that a weak barrier lets the minimum touch
  // To the last digits: the guarantee depends on this point to first order.
  const FitSettings tight{.max_systems = 5000, .relative_decrease = 1e-18};
  return minimise(problem, problem.pull_inside(kStartScale * minimum, kStartShare, centre), kStrongBarrier,
                  tight);
}

/// A motion that may be the true one.
struct Candidate {
  Fit minimum;    ///< weak barriers
  Fit reference;  ///< strong barriers
};

/// The fits confined above each station's plane that the floor does not exclude already, one for each entry
/// that this adds to location.floor_tests.
inline std::vector<Candidate> floor_tests(const FitProblem& problem, Location& location,
                                          const LocateSettings& settings) {
  const Fit& best = location.branches.front().minimum;
  const Fit& reference = location.branches.front().reference;
  std::vector<Candidate> result;
  for (const double height : station_heights(problem.scenario())) {
    if (problem.minimum_height_m() && *problem.minimum_height_m() >= height) {
      continue;
    }
    const FitProblem above = problem.with_minimum_height(height);
    const InteriorMotion interior = find_interior_motion(above, settings.minimise);
    if (!interior.z) {
      continue;
    }
    Search search(above, settings, *interior.z);
    search.descend(best.z, kLast);  // all but there already, unless it lies below
    search.descend(*interior.z, kLong);
    Candidate found{.minimum = search.distinct().front(), .reference = {}};
    found.reference = fit_reference(above, found.minimum.z, *interior.z, settings.minimise);
    location.systems += search.systems();
    location.starts += search.starts();
    const auto excess = [&](const Fit& fit, const Fit& free, double mu) {
      return free_cost(problem, fit, mu) - free_cost(problem, free, mu);
    };
    location.floor_tests.push_back(
        {.height_m = height,
         .excess_cost = excess(found.minimum, best, kWeakBarrier),
         .distance_m = problem.distance_m(found.minimum.z, best.z),
         .reference_excess_cost = excess(found.reference, reference, kStrongBarrier),
         .reference_distance_m = problem.distance_m(found.reference.z, reference.z)});
    result.push_back(std::move(found));
  }
  return result;
}

/// Finds, compares and states.
class Locator {
 public:
  Locator(const FitProblem& problem, const FitProblem& stated_on, const LocateSettings& settings,
          const ProgressObserver& observe)
      : problem_(problem), stated_on_(stated_on), settings_(settings), observe_(observe) {}

  [[nodiscard]] Location run() {
    const InteriorMotion interior = find_interior_motion(problem_, settings_.minimise);
    result_.lowest_height_m = interior.lowest_height_m;
    if (!interior.z) {
      return std::move(result_);
    }
    centre_ = *interior.z;
    Search search(problem_, settings_, centre_, observe_);
    explore(problem_, search);
    result_.starts = search.starts();
    result_.systems = search.systems();
    const std::vector<Fit> minima = search.distinct();
    result_.status = LocateStatus::kUnique;
    const Fit best = minima.front();
    add_branch({.minimum = best, .reference = fit_reference(problem_, best.z, centre_, settings_.minimise)},
               0.0, 0.0);
    for (std::size_t k = 1; k < minima.size(); ++k) {
      const double excess = 2 * (minima[k].cost - best.cost);
      const double distance = problem_.distance_m(minima[k].z, best.z);
      if (competes(excess, distance, kDecisiveCost)) {
        add_branch({.minimum = minima[k],
                    .reference = fit_reference(problem_, minima[k].z, centre_, settings_.minimise)},
                   excess, distance);
      }
    }
    std::vector<Candidate> confined = floor_tests(problem_, result_, settings_);
    for (std::size_t k = 0; k < confined.size(); ++k) {
      const FloorTest& test = result_.floor_tests[k];
      if (competes(test.excess_cost, test.distance_m, kDecisiveFloorCost)) {
        add_confined(std::move(confined[k]), test.excess_cost, test.distance_m);
      } else if (competes(test.reference_excess_cost, test.reference_distance_m, kDecisiveFloorCost)) {
        add_confined(std::move(confined[k]), test.reference_excess_cost, test.reference_distance_m);
      }
    }
    if (result_.branches.size() > 1) {
      result_.status = LocateStatus::kAmbiguous;
    }
    return std::move(result_);
  }

 private:
  /// Whether a motion explains the data nearly as well as the best and is too far from it.
  [[nodiscard]] bool competes(double excess, double distance, double decisive) const {
    // Without a linear guarantee (NaN) every distance counts.
    return excess < decisive && !(distance <= result_.branches.front().stated->linear_guarantee_rms_m);
  }

  /// Adds a fit that a floor test found unless it is one of the branches already.
  void add_confined(Candidate found, double excess, double distance) {
    const double g_lin = result_.branches.front().stated->linear_guarantee_rms_m;
    const bool listed =
        std::any_of(result_.branches.begin() + 1, result_.branches.end(), [&](const Branch& other) {
          return problem_.distance_m(found.minimum.z, other.minimum.z) <= g_lin &&
                 problem_.distance_m(found.reference.z, other.reference.z) <= g_lin;
        });
    if (!listed) {
      add_branch(std::move(found), excess, distance);
      result_.branches.back().from_floor_test = true;
    }
  }

  void add_branch(Candidate fits, double excess, double distance) {
    if (observe_) {
      observe_({.phase = "solving about the motion found", .fraction = 0.0});
    }
    result_.systems += fits.reference.systems;
    Branch branch;
    branch.minimum = std::move(fits.minimum);
    branch.reference = std::move(fits.reference);
    branch.excess_cost = excess;
    branch.distance_m = distance;
    constexpr double kAlmost = 1.0 - 1e-9;  // coordinates are moved with rounding errors
    const MotionCoordinates& from = problem_.trajectory().coordinates;
    const MotionCoordinates& to = stated_on_.trajectory().coordinates;
    const Eigen::VectorXd there = stated_on_.pull_inside(to.moved_from(from, branch.reference.z), kAlmost,
                                                         to.moved_from(from, centre_));
    branch.stated = state(stated_on_, there, settings_.model_error, settings_.solver, settings_.method);
    result_.branches.push_back(std::move(branch));
  }

  const FitProblem& problem_;
  const FitProblem& stated_on_;
  const LocateSettings& settings_;
  const ProgressObserver& observe_;
  Eigen::VectorXd centre_;
  Location result_;
};

}  // namespace detail

TRAMMEL_INLINE Location locate(const Scenario& scenario, const LocateSettings& settings,
                               const ProgressObserver& observe) {
  const FitProblem problem(scenario, settings.minimum_height_m);
  return locate(problem, problem, settings, observe);
}

TRAMMEL_INLINE Location locate(const FitProblem& fit, const FitProblem& stated_on,
                               const LocateSettings& settings, const ProgressObserver& observe) {
  return detail::Locator(fit, stated_on, settings, observe).run();
}

}  // namespace trammel::inline TRAMMEL_ABI::localise
