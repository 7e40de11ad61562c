// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of certificate.hpp.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "trammel/certify/certificate.hpp"
#include "trammel/certify/congruence_basis.hpp"
#include "trammel/certify/enclosed_criterion.hpp"
#include "trammel/certify/environment.hpp"
#include "trammel/certify/verified_cholesky.hpp"
#include "trammel/core/error.hpp"
#include "trammel/linalg/double_double.hpp"
#include "trammel/linalg/qr.hpp"

namespace trammel::inline TRAMMEL_ABI::certify {

namespace certificate_detail {

using linalg::EnclosedMatrix;
using linalg::Enclosure;
using linalg::round_down;
using linalg::round_up;

/// Inflations tried are powers of two from this exponent ...
inline constexpr int kSmallestInflation = -50;
/// ... to this one; a point that needs more is no approximate solution of the problem.
inline constexpr int kLargestInflation = 24;
/// An inflation above this is worth a second try in a better conditioned basis.
inline constexpr double kGoodInflation = 1e-10;
/// Share of the upper bound spent on the envelope ...
inline constexpr double kEnvelopeShare = 1e-11;
/// ... and the envelope's size: what the unbounded directions may add to the bias, relative to the upper
/// bound (a square, hence about 1e-10 in the bias itself).
inline constexpr double kEnvelopeBias = 1e-21;
/// Errors smaller than this share of what a direction does to the criterion count as this large.
inline constexpr double kResolution = 1e-18;
/// An envelope is never wider than this many standard deviations of the measurement noise.
inline constexpr double kWidestEnvelope = 1e18;

/// An interval wider than asked for by this factor and this much is still as good as asked for.
inline constexpr double kGapSlack = 1.01;
inline constexpr double kCostOfProof = 3e-10;

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
  EnclosedCriterion criterion;
  Eigen::MatrixXd stacked;           ///< all a_l below one another
  std::vector<Eigen::Index> offset;  ///< first row of a_l in it; one more than ellipsoids

  explicit Workspace(const GuaranteedProblem& given)
      : problem(given), information_factor(given.information_factor), criterion(given.criterion_factor) {
    offset.push_back(0);
    for (const Eigen::MatrixXd& factor : given.ellipsoids) {
      offset.push_back(offset.back() + factor.rows());
    }
    stacked.resize(offset.back(), given.parameters());
    for (std::size_t l = 0; l < given.ellipsoids.size(); ++l) {
      stacked.middleRows(offset[l], given.ellipsoids[l].rows()) = given.ellipsoids[l];
    }
  }

  /// One number per row of `stacked` from one per ellipsoid.
  [[nodiscard]] Eigen::VectorXd per_row(const Eigen::VectorXd& per_ellipsoid) const {
    Eigen::VectorXd result(stacked.rows());
    for (Eigen::Index l = 0; l < per_ellipsoid.size(); ++l) {
      const auto index = static_cast<std::size_t>(l);
      result.segment(offset[index], offset[index + 1] - offset[index]).setConstant(per_ellipsoid(l));
    }
    return result;
  }
};

inline double sum_rounded_up(const Eigen::VectorXd& values) {
  double total = 0.0;
  for (const double value : values) {
    total = round_up(total + value);
  }
  return total;
}

/// The matrix inequality in one basis: base + t growth, t >= 0, is to be proved positive definite.
struct Inequality {
  Eigen::MatrixXd base;           ///< W'(H(lambda) - E'SE)W
  Eigen::MatrixXd base_radius;    ///< enclosure of the above
  Eigen::MatrixXd growth;         ///< W'(H(lambda) + step sum_l H_l)W
  Eigen::MatrixXd growth_radius;  ///< enclosure of the above

  [[nodiscard]] bool holds(double t) const {
    if (t == 0.0) {
      return positive_definite(base, base_radius);
    }
    const Eigen::MatrixXd total = base + t * growth;
    // One rounding of the product (none, t is a power of two) and one of the sum.
    const Eigen::MatrixXd radius =
        ((1.0 + 0x1p-50) * (base_radius + t * growth_radius) + 0x1p-52 * total.cwiseAbs());
    return positive_definite(total, radius);
  }
};

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

inline Inequality make_inequality(const Workspace& work, const EnclosedMatrix& gain_information,
                                  const Eigen::VectorXd& multipliers, double step, const Envelope& envelope,
                                  const Eigen::MatrixXd& basis) {
  const EnclosedMatrix w(basis);
  // E W = (K F')(F W) - W, T'T = (E W)' S (E W).
  const EnclosedMatrix bias =
      linalg::product_minus(gain_information, linalg::product(work.information_factor, w), basis);
  const EnclosedMatrix bias_form = work.criterion.gram(bias);

  const Eigen::Index k = envelope.rows.rows();
  const Eigen::MatrixXd bounds = with_envelope(work, envelope);
  Eigen::VectorXd weights(bounds.rows());
  weights << work.per_row(multipliers), Eigen::VectorXd::Constant(k, envelope.multiplier);
  const EnclosedMatrix bounded = linalg::product(EnclosedMatrix(bounds), w);
  const EnclosedMatrix bound_form =
      linalg::product(bounded.transpose(), linalg::scale_rows(bounded, weights), linalg::ProductPart::kLower);

  const EnclosedMatrix base = linalg::difference(bound_form, bias_form);
  Inequality result;
  result.base = base.hi;
  result.base_radius = (1.0 + 0x1p-50) * (base.lo.cwiseAbs() + base.radius);
  // The growth may be known to double precision only: it is multiplied by t. Its error is bounded by the
  // usual gamma_n |X|'|X|, here with a comfortable constant, plus what `bounded` leaves open.
  const Eigen::Index q = work.stacked.rows();
  const Eigen::MatrixXd points = bounded.hi.topRows(q);
  result.growth = Eigen::MatrixXd::Zero(basis.cols(), basis.cols());
  result.growth.noalias() += step * (points.transpose() * points);
  result.growth += bound_form.hi;
  const Eigen::MatrixXd sizes = points.cwiseAbs();
  const double gamma = 4.0 * (static_cast<double>(q) + 4.0) * 0x1p-53;
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(basis.cols(), basis.cols());
  sum.noalias() += sizes.transpose() * (gamma * sizes + 4.0 * bounded.radius.topRows(q));
  const Eigen::MatrixXd across = sum + sum.transpose();
  result.growth_radius =
      step * across + (bound_form.lo.cwiseAbs() + bound_form.radius) + 0x1p-51 * result.growth.cwiseAbs();
  return result;
}

/// Smallest power of two (or zero) for which the inequality is proved; NaN if there is none in range.
inline double find_inflation(const Inequality& inequality) {
  if (inequality.holds(0.0)) {
    return 0.0;
  }
  if (!inequality.holds(std::ldexp(1.0, kLargestInflation))) {
    return std::numeric_limits<double>::quiet_NaN();
  }
  int fails = kSmallestInflation - 1;
  int holds = kLargestInflation;
  while (holds - fails > 1) {
    const int middle = fails + (holds - fails) / 2;
    (inequality.holds(std::ldexp(1.0, middle)) ? holds : fails) = middle;
  }
  return std::ldexp(1.0, holds);
}

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

inline void prove_upper(const Workspace& work, const CandidatePoint& point, UnboundedDirections unbounded,
                        Certificate& certificate) {
  const auto s = static_cast<double>(std::max<Eigen::Index>(point.multipliers.size(), 1));
  const Eigen::VectorXd multipliers = point.multipliers.cwiseMax(0.0);
  const EnclosedMatrix gain_information =
      linalg::product(EnclosedMatrix(point.gain), work.information_factor.transpose());
  const double noise = work.criterion.trace(gain_information).upper();
  const double scale = noise + multipliers.sum();
  if (!std::isfinite(scale)) {
    certificate.remark = "the gain or the multipliers are too large or not finite";
    return;
  }
  const Envelope envelope = make_envelope(work, gain_information, scale, unbounded);
  const double step = scale / s;

  double inflation = std::numeric_limits<double>::quiet_NaN();
  for (const Eigen::MatrixXd& basis :
       congruence_bases(point.prior_factor, with_envelope(work, envelope), unbounded.directions)) {
    const double found =
        find_inflation(make_inequality(work, gain_information, multipliers, step, envelope, basis));
    if (!(inflation <= found)) {
      inflation = found;
    }
    if (inflation <= kGoodInflation) {
      break;
    }
  }
  if (std::isnan(inflation)) {
    certificate.remark = "no multipliers near those given satisfy the matrix inequality";
    return;
  }
  certificate.inflation = inflation;
  certificate.multipliers = multipliers;
  if (inflation > 0.0) {
    for (double& value : certificate.multipliers) {
      value = round_up(value + round_up(inflation * value + round_up(inflation * step)));
    }
  }
  certificate.envelope = envelope.rows;
  certificate.envelope_multiplier = envelope.multiplier;
  certificate.upper =
      round_up(round_up(noise + envelope.multiplier) + sum_rounded_up(certificate.multipliers));
}

/// (I + sigma^2 L'JL)^-1 sigma L', through the QR factorisation of [I; sigma F L] so that only the square
/// root of the condition of I + sigma^2 L'JL matters.
inline Eigen::MatrixXd posterior_map(const Eigen::MatrixXd& prior_factor,
                                     const Eigen::MatrixXd& information_prior, double sigma) {
  const Eigen::Index k = prior_factor.cols();
  Eigen::MatrixXd both(k + information_prior.rows(), k);
  both << Eigen::MatrixXd::Identity(k, k), sigma * information_prior;
  const linalg::Qr qr(both);
  const Eigen::MatrixXd r = qr.matrixQR().topRows(k);
  Eigen::MatrixXd map = sigma * prior_factor.transpose();
  r.triangularView<Eigen::Upper>().transpose().solveInPlace(map);
  r.triangularView<Eigen::Upper>().solveInPlace(map);
  return map;
}

/// Lower bound of the value for the prior L L' scaled into the bounds; -infinity where nothing is proved.
inline double lower_bound(const Workspace& work, const Eigen::MatrixXd& prior_factor) {
  const EnclosedMatrix factor(prior_factor);
  const EnclosedMatrix bounded = linalg::product(EnclosedMatrix(work.stacked), factor);
  double largest = 0.0;
  for (std::size_t l = 0; l + 1 < work.offset.size(); ++l) {
    const Eigen::Index rows = work.offset[l + 1] - work.offset[l];
    double total = 0.0;
    for (Eigen::Index j = 0; j < bounded.cols(); ++j) {
      for (Eigen::Index i = work.offset[l]; i < work.offset[l] + rows; ++i) {
        // |hi| + |lo| + radius, rounded up.
        const double size = round_up((1.0 + 0x1p-50) * std::abs(bounded.hi(i, j)) + bounded.radius(i, j));
        total = round_up(total + round_up(size * size));
      }
    }
    largest = std::max(largest, total);
    if (!std::isfinite(total)) {
      return -std::numeric_limits<double>::infinity();
    }
  }
  const double sigma = largest > 0.0 ? round_down(round_down(1.0 / round_up(std::sqrt(largest)))) : 1.0;
  const EnclosedMatrix information_prior = linalg::product(work.information_factor, factor);
  const Eigen::MatrixXd map = posterior_map(prior_factor, information_prior.hi, sigma);
  if (!map.allFinite()) {
    return -std::numeric_limits<double>::infinity();
  }
  const EnclosedMatrix y(map);
  const EnclosedMatrix y_transposed = y.transpose();
  const double gain = work.criterion.trace(y_transposed, factor).lower();
  const double spread = work.criterion.trace(y_transposed).upper();
  const double seen = work.criterion.trace(linalg::product(information_prior, y).transpose()).upper();
  const double sigma_squared = round_up(sigma * sigma);
  const double first = gain > 0.0 ? round_down(2.0 * sigma * gain) : round_up(2.0 * sigma) * gain;
  return round_down(round_down(first - spread) - round_up(sigma_squared * seen));
}

inline void prove_lower(const Workspace& work, const CandidatePoint& point,
                        const UnboundedDirections& unbounded, Certificate& certificate) {
  double lower = 0.0;  // an error is never negative
  if (point.prior_factor.cols() > 0) {
    lower = std::max(lower, lower_bound(work, point.prior_factor));
  }
  if (unbounded.directions.cols() > 0) {
    lower = std::max(lower,
                     lower_bound(work, extend_prior(point.prior_factor, work.stacked,
                                                    work.problem.information_factor, unbounded.directions)));
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
  detail::prove_upper(work, point, unbounded, certificate);
  detail::prove_lower(work, point, unbounded, certificate);
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
  // The proof itself costs some digits beyond what the solver could see.
  const double allowed =
      settings.relative_gap * certificate_detail::kGapSlack + certificate_detail::kCostOfProof;
  if (solution.status == SolveStatus::kOptimal && !(certificate.relative_gap() <= allowed)) {
    solution.status = SolveStatus::kNumericalTrouble;
  }
}

}  // namespace trammel::inline TRAMMEL_ABI::certify
