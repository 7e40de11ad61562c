// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of quick_proof.hpp.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "trammel/certify/quick_proof.hpp"
#include "trammel/linalg/cholesky.hpp"
#include "trammel/linalg/error_norms.hpp"
#include "trammel/linalg/qr.hpp"

namespace trammel::inline TRAMMEL_ABI::certify {

namespace quick_proof_detail {

using linalg::kUnderflow;
using linalg::kUnitRoundoff;
using linalg::room;
using linalg::round_down;
using linalg::round_up;

/// Largest entry of I + L'JL up to which its Cholesky factorisation is accurate enough (loses its square
/// times u^2, at most about 1e-14).
inline constexpr double kWellConditioned = 1e8;

/// A lower bound may lose this share of the value, or that of the gap, where more would need a further
/// product and factorisation.
inline constexpr double kNegligible = 1e-11;
inline constexpr double kShareOfGap = 0.01;

/// F L has lost many digits if more than this share of a column of it may be rounding errors.
inline constexpr double kCancelled = 5e-12;

/// Share of |A||B| that add_sparse_product() may err by.
inline double double_double_share(const linalg::SparseColumns& b) {
  const double terms = static_cast<double>(b.longest()) + 5.0;
  return terms * terms * kUnitRoundoff * kUnitRoundoff;
}

/// Share by which a plain sum of `terms` products may err, with a few roundings before and after.
inline double plain_share(Eigen::Index terms) { return 2.0 * static_cast<double>(terms + 8) * kUnitRoundoff; }

}  // namespace quick_proof_detail

TRAMMEL_INLINE QuickProof::QuickProof(const GuaranteedProblem& problem, const Eigen::MatrixXd& gain)
    : gain_(gain),
      criterion_(problem.criterion_factor),
      information_(problem.information_factor),
      information_transposed_(information_.transpose()) {
  using namespace quick_proof_detail;
  const Eigen::Index p = gain.rows();
  const Eigen::Index m = information_.rows();
  Eigen::MatrixXd hi = Eigen::MatrixXd::Zero(p, m);
  Eigen::MatrixXd lo(p, m);
  linalg::add_sparse_product(gain, {}, information_transposed_, linalg::ProductPart::kFull, hi, lo);
  error_hi_ = -Eigen::MatrixXd::Identity(p, p);
  error_lo_.resize(p, p);
  linalg::add_sparse_product(hi, lo, information_, linalg::ProductPart::kFull, error_hi_, error_lo_);
  gain_information_ = hi.transpose();
  // The trailing part is below u of the leading one.
  const Eigen::VectorXd& weights = criterion_.weights();
  gain_information_errors_ =
      room(p) * (kUnitRoundoff * criterion_.sizes(gain_information_) +
                 double_double_share(information_transposed_) *
                     information_transposed_.sizes_times(linalg::transposed_sizes_times(gain, weights)));
  gain_information_errors_.array() += kUnderflow * weights.sum();
  if (!(linalg::entries_in_range(gain) && linalg::entries_in_range(problem.information_factor) &&
        linalg::entries_in_range(hi))) {
    gain_information_errors_.setConstant(std::numeric_limits<double>::infinity());
  }
  noise_ = criterion_.squared_norm(gain_information_, gain_information_errors_);
}

TRAMMEL_INLINE QuickProof::Image QuickProof::image(const Eigen::MatrixXd& near,
                                                   const Eigen::MatrixXd& bounds) const {
  using namespace quick_proof_detail;
  const Eigen::Index p = gain_.rows();
  Image result;
  result.bounds = linalg::SparseColumns(bounds);
  result.scale = linalg::balance(error_hi_, near);
  result.product = linalg::coarse_product(error_hi_, error_lo_, near, result.scale);
  // |rows of the error of E D|: of K F' times F D, and of the product with F itself.
  const Eigen::VectorXd seen = room(p) * information_transposed_.norms(result.scale);
  const Eigen::VectorXd information = information_.sizes_times(seen);
  result.error =
      double_double_share(information_transposed_) * linalg::sizes_times(gain_, information) +
      double_double_share(information_) *
          (linalg::transposed_sizes_times(gain_information_, (1.0 + 0x1p-50) * seen) + result.scale);
  result.error *= room(2 * p + information_.rows());
  result.error.array() += kUnderflow * result.scale.sum();
  if (!(std::isfinite(gain_information_errors_.sum()) && linalg::entries_in_range(bounds))) {
    result.error.setConstant(std::numeric_limits<double>::infinity());
  }
  // Differences of positions lose many digits in A W.
  result.bounded = Eigen::MatrixXd::Zero(near.cols(), bounds.rows());
  Eigen::MatrixXd low(near.cols(), bounds.rows());
  linalg::add_sparse_product(result.product.factor.transpose(), {}, result.bounds.transpose(),
                             linalg::ProductPart::kFull, result.bounded, low);
  return result;
}

TRAMMEL_INLINE MatrixInequality QuickProof::inequality(const Image& image,
                                                       const Eigen::VectorXd& rows) const {
  using namespace quick_proof_detail;
  const linalg::CoarseProduct& product = image.product;
  const Eigen::Index p = product.factor.rows();
  const Eigen::Index q = rows.size();
  const Eigen::VectorXd columns = image.bounds.sizes_times(Eigen::VectorXd::Ones(q));
  Eigen::VectorXd bounded_error = (room(p + q) * double_double_share(image.bounds.transpose())) *
                                  linalg::transposed_sizes_times(product.factor, columns);
  bounded_error.array() += linalg::kSmallestNorm;
  const Eigen::Index terms = q + criterion_.terms();
  UncertainForm form = weighted_gram(image.bounded, bounded_error, rows, terms);
  const Eigen::MatrixXd bias = product.product.transpose();
  const double row_error = criterion_.weights().dot(product.row_error + image.error);
  const Eigen::VectorXd errors =
      room(p) * ((row_error * product.column_size + (2.0 * kUnitRoundoff) * criterion_.sizes(bias)).array() +
                 kUnderflow * criterion_.weights().sum());
  criterion_.subtract_gram(bias, errors, terms, form);
  return {std::move(form), image.bounded, std::move(bounded_error), rows};
}

TRAMMEL_INLINE double QuickProof::largest_bound(const Eigen::MatrixXd& factor, const Image& image,
                                                const std::vector<Eigen::Index>& offset) {
  using namespace quick_proof_detail;
  const Eigen::MatrixXd rest = factor - image.product.factor;
  const linalg::SparseColumns transposed = image.bounds.transpose();
  const Eigen::MatrixXd bounded = image.bounded + linalg::sparse_product(rest.transpose(), transposed);
  // Norms of a row of A L, and of its errors: the trailing part of A W, rounding the sum, and both products.
  const double slack = room(factor.rows() + factor.cols());
  const Eigen::VectorXd norms = slack * ((1.0 + 0x1p-51) * linalg::column_norms(bounded) +
                                         double_double_share(transposed) *
                                             transposed.sizes_times(linalg::row_norms(image.product.factor)) +
                                         plain_share(static_cast<Eigen::Index>(transposed.longest())) *
                                             transposed.sizes_times(linalg::row_norms(rest)));
  double largest = image.error.sum() < std::numeric_limits<double>::infinity()
                       ? 0.0
                       : std::numeric_limits<double>::infinity();
  for (std::size_t l = 0; l + 1 < offset.size(); ++l) {
    double total = 0.0;
    for (Eigen::Index j = offset[l]; j < offset[l + 1]; ++j) {
      total = round_up(total + round_up(norms(j) * norms(j)));
    }
    largest = std::isfinite(total) ? std::max(largest, total) : std::numeric_limits<double>::infinity();
  }
  return largest;
}

TRAMMEL_INLINE QuickProof::Bias QuickProof::prior_bias(const Eigen::MatrixXd& factor,
                                                       const Image& image) const {
  using namespace quick_proof_detail;
  const linalg::CoarseProduct& product = image.product;
  const Eigen::Index p = factor.rows();
  const Eigen::MatrixXd rest = factor - product.factor;
  Eigen::MatrixXd bias = product.product;
  bias.noalias() += error_hi_ * rest;
  Bias result;
  result.rows = bias.transpose();
  const Eigen::VectorXd& weights = criterion_.weights();
  const Eigen::VectorXd rest_sizes = linalg::column_norms(rest, image.scale);
  const double error_size = weights.dot(linalg::row_norms(error_hi_, image.scale));
  const double coarse_error = weights.dot(product.row_error + image.error);
  const double rest_error = weights.dot(image.error) + 2.0 * plain_share(p) * error_size;
  result.errors = room(p) * ((coarse_error * product.column_size + rest_error * rest_sizes +
                              plain_share(p) * criterion_.sizes(result.rows))
                                 .array() +
                             kUnderflow * weights.sum());
  return result;
}

TRAMMEL_INLINE QuickProof::Seen QuickProof::prior_seen(const Eigen::MatrixXd& factor, bool careful) const {
  using namespace quick_proof_detail;
  Seen result;
  double share = plain_share(static_cast<Eigen::Index>(information_transposed_.longest()));
  if (careful) {
    share = double_double_share(information_transposed_);
    result.rows = Eigen::MatrixXd::Zero(factor.cols(), information_transposed_.cols());
    Eigen::MatrixXd low(result.rows.rows(), result.rows.cols());
    linalg::add_sparse_product(factor.transpose(), {}, information_transposed_, linalg::ProductPart::kFull,
                               result.rows, low);
  } else {
    result.rows = linalg::sparse_product(factor.transpose(), information_transposed_);
  }
  const double slack = room(factor.cols() + factor.rows());
  result.sizes = slack * linalg::column_norms(result.rows);
  // The trailing part left out is below u of the leading one.
  result.errors = slack * (share * information_transposed_.sizes_times(linalg::row_norms(factor)) +
                           kUnitRoundoff * result.sizes);
  result.errors.array() += kUnderflow;
  return result;
}

TRAMMEL_INLINE double QuickProof::residual(const Seen& seen, double share, const Bias& x) const {
  using namespace quick_proof_detail;
  const Eigen::Index terms = x.rows.rows() + x.rows.cols();
  Eigen::MatrixXd rest = gain_information_;
  const Eigen::MatrixXd scaled = share * x.rows;
  rest.noalias() += seen.rows.transpose() * scaled;
  // As the criterion sees them: sum |C e_l| times the norm of column l of X', and the errors of its rows.
  const double columns = room(terms) * criterion_.weights().dot(linalg::column_norms(x.rows));
  const double column_errors = room(terms) * x.errors.norm();
  const Eigen::VectorXd errors =
      room(terms) * (gain_information_errors_ + plain_share(terms) * criterion_.sizes(gain_information_) +
                     seen.sizes * (share * (plain_share(terms) * columns + column_errors)) +
                     seen.errors * (share * (columns + column_errors)));
  return criterion_.squared_norm(rest, errors).upper();
}

TRAMMEL_INLINE double QuickProof::lower_bound(const Prior& prior, const Image& image, double upper) const {
  using namespace quick_proof_detail;
  const Bias bias = prior_bias(prior.factor, image);
  const linalg::Enclosure square = criterion_.squared_norm(bias.rows, bias.errors);
  const double value = round_down(noise_.lower() + round_down(prior.share * std::max(square.lower(), 0.0)));
  double bound = -std::numeric_limits<double>::infinity();
  const auto is_enough = [&](double loss) {
    bound = std::max(bound, round_down(value - loss));
    return loss <= kNegligible * bound || loss <= kShareOfGap * (upper - bound);
  };
  Seen seen = prior_seen(prior.factor, false);
  if (is_enough(residual(seen, prior.share, bias))) {
    return bound;
  }
  if ((seen.errors.array() > kCancelled * seen.sizes.array()).any()) {
    seen = prior_seen(prior.factor, true);
    if (is_enough(residual(seen, prior.share, bias))) {
      return bound;
    }
  }
  const Eigen::MatrixXd best = posterior_map(prior.factor.transpose(), seen.rows, prior.share);
  if (best.allFinite()) {
    const Bias other{.rows = -best, .errors = Eigen::VectorXd::Zero(best.rows())};
    const Eigen::MatrixXd distance = bias.rows + best;
    const double apart =
        criterion_.squared_norm(distance, bias.errors + (2.0 * kUnitRoundoff) * criterion_.sizes(distance))
            .upper();
    const double loss = round_up(round_up(prior.share * apart) + residual(seen, prior.share, other));
    bound = std::max(bound, round_down(value - loss));
  }
  return bound;
}

TRAMMEL_INLINE Eigen::MatrixXd posterior_map(const Eigen::MatrixXd& prior_transposed,
                                             const Eigen::MatrixXd& seen_transposed, double share) {
  const Eigen::Index k = prior_transposed.rows();
  Eigen::MatrixXd map = prior_transposed;
  // The error enters squared: the plain normal equations do unless they are badly conditioned.
  Eigen::MatrixXd normal = Eigen::MatrixXd::Identity(k, k);
  normal.selfadjointView<Eigen::Lower>().rankUpdate(seen_transposed, share);
  const linalg::Cholesky cholesky(normal);
  if (cholesky.info() == Eigen::Success &&
      normal.diagonal().maxCoeff() < quick_proof_detail::kWellConditioned) {
    cholesky.solveInPlace(map);
    return map;
  }
  Eigen::MatrixXd both(k + seen_transposed.cols(), k);
  both << Eigen::MatrixXd::Identity(k, k), std::sqrt(share) * seen_transposed.transpose();
  const linalg::Qr qr(both);
  const Eigen::MatrixXd r = qr.matrixQR().topRows(k);
  r.triangularView<Eigen::Upper>().transpose().solveInPlace(map);
  r.triangularView<Eigen::Upper>().solveInPlace(map);
  return map;
}

}  // namespace trammel::inline TRAMMEL_ABI::certify
