// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of locate.hpp.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "trammel/core/random.hpp"
#include "trammel/linalg/cholesky.hpp"
#include "trammel/linalg/symmetric_eigen.hpp"
#include "trammel/localise/interior_motion.hpp"
#include "trammel/localise/locate.hpp"

namespace trammel::inline TRAMMEL_ABI::localise {

namespace detail {

/// Share of the ellipsoids that starts are pulled into.
inline constexpr double kStartShare = 0.95;

/// The search for minima of F with weak barriers.
class Search {
 public:
  /// `centre`: strictly inside.
  Search(const FitProblem& problem, const FitSettings& settings, Eigen::VectorXd centre,
         const ProgressObserver& observe = {})
      : problem_(problem), settings_(settings), centre_(std::move(centre)), observe_(observe) {}

  [[nodiscard]] const Eigen::VectorXd& centre() const { return centre_; }

  /// How many starts there will be: for the progress told.
  void expect(std::size_t starts) { expected_ = static_cast<double>(starts); }

  /// Fits with falling barrier weights from a start that is pulled inside first; keeps the last fit.
  template <std::size_t Count>
  void descend(const Eigen::VectorXd& start, const std::array<double, Count>& weights) {
    if (observe_) {
      observe_({.phase = "searching for motions that explain the data",
                .fraction = static_cast<double>(starts_) / expected_});
    }
    Fit fit{.z = problem_.pull_inside(start, kStartShare, centre_)};
    for (const double mu : weights) {
      fit = fit_levenberg_marquardt(problem_, fit.z, mu, settings_);
      systems_ += fit.systems;
    }
    ++starts_;
    minima_.push_back(std::move(fit));
  }

  /// The minima, best first, those that are the same only once.
  [[nodiscard]] std::vector<Fit> distinct() const {
    constexpr double kSame_m = 3.0;
    constexpr double kSameShare = 0.05;
    std::vector<Fit> sorted = minima_;
    std::sort(sorted.begin(), sorted.end(), [](const Fit& a, const Fit& b) { return a.cost < b.cost; });
    std::vector<Fit> result;
    for (Fit& fit : sorted) {
      const bool known = std::any_of(result.begin(), result.end(), [&](const Fit& other) {
        const double size = problem_.distance_m(other.z, Eigen::VectorXd::Zero(other.z.size()));
        return problem_.distance_m(fit.z, other.z) < std::max(kSame_m, kSameShare * size);
      });
      if (!known) {
        result.push_back(std::move(fit));
      }
    }
    return result;
  }
  [[nodiscard]] const std::vector<Fit>& minima() const { return minima_; }
  [[nodiscard]] int starts() const { return starts_; }
  [[nodiscard]] int systems() const { return systems_; }

 private:
  const FitProblem& problem_;
  FitSettings settings_;
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
    normal += kWeight * rows.transpose() * rows;
    right += kWeight * rows.transpose() * target;
  }
  return linalg::PivotedCholesky(normal).solve(right);
}

/// Heights of the stations, each once.
inline std::vector<double> station_heights(const Scenario& scenario) {
  std::vector<double> heights;
  for (const Station& station : scenario.stations) {
    heights.push_back(station.position_m.z());
  }
  std::sort(heights.begin(), heights.end());
  heights.erase(std::unique(heights.begin(), heights.end()), heights.end());
  return heights;
}

/// Starts from the path mirrored in a plane: all of it, before and after it comes closest, after thirds.
inline void descend_from_mirrors(const FitProblem& problem, Search& search, const Eigen::VectorXd& z,
                                 double plane_m) {
  constexpr std::array kWeights{0.3, kWeakBarrier};
  const TrajectoryProblem& trajectory = problem.trajectory();
  const trajectory::SplineBasis& basis = trajectory.coordinates.basis();
  const trajectory::QuadraticSpline<double> deviation = trajectory.coordinates.spline(z);
  const auto gap = [&](double t) {
    return std::abs(trajectory.nominal.position(t).z() + deviation.position(t).z() - plane_m);
  };
  const double closest = *std::min_element(problem.grid_s().begin(), problem.grid_s().end(),
                                           [&](double a, double b) { return gap(a) < gap(b); });
  search.descend(mirror(problem, z, plane_m, [](double) { return true; }), kWeights);
  search.descend(mirror(problem, z, plane_m, [&](double t) { return t < closest; }), kWeights);
  for (const double from :
       {closest, basis.begin_s() + basis.duration_s() / 3, basis.begin_s() + basis.duration_s() / 2,
        basis.begin_s() + basis.duration_s() * 2 / 3}) {
    search.descend(mirror(problem, z, plane_m, [&](double t) { return t >= from; }), kWeights);
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
  constexpr std::array kLong{30.0, 10.0, 3.0, 1.0, 0.3, kWeakBarrier};
  constexpr std::array kShort{3.0, 1.0, 0.3, kWeakBarrier};
  constexpr std::array kLast{0.3, kWeakBarrier};
  constexpr std::array kSigmas{-7.0, -3.0, 3.0, 7.0};
  constexpr std::size_t kMirrors = 6;
  constexpr std::size_t kRandom = 2;
  const std::vector<double> heights = station_heights(problem.scenario());
  search.expect(2 + 2 * kSigmas.size() + kMirrors * heights.size() + kRandom);
  search.descend(search.centre(), kLong);
  search.descend(search.centre(), kShort);
  const Eigen::VectorXd first = search.minima().front().z;
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
inline double free_cost(const FitProblem& problem, const Fit& fit) {
  return fit.chi2 + 2 * kWeakBarrier * problem.ellipsoid_barrier(fit.z);
}

/// The fits confined above each station's plane that the floor does not exclude already.
inline std::vector<Fit> floor_tests(const FitProblem& problem, const Fit& best, Location& location,
                                    const FitSettings& settings) {
  constexpr std::array kWeights{30.0, 10.0, 3.0, 1.0, 0.3, kWeakBarrier};
  std::vector<Fit> result;
  for (const double height : station_heights(problem.scenario())) {
    if (problem.minimum_height_m() && *problem.minimum_height_m() >= height) {
      continue;
    }
    const FitProblem above(problem.scenario(), height);
    const InteriorMotion interior = find_interior_motion(above);
    if (!interior.z) {
      continue;
    }
    Search search(above, settings, *interior.z);
    search.descend(*interior.z, kWeights);
    search.descend(best.z, kWeights);
    location.systems += search.systems();
    location.starts += search.starts();
    const Fit found = search.distinct().front();
    location.floor_tests.push_back({.height_m = height,
                                    .excess_cost = free_cost(problem, found) - free_cost(problem, best),
                                    .distance_m = problem.distance_m(found.z, best.z)});
    result.push_back(found);
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
    const InteriorMotion interior = find_interior_motion(problem_);
    result_.lowest_height_m = interior.lowest_height_m;
    if (!interior.z) {
      return std::move(result_);
    }
    centre_ = *interior.z;
    Search search(problem_, settings_.fit, centre_, observe_);
    explore(problem_, search);
    result_.starts = search.starts();
    result_.systems = search.systems();
    const std::vector<Fit> minima = search.distinct();
    result_.status = LocateStatus::kUnique;
    result_.branches.emplace_back().minimum = minima.front();
    state_branch(result_.branches.front());
    const Fit best = minima.front();
    for (std::size_t k = 1; k < minima.size(); ++k) {
      compete(minima[k], 2 * (minima[k].cost - best.cost), problem_.distance_m(minima[k].z, best.z), false);
    }
    const std::vector<Fit> confined = floor_tests(problem_, best, result_, settings_.fit);
    for (std::size_t k = 0; k < confined.size(); ++k) {
      const FloorTest& test = result_.floor_tests[k];
      compete(confined[k], test.excess_cost, test.distance_m, true);
    }
    return std::move(result_);
  }

 private:
  /// Lists a motion as a branch if it explains the data nearly as well and is too far from the best.
  void compete(const Fit& fit, double excess, double distance, bool floor_test) {
    const double g_lin = result_.branches.front().stated->linear_guarantee_rms_m;
    // Without a linear guarantee (NaN) every distance counts.
    if (!(excess < kDecisiveCost) || distance <= g_lin) {
      return;
    }
    result_.status = LocateStatus::kAmbiguous;
    const bool listed = std::any_of(
        result_.branches.begin() + 1, result_.branches.end(),
        [&](const Branch& other) { return problem_.distance_m(fit.z, other.minimum.z) <= g_lin; });
    if (floor_test && listed) {
      return;  // found as a minimum already
    }
    Branch branch;
    branch.minimum = fit;
    branch.excess_cost = excess;
    branch.distance_m = distance;
    branch.from_floor_test = floor_test;
    state_branch(branch);
    result_.branches.push_back(std::move(branch));
  }

  /// Reference and stated value of a branch.
  void state_branch(Branch& branch) {
    if (observe_) {
      observe_({.phase = "solving about the motion found", .fraction = 0.0});
    }
    constexpr double kStartScale = 0.9;  // away from the boundary that a weak barrier lets the minimum touch
    const Eigen::VectorXd start = problem_.pull_inside(kStartScale * branch.minimum.z, kStartShare, centre_);
    // To the last digits: the guarantee depends on this point to first order.
    constexpr FitSettings kTight{.max_systems = 5000, .relative_decrease = 1e-18};
    const Fit strong = fit_levenberg_marquardt(problem_, start, kStrongBarrier, kTight);
    result_.systems += strong.systems;
    branch.reference = strong;
    const Eigen::VectorXd there =
        stated_on_.trajectory().coordinates.from_motion(problem_.trajectory().coordinates.motion(strong.z));
    branch.stated = state(stated_on_, there, settings_.model_error, settings_.solver, settings_.method);
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
