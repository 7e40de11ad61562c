// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of certificate.hpp.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "trammel/certify/certificate.hpp"
#include "trammel/certify/congruence_basis.hpp"
#include "trammel/certify/enclosed_criterion.hpp"
#include "trammel/certify/environment.hpp"
#include "trammel/certify/gain_rounding.hpp"
#include "trammel/certify/matrix_inequality.hpp"
#include "trammel/core/error.hpp"
#include "trammel/linalg/cholesky.hpp"
#include "trammel/linalg/coarse_product.hpp"
#include "trammel/linalg/double_double.hpp"
#include "trammel/linalg/qr.hpp"
#include "trammel/minimax/prior_state.hpp"

namespace trammel::inline TRAMMEL_ABI::certify {

namespace certificate_detail {

using linalg::EnclosedMatrix;
using linalg::Enclosure;
using linalg::Precision;
using linalg::round_down;
using linalg::round_up;
using linalg::sum_rounded_up;

/// Every proof begins with multipliers inflated by this much, which nobody notices: it makes room for the
/// radii of plain arithmetic.
inline constexpr double kFirstInflation = 1e-12;
/// An inflation above this is worth a second try with more digits or in a better conditioned basis ...
inline constexpr double kGoodInflation = 1e-10;
/// ... if that may bring it below this share.
inline constexpr double kWorthwhile = 0.9;
/// Share of the upper bound spent on the envelope ...
inline constexpr double kEnvelopeShare = 1e-11;
/// ... and the envelope's size: what the unbounded directions may add to the bias, relative to the upper
/// bound (a square, hence about 1e-10 in the bias itself).
inline constexpr double kEnvelopeBias = 1e-21;
/// Radii of plain arithmetic below this share of a result do not matter.
inline constexpr double kNegligible = 1e-11;
/// So do radii and losses below this share of the gap that is proved.
inline constexpr double kShareOfGap = 0.01;
/// Largest entry of I + L'JL up to which its Cholesky factorisation is accurate enough (loses its square
/// times u^2, at most about 1e-14).
inline constexpr double kWellConditioned = 1e8;
/// Errors smaller than this share of what a direction does to the criterion count as this large.
inline constexpr double kResolution = 1e-18;
/// An envelope is never wider than this many standard deviations of the measurement noise.
inline constexpr double kWidestEnvelope = 1e18;

/// An interval wider than asked for by this factor and this much is still as good as asked for.
inline constexpr double kGapSlack = 1.01;
inline constexpr double kCostOfProof = 3e-10;
/// More parameters are not worth the time that rounding K anew takes.
inline constexpr Eigen::Index kMostToRound = 400;

/// What the proof may cost beyond what the solver could see.
inline double allowed_gap(const minimax::SolverSettings& settings) {
  return settings.relative_gap * kGapSlack + kCostOfProof;
}

inline std::string shape(const Eigen::MatrixXd& matrix) {
  return std::to_string(matrix.rows()) + " x " + std::to_string(matrix.cols());
}

inline void check_shapes(const GuaranteedProblem& problem, const CandidatePoint& point) {
  const Eigen::Index p = problem.parameters();
  const auto s = static_cast<Eigen::Index>(problem.ellipsoids.size());
  const std::string columns = std::to_string(p) + " columns";
  require(problem.information_factor.cols() == p, "problem.information_factor",
          shape(problem.information_factor), columns);
  for (std::size_t l = 0; l < problem.ellipsoids.size(); ++l) {
    require(problem.ellipsoids[l].cols() == p, "problem.ellipsoids[" + std::to_string(l) + "]",
            shape(problem.ellipsoids[l]), columns);
  }
  require(point.gain.rows() == p && point.gain.cols() == p, "gain", shape(point.gain),
          std::to_string(p) + " x " + std::to_string(p));
  require(point.multipliers.size() == s, "multipliers", std::to_string(point.multipliers.size()) + " numbers",
          std::to_string(s) + " numbers");
  require(point.prior_factor.rows() == p, "prior_factor", shape(point.prior_factor),
          std::to_string(p) + " rows");
}

/// What both bounds share. Matrices are transposed where that puts the problem's own factors, which are
/// mostly sparse, on the right of a product.
struct Workspace {
  const GuaranteedProblem& problem;
  EnclosedMatrix information_transposed;       ///< F'
  EnclosedMatrix gain_information_transposed;  ///< (K F')'
  EnclosedMatrix error;                        ///< E = K J - I
  EnclosedCriterion quick;                     ///< plain arithmetic: tried first
  Enclosure noise;                             ///< |C K F'|_F^2
  Eigen::MatrixXd stacked;                     ///< all a_l below one another
  std::vector<Eigen::Index> offset;            ///< first row of a_l in it; one more than ellipsoids

  Workspace(const GuaranteedProblem& given, const Eigen::MatrixXd& gain)
      : problem(given),
        information_transposed(given.information_factor.transpose()),
        quick(given.criterion_factor, Precision::kDouble) {
    const EnclosedMatrix gain_information = linalg::product(EnclosedMatrix(gain), information_transposed);
    const Eigen::Index p = given.parameters();
    error = linalg::product_minus(gain_information, EnclosedMatrix(given.information_factor),
                                  Eigen::MatrixXd::Identity(p, p));
    gain_information_transposed = gain_information.transpose();
    noise = quick.trace(gain_information_transposed);
    if (!(noise.radius <= kNegligible * noise.hi)) {
      noise = careful().trace(gain_information_transposed);
    }
    offset.push_back(0);
    for (const Eigen::MatrixXd& factor : given.ellipsoids) {
      offset.push_back(offset.back() + factor.rows());
    }
    stacked.resize(offset.back(), given.parameters());
    for (std::size_t l = 0; l < given.ellipsoids.size(); ++l) {
      stacked.middleRows(offset[l], given.ellipsoids[l].rows()) = given.ellipsoids[l];
    }
  }

  /// More digits, prepared when first needed.
  [[nodiscard]] const EnclosedCriterion& careful() const {
    if (!careful_) {
      careful_.emplace(problem.criterion_factor, Precision::kDoubleDouble);
    }
    return *careful_;
  }

  /// One number per row of `stacked` from one per ellipsoid.
  [[nodiscard]] Eigen::VectorXd per_row(const Eigen::VectorXd& per_ellipsoid) const {
    Eigen::VectorXd result(stacked.rows());
    minimax::per_row(per_ellipsoid, offset, result);
    return result;
  }

 private:
  mutable std::optional<EnclosedCriterion> careful_;
};

/// A square basis W and what problem and bounds make of it, transposed.
struct Image {
  Eigen::MatrixXd basis;      ///< W, p x p
  EnclosedMatrix bounded;     ///< (stacked factors, and envelope, times W)'
  EnclosedMatrix bias;        ///< (E W)'
  EnclosedMatrix bias_image;  ///< what the criterion makes of it
};

/// Fast: W is next to `basis`, but has few bits.
inline Image quick_image(const Workspace& work, const Eigen::MatrixXd& bounds, const Eigen::MatrixXd& basis) {
  linalg::CoarseProduct bias = linalg::coarse_product(work.error, basis);
  Image image;
  image.basis = std::move(bias.factor);
  image.bounded =
      linalg::product(EnclosedMatrix(image.basis.transpose()), EnclosedMatrix(bounds.transpose()));
  image.bias = bias.product.transpose();
  image.bias_image = work.quick.image(image.bias);
  return image;
}

/// Careful: W is `basis`, and E W = (K F')(F W) - W since both factors may be far smaller than K and J.
inline Image careful_image(const Workspace& work, const Eigen::MatrixXd& bounds,
                           const Eigen::MatrixXd& basis) {
  Image image;
  image.basis = basis;
  const EnclosedMatrix transposed(basis.transpose());
  image.bounded = linalg::product(transposed, EnclosedMatrix(bounds.transpose()));
  image.bias = linalg::product_minus(linalg::product(transposed, work.information_transposed),
                                     work.gain_information_transposed, transposed.hi);
  image.bias_image = work.careful().image(image.bias);
  return image;
}

/// Directions no ellipsoid bounds, confined.
struct Envelope {
  Eigen::MatrixXd rows;     ///< k x p, |rows theta| <= 1
  double multiplier = 0.0;  ///< of this additional ellipsoid
};

inline Eigen::MatrixXd with_envelope(const Workspace& work, const Envelope& envelope) {
  Eigen::MatrixXd bounds(work.stacked.rows() + envelope.rows.rows(), work.stacked.cols());
  bounds << work.stacked, envelope.rows;
  return bounds;
}

/// Multipliers of all bounds and how they may grow.
struct Weights {
  Eigen::MatrixXd bounds;  ///< stacked factors with the envelope
  Eigen::VectorXd rows;    ///< multiplier of each of its rows
  double step = 0.0;       ///< upper bound over the number of ellipsoids: even growth
  double total = 0.0;      ///< sum of the multipliers of the ellipsoids
  double count = 1.0;      ///< their number, at least one
};

/// An envelope whose cost is kEnvelopeShare of `scale`, sized by how far K is from leaving the unbounded
/// directions unbiased.
inline Envelope make_envelope(const Workspace& work, double scale, UnboundedDirections& unbounded) {
  Envelope envelope;
  const Eigen::Index k = unbounded.directions.cols();
  if (k == 0) {
    envelope.rows.resize(0, work.stacked.cols());
    return envelope;
  }
  const EnclosedMatrix bias = linalg::product(work.error, EnclosedMatrix(unbounded.directions));
  const EnclosedMatrix error = linalg::product(EnclosedMatrix(work.problem.criterion_factor), bias);
  const double bias_allowed = std::sqrt(kEnvelopeBias * scale / static_cast<double>(k));
  envelope.rows = Eigen::MatrixXd::Zero(k, work.stacked.cols());
  for (Eigen::Index j = 0; j < k; ++j) {
    const auto direction = unbounded.directions.col(j);
    const double effect = (work.problem.criterion_factor * direction).norm();
    const double seen = (work.problem.information_factor * direction).norm();
    const double size = std::max(error.hi.col(j).norm() + error.radius.col(j).norm(), kResolution * effect);
    double reach = std::min(bias_allowed / size, kWidestEnvelope / seen);
    if (!(std::isfinite(reach) && reach > 0.0)) {
      reach = 1.0;  // neither measured nor estimated: its size does not matter
    }
    envelope.rows(j, unbounded.coordinates[static_cast<std::size_t>(j)]) = 1.0 / reach;
    unbounded.directions.col(j) *= reach;
  }
  envelope.multiplier = kEnvelopeShare * scale;
  return envelope;
}

/// Multipliers lambda (1 + amount) + amount step.
struct Inflation {
  double amount = std::numeric_limits<double>::quiet_NaN();
  double step = 0.0;
};

/// Steps tried, as shares of the even one: even growth repairs bounds without a multiplier, growth in
/// proportion to the multipliers is cheaper where those that matter have one.
inline constexpr std::array<double, 2> kStepShares{1.0, 0.01};

/// lambda (1 + t) + t step, rounded up.
inline Eigen::VectorXd inflate(Eigen::VectorXd multipliers, const Inflation& inflation) {
  for (double& value : multipliers) {
    value = round_up(
        value + round_up(round_up(inflation.amount * value) + round_up(inflation.amount * inflation.step)));
  }
  return multipliers;
}

/// Looks for an inflation cheaper than `best` for which the inequality is proved; false if neither more
/// digits nor another basis would make it much cheaper.
inline bool search_inflation(const MatrixInequality& inequality, const Weights& weights, Eigen::Index growing,
                             Inflation& best) {
  bool may_improve = false;
  for (const double share : kStepShares) {
    const double step = share * weights.step;
    const double unit_cost = weights.total + weights.count * step;
    const double worthwhile =
        kWorthwhile * best.amount * (weights.total + weights.count * best.step) / unit_cost;
    const MatrixInequality::Growth growth(inequality, step, growing);
    if (std::isnan(best.amount) || growth.holds_at(worthwhile)) {
      best = {.amount = growth.find_inflation(), .step = step};
    }
    if (best.amount <= kGoodInflation) {
      return false;
    }
    may_improve = may_improve || std::isnan(best.amount) ||
                  growth.may_hold_at(best.step == step ? kWorthwhile * best.amount : worthwhile);
  }
  return may_improve;
}

/// Cheapest inflation for which the matrix inequality is proved, with the precision and in the basis that it
/// needs; NaN if in none. `first` becomes the quick image of the first basis.
inline Inflation prove_inequality(const Workspace& work, const Weights& weights,
                                  const Eigen::MatrixXd& prior_factor, const Eigen::MatrixXd& unbounded,
                                  Image& first) {
  Inflation best;
  for (int number = 0; number < kCongruenceBases; ++number) {
    const Eigen::MatrixXd basis = congruence_basis(number, prior_factor, weights.bounds, unbounded);
    if (basis.size() == 0) {
      continue;
    }
    for (const bool careful : {false, true}) {
      const Image image =
          careful ? careful_image(work, weights.bounds, basis) : quick_image(work, weights.bounds, basis);
      const MatrixInequality inequality(image.bounded, weights.rows, image.bias, image.bias_image,
                                        careful ? work.careful() : work.quick);
      if (number == 0 && !careful) {
        first = image;
      }
      if (inequality.holds()) {
        return {.amount = 0.0, .step = 0.0};
      }
      if (!search_inflation(inequality, weights, work.stacked.rows(), best)) {
        return best;
      }
    }
  }
  return best;
}

inline void prove_upper(const Workspace& work, const CandidatePoint& point, UnboundedDirections unbounded,
                        Image& first, Certificate& certificate) {
  const auto s = static_cast<double>(std::max<Eigen::Index>(point.multipliers.size(), 1));
  Eigen::VectorXd multipliers = point.multipliers.cwiseMax(0.0);
  const double noise = work.noise.upper();
  const double scale = noise + multipliers.sum();
  if (!std::isfinite(scale)) {
    certificate.remark = "the gain or the multipliers are too large or not finite";
    return;
  }
  multipliers = inflate(multipliers, {.amount = kFirstInflation, .step = scale / s});
  const Envelope envelope = make_envelope(work, scale, unbounded);
  Weights weights{.bounds = with_envelope(work, envelope),
                  .rows = {},
                  .step = scale / s,
                  .total = multipliers.sum(),
                  .count = s};
  weights.rows.resize(weights.bounds.rows());
  weights.rows << work.per_row(multipliers),
      Eigen::VectorXd::Constant(envelope.rows.rows(), envelope.multiplier);
  const Inflation inflation =
      prove_inequality(work, weights, point.prior_factor, unbounded.directions, first);
  if (std::isnan(inflation.amount)) {
    certificate.remark = "no multipliers near those given satisfy the matrix inequality";
    return;
  }
  certificate.inflation = kFirstInflation + inflation.amount;
  certificate.multipliers = inflate(multipliers, inflation);
  certificate.envelope = envelope.rows;
  // The inflation grew it by the same factor.
  certificate.envelope_multiplier = round_up(envelope.multiplier * round_up(1.0 + inflation.amount));
  certificate.upper =
      round_up(round_up(noise + certificate.envelope_multiplier) + sum_rounded_up(certificate.multipliers));
}

/// Y = (I + sigma^2 L'JL)^-1 sigma L' from L' and (F L)', through the QR factorisation of [I; sigma F L]
/// where only the square root of the condition of I + sigma^2 L'JL may matter.
inline Eigen::MatrixXd posterior_map(const Eigen::MatrixXd& prior_transposed,
                                     const Eigen::MatrixXd& seen_transposed, double sigma) {
  const Eigen::Index k = prior_transposed.rows();
  Eigen::MatrixXd map = sigma * prior_transposed;
  // The error enters squared: the plain normal equations do unless they are badly conditioned.
  Eigen::MatrixXd normal = Eigen::MatrixXd::Identity(k, k);
  normal.selfadjointView<Eigen::Lower>().rankUpdate(seen_transposed, sigma * sigma);
  const linalg::Cholesky cholesky(normal);
  if (cholesky.info() == Eigen::Success && normal.diagonal().maxCoeff() < kWellConditioned) {
    cholesky.solveInPlace(map);
    return map;
  }
  Eigen::MatrixXd both(k + seen_transposed.cols(), k);
  both << Eigen::MatrixXd::Identity(k, k), sigma * seen_transposed.transpose();
  const linalg::Qr qr(both);
  const Eigen::MatrixXd r = qr.matrixQR().topRows(k);
  r.triangularView<Eigen::Upper>().transpose().solveInPlace(map);
  r.triangularView<Eigen::Upper>().solveInPlace(map);
  return map;
}

/// Largest |a_l L|_F^2, rounded up; infinite if that is not known. bounded: transposed a_l L side by side.
inline double largest_bound(const Workspace& work, const EnclosedMatrix& bounded) {
  double largest = 0.0;
  for (std::size_t l = 0; l + 1 < work.offset.size(); ++l) {
    double total = 0.0;
    for (Eigen::Index j = work.offset[l]; j < work.offset[l + 1]; ++j) {
      for (Eigen::Index i = 0; i < bounded.rows(); ++i) {
        const double size = (1.0 + 0x1p-50) * std::abs(bounded.hi(i, j)) + bounded.radius(i, j);
        total += size * size;
      }
    }
    const auto terms = static_cast<double>((work.offset[l + 1] - work.offset[l]) * bounded.rows());
    total *= 1.0 + (terms + 8.0) * 0x1p-52;  // all roundings of the sum of non-negative terms
    largest = std::isfinite(total) ? std::max(largest, total) : std::numeric_limits<double>::infinity();
  }
  return largest;
}

/// A prior factor L, p x k, and what problem and bounds make of it, transposed.
struct Prior {
  EnclosedMatrix factor;   ///< L'
  EnclosedMatrix seen;     ///< (F L)'
  EnclosedMatrix bounded;  ///< (stacked factors times L)'
  EnclosedMatrix bias;     ///< (E L)'
};

/// near: quick image of a basis W next to L, so that E L = E W + E (L - W) needs few digits of the second
/// term; empty or of another shape where there is none.
inline Prior make_prior(const Workspace& work, const Eigen::MatrixXd& factor, const Image& near) {
  Prior prior;
  prior.factor = EnclosedMatrix(factor.transpose());
  prior.seen = linalg::product(prior.factor, work.information_transposed);
  prior.bounded = linalg::product(prior.factor, EnclosedMatrix(work.stacked.transpose()));
  if (near.basis.cols() == factor.cols()) {
    const EnclosedMatrix rest =
        linalg::product(work.error, EnclosedMatrix(factor - near.basis), Precision::kDouble);
    prior.bias = linalg::sum(near.bias, rest.transpose());
  } else {
    prior.bias = linalg::product(work.error, EnclosedMatrix(factor)).transpose();
  }
  return prior;
}

/// Lower bound from K, if it is nearly the best estimator for the prior V = sigma^2 L L':
///
///   min over K of |C K F'|^2 + sigma^2 |C E L|^2 >= its value for this K - |R|^2,
///   R = C (K F' + sigma^2 E L (F L)'),
///
/// by duality of least squares: the residual R of the optimality condition is zero for the best K.
struct NearbyValue {
  double bound = -std::numeric_limits<double>::infinity();
  double loss = std::numeric_limits<double>::infinity();  ///< |R|^2, rounded up
};

inline NearbyValue nearby_value(const Workspace& work, const Prior& prior, double sigma) {
  const double share = round_down(sigma * sigma);  // V = share L L'
  const EnclosedMatrix& noise = work.gain_information_transposed;
  EnclosedMatrix residual = work.quick.multiply(prior.seen.transpose(), prior.bias);
  constexpr double kRoundings = 0x1p-51;  // of the sum, and the trailing part of the noise
  residual.radius = (1.0 + 0x1p-50) * (share * residual.radius + noise.radius +
                                       kRoundings * (share * residual.hi.cwiseAbs() + noise.hi.cwiseAbs()));
  residual.hi = share * residual.hi + noise.hi;
  const Enclosure bias = work.quick.trace(prior.bias);
  NearbyValue result;
  result.loss = work.quick.trace(residual).upper();
  result.bound = round_down(round_down(work.noise.lower() + round_down(share * std::max(bias.lower(), 0.0))) -
                            result.loss);
  return result;
}

/// Lower bound of the value for the prior L L' scaled into the bounds; -infinity where nothing is proved.
/// near: image of a basis next to L, empty where there is none; upper: what is proved on the other side,
/// below which a small share of the gap may be lost.
inline double lower_bound(const Workspace& work, const Eigen::MatrixXd& prior_factor, const Image& near,
                          double upper) {
  const Prior prior = make_prior(work, prior_factor, near);
  const double largest = largest_bound(work, prior.bounded);
  if (!std::isfinite(largest)) {
    return -std::numeric_limits<double>::infinity();
  }
  const double sigma = largest > 0.0 ? round_down(round_down(1.0 / round_up(std::sqrt(largest)))) : 1.0;
  const NearbyValue nearby = nearby_value(work, prior, sigma);
  const double negligible =
      std::max(kNegligible * nearby.bound, std::isfinite(upper) ? kShareOfGap * (upper - nearby.bound) : 0.0);
  if (nearby.loss <= negligible) {
    return nearby.bound;
  }
  const Eigen::MatrixXd map = posterior_map(prior.factor.hi, prior.seen.hi, sigma);
  if (!map.allFinite()) {
    return nearby.bound;
  }
  const EnclosedMatrix y(map);
  for (const bool careful : {false, true}) {
    const EnclosedCriterion& criterion = careful ? work.careful() : work.quick;
    const EnclosedMatrix image = criterion.image(y);
    const Enclosure gain = criterion.trace(y, image, criterion.image(prior.factor));
    const Enclosure spread = criterion.trace(y, image, image);
    const Enclosure measured = criterion.trace(criterion.multiply(prior.seen.transpose(), y));
    const double sigma_squared = round_up(sigma * sigma);
    const double first =
        gain.lower() > 0.0 ? round_down(2.0 * sigma * gain.lower()) : round_up(2.0 * sigma) * gain.lower();
    const double bound =
        round_down(round_down(first - spread.upper()) - round_up(sigma_squared * measured.upper()));
    const double uncertainty = 2.0 * sigma * gain.radius + spread.radius + sigma_squared * measured.radius;
    if (careful || uncertainty <= negligible) {
      return std::max(bound, nearby.bound);
    }
  }
  return nearby.bound;
}

inline void prove_lower(const Workspace& work, const CandidatePoint& point,
                        const UnboundedDirections& unbounded, const Image& near, Certificate& certificate) {
  double lower = 0.0;  // an error is never negative
  if (point.prior_factor.cols() > 0) {
    lower = std::max(lower, lower_bound(work, point.prior_factor, near, certificate.upper));
  }
  if (unbounded.directions.cols() > 0) {
    const Eigen::MatrixXd extended =
        extend_prior(point.prior_factor, work.stacked, work.problem.information_factor, unbounded.directions);
    lower = std::max(lower, lower_bound(work, extended, {}, certificate.upper));
  }
  certificate.lower = lower;
}

}  // namespace certificate_detail

TRAMMEL_INLINE Certificate verify(const GuaranteedProblem& problem, const CandidatePoint& point) {
  namespace detail = certificate_detail;
  detail::check_shapes(problem, point);
  Certificate certificate;
  if (!(point.gain.allFinite() && point.multipliers.allFinite() && point.prior_factor.allFinite())) {
    certificate.remark = "the point to be verified has entries that are not finite";
    return certificate;
  }
  const detail::Workspace work(problem, point.gain);
  const UnboundedDirections unbounded = find_unbounded_directions(work.stacked);
  detail::Image first;
  detail::prove_upper(work, point, unbounded, first, certificate);
  detail::prove_lower(work, point, unbounded, first, certificate);
  const std::string_view defect = arithmetic_defect();
  if (std::isfinite(certificate.upper) && std::isfinite(certificate.lower)) {
    certificate.claim = defect.empty() ? Claim::kVerified : Claim::kApproximate;
  }
  if (!defect.empty()) {
    certificate.remark = defect;
  } else if (certificate.claim == Claim::kVerified && certificate.lower > certificate.upper) {
    // Impossible unless the arithmetic is broken in a way the checks do not know: claim nothing.
    certificate.claim = Claim::kNone;
    certificate.remark = "the two proved bounds contradict each other";
  }
  return certificate;
}

TRAMMEL_INLINE Certificate verify(const GuaranteedProblem& problem, const minimax::Solution& solution) {
  if (solution.status == SolveStatus::kUnbounded) {
    Certificate certificate;
    certificate.remark = "the error is unbounded";
    certificate.upper = std::numeric_limits<double>::infinity();
    return certificate;
  }
  return verify(problem, CandidatePoint{.gain = solution.gain,
                                        .multipliers = solution.multipliers,
                                        .prior_factor = solution.prior_factor});
}

TRAMMEL_INLINE void apply(const Certificate& certificate, const minimax::SolverSettings& settings,
                          minimax::Solution& solution) {
  solution.claim = certificate.claim;
  if (certificate.claim == Claim::kNone) {
    if (solution.status == SolveStatus::kOptimal) {
      solution.status = SolveStatus::kNumericalTrouble;
    }
    return;
  }
  solution.upper = certificate.upper;
  solution.lower = certificate.lower;
  solution.multipliers = certificate.multipliers;
  const double allowed = certificate_detail::allowed_gap(settings);
  const double allowed_stalled = kStalledSlack * settings.relative_gap;
  const bool verified = certificate.claim == Claim::kVerified;
  if (solution.status == SolveStatus::kOptimal || solution.status == SolveStatus::kNumericalTrouble) {
    const bool narrow =
        certificate.relative_gap() <= (verified ? std::max(allowed, allowed_stalled) : allowed);
    solution.status = narrow ? SolveStatus::kOptimal : SolveStatus::kNumericalTrouble;
  }
}

TRAMMEL_INLINE Certificate certify(const GuaranteedProblem& problem, const minimax::SolverSettings& settings,
                                   minimax::Solution& solution) {
  Certificate certificate = verify(problem, solution);
  const bool wide = !(certificate.relative_gap() <= certificate_detail::allowed_gap(settings));
  if (wide && solution.status != SolveStatus::kUnbounded &&
      problem.parameters() <= certificate_detail::kMostToRound) {
    const CandidatePoint rounded{.gain = round_gain(problem, solution.prior_factor),
                                 .multipliers = solution.multipliers,
                                 .prior_factor = solution.prior_factor};
    if (rounded.gain.size() > 0) {
      const Certificate other = verify(problem, rounded);
      const bool no_less = other.claim == Claim::kVerified || other.claim == certificate.claim;
      if (no_less && !(other.relative_gap() >= certificate.relative_gap())) {
        certificate = other;
        solution.gain = rounded.gain;
      }
    }
  }
  apply(certificate, settings, solution);
  return certificate;
}

}  // namespace trammel::inline TRAMMEL_ABI::certify
