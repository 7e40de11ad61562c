// SPDX-License-Identifier: Apache-2.0
/// @file
/// Settings and result of the semidefinite solver.
#pragma once

#include <array>
#include <concepts>
#include <limits>
#include <string_view>
#include <type_traits>
#include <vector>

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/core/settings.hpp"

namespace trammel::inline TRAMMEL_ABI::sdp {

/// Why the solver stopped; primal and dual as in sdp::Problem.
enum class Status {
  kOptimal,
  kPrimalInfeasible,
  kDualInfeasible,
  kIterationLimit,
  kNumericalTrouble,
};

/// One row of the table that documentation, `--help` and the report print.
struct StatusText {
  Status status;
  std::string_view name;    ///< as in result files
  std::string_view cause;   ///< what happened
  std::string_view remedy;  ///< what to do about it
};

inline constexpr std::array<StatusText, 5> kStatusTable{{
    {Status::kOptimal, "optimal", "all six error measures are within the tolerance", "use the result"},
    {Status::kPrimalInfeasible, "primal_infeasible",
     "no x makes the matrix sum x_i F_i - F_0 positive semidefinite: a ray Y with <F_i, Y> = 0, <F_0, Y> = 1 "
     "proves it",
     "relax the constraints that the ray's largest entries point to"},
    {Status::kDualInfeasible, "dual_infeasible",
     "the objective c'x is unbounded below or nearly so: a ray x with sum x_i F_i positive semidefinite and "
     "c'x = -1 proves it",
     "bound the direction that the ray points to"},
    {Status::kIterationLimit, "iteration_limit",
     "the iteration limit was reached before the error measures were small enough",
     "raise max_iterations or relax tolerance"},
    {Status::kNumericalTrouble, "numerical_trouble",
     "rounding errors stopped the progress before the error measures were small enough",
     "check the scaling of the data and whether both problems have interior points; the best iterate is "
     "returned"},
}};

/// Row of kStatusTable for `status`.
[[nodiscard]] constexpr const StatusText& describe(Status status) noexcept {
  return kStatusTable[static_cast<std::size_t>(status)];
}

/// When to compute in double-double numbers (32 digits, some 50 times slower per operation).
enum class Precision {
  kAutomatic,     ///< double, then double-double where double ends in trouble and the problem is small
  kDouble,        ///< double only
  kDoubleDouble,  ///< double-double only
};

[[nodiscard]] constexpr std::string_view to_string(Precision precision) noexcept {
  switch (precision) {
    case Precision::kDouble:
      return "double";
    case Precision::kDoubleDouble:
      return "double-double";
    case Precision::kAutomatic:
      break;
  }
  return "automatic";
}

/// Settings of the solver.
struct Settings {
  double tolerance = 1e-8;             ///< aim for the six error measures
  double acceptable_tolerance = 1e-7;  ///< still called optimal when rounding errors stop the progress
  double infeasibility_tolerance = 1e-8;
  int max_iterations = 150;
  Precision precision = Precision::kAutomatic;
};

template <class S, class Visitor>
requires std::same_as<std::remove_const_t<S>, Settings>
void visit_fields(S& settings, Visitor&& visit) {
  visit(FieldDoc{.name = "tolerance",
                 .unit = "",
                 .meaning = "stop when the six DIMACS error measures are at most this",
                 .minimum = 1e-20,
                 .maximum = 1e-2},
        settings.tolerance);
  visit(FieldDoc{.name = "acceptable_tolerance",
                 .unit = "",
                 .meaning =
                     "error measures that still count as optimal where rounding errors stop the progress",
                 .minimum = 1e-20,
                 .maximum = 1e-2},
        settings.acceptable_tolerance);
  visit(FieldDoc{.name = "infeasibility_tolerance",
                 .unit = "",
                 .meaning = "largest violation of a normalised ray that proves infeasibility",
                 .minimum = 1e-20,
                 .maximum = 1e-2},
        settings.infeasibility_tolerance);
  visit(FieldDoc{.name = "max_iterations",
                 .unit = "",
                 .meaning = "iterations after which the best iterate is returned",
                 .minimum = 1.0,
                 .maximum = 1e6},
        settings.max_iterations);
  visit(FieldDoc{.name = "precision",
                 .unit = "",
                 .meaning = "numbers computed with: automatic, double or double-double"},
        settings.precision);
}

/// Block-diagonal matrix: one n x n matrix per dense block, one n x 1 matrix per diagonal or free block.
using BlockMatrix = std::vector<Eigen::MatrixXd>;

/// Where the time went, in seconds.
struct Timings {
  double total_s = std::numeric_limits<double>::quiet_NaN();
  double schur_assembly_s = std::numeric_limits<double>::quiet_NaN();
  double schur_factor_s = std::numeric_limits<double>::quiet_NaN();
};

/// The six error measures of the seventh DIMACS challenge (Mittelmann 2003, section 2.1), with |.| the
/// largest absolute entry:
///   err1 = ||<F_i, Y> - c||_2 / (1 + |c|)           err2 = max(0, -lambda_min(Y)) / (1 + |c|)
///   err3 = ||sum x_i F_i - F_0 - X||_F / (1 + |F_0|)  err4 = max(0, -lambda_min(X)) / (1 + |F_0|)
///   err5 = (c'x - <F_0, Y>) / (1 + |c'x| + |<F_0, Y>|)  err6 = <X, Y> / (1 + |c'x| + |<F_0, Y>|)
using DimacsErrors = std::array<double, 6>;

/// Answer to a Problem. Not computed: NaN or empty.
///
/// | symbol | field      | shape | meaning                                                                |
/// |--------|------------|-------|------------------------------------------------------------------------|
/// | x      | x          | m     | variables of (P)                                                       |
/// | X      | slack      | block | sum x_i F_i - F_0 up to err3, positive definite up to err4             |
/// | Y      | multiplier | block | variables of (D), positive definite up to err2 on semidefinite blocks  |
/// | -      | ray_x      | m     | where dual infeasible: c'x = -1, sum x_i F_i in K up to violation      |
/// | -      | ray_y      | block | where primal infeasible: <F_0, Y> = 1, <F_i, Y> = 0 up to violation    |
struct Solution {
  Status status = Status::kNumericalTrouble;
  Precision precision = Precision::kDouble;  ///< numbers the answer was computed with
  Eigen::VectorXd x;
  BlockMatrix slack;
  BlockMatrix multiplier;
  double primal_objective = std::numeric_limits<double>::quiet_NaN();  ///< c'x
  double dual_objective = std::numeric_limits<double>::quiet_NaN();    ///< <F_0, Y>
  DimacsErrors dimacs{};
  Eigen::VectorXd ray_x;
  BlockMatrix ray_y;
  double ray_violation = std::numeric_limits<double>::quiet_NaN();
  int iterations = 0;         ///< of all passes
  bool sparse_schur = false;  ///< the Schur complement was factorised as a sparse matrix
  Timings timings;
};

}  // namespace trammel::inline TRAMMEL_ABI::sdp
