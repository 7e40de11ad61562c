// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of solve.hpp.
#pragma once

#include <algorithm>
#include <chrono>
#include <cmath>
#include <string>

#include "trammel/core/error.hpp"
#include "trammel/linalg/dense_kernels.hpp"
#include "trammel/linalg/symmetric_eigen.hpp"
#include "trammel/sdp/detail/combination.hpp"
#include "trammel/sdp/detail/face.hpp"
#include "trammel/sdp/detail/model.hpp"
#include "trammel/sdp/detail/outcome.hpp"
#include "trammel/sdp/solve.hpp"

namespace trammel::inline TRAMMEL_ABI::sdp {

namespace detail {

/// Value of sum over the entries of F_i (or F_0) with a block matrix; `add(variable, value)` receives each
/// term.
template <class Add>
void for_each_product(const Problem& problem, const BlockMatrix& matrix, Add&& add) {
  for (const Entry& e : problem.entries) {
    const auto b = static_cast<std::size_t>(e.block);
    const bool dense = problem.blocks[b].kind == BlockKind::kDense;
    const double twice = e.row == e.column ? 1.0 : 2.0;
    add(e.variable, twice * e.value * matrix[b](e.row, dense ? e.column : 0));
  }
  for (const LowRankTerm& t : problem.low_rank) {
    const Eigen::MatrixXd product = matrix[static_cast<std::size_t>(t.block)] * t.vectors;
    add(t.variable, (t.vectors.cwiseProduct(product) * t.weights).sum());
  }
}

/// max(0, -lambda_min) over the blocks with a sign; free blocks count only where `free_counts`.
inline double negative_part(const Problem& problem, const BlockMatrix& matrix) {
  double worst = 0.0;
  for (std::size_t b = 0; b < matrix.size(); ++b) {
    switch (problem.blocks[b].kind) {
      case BlockKind::kFree:
        break;
      case BlockKind::kDiagonal:
        worst = std::max(worst, -matrix[b].minCoeff());
        break;
      case BlockKind::kDense: {
        Eigen::MatrixXd factor = matrix[b];
        if (linalg::Dense<double>::cholesky(factor) != 0) {
          const linalg::SymmetricEigen eigen(matrix[b], Eigen::EigenvaluesOnly);
          worst = std::max(worst, -eigen.eigenvalues()[0]);
        }
        break;
      }
    }
  }
  return worst;
}

inline double largest_constant(const Problem& problem) {
  double largest = 0.0;
  for (const Entry& e : problem.entries) {
    if (e.variable == kConstant) {
      largest = std::max(largest, std::abs(e.value));
    }
  }
  return largest;
}

inline double inner_product(const BlockMatrix& a, const BlockMatrix& b) {
  double sum = 0.0;
  for (std::size_t k = 0; k < a.size(); ++k) {
    sum += a[k].cwiseProduct(b[k]).sum();
  }
  return sum;
}

inline double constant_times(const Problem& problem, const BlockMatrix& y) {
  double sum = 0.0;
  for_each_product(problem, y,
                   [&](int variable, double value) { sum += variable == kConstant ? value : 0.0; });
  return sum;
}

inline void require_shapes(const Problem& problem, const Eigen::VectorXd& x, const BlockMatrix& slack,
                           const BlockMatrix& multiplier) {
  require(x.size() == problem.cost.size(), "x", std::to_string(x.size()) + " numbers",
          std::to_string(problem.cost.size()));
  for (const auto& [name, matrix] : {std::pair("slack", &slack), std::pair("multiplier", &multiplier)}) {
    require(matrix->size() == problem.blocks.size(), name, std::to_string(matrix->size()) + " blocks",
            std::to_string(problem.blocks.size()));
    for (std::size_t b = 0; b < matrix->size(); ++b) {
      const Block& block = problem.blocks[b];
      const Eigen::Index columns = block.kind == BlockKind::kDense ? block.size : 1;
      const Eigen::MatrixXd& value = (*matrix)[b];
      require(value.rows() == block.size && value.cols() == columns,
              std::string(name) + "[" + std::to_string(b) + "]",
              std::to_string(value.rows()) + " x " + std::to_string(value.cols()),
              std::to_string(block.size) + " x " + std::to_string(columns));
    }
  }
}

/// Operations of one iteration, roughly.
inline double operations(const Model& model) {
  constexpr double kProductsPerIteration = 12.0;
  const auto m = static_cast<double>(model.cost.size());
  double sum = m * m * m / 3.0;
  for (const DenseData& data : model.dense) {
    const double n = data.size;
    sum += kProductsPerIteration * n * n * n + static_cast<double>(data.entries.size()) * (n + m);
  }
  return sum;
}

/// A variable without coefficients but with a cost moves the objective freely.
inline Eigen::Index unconstrained_variable(const Problem& problem) {
  std::vector<char> seen(static_cast<std::size_t>(problem.cost.size()), 0);
  for (const Entry& e : problem.entries) {
    if (e.variable != kConstant && e.value != 0.0) {
      seen[static_cast<std::size_t>(e.variable)] = 1;
    }
  }
  for (const LowRankTerm& t : problem.low_rank) {
    seen[static_cast<std::size_t>(t.variable)] = 1;
  }
  for (Eigen::Index i = 0; i < problem.cost.size(); ++i) {
    if (seen[static_cast<std::size_t>(i)] == 0 && problem.cost[i] != 0.0) {
      return i;
    }
  }
  return -1;
}

/// Outcome of the passes in the precision asked for, and the precision of the last one.
inline std::pair<Outcome, Precision> run_passes(const Model& model, const Settings& settings,
                                                const ProgressObserver& observe) {
  constexpr double kSmallProblem = 5e8;  // operations that take seconds in double-double numbers
  if (settings.precision == Precision::kDoubleDouble) {
    return {run_double_double(model, settings, observe, {}), Precision::kDoubleDouble};
  }
  Outcome outcome = run_double(model, settings, observe);
  const bool trouble =
      outcome.status == Status::kNumericalTrouble || outcome.status == Status::kIterationLimit;
  if (settings.precision == Precision::kDouble || !trouble || operations(model) > kSmallProblem) {
    return {std::move(outcome), Precision::kDouble};
  }
  Outcome again = run_double_double(model, settings, observe, outcome.sound);
  again.iterations += outcome.iterations;
  again.assembly_s += outcome.assembly_s;
  again.factor_s += outcome.factor_s;
  return {std::move(again), Precision::kDoubleDouble};
}

inline double largest(const DimacsErrors& errors) {
  return std::abs(*std::max_element(errors.begin(), errors.end(),
                                    [](double a, double b) { return std::abs(a) < std::abs(b); }));
}

/// Where x was rounded from double-double numbers, X = sum x_i F_i - F_0 may fit the rounded x better than
/// the rounded X does.
inline void round_slack(const Problem& problem, Solution& solution) {
  if (solution.precision != Precision::kDoubleDouble) {
    return;
  }
  BlockMatrix slack = combine(problem, solution.x, 1.0);
  for (std::size_t b = 0; b < slack.size(); ++b) {
    if (problem.blocks[b].kind == BlockKind::kFree) {
      slack[b].setZero();
    }
  }
  const DimacsErrors errors = dimacs_errors(problem, solution.x, slack, solution.multiplier);
  if (largest(errors) < largest(solution.dimacs)) {
    solution.slack = std::move(slack);
    solution.dimacs = errors;
  }
}

/// The ray as a Solution states it, with the violation evaluated on the problem as given.
inline void attach_ray(const Problem& problem, Solution& solution) {
  if (solution.status == Status::kPrimalInfeasible) {
    const double scale = constant_times(problem, solution.multiplier);
    Eigen::VectorXd products = Eigen::VectorXd::Zero(problem.cost.size());
    solution.ray_y = solution.multiplier;
    for (Eigen::MatrixXd& block : solution.ray_y) {
      block /= scale;
    }
    for_each_product(problem, solution.ray_y, [&](int variable, double value) {
      if (variable != kConstant) {
        products[variable] += value;
      }
    });
    solution.ray_violation = products.norm();
  } else if (solution.status == Status::kDualInfeasible) {
    solution.ray_x = solution.x / std::abs(problem.cost.dot(solution.x));
    const BlockMatrix image = combine(problem, solution.ray_x, 0.0);
    solution.ray_violation = negative_part(problem, image);
    for (std::size_t b = 0; b < image.size(); ++b) {
      if (problem.blocks[b].kind == BlockKind::kFree) {
        solution.ray_violation = std::max(solution.ray_violation, image[b].cwiseAbs().maxCoeff());
      }
    }
  }
}

/// Objectives, error measures and ray from x, X and Y.
inline void evaluate(const Problem& problem, Solution& solution) {
  solution.primal_objective = problem.cost.dot(solution.x);
  solution.dual_objective = constant_times(problem, solution.multiplier);
  solution.dimacs = dimacs_errors(problem, solution.x, solution.slack, solution.multiplier);
  round_slack(problem, solution);
  attach_ray(problem, solution);
}

inline Solution solve_as_given(const Problem& problem, const Settings& settings,
                               const ProgressObserver& observe) {
  const Model model = reduce(problem);
  auto [outcome, precision] = run_passes(model, settings, observe);
  Solution solution;
  solution.status = outcome.status;
  solution.precision = precision;
  solution.x = std::move(outcome.best.x);
  solution.slack = expand(problem, model, outcome.best.slack);
  solution.multiplier = expand(problem, model, outcome.best.multiplier);
  if (const Eigen::Index i = unconstrained_variable(problem); i >= 0) {
    solution.status = Status::kDualInfeasible;
    solution.x = Eigen::VectorXd::Zero(problem.cost.size());
    solution.x[i] = problem.cost[i] > 0.0 ? -1.0 : 1.0;
  }
  evaluate(problem, solution);
  solution.iterations = outcome.iterations;
  solution.timings.schur_assembly_s = outcome.assembly_s;
  solution.timings.schur_factor_s = outcome.factor_s;
  solution.sparse_schur = outcome.sparse_schur;
  return solution;
}

/// Solves the program on the faces; where its answer does not serve the whole, the program as given too.
inline Solution solve_on_faces(const Problem& problem, const std::vector<Face>& faces,
                               const Settings& settings, const ProgressObserver& observe) {
  constexpr double kShare = 0.5;  // of the tolerances, that finite variables of the faces may use up
  const FaceProblem on_faces = restrict_to(problem, faces);
  Solution solution = solve_as_given(on_faces.problem, settings, observe);
  if (solution.status == Status::kDualInfeasible) {
    const double objective = std::abs(on_faces.problem.cost.dot(solution.x));
    lift(problem, faces, on_faces.kept, 0.0, kShare * settings.infeasibility_tolerance * objective, solution);
  } else {
    lift(problem, faces, on_faces.kept, 1.0, kShare * settings.tolerance * (1.0 + largest_constant(problem)),
         solution);
  }
  evaluate(problem, solution);
  const bool serves = solution.status == Status::kOptimal
                          ? largest(solution.dimacs) <= settings.acceptable_tolerance
                          : solution.ray_violation <= settings.infeasibility_tolerance;
  if (serves) {
    return solution;
  }
  Solution whole = solve_as_given(problem, settings, observe);
  whole.iterations += solution.iterations;
  whole.timings.schur_assembly_s += solution.timings.schur_assembly_s;
  whole.timings.schur_factor_s += solution.timings.schur_factor_s;
  return whole;
}

}  // namespace detail

TRAMMEL_INLINE DimacsErrors dimacs_errors(const Problem& problem, const Eigen::VectorXd& x,
                                          const BlockMatrix& slack, const BlockMatrix& multiplier) {
  validate(problem);
  detail::require_shapes(problem, x, slack, multiplier);
  Eigen::VectorXd dual = -problem.cost;
  detail::for_each_product(problem, multiplier, [&](int variable, double value) {
    if (variable != kConstant) {
      dual[variable] += value;
    }
  });
  const BlockMatrix image = detail::combine(problem, x, 1.0);
  double squares = 0.0;
  for (std::size_t b = 0; b < image.size(); ++b) {
    squares += (image[b] - slack[b]).squaredNorm();
  }
  const double primal_objective = problem.cost.dot(x);
  const double dual_objective = detail::constant_times(problem, multiplier);
  const double cost_size = 1.0 + problem.cost.cwiseAbs().maxCoeff();
  const double constant_size = 1.0 + detail::largest_constant(problem);
  const double objective_size = 1.0 + std::abs(primal_objective) + std::abs(dual_objective);
  return {dual.norm() / cost_size,
          detail::negative_part(problem, multiplier) / cost_size,
          std::sqrt(squares) / constant_size,
          detail::negative_part(problem, slack) / constant_size,
          (primal_objective - dual_objective) / objective_size,
          detail::inner_product(slack, multiplier) / objective_size};
}

TRAMMEL_INLINE Solution solve(const Problem& problem, const Settings& settings,
                              const ProgressObserver& observe) {
  const auto begin = std::chrono::steady_clock::now();
  validate(problem);
  trammel::validate(settings, "sdp.settings");
  const std::vector<detail::Face> faces = detail::find_faces(problem);
  Solution solution = faces.empty() ? detail::solve_as_given(problem, settings, observe)
                                    : detail::solve_on_faces(problem, faces, settings, observe);
  solution.timings.total_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return solution;
}

}  // namespace trammel::inline TRAMMEL_ABI::sdp
