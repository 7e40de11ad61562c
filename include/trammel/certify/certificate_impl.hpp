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
#include "trammel/certify/quick_proof.hpp"
#include "trammel/core/error.hpp"
#include "trammel/linalg/double_double.hpp"
#include "trammel/linalg/error_norms.hpp"
#include "trammel/minimax/prior_state.hpp"

namespace trammel::inline TRAMMEL_ABI::certify {

namespace certificate_detail {

using linalg::EnclosedMatrix;
using linalg::round_down;
using linalg::round_up;
using linalg::sum_rounded_up;

/// Every proof begins with multipliers inflated by this much, which nobody notices: it makes room for the
/// radii of plain arithmetic.
inline constexpr double kFirstInflation = 1e-12;
/// An inflation above this that also costs more than this share of the interval is worth a second try: with
/// other steps if that brings it below the first share of itself, with more digits or in a better conditioned
/// basis if that may bring it below the second.
inline constexpr double kGoodInflation = 1e-10;
inline constexpr double kAffordableShare = 0.2;
inline constexpr double kWorthOtherSteps = 0.9;
inline constexpr double kWorthMoreDigits = 0.5;
/// An interval narrower than this is not worth a second prior for the lower bound.
inline constexpr double kGoodGap = 1e-8;
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
  const Eigen::MatrixXd& gain;
  QuickProof quick;
  Eigen::MatrixXd stacked;           ///< all a_l below one another
  std::vector<Eigen::Index> offset;  ///< first row of a_l in it; one more than ellipsoids

  Workspace(const GuaranteedProblem& given, const Eigen::MatrixXd& given_gain)
      : problem(given), gain(given_gain), quick(given, given_gain) {
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
    minimax::per_row(per_ellipsoid, offset, result);
    return result;
  }

  /// In double-double arithmetic, prepared when first needed.
  struct Careful {
    EnclosedMatrix information_transposed;       ///< F'
    EnclosedMatrix gain_information_transposed;  ///< (K F')'
    EnclosedCriterion criterion;
  };
  [[nodiscard]] const Careful& careful() const {
    if (!careful_) {
      const EnclosedMatrix information(problem.information_factor.transpose());
      careful_.emplace(Careful{
          .information_transposed = information,
          .gain_information_transposed = linalg::product(EnclosedMatrix(gain), information).transpose(),
          .criterion = EnclosedCriterion(problem.criterion_factor)});
    }
    return *careful_;
  }

 private:
  mutable std::optional<Careful> careful_;
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

/// Multipliers lambda (1 + amount) + amount step.
struct Inflation {
  double amount = std::numeric_limits<double>::quiet_NaN();
  double step = 0.0;
};

/// Multipliers of all bounds and how they may grow.
struct Weights {
  Eigen::MatrixXd bounds;   ///< stacked factors with the envelope
  Eigen::VectorXd rows;     ///< multiplier of each of its rows
  double step = 0.0;        ///< upper bound over the number of ellipsoids: even growth
  double total = 0.0;       ///< sum of the multipliers of the ellipsoids
  double count = 1.0;       ///< their number, at least one
  double affordable = 0.0;  ///< cost of an inflation that is small beside the interval

  /// What an inflation adds to the upper bound.
  [[nodiscard]] double cost(const Inflation& inflation) const {
    return inflation.amount * (total + count * inflation.step);
  }
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
  const EnclosedMatrix directions(unbounded.directions);
  const EnclosedMatrix bias = linalg::product_minus(
      work.careful().gain_information_transposed.transpose(),
      linalg::product(EnclosedMatrix(work.problem.information_factor), directions), unbounded.directions);
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
    const MatrixInequality::Growth growth(inequality, step, growing);
    // As much as the best one costs.
    const auto equal_cost = [&] { return weights.cost(best) / weights.cost({.amount = 1.0, .step = step}); };
    if (std::isnan(best.amount) || growth.holds_at(kWorthOtherSteps * equal_cost())) {
      best = {.amount = growth.find_inflation(), .step = step};
    }
    if (best.amount <= kGoodInflation || weights.cost(best) <= weights.affordable) {
      return false;
    }
    may_improve =
        may_improve || std::isnan(best.amount) || growth.may_hold_at(kWorthMoreDigits * equal_cost());
  }
  return may_improve;
}

/// The inequality in double-double arithmetic: E W = (K F')(F W) - W since both factors may be far smaller
/// than K and J, W exact.
inline MatrixInequality careful_inequality(const Workspace& work, const Weights& weights,
                                           const Eigen::MatrixXd& basis) {
  const Workspace::Careful& careful = work.careful();
  const EnclosedMatrix transposed(basis.transpose());
  const EnclosedMatrix bounded = linalg::product(transposed, EnclosedMatrix(weights.bounds.transpose()));
  const EnclosedMatrix bias =
      linalg::product_minus(linalg::product(transposed, careful.information_transposed),
                            careful.gain_information_transposed, transposed.hi);
  const EnclosedMatrix form =
      linalg::difference(linalg::product(bounded, linalg::scale_rows(bounded.transpose(), weights.rows),
                                         linalg::ProductPart::kLower),
                         careful.criterion.gram(bias));
  // The trailing part, and what inflating by sums with it rounds.
  Eigen::MatrixXd radius =
      (1.0 + 0x1p-50) * (form.lo.cwiseAbs() + form.radius) + 0x1p-51 * form.hi.cwiseAbs();
  return {UncertainForm{.middle = form.hi, .radius = std::move(radius), .left = {}, .right = {}}, bounded.hi,
          2.0 * linalg::row_norms(bounded.radius), weights.rows};
}

/// Cheapest inflation for which the matrix inequality is proved, with the precision and in the basis that it
/// needs; NaN if in none. tried: what was not proved in the first basis, null if nothing was tried.
inline Inflation prove_inequality(const Workspace& work, const Weights& weights,
                                  const Eigen::MatrixXd& prior_factor, const Eigen::MatrixXd& unbounded,
                                  const MatrixInequality* tried) {
  Inflation best;
  const Eigen::Index growing = work.stacked.rows();
  for (int number = 0; number < kCongruenceBases; ++number) {
    const Eigen::MatrixXd basis = congruence_basis(number, prior_factor, weights.bounds, unbounded);
    if (basis.size() == 0) {
      continue;
    }
    for (const bool careful : {false, true}) {
      if (number == 0 && !careful && tried != nullptr) {
        if (!search_inflation(*tried, weights, growing, best)) {
          return best;
        }
        continue;
      }
      const MatrixInequality inequality =
          careful ? careful_inequality(work, weights, basis)
                  : work.quick.inequality(work.quick.image(basis, weights.bounds), weights.rows);
      if (inequality.holds()) {
        return {.amount = 0.0, .step = 0.0};
      }
      if (!search_inflation(inequality, weights, growing, best)) {
        return best;
      }
    }
  }
  return best;
}

/// A point before anything is repaired.
struct Start {
  double noise = 0.0;           ///< |C K F'|_F^2, rounded up
  Eigen::VectorXd multipliers;  ///< not negative, inflated by kFirstInflation
  double scale = 0.0;           ///< their sum with the noise: the upper bound, if they are feasible
  double count = 1.0;           ///< number of ellipsoids, at least one
  double step = 0.0;            ///< `scale` over it
  QuickProof::Image image;      ///< of L, empty where that has no columns
  std::optional<MatrixInequality> inequality;  ///< in a basis next to L, if that is square
  bool holds = false;                          ///< it is proved: nothing has to be repaired
  UnboundedDirections unbounded;               ///< none where it holds

  Start(const Workspace& work, const CandidatePoint& point)
      : noise(work.quick.noise().upper()), multipliers(point.multipliers.cwiseMax(0.0)) {
    const Eigen::Index p = work.stacked.cols();
    scale = noise + multipliers.sum();
    count = static_cast<double>(std::max<Eigen::Index>(multipliers.size(), 1));
    step = scale / count;
    if (point.prior_factor.cols() > 0) {
      image = work.quick.image(point.prior_factor, work.stacked);
    }
    if (std::isfinite(scale)) {
      multipliers = inflate(multipliers, {.amount = kFirstInflation, .step = step});
      if (point.prior_factor.cols() == p) {
        inequality.emplace(work.quick.inequality(image, work.per_row(multipliers)));
        holds = inequality->holds();
      }
    }
    unbounded = holds ? UnboundedDirections{.directions = Eigen::MatrixXd(p, 0), .coordinates = {}}
                      : find_unbounded_directions(work.stacked);
  }
};

/// lower: a lower bound already proved, for what is small beside the interval.
inline void prove_upper(const Workspace& work, const CandidatePoint& point, const Start& start, double lower,
                        Certificate& certificate) {
  if (!std::isfinite(start.scale)) {
    certificate.remark = "the gain or the multipliers are too large or not finite";
    return;
  }
  Inflation inflation{.amount = 0.0, .step = 0.0};
  Envelope envelope{.rows = Eigen::MatrixXd(0, work.stacked.cols()), .multiplier = 0.0};
  if (!start.holds) {
    UnboundedDirections scaled = start.unbounded;
    envelope = make_envelope(work, start.scale, scaled);
    Weights weights{.bounds = with_envelope(work, envelope),
                    .rows = Eigen::VectorXd(work.stacked.rows() + envelope.rows.rows()),
                    .step = start.step,
                    .total = start.multipliers.sum(),
                    .count = start.count,
                    .affordable = kAffordableShare * (start.scale - lower)};
    weights.rows << work.per_row(start.multipliers),
        Eigen::VectorXd::Constant(envelope.rows.rows(), envelope.multiplier);
    inflation =
        prove_inequality(work, weights, point.prior_factor, scaled.directions,
                         start.inequality && envelope.rows.rows() == 0 ? &*start.inequality : nullptr);
  }
  if (std::isnan(inflation.amount)) {
    certificate.remark = "no multipliers near those given satisfy the matrix inequality";
    return;
  }
  certificate.inflation = kFirstInflation + inflation.amount;
  certificate.multipliers = inflate(start.multipliers, inflation);
  certificate.envelope = envelope.rows;
  // The inflation grew it by the same factor.
  certificate.envelope_multiplier = round_up(envelope.multiplier * round_up(1.0 + inflation.amount));
  certificate.upper = round_up(round_up(start.noise + certificate.envelope_multiplier) +
                               sum_rounded_up(certificate.multipliers));
}

/// Lower bound of the value for the prior L L' scaled into the bounds; -infinity where nothing is proved.
/// image: of L.
inline double lower_bound(const Workspace& work, const Eigen::MatrixXd& factor,
                          const QuickProof::Image& image, double upper) {
  const double largest = QuickProof::largest_bound(factor, image, work.offset);
  if (!std::isfinite(largest)) {
    return -std::numeric_limits<double>::infinity();
  }
  return work.quick.lower_bound({.factor = factor, .share = largest > 0.0 ? round_down(1.0 / largest) : 1.0},
                                image, upper);
}

inline double prove_lower(const Workspace& work, const CandidatePoint& point, const Start& start) {
  const Eigen::MatrixXd& factor = point.prior_factor;
  double lower = 0.0;  // an error is never negative
  const bool unbounded = start.unbounded.directions.cols() > 0;
  if (unbounded) {
    const Eigen::MatrixXd extended =
        extend_prior(factor, work.stacked, work.problem.information_factor, start.unbounded.directions);
    lower =
        std::max(lower, lower_bound(work, extended, work.quick.image(extended, work.stacked), start.scale));
  }
  if (factor.cols() > 0 && !(unbounded && start.scale - lower < kGoodGap * start.scale)) {
    lower = std::max(lower, lower_bound(work, factor, start.image, start.scale));
  }
  return lower;
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
  const detail::Start start(work, point);
  certificate.lower = detail::prove_lower(work, point, start);
  detail::prove_upper(work, point, start, certificate.lower, certificate);
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
