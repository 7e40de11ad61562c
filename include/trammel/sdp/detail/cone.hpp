// SPDX-License-Identifier: Apache-2.0
/// @file
/// What the interior-point method asks of a cone.
#pragma once

#include <concepts>

#include <Eigen/Core>

#include "trammel/core/config.hpp"

namespace trammel::inline TRAMMEL_ABI::sdp::detail {

template <class Scalar>
using MatrixOf = Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic>;
template <class Scalar>
using VectorOf = Eigen::Matrix<Scalar, Eigen::Dynamic, 1>;

/// Which of the two matrices of a cone.
enum class Side { kX, kY };

/// A symmetric cone with its part of the coefficients F_i and of the iterate (X, Y). All `add_` functions add
/// to vectors over the variables; a Schur matrix receives each pair (i, j) once, in either triangle.
///
/// | operation        | formula                                                                             |
/// |------------------|-------------------------------------------------------------------------------------|
/// | start            | X = Y = multiples of the identity                                                   |
/// | update_residual  | D = sum x_i F_i - F_0 - X                                                           |
/// | factorise        | prepares X^-1 and the factors of X and Y; false: not in the interior                |
/// | add_adjoint_y    | out_i += scale <F_i, Y>                                                             |
/// | add_schur        | B_ij += <F_i, X^-1 F_j Y>                                                           |
/// | fill_root        | rows of M with B = M'M, `root_rows` of them from `first` on                         |
/// | add_gram         | G_ij += <F_i, F_j>                                                                  |
/// | subtract_from_y  | Y -= sum z_i F_i                                                                    |
/// | smallest_y       | lambda_min(Y), any number >= 0 where that is positive                               |
/// | begin_direction  | out_i += <F_i, mu X^-1 - Y - sym(X^-1 (D Y + [dX dY]))>, [] only in the corrector   |
/// | finish_direction | dX = D + sum dx_i F_i, dY = mu X^-1 - Y - sym(X^-1 (dX Y + [..]))                   |
/// | refine_direction | dX += sum dx_i F_i, dY -= sym(X^-1 (sum dx_i F_i) Y)                                |
/// | add_adjoint_dy   | out_i += scale <F_i, dY>                                                            |
/// | max_step         | largest a with X + a dX (or Y + a dY) in the cone, a little less, or infinity       |
/// | step             | X += a dX or Y += a dY                                                              |
/// | inner_product    | <X, Y>; after_step: <X + a dX, Y + b dY>                                            |
template <class C>
concept Cone = requires(C cone, const C& constant, const VectorOf<typename C::Scalar>& x,
                        VectorOf<typename C::Scalar>& out, MatrixOf<typename C::Scalar>& schur,
                        typename C::Scalar a, bool second_order) {
  cone.update_residual(x);
  { cone.factorise() } -> std::same_as<bool>;
  constant.add_adjoint_y(out, a);
  cone.add_schur(schur);
  cone.fill_root(Eigen::Index{0}, schur);
  { constant.root_rows() } -> std::same_as<Eigen::Index>;
  cone.add_gram(schur);
  cone.subtract_from_y(x);
  { cone.smallest_y() } -> std::same_as<double>;
  cone.begin_direction(a, second_order, out);
  cone.finish_direction(x);
  cone.refine_direction(x);
  constant.add_adjoint_dy(out, a);
  { cone.max_step(Side::kX, a) } -> std::same_as<double>;
  cone.step(Side::kX, a);
  { constant.inner_product() } -> std::same_as<typename C::Scalar>;
  { constant.after_step(a, a) } -> std::same_as<typename C::Scalar>;
  { constant.constant_times_y() } -> std::same_as<typename C::Scalar>;
  { constant.residual_norm_squared() } -> std::same_as<typename C::Scalar>;
  { constant.size() } -> std::same_as<Eigen::Index>;
};

}  // namespace trammel::inline TRAMMEL_ABI::sdp::detail
