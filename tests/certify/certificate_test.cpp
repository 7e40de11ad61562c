// SPDX-License-Identifier: Apache-2.0
#include "trammel/certify/certificate.hpp"

#include <algorithm>
#include <cfenv>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "exact.hpp"
#include "trammel/core/error.hpp"
#include "trammel/core/random.hpp"
#include "trammel/linalg/lu.hpp"

namespace {

using trammel::Claim;
using trammel::GuaranteedProblem;
using trammel::RandomStream;
using trammel::certify::CandidatePoint;
using trammel::certify::Certificate;
using trammel::certify::verify;
using trammel::exact::Rational;
namespace exact = trammel::exact;

constexpr std::uint64_t kSeed = 97;

Eigen::MatrixXd random_matrix(Eigen::Index rows, Eigen::Index cols, RandomStream& random) {
  Eigen::MatrixXd result(rows, cols);
  for (double& entry : result.reshaped()) {
    entry = random.normal();
  }
  return result;
}

/// K that is best for the prior L L'.
Eigen::MatrixXd gain_for(const GuaranteedProblem& problem, const Eigen::MatrixXd& prior_factor) {
  const Eigen::MatrixXd seen = problem.information_factor * prior_factor;
  const Eigen::MatrixXd m = Eigen::MatrixXd::Identity(seen.cols(), seen.cols()) + seen.transpose() * seen;
  return prior_factor * trammel::linalg::Lu(m).solve(prior_factor.transpose());
}

/// Reverse water-filling: S = diag(weight), J = diag(information), one ellipsoid per block of coordinates,
/// |theta_block / radius| <= 1. Maximise sum w_i r_i v_i/(1 + j_i r_i v_i) over v >= 0, sum of v over a
/// block <= 1 (r_i = radius_i^2): v_i = (sqrt(w_i r_i / lambda) - 1)/(j_i r_i) where positive.
struct WaterFilling {
  std::vector<long double> v;
  std::vector<long double> lambda;
  long double value = 0.0L;
};

WaterFilling fill(const std::vector<double>& weight, const std::vector<double>& information,
                  const std::vector<double>& radius, const std::vector<std::vector<std::size_t>>& blocks) {
  WaterFilling result;
  result.v.assign(weight.size(), 0.0L);
  for (const std::vector<std::size_t>& block : blocks) {
    const auto levels = [&](long double lambda) {
      long double total = 0.0L;
      for (const std::size_t i : block) {
        const long double r = static_cast<long double>(radius[i]) * radius[i];
        result.v[i] = std::max(0.0L, (std::sqrt(weight[i] * r / lambda) - 1.0L) / (information[i] * r));
        total += result.v[i];
      }
      return total;
    };
    long double low = 0.0L;
    long double high = 0.0L;
    for (const std::size_t i : block) {
      high = std::max(high, static_cast<long double>(weight[i]) * radius[i] * radius[i]);
    }
    for (int step = 0; step < 200; ++step) {
      const long double middle = (low + high) / 2.0L;
      (levels(middle) > 1.0L ? low : high) = middle;
    }
    (void)levels(high);
    result.lambda.push_back(high);
    for (const std::size_t i : block) {
      const long double r = static_cast<long double>(radius[i]) * radius[i];
      result.value += weight[i] * r * result.v[i] / (1.0L + information[i] * r * result.v[i]);
    }
  }
  return result;
}

/// Diagonal instance in exactly representable numbers, optionally turned by the orthogonal (1/2) Hadamard
/// matrix of order four, which is exact in binary.
struct Instance {
  GuaranteedProblem problem;
  CandidatePoint point;
  WaterFilling truth;
};

Instance commuting_instance(const std::vector<std::vector<std::size_t>>& blocks, bool turned,
                            RandomStream& random) {
  std::size_t p = 0;
  for (const auto& block : blocks) {
    p += block.size();
  }
  std::vector<double> weight(p);
  std::vector<double> information(p);
  std::vector<double> radius(p);
  const auto n = static_cast<Eigen::Index>(p);
  Eigen::VectorXd c(n);
  Eigen::VectorXd f(n);
  Eigen::VectorXd inverse_radius(n);
  for (std::size_t i = 0; i < p; ++i) {
    const auto index = static_cast<Eigen::Index>(i);
    c(index) = std::round(64.0 * (0.1 + random.uniform())) / 64.0;
    f(index) = std::round(64.0 * (0.1 + 4.0 * random.uniform())) / 64.0;
    inverse_radius(index) = std::exp2(std::round(4.0 * random.normal()));
    weight[i] = c(index) * c(index);
    information[i] = f(index) * f(index);
    radius[i] = 1.0 / inverse_radius(index);
  }
  Eigen::MatrixXd turn = Eigen::MatrixXd::Identity(n, n);
  if (turned) {
    turn << 0.5, 0.5, 0.5, 0.5, 0.5, -0.5, 0.5, -0.5, 0.5, 0.5, -0.5, -0.5, 0.5, -0.5, -0.5, 0.5;
  }
  Instance instance;
  instance.truth = fill(weight, information, radius, blocks);
  instance.problem.information_factor = f.asDiagonal() * turn;
  instance.problem.criterion_factor = c.asDiagonal() * turn;
  for (const auto& block : blocks) {
    Eigen::MatrixXd factor = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(block.size()), n);
    for (std::size_t row = 0; row < block.size(); ++row) {
      const auto index = static_cast<Eigen::Index>(block[row]);
      factor.row(static_cast<Eigen::Index>(row)) = inverse_radius(index) * turn.row(index);
    }
    instance.problem.ellipsoids.push_back(factor);
  }
  Eigen::VectorXd root(n);
  for (std::size_t i = 0; i < p; ++i) {
    root(static_cast<Eigen::Index>(i)) = radius[i] * static_cast<double>(std::sqrt(instance.truth.v[i]));
  }
  instance.point.prior_factor = turn.transpose() * root.asDiagonal();
  instance.point.gain = gain_for(instance.problem, instance.point.prior_factor);
  instance.point.multipliers.resize(static_cast<Eigen::Index>(blocks.size()));
  for (std::size_t l = 0; l < blocks.size(); ++l) {
    instance.point.multipliers(static_cast<Eigen::Index>(l)) = static_cast<double>(instance.truth.lambda[l]);
  }
  return instance;
}

/// An inflation of up to 1e-11, shared by multipliers and criterion, is taken where it spares careful
/// arithmetic.
constexpr double kNegligible = 3e-11;

void expect_verified_around(const Certificate& certificate, long double value, double width) {
  EXPECT_EQ(certificate.claim, Claim::kVerified) << certificate.remark;
  // The reference is exact to long double; allow for its own rounding.
  EXPECT_LE(certificate.lower, value * (1.0L + 1e-18L));
  EXPECT_GE(certificate.upper, value * (1.0L - 1e-18L));
  EXPECT_LE(certificate.relative_gap(), width);
}

TEST(Certificate, OneEllipsoidIsWaterFilling) {
  SCOPED_TRACE("seed " + std::to_string(kSeed));
  RandomStream random(kSeed);
  for (int n = 0; n < 20; ++n) {
    const Instance instance = commuting_instance({{0, 1, 2, 3}}, n % 2 == 1, random);
    expect_verified_around(verify(instance.problem, instance.point), instance.truth.value, kNegligible);
  }
}

TEST(Certificate, ProductOfEllipsoidsIsWaterFillingInEach) {
  SCOPED_TRACE("seed " + std::to_string(kSeed));
  RandomStream random(kSeed + 1);
  for (int n = 0; n < 20; ++n) {
    const Instance instance = commuting_instance({{0, 2}, {1}, {3, 4, 5, 6, 7}}, false, random);
    expect_verified_around(verify(instance.problem, instance.point), instance.truth.value, kNegligible);
  }
}

TEST(Certificate, AWrongMultiplierIsRepairedAndSaysSo) {
  RandomStream random(kSeed);
  Instance instance = commuting_instance({{0, 1, 2, 3}}, true, random);
  instance.point.multipliers *= 0.999;
  const Certificate certificate = verify(instance.problem, instance.point);
  EXPECT_EQ(certificate.claim, Claim::kVerified);
  EXPECT_GT(certificate.inflation, 1e-8);
  EXPECT_LT(certificate.inflation, 1e-2);
  EXPECT_GE(certificate.upper, instance.truth.value);
}

TEST(Certificate, TooLargePriorIsScaledIntoTheBounds) {
  RandomStream random(kSeed);
  Instance instance = commuting_instance({{0, 1}, {2, 3}}, false, random);
  instance.point.prior_factor *= 3.0;
  const Certificate certificate = verify(instance.problem, instance.point);
  EXPECT_EQ(certificate.claim, Claim::kVerified);
  EXPECT_LE(certificate.lower, instance.truth.value);
  EXPECT_GE(certificate.lower, 0.99 * instance.truth.value);
}

/// Checks every statement of a certificate in rational arithmetic.
void expect_true_exactly(const GuaranteedProblem& problem, const CandidatePoint& point,
                         const Certificate& certificate) {
  const exact::Matrix f(problem.information_factor);
  const exact::Matrix information = exact::transpose(f) * f;
  const exact::Matrix criterion(problem.criterion_factor);
  const exact::Matrix form = exact::transpose(criterion) * criterion;
  const exact::Matrix gain(point.gain);
  const Eigen::Index p = problem.parameters();
  const exact::Matrix bias = gain * information - exact::Matrix(Eigen::MatrixXd::Identity(p, p));
  exact::Matrix bounds = Rational(-1) * (exact::transpose(bias) * form * bias);
  Rational upper = exact::trace(form * gain * information * exact::transpose(gain));
  const exact::Matrix prior_factor(point.prior_factor);
  const exact::Matrix prior = prior_factor * exact::transpose(prior_factor);
  Rational largest = 0;
  for (std::size_t l = 0; l < problem.ellipsoids.size(); ++l) {
    const exact::Matrix factor(problem.ellipsoids[l]);
    const exact::Matrix ellipsoid = exact::transpose(factor) * factor;
    const Rational multiplier(certificate.multipliers(static_cast<Eigen::Index>(l)));
    bounds = bounds + multiplier * ellipsoid;
    upper += multiplier;
    largest = std::max(largest, exact::trace(ellipsoid * prior));
  }
  if (certificate.envelope.rows() > 0) {
    const exact::Matrix factor(certificate.envelope);
    bounds = bounds + Rational(certificate.envelope_multiplier) * (exact::transpose(factor) * factor);
    upper += Rational(certificate.envelope_multiplier);
  }
  EXPECT_TRUE(exact::positive_definite(bounds));
  EXPECT_LE(upper, Rational(certificate.upper));
  if (certificate.envelope.rows() == 0) {
    // f(V) = tr C L (I + L'JL)^-1 L'C' for V = L L' / largest.
    const exact::Matrix seen = f * prior_factor;
    const exact::Matrix unit(Eigen::MatrixXd::Identity(prior_factor.cols, prior_factor.cols));
    const exact::Matrix m = largest * unit + exact::transpose(seen) * seen;
    const exact::Matrix image = criterion * prior_factor;
    const Rational value = exact::trace(image * exact::solve(m, exact::transpose(image)));
    EXPECT_LE(Rational(certificate.lower), value);
    EXPECT_GE(Rational(certificate.lower) * Rational(1.0 + 1e-10), value);
  }
}

TEST(Certificate, EveryStatementHoldsInRationalArithmetic) {
  SCOPED_TRACE("seed " + std::to_string(kSeed));
  RandomStream random(kSeed + 2);
  int verified = 0;
  for (int n = 0; n < 40; ++n) {
    const auto p = static_cast<Eigen::Index>(2 + random.uniform() * 5);
    GuaranteedProblem problem;
    problem.information_factor = random_matrix(static_cast<Eigen::Index>(random.uniform() * 8), p, random);
    problem.criterion_factor = random_matrix(static_cast<Eigen::Index>(1 + random.uniform() * 8), p, random);
    for (Eigen::Index l = 0; l < 3; ++l) {
      problem.ellipsoids.push_back(random_matrix(3, p, random));
    }
    Eigen::MatrixXd scale = Eigen::MatrixXd::Identity(p, p);
    if (n % 2 == 0) {  // parameters in very different units
      for (double& entry : scale.diagonal()) {
        entry = std::pow(10.0, 3.0 * random.normal());
      }
      problem.information_factor *= scale;
      problem.criterion_factor *= scale;
      for (Eigen::MatrixXd& factor : problem.ellipsoids) {
        factor *= scale;
      }
    }
    CandidatePoint point;
    const Eigen::Index k = n % 5 == 0 ? p - 1 : p;  // also a singular prior
    point.prior_factor = scale.diagonal().cwiseInverse().asDiagonal() * random_matrix(p, k, random);
    point.gain = gain_for(problem, point.prior_factor);
    point.multipliers = Eigen::VectorXd::Constant(3, random.uniform());
    const Certificate certificate = verify(problem, point);
    if (certificate.claim == Claim::kVerified) {
      ++verified;
      expect_true_exactly(problem, point, certificate);
    }
  }
  EXPECT_GE(verified, 36);
}

/// Positions bounded by measurements only, accelerations by an ellipsoid: second differences do not see
/// uniform motion.
GuaranteedProblem uniform_motion_unbounded(bool measured) {
  constexpr Eigen::Index kPoints = 6;
  GuaranteedProblem problem;
  problem.criterion_factor = Eigen::MatrixXd::Identity(kPoints, kPoints) / 3.0;
  problem.information_factor = Eigen::MatrixXd::Zero(kPoints, kPoints);
  if (measured) {
    problem.information_factor.diagonal() << 1.0, 0.7, 1.3, 0.9, 1.1, 0.3;
  } else {
    problem.information_factor(2, 2) = 1.0;
  }
  for (Eigen::Index i = 0; i + 2 < kPoints; ++i) {
    Eigen::MatrixXd factor = Eigen::MatrixXd::Zero(1, kPoints);
    factor.row(0).segment<3>(i) << 0.3, -0.6, 0.3;
    problem.ellipsoids.push_back(factor);
  }
  return problem;
}

TEST(Certificate, UnboundedDirectionsGetAnEnvelopeFarAway) {
  const GuaranteedProblem problem = uniform_motion_unbounded(true);
  CandidatePoint point;
  point.prior_factor = Eigen::MatrixXd::Identity(6, 6);
  point.prior_factor.col(0).setConstant(1e7);  // uniform motion
  point.prior_factor.col(1) << 0, 1e7, 2e7, 3e7, 4e7, 5e7;
  point.gain = gain_for(problem, point.prior_factor);
  // Least squares leave uniform motion unbiased.
  point.gain = trammel::linalg::Lu(problem.information_factor.transpose() * problem.information_factor)
                   .solve(Eigen::MatrixXd::Identity(6, 6));
  point.multipliers = Eigen::VectorXd::Constant(4, 1.0);
  const Certificate certificate = verify(problem, point);
  EXPECT_EQ(certificate.claim, Claim::kVerified) << certificate.remark;
  ASSERT_EQ(certificate.envelope.rows(), 2);
  EXPECT_LT(certificate.envelope.cwiseAbs().maxCoeff(), 1e-4);  // wider than 1e4 standard deviations
  expect_true_exactly(problem, point, certificate);
  EXPECT_GT(certificate.lower, 0.0);
}

TEST(Certificate, RoundingModeOtherThanNearestIsNoProof) {
  RandomStream random(kSeed);
  const Instance instance = commuting_instance({{0, 1, 2, 3}}, true, random);
  ASSERT_EQ(std::fesetround(FE_UPWARD), 0);
  const Certificate certificate = verify(instance.problem, instance.point);
  std::fesetround(FE_TONEAREST);
  EXPECT_NE(certificate.claim, Claim::kVerified);
  EXPECT_EQ(certificate.remark, "rounding is not to nearest");
}

TEST(Certificate, NothingIsClaimedForAnEstimatorThatIgnoresAnUnboundedDirection) {
  const GuaranteedProblem problem = uniform_motion_unbounded(false);
  CandidatePoint point;
  point.prior_factor = Eigen::MatrixXd::Identity(6, 6);
  point.gain = gain_for(problem, point.prior_factor);
  point.multipliers = Eigen::VectorXd::Constant(4, 1.0);
  const Certificate certificate = verify(problem, point);
  // Its envelope would have to be smaller than any motion of interest; the lower bound tells the truth.
  EXPECT_GT(certificate.lower, 1e6);
}

TEST(Certificate, EntriesThatAreNotFiniteProveNothingAndWrongShapesAreErrors) {
  RandomStream random(kSeed);
  Instance instance = commuting_instance({{0, 1, 2, 3}}, false, random);
  CandidatePoint point = instance.point;
  point.gain(1, 2) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(verify(instance.problem, point).claim, Claim::kNone);
  point = instance.point;
  point.multipliers.resize(2);
  try {
    (void)verify(instance.problem, point);
    FAIL();
  } catch (const trammel::Error& error) {
    EXPECT_STREQ(error.what(), "multipliers: found 2 numbers, expected 1 numbers");
  }
}

/// The bounds that apply() turns into a status.
trammel::SolveStatus status_after(trammel::SolveStatus before, double gap, Claim claim) {
  Certificate certificate;
  certificate.claim = claim;
  certificate.upper = 1.0;
  certificate.lower = 1.0 - gap;
  trammel::minimax::Solution solution;
  solution.status = before;
  trammel::certify::apply(certificate, {.relative_gap = 1e-8}, solution);
  return solution.status;
}

TEST(Apply, StatusFollowsTheProvedInterval) {
  using trammel::SolveStatus;
  for (const SolveStatus before : {SolveStatus::kOptimal, SolveStatus::kNumericalTrouble}) {
    EXPECT_EQ(status_after(before, 1e-9, Claim::kVerified), SolveStatus::kOptimal);
    EXPECT_EQ(status_after(before, 3.9e-8, Claim::kVerified), SolveStatus::kOptimal);
    EXPECT_EQ(status_after(before, 2e-6, Claim::kVerified), SolveStatus::kNumericalTrouble);
    EXPECT_EQ(status_after(before, 3.9e-8, Claim::kApproximate), SolveStatus::kNumericalTrouble);
    EXPECT_EQ(status_after(before, 0.0, Claim::kNone), SolveStatus::kNumericalTrouble);
  }
  EXPECT_EQ(status_after(SolveStatus::kIterationLimit, 1e-9, Claim::kVerified), SolveStatus::kIterationLimit);
}

}  // namespace
