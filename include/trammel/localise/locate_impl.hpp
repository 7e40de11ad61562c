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
#include "trammel/localise/locate.hpp"

namespace trammel::inline TRAMMEL_ABI::localise {

namespace detail {

/// Share of the ellipsoids that starts are pulled into.
inline constexpr double kStartShare = 0.95;

/// The search for minima of F with weak barriers.
class Search {
 public:
  Search(const FitProblem& problem, const FitSettings& settings) : problem_(problem), settings_(settings) {}

  /// Fits with falling barrier weights from a start that is pulled inside first; keeps the last fit.
  template <std::size_t Count>
  void descend(const Eigen::VectorXd& start, const std::array<double, Count>& weights) {
    const std::optional<Eigen::VectorXd> inside = problem_.pull_inside(start, kStartShare);
    if (!inside) {
      return;
    }
    Fit fit{.z = *inside};
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
  const Eigen::VectorXd zero = Eigen::VectorXd::Zero(problem.parameters());
  search.descend(zero, kLong);
  if (search.minima().empty()) {
    return;  // zero is not above the floor: nothing to start from
  }
  search.descend(zero, kShort);
  const Eigen::VectorXd first = search.minima().front().z;
  const Eigen::MatrixXd weak = weak_directions(problem, first);
  for (Eigen::Index k = 0; k < weak.cols(); ++k) {
    for (const double sigmas : {-7.0, -3.0, 3.0, 7.0}) {
      search.descend(first + sigmas * weak.col(k), kLast);
    }
  }
  for (const double height : station_heights(problem.scenario())) {
    descend_from_mirrors(problem, search, first, height);
  }
  constexpr std::uint64_t kSeed = 1;
  RandomStream stream(kSeed);
  constexpr int kRandom = 2;
  for (int i = 0; i < kRandom; ++i) {
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
    Search search(above, settings);
    search.descend(Eigen::VectorXd::Zero(problem.parameters()), kWeights);
    search.descend(best.z, kWeights);
    location.systems += search.systems();
    location.starts += search.starts();
    const std::vector<Fit> found = search.distinct();
    if (!found.empty()) {
      result.push_back(found.front());
    }
  }
  return result;
}

/// Reference and stated value of a branch.
inline void state_branch(const FitProblem& problem, const LocateSettings& settings, Branch& branch,
                         Location& location) {
  constexpr double kStartScale = 0.9;  // away from the boundary that a weak barrier lets the minimum touch
  const std::optional<Eigen::VectorXd> start =
      problem.pull_inside(kStartScale * branch.minimum.z, kStartShare);
  if (!start) {
    return;
  }
  const Fit strong = fit_levenberg_marquardt(problem, *start, kStrongBarrier, settings.fit);
  location.systems += strong.systems;
  branch.reference = strong.z;
  branch.stated = state(problem, branch.reference, settings.model_error, settings.solver);
}

}  // namespace detail

TRAMMEL_INLINE Location locate(const Scenario& scenario, const LocateSettings& settings) {
  const FitProblem problem(scenario, settings.minimum_height_m);
  Location result;
  detail::Search search(problem, settings.fit);
  detail::explore(problem, search);
  result.starts = search.starts();
  result.systems = search.systems();
  const std::vector<Fit> minima = search.distinct();
  if (minima.empty()) {
    return result;
  }
  result.status = LocateStatus::kUnique;
  result.branches.emplace_back().minimum = minima.front();
  detail::state_branch(problem, settings, result.branches.front(), result);
  const Fit best = minima.front();
  const double g_lin = result.branches.front().stated ? result.branches.front().stated->linear_guarantee_rms_m
                                                      : std::numeric_limits<double>::quiet_NaN();
  const auto compete = [&](const Fit& fit, double excess, bool floor_test) {
    const double distance = problem.distance_m(fit.z, best.z);
    // Without a linear guarantee every distance counts.
    if (!(excess < kDecisiveCost) || distance <= g_lin) {
      return;
    }
    result.status = LocateStatus::kAmbiguous;
    const bool listed =
        std::any_of(result.branches.begin() + 1, result.branches.end(),
                    [&](const Branch& other) { return problem.distance_m(fit.z, other.minimum.z) <= g_lin; });
    if (floor_test && listed) {
      return;  // found as a minimum already
    }
    Branch branch;
    branch.minimum = fit;
    branch.excess_cost = excess;
    branch.distance_m = distance;
    branch.from_floor_test = floor_test;
    detail::state_branch(problem, settings, branch, result);
    result.branches.push_back(std::move(branch));
  };
  for (std::size_t k = 1; k < minima.size(); ++k) {
    compete(minima[k], 2 * (minima[k].cost - best.cost), false);
  }
  for (const Fit& fit : detail::floor_tests(problem, best, result, settings.fit)) {
    compete(fit, detail::free_cost(problem, fit) - detail::free_cost(problem, best), true);
  }
  return result;
}

}  // namespace trammel::inline TRAMMEL_ABI::localise
