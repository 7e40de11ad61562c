// SPDX-License-Identifier: Apache-2.0
/// @file
/// The primal-dual interior-point iteration on a Model.
#pragma once

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <deque>
#include <limits>
#include <optional>
#include <type_traits>
#include <utility>
#include <vector>

#include "trammel/core/progress.hpp"
#include "trammel/sdp/detail/dense_cone.hpp"
#include "trammel/sdp/detail/diagonal_cone.hpp"
#include "trammel/sdp/detail/model.hpp"
#include "trammel/sdp/detail/outcome.hpp"
#include "trammel/sdp/detail/schur_system.hpp"
#include "trammel/sdp/solution.hpp"

namespace trammel::inline TRAMMEL_ABI::sdp::detail {

template <class ScalarType>
class InteriorPoint {
 public:
  using Scalar = ScalarType;
  using Vector = VectorOf<Scalar>;
  using Matrix = MatrixOf<Scalar>;
  static_assert(Cone<DenseCone<Scalar>> && Cone<DiagonalCone<Scalar>>);

  InteriorPoint(const Model& model, const Settings& settings, const ProgressObserver& observe)
      : model_(model),
        settings_(settings),
        observe_(observe),
        cost_(model.cost.cast<Scalar>()),
        diagonal_(model.diagonal),
        system_(equation_matrix(model), std::is_same_v<Scalar, double> ? schur_density(model) : 1.0) {
    for (const DenseData& data : model.dense) {
      dense_.emplace_back(data);
    }
  }

  /// The algorithm, from the iterate given or from multiples of the identity.
  [[nodiscard]] Outcome run(const Start* from = nullptr) {
    start(from);
    for (iteration_ = 0;; ++iteration_) {
      measure();
      keep_landmarks();
      if (close_gap()) {
        return finish(Status::kOptimal);
      }
      search_last_step();
      if (const std::optional<Status> reason = reason_to_stop()) {
        if (*reason != Status::kNumericalTrouble || !change_strategy()) {
          return finish(*reason);
        }
      }
      choose_treatment();
      if (!build_schur_system()) {
        return finish(Status::kNumericalTrouble);
      }
      solve_direction(Scalar(0), Order::kFirst);
      const Scalar target = centring() * mu_;
      solve_direction(target, Order::kSecond);
      take_step();
    }
  }

 private:
  enum class Order { kFirst, kSecond };
  /// Where the feasible Y have no interior, x grows without end as <F_i, Y> = c_i is approached, and
  /// rounding errors with it. kRegularised leaves the small residual r that is reached: the problem with
  /// costs c + r has interior points on both sides, and its path bounded x. `close_gap` makes r vanish.
  enum class Aim { kSolution, kRegularised };
  struct Iterate {
    Vector x;
    Vector free;
    std::vector<Matrix> dense_x;
    std::vector<Matrix> dense_y;
    Vector diagonal_x;
    Vector diagonal_y;
  };
  using Clock = std::chrono::steady_clock;

  template <class Visit>
  void for_each_cone(Visit&& visit) {
    for (DenseCone<Scalar>& cone : dense_) {
      visit(cone);
    }
    if (diagonal_.size() > 0) {
      visit(diagonal_);
    }
  }

  static Matrix equation_matrix(const Model& model) {
    Matrix g = Matrix::Zero(model.cost.size(), model.equations.size);
    for (const DiagonalEntry& e : model.equations.entries) {
      if (e.variable != kConstant) {
        g(e.variable, e.row) = Scalar(e.value);
      }
    }
    return g;
  }

  /// Multiples of the identity per block as in Toh, Todd, Tutuncu (1999), section 4.
  void start(const Start* from) {
    const Eigen::Index m = cost_.size();
    x_ = Vector::Zero(m);
    free_ = Vector::Zero(model_.equations.size);
    equations_ = equation_matrix(model_);
    equation_right_ = Vector::Zero(model_.equations.size);
    constant_size_ = Scalar(0);
    coefficient_squares_ = Eigen::VectorXd::Zero(m);
    for (const DiagonalEntry& e : model_.equations.entries) {
      if (e.variable == kConstant) {
        equation_right_[e.row] = Scalar(e.value);
        constant_size_ = std::max(constant_size_, Scalar(std::abs(e.value)));
      }
    }
    for (std::size_t b = 0; b < dense_.size(); ++b) {
      Eigen::VectorXd squares = Eigen::VectorXd::Zero(m);
      double constant = 0.0;
      for (const Entry& e : model_.dense[b].entries) {
        const double square = (e.row == e.column ? 1.0 : 2.0) * e.value * e.value;
        if (e.variable == kConstant) {
          constant += square;
          constant_size_ = std::max(constant_size_, Scalar(std::abs(e.value)));
        } else {
          squares[e.variable] += square;
        }
      }
      for (const LowRankTerm& t : model_.dense[b].low_rank) {
        squares[t.variable] += (t.vectors * t.weights.asDiagonal() * (t.vectors.transpose() * t.vectors) *
                                t.weights.asDiagonal() * t.vectors.transpose())
                                   .trace();
      }
      coefficient_squares_ += squares;
      const auto [x0, y0] = starting_sizes(squares, constant, model_.dense[b].size);
      dense_[b].start(Scalar(x0), Scalar(y0));
      total_size_ += model_.dense[b].size;
    }
    start_diagonal();
    if (from != nullptr && from->x.size() > 0) {
      start_from(*from);
    }
  }

  /// Leaves the multiples of the identity where rounding to double took the iterate out of the cones.
  void start_from(const Start& from) {
    keep(best_);
    x_ = from.x.template cast<Scalar>();
    free_ = from.multiplier.free.template cast<Scalar>();
    for (std::size_t b = 0; b < dense_.size(); ++b) {
      dense_[b].set(from.slack.dense[b].template cast<Scalar>(),
                    from.multiplier.dense[b].template cast<Scalar>());
    }
    diagonal_.set(from.slack.diagonal.template cast<Scalar>(),
                  from.multiplier.diagonal.template cast<Scalar>());
    bool inside = true;
    for_each_cone([&](auto& cone) { inside = cone.factorise() && inside; });
    if (!inside) {
      restore(best_);
    }
  }

  void start_diagonal() {
    const Eigen::Index rows = diagonal_.size();
    Eigen::VectorXd squares = Eigen::VectorXd::Zero(cost_.size());
    double constant = 0.0;
    for (const DiagonalEntry& e : model_.diagonal.entries) {
      if (e.variable == kConstant) {
        constant += e.value * e.value;
        constant_size_ = std::max(constant_size_, Scalar(std::abs(e.value)));
      } else {
        squares[e.variable] += e.value * e.value;
      }
    }
    coefficient_squares_ += squares;
    const auto [x0, y0] = starting_sizes(squares, constant, 1);
    diagonal_.set(Vector::Constant(rows, Scalar(x0)), Vector::Constant(rows, Scalar(y0)));
    total_size_ += static_cast<int>(rows);
  }

  [[nodiscard]] std::pair<double, double> starting_sizes(const Eigen::VectorXd& squares, double constant,
                                                         int size) const {
    constexpr double kSmallest = 10.0;
    const double n = size;
    double x0 = std::max({kSmallest, std::sqrt(n), std::sqrt(constant)});
    double y0 = std::max(kSmallest, std::sqrt(n));
    for (Eigen::Index i = 0; i < squares.size(); ++i) {
      if (squares[i] > 0.0) {
        const double norm = std::sqrt(squares[i]);
        x0 = std::max(x0, norm);
        y0 = std::max(y0, n * (1.0 + std::abs(model_.cost[i])) / (1.0 + norm));
      }
    }
    return {x0, y0};
  }

  /// Residuals, objectives and error measures of the iterate; keeps the best one.
  void measure() {
    dual_residual_ = cost_;
    Scalar squares(0);
    Scalar inner(0);
    for_each_cone([&](auto& cone) {
      cone.update_residual(x_);
      cone.add_adjoint_y(dual_residual_, Scalar(-1));
      squares += cone.residual_norm_squared();
      inner += cone.inner_product();
    });
    dual_objective_ = dual_objective();
    dual_residual_ -= equations_ * free_;
    equation_residual_ = equation_right_ - equations_.transpose() * x_;
    squares += equation_residual_.squaredNorm();
    primal_objective_ = cost_.dot(x_);
    mu_ = inner / Scalar(std::max(1, total_size_));
    using std::abs;
    using std::sqrt;
    objective_size_ = Scalar(1) + abs(primal_objective_) + abs(dual_objective_);
    const Scalar size = objective_size_;
    dual_error_ = static_cast<double>(dual_residual_.norm() / (Scalar(1) + max_abs(cost_)));
    primal_error_ = static_cast<double>(sqrt(squares) / (Scalar(1) + constant_size_));
    const double gap = static_cast<double>(abs(primal_objective_ - dual_objective_) / size);
    primal_error_ = std::max(primal_error_, rounding_error());
    error_ =
        std::max({dual_error_, primal_error_, gap, std::abs(static_cast<double>(inner / size)), negative_y_});
    if (error_ < best_error_) {
      if (error_ < kRealProgress * best_error_) {
        last_progress_ = iteration_;
      }
      best_error_ = error_;
      keep(best_);
    }
    if (observe_) {
      const double range =
          std::log10(std::max(best_error_, settings_.tolerance)) / std::log10(settings_.tolerance);
      fraction_ = std::max(fraction_, std::clamp(range, 0.0, 1.0));
      observe_({"semidefinite program", fraction_});
    }
  }

  /// Iterates to come back to, and the size of x that later ones are compared with.
  void keep_landmarks() {
    const bool sound = static_cast<double>(system_.relative_residual()) <= kSound;
    if (sound && std::min(step_x_, step_y_) > kLongStep && aim_ == Aim::kSolution) {
      keep(sound_);
    }
    if (feasible_at_ < 0 && std::max(dual_error_, primal_error_) <= kFloor * settings_.tolerance) {
      keep(feasible_);
      feasible_at_ = iteration_;
    }
    if (std::isnan(norm_midway_) && error_ < kMidway) {
      norm_midway_ = static_cast<double>(x_.norm());
    }
  }

  /// <F_0, Y>.
  [[nodiscard]] Scalar dual_objective() {
    Scalar sum = equation_right_.dot(free_);
    for_each_cone([&](auto& cone) { sum += cone.constant_times_y(); });
    return sum;
  }

  /// What rounding x to double will add to the primal error; counts only where more digits are computed with.
  [[nodiscard]] double rounding_error() const {
    if constexpr (std::is_same_v<Scalar, double>) {
      return 0.0;
    } else {
      const Eigen::VectorXd x = x_.template cast<double>();
      const double moved = std::sqrt(x.cwiseAbs2().dot(coefficient_squares_));
      return kRoundedLeast * std::numeric_limits<double>::epsilon() / 2.0 * moved /
             static_cast<double>(Scalar(1) + constant_size_);
    }
  }

  static Scalar max_abs(const Vector& v) {
    Scalar largest(0);
    for (Eigen::Index i = 0; i < v.size(); ++i) {
      using std::abs;
      largest = std::max(largest, abs(v[i]));
    }
    return largest;
  }

  [[nodiscard]] std::optional<Status> reason_to_stop() {
    if (error_ <= settings_.tolerance) {
      return Status::kOptimal;
    }
    if (const std::optional<Status> infeasible = infeasibility()) {
      return infeasible;
    }
    if (iteration_ >= settings_.max_iterations) {
      return Status::kIterationLimit;
    }
    const bool stuck = std::max(step_x_, step_y_) < kSmallestStep;
    if (!std::isfinite(error_) || stuck ||
        iteration_ - last_progress_ > (small_pivots_ == SmallPivots::kShift ? kPatience : kShortPatience)) {
      return Status::kNumericalTrouble;
    }
    return std::nullopt;
  }

  /// After trouble: back to an earlier iterate, with another treatment of small pivots or another aim.
  [[nodiscard]] bool change_strategy() {
    if (aim_ == Aim::kRegularised) {
      regularised_ = true;
      if (!early_) {
        return false;
      }
      early_ = false;
      aim_ = Aim::kSolution;
      restore(feasible_);
    } else if (small_pivots_ == SmallPivots::kHold) {
      treat_small_pivots(root_is_cheap() ? SmallPivots::kNone : SmallPivots::kShift);
      restore(best_);
    } else if (!regularised_ && best_error_ > settings_.acceptable_tolerance) {
      aim_ = Aim::kRegularised;
      restore(feasible_at_ >= 0 ? feasible_ : best_);
    } else {
      return false;
    }
    bool inside = true;
    for_each_cone([&](auto& cone) { inside = cone.factorise() && inside; });
    last_progress_ = iteration_;
    step_x_ = step_y_ = 1.0;
    measure();
    return inside;
  }

  [[nodiscard]] bool root_is_cheap() {
    const auto m = static_cast<double>(cost_.size());
    return static_cast<double>(root_rows()) * m * m <= kCheapRoot;
  }

  [[nodiscard]] Eigen::Index root_rows() {
    Eigen::Index rows = 0;
    for_each_cone([&](auto& cone) { rows += cone.root_rows(); });
    return rows;
  }

  void restore(const Iterate& kept) {
    x_ = kept.x;
    free_ = kept.free;
    for (std::size_t b = 0; b < dense_.size(); ++b) {
      dense_[b].set(kept.dense_x[b], kept.dense_y[b]);
    }
    diagonal_.set(kept.diagonal_x, kept.diagonal_y);
  }

  /// Where x grows without end: at the point of the last step where c'x = <F_0, Y>, <X, Y> = x'r is left.
  /// Moving Y to the nearest point without r removes both and costs negative eigenvalues far below r. Whether
  /// that ends within the tolerance; the iterate is kept as the best one then.
  [[nodiscard]] bool close_gap() {
    if (iteration_ == 0) {
      return false;
    }
    const double gap = static_cast<double>((primal_objective_ - dual_objective_) / objective_size_);
    const double gap_step = static_cast<double>(
        (Scalar(step_x_) * cost_.dot(dx_) - Scalar(step_y_) * dual_change_) / objective_size_);
    const bool crossed = gap < 0.0 && gap_step < gap;
    const bool wanted = aim_ == Aim::kRegularised ? gap <= settings_.tolerance : crossed && diverging();
    const bool late = only_residual_left();
    if (!late && (!wanted || dual_error_ > kCrossing * settings_.tolerance)) {
      return false;
    }
    Iterate here;
    keep(here);
    if (crossed && !late) {
      const double back = gap / gap_step;
      move(-back * step_x_, -back * step_y_);
      measure();
    }
    project_multiplier();
    // Once more of the same is no better, what is acceptable has to do.
    const bool wait = late && error_ > settings_.tolerance && error_ < kRealProgress * late_error_;
    const bool fine = error_ <= settings_.acceptable_tolerance && !wait;
    if (!fine) {
      next_late_ = iteration_ + kLatePause;
      late_error_ = error_;
      negative_y_ = 0.0;
      restore(here);
      measure();
    }
    return fine;
  }

  /// Whether rounding errors in the constraints <F_i, Y> = c_i alone keep the error up.
  [[nodiscard]] bool only_residual_left() const {
    const auto complementarity = static_cast<double>(mu_ * Scalar(total_size_) / objective_size_);
    return iteration_ >= next_late_ && dual_error_ > settings_.tolerance &&
           std::max(complementarity, primal_error_) <= settings_.tolerance;
  }

  /// Whether x has grown since the middle of the way: the sign of a problem without interior points.
  [[nodiscard]] bool diverging() const { return static_cast<double>(x_.norm()) > kDiverging * norm_midway_; }

  /// Moves Y to the nearest point where <F_i, Y> = c_i, if that is violated; the error measures count the
  /// eigenvalues of Y that became negative.
  void project_multiplier() {
    const auto share_of_gap = static_cast<double>(x_.dot(dual_residual_) / objective_size_);
    const double violated = std::max(dual_error_, std::abs(share_of_gap));
    if (!(violated > kNoViolation * settings_.tolerance) || !std::isfinite(violated)) {
      return;
    }
    system_.treat_small_pivots(SmallPivots::kHold);
    Matrix& gram = system_.clear();
    for_each_cone([&](auto& cone) { cone.add_gram(gram); });
    if (!system_.factorise()) {
      return;
    }
    Vector right = Vector::Zero(cost_.size() + equations_.cols());
    right.head(cost_.size()) = -dual_residual_;
    const Vector solution = system_.solve(right);
    system_.treat_small_pivots(small_pivots_);
    const Vector correction = solution.head(cost_.size());
    free_ += solution.tail(equations_.cols());
    for_each_cone([&](auto& cone) { cone.subtract_from_y(correction); });
    double smallest = 0.0;
    for_each_cone([&](auto& cone) { smallest = std::min(smallest, cone.smallest_y()); });
    negative_y_ = -smallest / static_cast<double>(Scalar(1) + max_abs(cost_));
    measure();
  }

  /// Where rounding errors are about to win, the best balance of gap and complementarity may lie within the
  /// last step: looks for it there and keeps it as the best iterate.
  void search_last_step() {
    constexpr int kPoints = 63;
    constexpr double kNear = 30.0;
    constexpr double kWorthIt = 0.999;
    if (iteration_ == 0 || error_ <= settings_.tolerance || error_ > kNear * settings_.acceptable_tolerance) {
      return;
    }
    const auto size = static_cast<double>(objective_size_);
    const auto gap = static_cast<double>(primal_objective_ - dual_objective_) / size;
    const auto gap_step =
        static_cast<double>(Scalar(step_x_) * cost_.dot(dx_) - Scalar(step_y_) * dual_change_) / size;
    double best = kWorthIt * std::min(error_, best_error_);
    double chosen = 0.0;
    for (int k = 1; k <= kPoints; ++k) {
      const double back = static_cast<double>(k) / (kPoints + 1);
      Scalar inner(0);
      for_each_cone(
          [&](auto& cone) { inner += cone.after_step(Scalar(-back * step_x_), Scalar(-back * step_y_)); });
      const double estimate = std::max(
          {std::abs(gap - back * gap_step), static_cast<double>(inner) / size, primal_error_, dual_error_});
      if (estimate < best) {
        best = estimate;
        chosen = back;
      }
    }
    if (chosen > 0.0) {
      move(-chosen * step_x_, -chosen * step_y_);
      measure();
      move(chosen * step_x_, chosen * step_y_);
      measure();
    }
  }

  void move(double a, double b) {
    for_each_cone([&](auto& cone) {
      cone.step(Side::kX, Scalar(a));
      cone.step(Side::kY, Scalar(b));
    });
    x_ += Scalar(a) * dx_;
    free_ += Scalar(b) * dfree_;
  }

  /// Looks for a ray: Y / <F_0, Y> against (P), x / |c'x| against (D).
  [[nodiscard]] std::optional<Status> infeasibility() {
    double violation = std::numeric_limits<double>::infinity();
    std::optional<Status> status;
    if (primal_error_ > settings_.tolerance && dual_objective_ > Scalar(0)) {
      violation = static_cast<double>((cost_ - dual_residual_).norm() / dual_objective_);
      status = Status::kPrimalInfeasible;
    }
    if (dual_error_ > settings_.tolerance && primal_objective_ < Scalar(0)) {
      const double other = ray_x_violation();
      if (other < violation) {
        violation = other;
        status = Status::kDualInfeasible;
      }
    }
    if (violation < best_violation_) {
      if (violation < kRealProgress * best_violation_) {
        last_progress_ = iteration_;
      }
      best_violation_ = violation;
    }
    if (!(violation <= settings_.infeasibility_tolerance)) {
      return std::nullopt;
    }
    ray_violation_ = violation;
    return status;
  }

  /// Bound of -lambda_min(sum x_i F_i / |c'x|): distance of sum x_i F_i to X in the cone.
  [[nodiscard]] double ray_x_violation() {
    Scalar squares = (equations_.transpose() * x_).squaredNorm();
    for_each_cone([&](auto& cone) { squares += cone.distance_to_ray_squared(); });
    using std::sqrt;
    return static_cast<double>(sqrt(squares) / -primal_objective_);
  }

  [[nodiscard]] bool build_schur_system() {
    if (iteration_ == 0) {
      bool inside = true;
      for_each_cone([&](auto& cone) { inside = cone.factorise() && inside; });
    }
    const auto begin = Clock::now();
    const bool through_root = small_pivots_ == SmallPivots::kNone;
    if (through_root) {
      Matrix& root = system_.clear_root(root_rows());
      Eigen::Index first = 0;
      for_each_cone([&](auto& cone) {
        cone.fill_root(first, root);
        first += cone.root_rows();
      });
    } else {
      Matrix& schur = system_.clear();
      for_each_cone([&](auto& cone) { cone.add_schur(schur); });
    }
    const auto middle = Clock::now();
    const bool fine = through_root ? system_.factorise_root() : system_.factorise();
    assembly_s_ += std::chrono::duration<double>(middle - begin).count();
    factor_s_ += std::chrono::duration<double>(Clock::now() - middle).count();
    return fine;
  }

  /// Whether to regularise from here on, which share of the residual to remove, how to solve the system.
  void choose_treatment() {
    if (aim_ == Aim::kSolution && !regularised_ && feasible_at_ == iteration_ &&
        error_ > settings_.acceptable_tolerance && diverging()) {
      aim_ = Aim::kRegularised;
      early_ = true;
      last_progress_ = iteration_;
    }
    dual_share_ = Scalar(1);
    if (aim_ == Aim::kRegularised) {
      const double floor = kFloor * settings_.tolerance;
      dual_share_ = Scalar(dual_error_ > floor ? 1.0 - floor / dual_error_ : 0.0);
    }
    if (small_pivots_ == SmallPivots::kHold && root_is_cheap() &&
        static_cast<double>(system_.relative_residual()) > kPoor) {
      treat_small_pivots(SmallPivots::kNone);
    }
  }

  void treat_small_pivots(SmallPivots treatment) {
    small_pivots_ = treatment;
    system_.treat_small_pivots(treatment);
  }

  /// Newton direction towards X Y = target I.
  void solve_direction(Scalar target, Order order) {
    const Eigen::Index m = cost_.size();
    Vector right(m + equations_.cols());
    Vector gradient = -dual_share_ * dual_residual_;
    for_each_cone([&](auto& cone) { cone.begin_direction(target, order == Order::kSecond, gradient); });
    right << gradient, equation_residual_;
    const Vector solution = system_.solve(right);
    dx_ = solution.head(m);
    dfree_ = solution.tail(equations_.cols());
    for_each_cone([&](auto& cone) { cone.finish_direction(dx_); });
    if (order == Order::kSecond) {
      refine_direction();
    }
  }

  /// Corrects dY where rounding errors in its evaluation, and not only in dx, leave <F_i, Y + dY> away from
  /// c_i: by Newton steps for that residual alone, whose own errors are relative to the correction.
  void refine_direction() {
    constexpr int kMaxCorrections = 4;
    constexpr double kWorthIt = 1e-3;  // of the tolerance
    const Eigen::Index m = cost_.size();
    // A residual d of <F_i, Y> = c_i counts itself, and as x'd in the gap.
    const double weight = std::max(1.0 / static_cast<double>(Scalar(1) + max_abs(cost_)),
                                   static_cast<double>(x_.norm() / objective_size_));
    double previous = std::numeric_limits<double>::infinity();
    for (int k = 0; k < kMaxCorrections; ++k) {
      Vector rest = dual_share_ * dual_residual_ - equations_ * dfree_;
      for_each_cone([&](auto& cone) { cone.add_adjoint_dy(rest, Scalar(-1)); });
      const double error = static_cast<double>(rest.norm()) * weight;
      if (!(error > kWorthIt * settings_.tolerance) || !(error < previous / 2.0)) {
        return;
      }
      previous = error;
      Vector right = Vector::Zero(m + equations_.cols());
      right.head(m) = -rest;
      const Vector solution = system_.solve(right);
      dx_ += solution.head(m);
      dfree_ += solution.tail(equations_.cols());
      const Vector correction = solution.head(m);
      for_each_cone([&](auto& cone) { cone.refine_direction(correction); });
    }
  }

  [[nodiscard]] double max_step(Side side, double enough) {
    double step = std::numeric_limits<double>::infinity();
    for_each_cone([&](auto& cone) { step = std::min(step, cone.max_step(side, Scalar(enough))); });
    return step;
  }

  /// Share of mu to aim for, from how far the predictor gets (Toh, Todd, Tutuncu 1999, section 3).
  [[nodiscard]] Scalar centring() {
    constexpr double kEnough = 1.1;
    constexpr double kSmallMu = 1e-6;
    const double fraction = step_fraction();
    const double a = std::min(1.0, fraction * max_step(Side::kX, kEnough));
    const double b = std::min(1.0, fraction * max_step(Side::kY, kEnough));
    Scalar after(0);
    for_each_cone([&](auto& cone) { after += cone.after_step(Scalar(a), Scalar(b)); });
    const double ratio = static_cast<double>(after / (mu_ * Scalar(total_size_)));
    const double least = std::min(a, b);
    const double power = static_cast<double>(mu_) > kSmallMu ? std::max(1.0, 3.0 * least * least) : 1.0;
    return Scalar(ratio > 0.0 ? std::min(1.0, std::pow(ratio, power)) : kSmallestCentring);
  }

  [[nodiscard]] double step_fraction() const { return 0.9 + 0.09 * std::min({1.0, step_x_, step_y_}); }

  void take_step() {
    constexpr double kEnough = 1.15;
    constexpr int kRetries = 12;
    constexpr double kShorter = 0.7;
    const double fraction = step_fraction();
    step_x_ = std::min(1.0, fraction * max_step(Side::kX, kEnough));
    step_y_ = std::min(1.0, fraction * max_step(Side::kY, kEnough));
    const Scalar dual_before = dual_objective();
    move(step_x_, step_y_);
    dual_change_ = step_y_ > 0.0 ? (dual_objective() - dual_before) / Scalar(step_y_) : Scalar(0);
    for (int retry = 0; retry < kRetries; ++retry) {
      bool inside = true;
      for_each_cone([&](auto& cone) { inside = inside && cone.factorise(); });
      if (inside) {
        return;
      }
      const double back_x = (1.0 - kShorter) * step_x_;
      const double back_y = (1.0 - kShorter) * step_y_;
      move(-back_x, -back_y);
      step_x_ -= back_x;
      step_y_ -= back_y;
    }
    step_x_ = step_y_ = 0.0;
  }

  void keep(Iterate& kept) {
    kept.x = x_;
    kept.free = free_;
    kept.dense_x.resize(dense_.size());
    kept.dense_y.resize(dense_.size());
    for (std::size_t b = 0; b < dense_.size(); ++b) {
      kept.dense_x[b] = dense_[b].x();
      kept.dense_y[b] = dense_[b].y();
    }
    kept.diagonal_x = diagonal_.x();
    kept.diagonal_y = diagonal_.y();
  }

  [[nodiscard]] static Start rounded(const Iterate& kept) {
    Start start;
    start.x = kept.x.template cast<double>();
    for (std::size_t b = 0; b < kept.dense_x.size(); ++b) {
      start.slack.dense.push_back(kept.dense_x[b].template cast<double>());
      start.multiplier.dense.push_back(kept.dense_y[b].template cast<double>());
    }
    start.slack.diagonal = kept.diagonal_x.template cast<double>();
    start.multiplier.diagonal = kept.diagonal_y.template cast<double>();
    start.slack.free = Eigen::VectorXd::Zero(kept.free.size());
    start.multiplier.free = kept.free.template cast<double>();
    return start;
  }

  [[nodiscard]] Outcome finish(Status status) {
    const bool infeasible = status == Status::kPrimalInfeasible || status == Status::kDualInfeasible;
    if (infeasible) {
      keep(best_);
    } else if (status != Status::kOptimal) {
      restore(best_);
      measure();
      project_multiplier();
    }
    if (!infeasible && status != Status::kOptimal && best_error_ <= settings_.acceptable_tolerance) {
      status = Status::kOptimal;
    }
    Outcome outcome;
    outcome.status = status;
    outcome.best = rounded(best_);
    if (sound_.x.size() > 0) {
      outcome.sound = rounded(sound_);
    }
    outcome.ray_violation = ray_violation_;
    outcome.iterations = iteration_;
    outcome.assembly_s = assembly_s_;
    outcome.sparse_schur = system_.is_sparse();
    outcome.factor_s = factor_s_;
    return outcome;
  }

  static constexpr double kFloor = 0.1;          // residual that regularising leaves, in tolerances
  static constexpr double kCrossing = 1.0;       // largest residual with which the gap is closed, likewise
  static constexpr double kNoViolation = 0.01;   // residual not worth moving Y, likewise
  static constexpr int kLatePause = 4;           // iterations until the residual is tried to be removed again
  static constexpr double kMidway = 1e-2;        // error at which the size of x is remembered,
  static constexpr double kDiverging = 3.0;      // and growth from there on that bounded x do not show
  static constexpr double kPoor = 1e-8;          // relative residual of a system that asks for M instead of B
  static constexpr double kSound = 1e-6;         // and of one that gives a usable direction
  static constexpr double kLongStep = 0.1;       // shorter ones leave a badly centred iterate
  static constexpr double kCheapRoot = 2e6;      // operations of a factorisation of M that take no time
  static constexpr double kRealProgress = 0.9;   // smaller improvements do not count
  static constexpr int kShortPatience = 6;       // iterations without progress before the strategy changes
  static constexpr int kPatience = 15;           // and before giving up
  static constexpr double kSmallestStep = 1e-7;  // of both steps
  static constexpr double kRoundedLeast = 0.2;   // share of the rounding errors that remains once X fits x
  static constexpr double kSmallestCentring = 0.1;

  const Model& model_;
  const Settings& settings_;
  const ProgressObserver& observe_;
  Vector cost_;
  std::deque<DenseCone<Scalar>> dense_;
  DiagonalCone<Scalar> diagonal_;
  SchurSystem<Scalar> system_;
  Matrix equations_;
  Vector equation_right_;
  Scalar constant_size_{0};
  Eigen::VectorXd coefficient_squares_;  ///< ||F_i||^2
  int total_size_ = 0;

  SmallPivots small_pivots_ = SmallPivots::kHold;
  int iteration_ = 0;
  int last_progress_ = 0;
  int next_late_ = 0;  ///< first iteration that may try to remove the residual alone
  double late_error_ = std::numeric_limits<double>::infinity();  ///< what was left the last time
  Vector x_;
  Vector free_;
  Vector dx_;
  Vector dfree_;
  Vector dual_residual_;
  Scalar dual_share_{1};
  Vector equation_residual_;
  Scalar primal_objective_{0};
  Scalar dual_objective_{0};
  Scalar objective_size_{1};
  Scalar mu_{0};
  double primal_error_ = 0.0;
  double dual_error_ = 0.0;
  double negative_y_ = 0.0;
  double error_ = 0.0;
  Scalar dual_change_{0};  ///< of <F_0, Y> along the whole of dY
  double step_x_ = 1.0;
  double step_y_ = 1.0;
  double best_error_ = std::numeric_limits<double>::infinity();
  double best_violation_ = std::numeric_limits<double>::infinity();
  double ray_violation_ = std::numeric_limits<double>::quiet_NaN();
  double fraction_ = 0.0;
  double assembly_s_ = 0.0;
  double factor_s_ = 0.0;
  Iterate best_;
  Iterate feasible_;                                               ///< the first one with small residuals
  int feasible_at_ = -1;                                           ///< its iteration
  Iterate sound_;                                                  ///< the last one that rounding spared
  double norm_midway_ = std::numeric_limits<double>::quiet_NaN();  ///< ||x|| where error_ fell below kMidway
  Aim aim_ = Aim::kSolution;
  bool early_ = false;        ///< regularising before there was any trouble
  bool regularised_ = false;  ///< regularising has been tried
};

}  // namespace trammel::inline TRAMMEL_ABI::sdp::detail
