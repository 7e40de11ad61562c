// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of matrix_inequality.hpp.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "trammel/core/error.hpp"
#include "trammel/linalg/cholesky.hpp"
#include "trammel/linalg/svd.hpp"
#include "trammel/linalg/symmetric_eigen.hpp"
#include "trammel/minimax/matrix_inequality.hpp"
#include "trammel/minimax/prior_state.hpp"
#include "trammel/minimax/reduced_solution.hpp"
#include "trammel/sdp/solve.hpp"

namespace trammel::inline TRAMMEL_ABI::minimax {

namespace detail {

/// What distinguishes the two forms of the inequality; letters as in MatrixInequality.
struct InequalityData {
  Eigen::MatrixXd J, B, W, E, E_2, G;
};

/// Writes the inequality entry by entry.
class InequalityWriter {
 public:
  InequalityWriter(const InequalityData& data, std::vector<Eigen::MatrixXd> ellipsoids)
      : data_(data), ellipsoids_(std::move(ellipsoids)), q_(data.J.rows()) {}

  [[nodiscard]] MatrixInequality write() {
    const Eigen::Index rows = data_.B.rows();
    const auto s = static_cast<Eigen::Index>(ellipsoids_.size());
    program_.blocks = {{sdp::BlockKind::kDense, static_cast<int>(q_ + rows)},
                       {sdp::BlockKind::kDense, static_cast<int>(rows + data_.G.cols())},
                       {sdp::BlockKind::kDiagonal, static_cast<int>(s)}};
    // Constants move to the other side: X = sum x_i F_i - F_0.
    add(sdp::kConstant, 0, q_, 0, data_.B);
    add(sdp::kConstant, 0, q_, q_, -data_.E);
    add(sdp::kConstant, 1, rows, rows, -data_.E_2);
    std::vector<double> cost;
    MatrixInequality result;
    write_gain(cost, result.gain_entries);
    write_noise(cost);
    result.first_multiplier = static_cast<Eigen::Index>(cost.size());
    write_multipliers(cost);
    program_.cost = Eigen::Map<const Eigen::VectorXd>(cost.data(), static_cast<Eigen::Index>(cost.size()));
    result.program = std::move(program_);
    result.size = q_;
    return result;
  }

 private:
  void add(int variable, int block, Eigen::Index row, Eigen::Index column, double value) {
    if (value != 0.0) {
      program_.entries.push_back({variable, block, static_cast<int>(row), static_cast<int>(column), value});
    }
  }
  /// A matrix with its first entry at (row, column); of a diagonal position, the lower triangle.
  void add(int variable, int block, Eigen::Index row, Eigen::Index column, const Eigen::MatrixXd& values) {
    for (Eigen::Index j = 0; j < values.cols(); ++j) {
      for (Eigen::Index i = row == column ? j : 0; i < values.rows(); ++i) {
        add(variable, block, row + i, column + j, values(i, j));
      }
    }
  }

  /// One variable per entry of the lower triangle of K that occurs at all.
  void write_gain(std::vector<double>& cost, std::vector<std::pair<Eigen::Index, Eigen::Index>>& entries) {
    const Eigen::Index rows = data_.B.rows();
    for (Eigen::Index j = 0; j < q_; ++j) {
      for (Eigen::Index i = j; i < q_; ++i) {
        const std::size_t before = program_.entries.size();
        const auto variable = static_cast<int>(cost.size());
        Eigen::MatrixXd bias = data_.B.col(i) * data_.J.row(j);
        Eigen::MatrixXd noise = data_.B.col(i) * data_.G.row(j);
        if (i != j) {
          bias += data_.B.col(j) * data_.J.row(i);
          noise += data_.B.col(j) * data_.G.row(i);
        }
        add(variable, 0, q_, 0, bias);
        add(variable, 1, rows, 0, noise.transpose());
        if (program_.entries.size() > before) {
          cost.push_back(0.0);
          entries.emplace_back(i, j);
        }
      }
    }
  }

  void write_noise(std::vector<double>& cost) {
    for (Eigen::Index j = 0; j < data_.W.rows(); ++j) {
      for (Eigen::Index i = j; i < data_.W.rows(); ++i) {
        add(static_cast<int>(cost.size()), 1, i, j, 1.0);
        cost.push_back(i == j ? data_.W(i, j) : 2.0 * data_.W(i, j));
      }
    }
  }

  void write_multipliers(std::vector<double>& cost) {
    for (std::size_t l = 0; l < ellipsoids_.size(); ++l) {
      const auto variable = static_cast<int>(cost.size());
      const Eigen::MatrixXd& a = ellipsoids_[l];
      Eigen::MatrixXd vectors = Eigen::MatrixXd::Zero(q_ + data_.B.rows(), a.rows());
      vectors.topRows(q_) = a.transpose();
      program_.low_rank.push_back({variable, 0, std::move(vectors), Eigen::VectorXd::Ones(a.rows())});
      add(variable, 2, static_cast<Eigen::Index>(l), static_cast<Eigen::Index>(l), 1.0);
      cost.push_back(1.0);
    }
  }

  const InequalityData& data_;
  std::vector<Eigen::MatrixXd> ellipsoids_;
  Eigen::Index q_;
  sdp::Problem program_;
};

/// K in reduced coordinates from the variables of the inequality.
inline Eigen::MatrixXd gain_of(const MatrixInequality& inequality, const Eigen::VectorXd& x) {
  Eigen::MatrixXd K = Eigen::MatrixXd::Zero(inequality.size, inequality.size);
  for (std::size_t k = 0; k < inequality.gain_entries.size(); ++k) {
    const auto [i, j] = inequality.gain_entries[k];
    K(i, j) = K(j, i) = x[static_cast<Eigen::Index>(k)];
  }
  return inequality.basis * K * inequality.basis.transpose();
}

/// Both bounds from what the general solver returned.
class SemidefiniteCertificate {
 public:
  SemidefiniteCertificate(const ReducedProblem& reduced, const MatrixInequality& inequality)
      : reduced_(reduced), inequality_(inequality), state_(reduced) {}

  [[nodiscard]] ReducedSolution make(const sdp::Solution& solution) {
    const auto s = static_cast<Eigen::Index>(reduced_.ellipsoids());
    ReducedSolution result;
    const Eigen::VectorXd multipliers = solution.x.segment(inequality_.first_multiplier, s).cwiseMax(0.0);
    // The multiplier of H(lambda) is the least favourable prior.
    const linalg::SymmetricEigen eigen(
        solution.multiplier[0].topLeftCorner(inequality_.size, inequality_.size));
    const double floor = std::numeric_limits<double>::epsilon() * eigen.eigenvalues().cwiseAbs().maxCoeff();
    state_.factor = inequality_.basis * eigen.eigenvectors() *
                    eigen.eigenvalues().cwiseMax(floor).cwiseSqrt().asDiagonal();
    state_.update(reduced_);
    state_.factor /= std::sqrt(std::max(1.0, state_.use.maxCoeff()));
    state_.update(reduced_);
    result.lower = state_.value;
    result.prior_factor = state_.factor;
    result.gain = state_.gain();
    offer(result.gain, multipliers, result);
    offer(gain_of(inequality_, solution.x), multipliers, result);
    return result;
  }

 private:
  /// Takes the gain K (q x q) with `multipliers` raised until the inequality holds, where that is better.
  void offer(const Eigen::MatrixXd& gain, const Eigen::VectorXd& multipliers, ReducedSolution& result) const {
    const Eigen::MatrixXd bias =
        reduced_.criterion * (gain * reduced_.information.transpose() * reduced_.information -
                              Eigen::MatrixXd::Identity(reduced_.size(), reduced_.size()));
    Eigen::MatrixXd slack = -bias.transpose() * bias;
    for (Eigen::Index l = 0; l < multipliers.size(); ++l) {
      const auto at = static_cast<std::size_t>(l);
      const auto a = reduced_.bounds.middleRows(reduced_.first_row[at],
                                                reduced_.first_row[at + 1] - reduced_.first_row[at]);
      slack += multipliers[l] * a.transpose() * a;
    }
    // sum H_l = I in reduced coordinates: raising all multipliers by the same amount lifts every eigenvalue.
    const double least = linalg::SymmetricEigen(slack, Eigen::EigenvaluesOnly).eigenvalues().minCoeff();
    const double rounding = 10.0 * static_cast<double>(reduced_.size()) *
                            std::numeric_limits<double>::epsilon() * multipliers.maxCoeff();
    const Eigen::VectorXd raised = multipliers.array() + std::max(0.0, rounding - least);
    const double upper =
        (reduced_.criterion * gain * reduced_.information.transpose()).squaredNorm() + raised.sum();
    if (upper < result.upper) {
      result.upper = upper;
      result.multipliers = raised;
      result.gain = gain;
    }
  }

  const ReducedProblem& reduced_;
  const MatrixInequality& inequality_;
  PriorState state_;
};

inline Eigen::MatrixXd without_zero_rows(const Eigen::MatrixXd& matrix) {
  std::vector<Eigen::Index> kept;
  const double negligible = std::numeric_limits<double>::epsilon() * matrix.norm();
  for (Eigen::Index i = 0; i < matrix.rows(); ++i) {
    if (matrix.row(i).norm() > negligible) {
      kept.push_back(i);
    }
  }
  return matrix(kept, Eigen::all);
}

}  // namespace detail

TRAMMEL_INLINE MatrixInequality whitened_inequality(const ReducedProblem& reduced) {
  constexpr double kObserved = 1e-2;  // smallest singular value of F, in units of the bounds, to whiten by it
  const Eigen::Index q = reduced.size();
  Eigen::MatrixXd padded = Eigen::MatrixXd::Zero(q, q);
  padded.topRows(reduced.information.rows()) = reduced.information;
  const linalg::Svd svd(padded, Eigen::ComputeFullV);
  const Eigen::ArrayXd f = svd.singularValues().array();
  const bool observed = f.minCoeff() >= kObserved;
  const Eigen::ArrayXd scale = observed ? Eigen::ArrayXd(f.inverse()) : (1.0 + f.square()).rsqrt();
  Eigen::MatrixXd basis = svd.matrixV() * scale.matrix().asDiagonal();
  // Directions that no measurement sees, but for rounding errors, are exactly unseen.
  const double rounding = static_cast<double>(q) * std::numeric_limits<double>::epsilon() * f.maxCoeff();
  Eigen::VectorXd root_J = (f > rounding).select(f * scale, 0.0);
  detail::InequalityData data;
  Eigen::MatrixXd criterion = reduced.criterion * basis;
  if (observed) {
    const linalg::Svd of_criterion(criterion, Eigen::ComputeFullV);
    basis = basis * of_criterion.matrixV();
    root_J.setOnes();
    criterion = Eigen::MatrixXd::Zero(of_criterion.singularValues().size(), q);
    criterion.diagonal() = of_criterion.singularValues();
  }
  data.B = detail::without_zero_rows(criterion);
  data.J = root_J.cwiseAbs2().asDiagonal();
  data.G = detail::without_zero_rows(Eigen::MatrixXd(root_J.asDiagonal())).transpose();
  data.W.setIdentity(data.B.rows(), data.B.rows());
  data.E.setIdentity(data.B.rows(), data.B.rows());
  data.E_2.setIdentity(data.G.cols(), data.G.cols());
  std::vector<Eigen::MatrixXd> ellipsoids;
  for (std::size_t l = 0; l < reduced.ellipsoids(); ++l) {
    ellipsoids.emplace_back(
        reduced.bounds.middleRows(reduced.first_row[l], reduced.first_row[l + 1] - reduced.first_row[l]) *
        basis);
  }
  MatrixInequality result = detail::InequalityWriter(data, std::move(ellipsoids)).write();
  result.basis = std::move(basis);
  return result;
}

TRAMMEL_INLINE MatrixInequality printed_inequality(const GuaranteedProblem& problem) {
  require_well_formed(problem);
  const Eigen::Index p = problem.parameters();
  detail::InequalityData data;
  data.J = problem.information_factor.transpose() * problem.information_factor;
  data.W = problem.criterion_factor.transpose() * problem.criterion_factor;
  const auto inverse = [&](const Eigen::MatrixXd& matrix, const char* name) {
    const linalg::Cholesky cholesky(matrix);
    if (cholesky.info() != Eigen::Success) {
      throw Error({name, "a singular matrix", "a definite one, as the printed inequality inverts it"});
    }
    return Eigen::MatrixXd(cholesky.solve(Eigen::MatrixXd::Identity(p, p)));
  };
  data.E = inverse(data.W, "criterion matrix S");
  data.E_2 = inverse(data.J, "information matrix J");
  data.B.setIdentity(p, p);
  data.G.setIdentity(p, p);
  MatrixInequality result = detail::InequalityWriter(data, problem.ellipsoids).write();
  result.basis.setIdentity(p, p);
  return result;
}

TRAMMEL_INLINE Solution solve_semidefinite(const GuaranteedProblem& problem, const SolverSettings& settings,
                                           const ProgressObserver& observe) {
  return solve_reduced(problem, settings, Method::kSemidefinite, [&](const ReducedProblem& reduced) {
    const MatrixInequality inequality = whitened_inequality(reduced);
    // A share of the gap: the rest is room for raising the multipliers.
    sdp::Settings general;
    general.tolerance = std::max(1e-13, 0.02 * settings.relative_gap);
    general.max_iterations = settings.max_iterations;
    const sdp::Solution answer = sdp::solve(inequality.program, general, observe);
    ReducedSolution result = detail::SemidefiniteCertificate(reduced, inequality).make(answer);
    result.iterations = answer.iterations;
    const double gap = (result.upper - result.lower) / (result.upper + reduced.free_error);
    result.status = gap <= settings.relative_gap                    ? SolveStatus::kOptimal
                    : answer.status == sdp::Status::kIterationLimit ? SolveStatus::kIterationLimit
                                                                    : SolveStatus::kNumericalTrouble;
    return result;
  });
}

}  // namespace trammel::inline TRAMMEL_ABI::minimax
