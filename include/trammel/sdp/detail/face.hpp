// SPDX-License-Identifier: Apache-2.0
/// @file
/// Constraints that confine Y to a face of the semidefinite cone, and the program on that face.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/sdp/problem.hpp"
#include "trammel/sdp/solution.hpp"

namespace trammel::inline TRAMMEL_ABI::sdp::detail {

/// A dense block, n rows, in which constraints <F_i, Y> = 0 with semidefinite F_i force Y G = 0 and so
/// Y = N Z N'. The program in Z has interior points where the one in Y has none.
struct Face {
  struct Term {
    int variable = 0;   ///< i
    double sign = 1.0;  ///< sign F_i is positive semidefinite
  };
  int block = 0;
  std::vector<Term> terms;
  Eigen::MatrixXd factor;  ///< n x r, G = sum of sign F_i = factor factor'
  Eigen::MatrixXd basis;   ///< N, n x (n - r), G N = 0: rows of the identity, and r others
};

/// Faces that single constraints show: c_i = 0, all of F_i in one dense block, its rank small (Borwein,
/// Wolkowicz 1981, "Facial reduction for a cone-convex programming problem", one step). A block in which Y
/// would vanish is left alone.
[[nodiscard]] std::vector<Face> find_faces(const Problem& problem);

/// The program in Z. Variables of the faces' terms are left out, `kept` numbers the others.
struct FaceProblem {
  Problem problem;
  std::vector<int> kept;
};
[[nodiscard]] FaceProblem restrict_to(const Problem& problem, const std::vector<Face>& faces);

/// x, X and Y of the whole from those on the faces, into `solution`. The variables of the terms become just
/// large enough for lambda_min(X) >= -deficit; `constant` F_0 belongs to X.
void lift(const Problem& problem, const std::vector<Face>& faces, const std::vector<int>& kept,
          double constant, double deficit, Solution& solution);

}  // namespace trammel::inline TRAMMEL_ABI::sdp::detail

#ifndef TRAMMEL_COMPILED
#include "trammel/sdp/detail/face_impl.hpp"
#endif
