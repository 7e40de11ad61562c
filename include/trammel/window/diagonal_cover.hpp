// SPDX-License-Identifier: Apache-2.0
/// @file
/// The cheapest block diagonal above a banded matrix.
#pragma once

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/linalg/banded_matrix.hpp"

namespace trammel::inline TRAMMEL_ABI::window {

/// Lower Cholesky factor of diag(kappa_l I_3) - G, G symmetric; false where that is not positive definite.
[[nodiscard]] bool cover_factor(const linalg::BandedMatrix& G, const Eigen::VectorXd& kappa,
                                linalg::BandedMatrix& factor);

/// Improves kappa with diag(kappa_l I_3) > G towards the minimum of sum_l cost_l kappa_l under that
/// condition.
///
/// | symbol | meaning                                | shape          |
/// |--------|----------------------------------------|----------------|
/// | G      | symmetric, banded                      | 3 s x 3 s      |
/// | kappa  | one number per block, admissible       | s              |
/// | cost   | positive                               | s              |
///
/// Method: Newton's method for sum cost kappa - mu log det(diag(kappa) - G) with falling mu; gradient and
/// Hessian, mu |[(diag(kappa) - G)^-1]_lm|_F^2, come from the inverse within the band. Starts with 3 s mu =
/// `first_gap`, a guess of how far `kappa` is from the minimum. Stops when 3 s mu, the
/// distance from the minimum, is below `tolerance`, or where rounding errors end the progress. Returns the
/// last admissible kappa (the one given, if that is not admissible). Cost: 10 to 25 steps of 3 s b^2
/// operations for a band of b.
[[nodiscard]] Eigen::VectorXd cheapest_cover(const linalg::BandedMatrix& G, Eigen::VectorXd kappa,
                                             const Eigen::VectorXd& cost, double first_gap, double tolerance);

}  // namespace trammel::inline TRAMMEL_ABI::window

#ifndef TRAMMEL_COMPILED
#include "trammel/window/diagonal_cover_impl.hpp"
#endif
