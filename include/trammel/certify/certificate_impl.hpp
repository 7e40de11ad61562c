// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of certificate.hpp.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "trammel/certify/certificate.hpp"
#include "trammel/certify/congruence_basis.hpp"
#include "trammel/certify/enclosed_criterion.hpp"
#include "trammel/certify/environment.hpp"
#include "trammel/certify/gain_rounding.hpp"
#include "trammel/certify/matrix_inequality.hpp"
#include "trammel/core/error.hpp"
#include "trammel/linalg/cholesky.hpp"
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

/// An inflation above this is worth a second try in a better conditioned basis.
inline constexpr double kGoodInflation = 1e-10;
/// Share of the upper bound spent on the envelope ...
inline constexpr double kEnvelopeShare = 1e-11;
/// ... and the envelope's size: what the unbounded directions may add to the bias, relative to the upper
/// bound (a square, hence about 1e-10 in the bias itself).
inline constexpr double kEnvelopeBias = 1e-21;
/// Radii of plain arithmetic below this share of a result do not matter.
inline constexpr double kNegligible = 1e-11;
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

/// What both bounds share.
struct Workspace {
  const GuaranteedProblem& problem;
  EnclosedMatrix information_factor;
  EnclosedCriterion quick;           ///< plain arithmetic: tried first, sufficient on well scaled problems
  Eigen::MatrixXd stacked;           ///< all a_l below one another
  std::vector<Eigen::Index> offset;  ///< first row of a_l in it; one more than ellipsoids

  explicit Workspace(const GuaranteedProblem& given)
      : problem(given),
        information_factor(given.information_factor),
        quick(given.criterion_factor, Precision::kDouble) {
    offset.push_back(0);
    for (const Eigen::MatrixXd& factor : given.ellipsoids) {
      offset.push_back(offset.back() + factor.rows());
    }
    stacked.resize(offset.back(), given.parameters());
    for (std::size_t l = 0; l < given.ellipsoids.size(); ++l) {
      stacked.middleRows(offset[l], given.ellipsoids[l].rows()) = given.ellipsoids[l];
    }
  }

  /// Double-double arithmetic, prepared when first needed.
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

/// A basis and what problem and bounds make of it, all products in double-double arithmetic (differences of
/// positions lose many digits in a_l W).
struct Image {
  Eigen::MatrixXd basis;   ///< W
  EnclosedMatrix seen;     ///< F W
  EnclosedMatrix bounded;  ///< stacked factors (and envelope) times W
};

inline Image make_image(const Workspace& work, const Eigen::MatrixXd& bounds, const Eigen::MatrixXd& basis) {
  return {basis, linalg::product(work.information_factor, EnclosedMatrix(basis)),
          linalg::product(EnclosedMatrix(bounds), EnclosedMatrix(basis))};
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
inline Envelope make_envelope(const Workspace& work, const EnclosedMatrix& gain_information, double scale,
                              UnboundedDirections& unbounded) {
  Envelope envelope;
  const Eigen::Index k = unbounded.directions.cols();
  if (k == 0) {
    envelope.rows.resize(0, work.stacked.cols());
    return envelope;
  }
  const EnclosedMatrix directions(unbounded.directions);
  const EnclosedMatrix bias = linalg::product_minus(
      gain_information, linalg::product(work.information_factor, directions), unbounded.directions);
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

/// |C K F'|_F^2, rounded up.
inline double noise_error(const Workspace& work, const EnclosedMatrix& gain_information) {
  const Enclosure quick = work.quick.trace(gain_information);
  return quick.radius <= kNegligible * quick.hi ? quick.upper()
                                                : work.careful().trace(gain_information).upper();
}

/// Multipliers lambda (1 + amount) + amount step.
struct Inflation {
  double amount = std::numeric_limits<double>::quiet_NaN();
  double step = 0.0;
};

/// Steps tried, as shares of the even one: even growth repairs bounds without a multiplier, growth in
/// proportion to the multipliers is cheaper where those that matter have one.
inline constexpr std::array<double, 2> kStepShares{1.0, 0.01};

/// Cheapest inflation for which the matrix inequality is proved in one of the bases; NaN if in none.
inline Inflation prove_inequality(const Workspace& work, const Weights& weights,
                                  const EnclosedMatrix& gain_information, const Image& prior,
                                  const Eigen::MatrixXd& unbounded) {
  Inflation best;
  double best_cost = std::numeric_limits<double>::infinity();
  for (int number = 0; number < kCongruenceBases && !(best.amount <= kGoodInflation); ++number) {
    const bool is_prior = number == 0 && unbounded.cols() == 0 && prior.basis.rows() == prior.basis.cols();
    Image other;
    if (!is_prior) {
      const Eigen::MatrixXd basis = congruence_basis(number, prior.basis, weights.bounds, unbounded);
      if (basis.size() == 0) {
        continue;
      }
      other = make_image(work, weights.bounds, basis);
    }
    const Image& image = is_prior ? prior : other;
    const EnclosedMatrix bias = linalg::product_minus(gain_information, image.seen, image.basis);
    const double small = MatrixInequality(image.bounded, weights.rows, bias, work.quick)
                             .find_small_inflation(weights.step, work.stacked.rows());
    if (small >= 0.0) {
      return {.amount = small, .step = weights.step};
    }
    const MatrixInequality inequality(image.bounded, weights.rows, bias, work.careful());
    for (const double share : kStepShares) {
      const double step = share * weights.step;
      const double amount = inequality.find_inflation(step, work.stacked.rows());
      const double cost = amount * (weights.total + weights.count * step);
      if (cost < best_cost) {
        best_cost = cost;
        best = {.amount = amount, .step = step};
      }
      if (amount <= kGoodInflation) {
        break;
      }
    }
  }
  return best;
}

inline void prove_upper(const Workspace& work, const CandidatePoint& point, const Image& prior,
                        UnboundedDirections unbounded, Certificate& certificate) {
  const auto s = static_cast<double>(std::max<Eigen::Index>(point.multipliers.size(), 1));
  const Eigen::VectorXd multipliers = point.multipliers.cwiseMax(0.0);
  const EnclosedMatrix gain_information =
      linalg::product(EnclosedMatrix(point.gain), work.information_factor.transpose());
  const double noise = noise_error(work, gain_information);
  const double scale = noise + multipliers.sum();
  if (!std::isfinite(scale)) {
    certificate.remark = "the gain or the multipliers are too large or not finite";
    return;
  }
  const Envelope envelope = make_envelope(work, gain_information, scale, unbounded);
  Weights weights{.bounds = with_envelope(work, envelope),
                  .rows = {},
                  .step = scale / s,
                  .total = multipliers.sum(),
                  .count = s};
  weights.rows.resize(weights.bounds.rows());
  weights.rows << work.per_row(multipliers),
      Eigen::VectorXd::Constant(envelope.rows.rows(), envelope.multiplier);
  const Inflation inflation = prove_inequality(work, weights, gain_information, prior, unbounded.directions);
  if (std::isnan(inflation.amount)) {
    certificate.remark = "no multipliers near those given satisfy the matrix inequality";
    return;
  }
  certificate.inflation = inflation.amount;
  certificate.multipliers = multipliers;
  if (inflation.amount > 0.0) {
    for (double& value : certificate.multipliers) {
      value = round_up(
          value + round_up(round_up(inflation.amount * value) + round_up(inflation.amount * inflation.step)));
    }
  }
  certificate.envelope = envelope.rows;
  // The inflation grew it by the same factor.
  certificate.envelope_multiplier = inflation.amount > 0.0
                                        ? round_up(envelope.multiplier * round_up(1.0 + inflation.amount))
                                        : envelope.multiplier;
  certificate.upper =
      round_up(round_up(noise + certificate.envelope_multiplier) + sum_rounded_up(certificate.multipliers));
}

/// (I + sigma^2 L'JL)^-1 sigma L', through the QR factorisation of [I; sigma F L] so that only the square
/// root of the condition of I + sigma^2 L'JL matters.
inline Eigen::MatrixXd posterior_map(const Eigen::MatrixXd& prior_factor,
                                     const Eigen::MatrixXd& information_prior, double sigma) {
  const Eigen::Index k = prior_factor.cols();
  Eigen::MatrixXd map = sigma * prior_factor.transpose();
  // The error enters squared: the plain normal equations do unless they are badly conditioned.
  Eigen::MatrixXd normal = Eigen::MatrixXd::Identity(k, k);
  normal.selfadjointView<Eigen::Lower>().rankUpdate(information_prior.transpose(), sigma * sigma);
  const linalg::Cholesky cholesky(normal);
  if (cholesky.info() == Eigen::Success && normal.diagonal().maxCoeff() < kWellConditioned) {
    cholesky.solveInPlace(map);
    return map;
  }
  Eigen::MatrixXd both(k + information_prior.rows(), k);
  both << Eigen::MatrixXd::Identity(k, k), sigma * information_prior;
  const linalg::Qr qr(both);
  const Eigen::MatrixXd r = qr.matrixQR().topRows(k);
  r.triangularView<Eigen::Upper>().transpose().solveInPlace(map);
  r.triangularView<Eigen::Upper>().solveInPlace(map);
  return map;
}

/// Largest |a_l L|_F^2, rounded up; infinite if that is not known.
inline double largest_bound(const Workspace& work, const EnclosedMatrix& bounded) {
  double largest = 0.0;
  for (std::size_t l = 0; l + 1 < work.offset.size(); ++l) {
    double total = 0.0;
    for (Eigen::Index j = 0; j < bounded.cols(); ++j) {
      for (Eigen::Index i = work.offset[l]; i < work.offset[l + 1]; ++i) {
        const double size = (1.0 + 0x1p-50) * std::abs(bounded.hi(i, j)) + bounded.radius(i, j);
        total += size * size;
      }
    }
    const auto terms = static_cast<double>((work.offset[l + 1] - work.offset[l]) * bounded.cols());
    total *= 1.0 + (terms + 8.0) * 0x1p-52;  // all roundings of the sum of non-negative terms
    largest = std::isfinite(total) ? std::max(largest, total) : std::numeric_limits<double>::infinity();
  }
  return largest;
}

/// Lower bound of the value for the prior L L' scaled into the bounds; -infinity where nothing is proved.
inline double lower_bound(const Workspace& work, const Image& prior) {
  const EnclosedMatrix factor(prior.basis);
  const double largest = largest_bound(work, prior.bounded);
  if (!std::isfinite(largest)) {
    return -std::numeric_limits<double>::infinity();
  }
  const double sigma = largest > 0.0 ? round_down(round_down(1.0 / round_up(std::sqrt(largest)))) : 1.0;
  const Eigen::MatrixXd map = posterior_map(prior.basis, prior.seen.hi, sigma);
  if (!map.allFinite()) {
    return -std::numeric_limits<double>::infinity();
  }
  const EnclosedMatrix y(map);
  const EnclosedMatrix y_transposed = y.transpose();
  for (const bool careful : {false, true}) {
    const EnclosedCriterion& criterion = careful ? work.careful() : work.quick;
    const EnclosedMatrix seen = criterion.multiply(prior.seen, y);
    const Enclosure gain = criterion.trace(y_transposed, factor);
    const Enclosure spread = criterion.trace(y_transposed);
    const Enclosure measured = criterion.trace(seen.transpose());
    const double sigma_squared = round_up(sigma * sigma);
    const double first =
        gain.lower() > 0.0 ? round_down(2.0 * sigma * gain.lower()) : round_up(2.0 * sigma) * gain.lower();
    const double bound =
        round_down(round_down(first - spread.upper()) - round_up(sigma_squared * measured.upper()));
    const double uncertainty = 2.0 * sigma * gain.radius + spread.radius + sigma_squared * measured.radius;
    if (careful || uncertainty <= kNegligible * bound) {
      return bound;
    }
  }
  return -std::numeric_limits<double>::infinity();
}

inline void prove_lower(const Workspace& work, const Image& prior, const UnboundedDirections& unbounded,
                        Certificate& certificate) {
  double lower = 0.0;  // an error is never negative
  if (prior.basis.cols() > 0) {
    lower = std::max(lower, lower_bound(work, prior));
  }
  if (unbounded.directions.cols() > 0) {
    const Eigen::MatrixXd extended =
        extend_prior(prior.basis, work.stacked, work.problem.information_factor, unbounded.directions);
    lower = std::max(lower, lower_bound(work, make_image(work, work.stacked, extended)));
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
  const detail::Workspace work(problem);
  const UnboundedDirections unbounded = find_unbounded_directions(work.stacked);
  const detail::Image prior = detail::make_image(work, work.stacked, point.prior_factor);
  detail::prove_upper(work, point, prior, unbounded, certificate);
  detail::prove_lower(work, prior, unbounded, certificate);
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
