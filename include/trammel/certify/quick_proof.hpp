// SPDX-License-Identifier: Apache-2.0
/// @file
/// Both bounds of a certificate at the cost of a few plain products.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "trammel/certify/matrix_inequality.hpp"
#include "trammel/certify/quick_criterion.hpp"
#include "trammel/core/config.hpp"
#include "trammel/linalg/coarse_product.hpp"
#include "trammel/linalg/double_double.hpp"
#include "trammel/linalg/sparse_columns.hpp"
#include "trammel/problem/guaranteed_problem.hpp"

namespace trammel::inline TRAMMEL_ABI::certify {

/// What is known of an estimator K, p x p, of a guaranteed problem with p parameters, m measurements.
///
/// E = K J - I is evaluated in double-double arithmetic that skips the zeros of F, and multiplied by coarse
/// factors (coarse_product()); everything after that is plain arithmetic, since no leading digits cancel any
/// more. Errors are kept as norms of rows, as the criterion sees them. Cost beside sparse products: two
/// p x p products for each basis, two halves for the form, and two for the lower bound.
class QuickProof {
 public:
  QuickProof(const GuaranteedProblem& problem, const Eigen::MatrixXd& gain);

  /// |C K F'|_F^2.
  [[nodiscard]] const linalg::Enclosure& noise() const { return noise_; }

  /// W next to a given matrix, A W and E W. A, q x p: stacked factors of bounds.
  struct Image {
    linalg::SparseColumns bounds;   ///< A
    Eigen::VectorXd scale;          ///< D of coarse_product()
    linalg::CoarseProduct product;  ///< W and E W, but for the error of E
    Eigen::VectorXd error;          ///< p, Euclidean norms of the errors of the rows of E D
    Eigen::MatrixXd bounded;        ///< (A W)' to double precision
  };
  [[nodiscard]] Image image(const Eigen::MatrixXd& near, const Eigen::MatrixXd& bounds) const;

  /// W'(H(lambda) - E'SE)W. rows: multiplier of each row of A.
  [[nodiscard]] MatrixInequality inequality(const Image& image, const Eigen::VectorXd& rows) const;

  /// Upper bound of the largest sum of squares of a_l L over groups of the first rows of A, L: p x k;
  /// infinite or NaN if that is not known. offset: first row of each group, and one more. image: of L.
  [[nodiscard]] static double largest_bound(const Eigen::MatrixXd& factor, const Image& image,
                                            const std::vector<Eigen::Index>& offset);

  /// A prior with covariance share L L'.
  struct Prior {
    const Eigen::MatrixXd& factor;  ///< L, p x k
    double share = 0.0;
  };

  /// Lower bound of the mean-square error of any linear estimator for a prior V = share L L'. By duality of
  /// least squares, for any Q, p x k,
  ///
  ///   min over K' >= |C K F'|^2 + share |C E L|^2 - share |C (E L + Q)|^2 - |C (K F' - share Q (F L)')|^2,
  ///
  /// with equality for the K that is best for V and Q = -E L, which is tried first; where that loses more
  /// than a negligible share of the value, or of the distance to `upper`, F L is evaluated with more digits
  /// (if it has lost many) and also Q = L (I + share L'JL)^-1 tried.
  /// image: of L.
  [[nodiscard]] double lower_bound(const Prior& prior, const Image& image, double upper) const;

 private:
  /// E L from E W, transposed, and the errors of its rows.
  struct Bias {
    Eigen::MatrixXd rows;
    Eigen::VectorXd errors;
  };
  [[nodiscard]] Bias prior_bias(const Eigen::MatrixXd& factor, const Image& image) const;

  /// (F L)' and norms: of its columns, and of their errors. careful: in double-double arithmetic, where the
  /// columns of F L are far smaller than those of |F||L|.
  struct Seen {
    Eigen::MatrixXd rows;
    Eigen::VectorXd sizes;
    Eigen::VectorXd errors;
  };
  [[nodiscard]] Seen prior_seen(const Eigen::MatrixXd& factor, bool careful) const;

  /// |C (K F' + share X (F L)')|_F^2, rounded up; X given transposed with the errors of its rows.
  [[nodiscard]] double residual(const Seen& seen, double share, const Bias& x) const;

  const Eigen::MatrixXd& gain_;
  QuickCriterion criterion_;
  linalg::SparseColumns information_;             ///< F
  linalg::SparseColumns information_transposed_;  ///< F'
  Eigen::MatrixXd gain_information_;              ///< (K F')', leading part
  Eigen::VectorXd gain_information_errors_;       ///< of its rows, as the criterion sees them
  Eigen::MatrixXd error_hi_;                      ///< E = error_hi + error_lo, but for rounding
  Eigen::MatrixXd error_lo_;
  linalg::Enclosure noise_;
};

/// (I + share L'JL)^-1 L' from L' and (F L)', through the QR factorisation of [I; sqrt(share) F L] where only
/// the square root of the condition may matter.
[[nodiscard]] Eigen::MatrixXd posterior_map(const Eigen::MatrixXd& prior_transposed,
                                            const Eigen::MatrixXd& seen_transposed, double share);

}  // namespace trammel::inline TRAMMEL_ABI::certify

#ifndef TRAMMEL_COMPILED
#include "trammel/certify/quick_proof_impl.hpp"
#endif
