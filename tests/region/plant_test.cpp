// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "trammel/core/error.hpp"
#include "trammel/core/random.hpp"
#include "trammel/region/closed_loop.hpp"
#include "trammel/region/plant.hpp"
#include "trammel/region/residuals.hpp"

namespace {

using namespace trammel::region;
using trammel::Error;
using trammel::RandomStream;

Eigen::VectorXd vector(std::initializer_list<double> values) {
  Eigen::VectorXd result(static_cast<Eigen::Index>(values.size()));
  std::copy(values.begin(), values.end(), result.begin());
  return result;
}

PlantModel all_unknown(std::size_t na, std::size_t terms, int delay) {
  return {.a = std::vector<std::optional<double>>(na),
          .b = std::vector<std::optional<double>>(terms),
          .delay = delay};
}

TEST(RegionPlant, ImpulseParameters) {
  const struct {
    Plant plant;
    Eigen::VectorXd theta;
  } cases[] = {{{vector({-2.0, 1.0}), vector({1.0, 1.6}), 1}, vector({1.0, 3.6, 6.2, 8.8})},
               {{vector({0.5, -0.25, 0.125}), vector({1.5, -0.75, 0.3}), 2},
                vector({1.5, -1.5, 1.425, -1.275, 1.18125, -1.0875})},
               {{vector({}), vector({2.0, -1.0, 0.5}), 3}, vector({2.0, -1.0, 0.5})},
               {{vector({0.8}), vector({1.25}), 1}, vector({1.25, -1.0})}};
  for (const auto& [plant, theta] : cases) {
    EXPECT_LT((impulse_parameters(plant, static_cast<int>(theta.size())) - theta).cwiseAbs().maxCoeff(),
              1e-12);
    const PlantModel model = all_unknown(static_cast<std::size_t>(plant.a.size()),
                                         static_cast<std::size_t>(plant.b.size()), plant.delay);
    const PlantFromImpulse back = plant_from_impulse(model, theta);
    EXPECT_LT((back.parameters - unknown_of(model, plant)).cwiseAbs().maxCoeff(), 1e-12);
    EXPECT_GE(back.condition, 1.0);
  }
}

TEST(RegionPlant, InverseWithKnownCoefficients) {
  const PlantModel model{.a = {std::nullopt, 1.0}, .b = {std::nullopt, 1.6}, .delay = 1};
  EXPECT_LT((plant_from_impulse(model, vector({1.0, 3.6})).parameters - vector({-2.0, 1.0})).norm(), 1e-12);
  EXPECT_LT((plant_from_impulse(model, vector({0.8, 2.1})).parameters - vector({-0.625, 0.8})).norm(), 1e-12);
}

TEST(RegionPlant, InverseOfRandomPlantsWithRandomMasks) {
  RandomStream random(20240611);
  int checked = 0;
  for (int trial = 0; trial < 200; ++trial) {
    SCOPED_TRACE("seed 20240611, trial " + std::to_string(trial));
    const auto na = static_cast<Eigen::Index>(random.uniform() * 4.0);
    const auto terms = static_cast<Eigen::Index>(1.0 + random.uniform() * 3.0);
    Plant plant{Eigen::VectorXd(na), Eigen::VectorXd(terms), 1 + static_cast<int>(random.uniform() * 3.0)};
    PlantModel model;
    model.delay = plant.delay;
    for (Eigen::Index k = 0; k < na; ++k) {
      plant.a(k) = 2.0 * random.uniform() - 1.0;
      model.a.push_back(random.sign() > 0.0 ? std::optional<double>(plant.a(k)) : std::nullopt);
    }
    for (Eigen::Index k = 0; k < terms; ++k) {
      plant.b(k) = 2.0 * random.uniform() - 1.0;
      model.b.push_back(k > 0 && random.sign() > 0.0 ? std::optional<double>(plant.b(k)) : std::nullopt);
    }
    // With as many equations as the plant has coefficients every mask is determined.
    const PlantFromImpulse back =
        plant_from_impulse(model, impulse_parameters(plant, static_cast<int>(na + terms)));
    if (back.condition < 1e5) {
      EXPECT_LT((back.parameters - unknown_of(model, plant)).cwiseAbs().maxCoeff(), 1e-10);
      ++checked;
    }
  }
  EXPECT_GT(checked, 150);
}

TEST(RegionPlant, CommonFactorIsSingular) {
  // A = (1 + z/2)(1 - z/4), B = z (1 + z/2)
  const Plant plant{vector({0.25, -0.125}), vector({1.0, 0.5}), 1};
  const PlantFromImpulse back = plant_from_impulse(all_unknown(2, 2, 1), impulse_parameters(plant, 4));
  EXPECT_TRUE(std::isinf(back.condition));
  EXPECT_TRUE(back.parameters.hasNaN());
}

TEST(RegionPlant, WrongUseNamesTheArgument) {
  EXPECT_THROW(impulse_parameters({vector({}), vector({}), 1}, 2), Error);
  EXPECT_THROW(impulse_parameters({vector({}), vector({1.0}), 0}, 2), Error);
  EXPECT_THROW(impulse_parameters({vector({NAN}), vector({1.0}), 1}, 2), Error);
  EXPECT_THROW((void)plant_from_impulse({.a = {}, .b = {1.0}, .delay = 1}, vector({1.0})), Error);
  EXPECT_THROW((void)plant_from_impulse(all_unknown(1, 1, 1), vector({1.0})), Error);
  try {
    (void)complete(all_unknown(1, 1, 1), vector({1.0}));
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.detail().where, "complete: p");
  }
}

/// Residuals of the plant equation are the noise, those of the prediction the noise with its memory, for any
/// orders, delay, mask and feedback.
TEST(RegionPlant, ResidualsAtTheTruth) {
  RandomStream random(7);
  for (int trial = 0; trial < 60; ++trial) {
    SCOPED_TRACE("seed 7, trial " + std::to_string(trial));
    const auto na = static_cast<Eigen::Index>(random.uniform() * 4.0);
    const auto terms = static_cast<Eigen::Index>(1.0 + random.uniform() * 3.0);
    Plant plant{Eigen::VectorXd(na), Eigen::VectorXd(terms), 1 + static_cast<int>(random.uniform() * 3.0)};
    PlantModel model;
    model.delay = plant.delay;
    for (Eigen::Index k = 0; k < na; ++k) {
      plant.a(k) = (2.0 * random.uniform() - 1.0) / static_cast<double>(na);
      model.a.push_back(random.sign() > 0.0 ? std::optional<double>(plant.a(k)) : std::nullopt);
    }
    for (Eigen::Index k = 0; k < terms; ++k) {
      plant.b(k) = 2.0 * random.uniform() - 1.0;
      model.b.push_back(k > 0 && random.sign() > 0.0 ? std::optional<double>(plant.b(k)) : std::nullopt);
    }
    ProbedRecord record;
    record.period = static_cast<int>(na + terms);
    record.gain = 0.5 + random.uniform();
    record.probe.resize(20);
    std::vector<double> noise;
    for (double& probe : record.probe) {
      probe = random.normal();
    }
    simulate_loop(
        plant, [](const LoopView& view) { return -0.2 * view.y(0) + 0.1 * view.u(1) + 0.3; },
        [&](const LoopView&) { return noise.emplace_back(random.normal()); }, record);

    // Some of these loops grow: rounding errors are relative to the largest signal.
    const double size = 1.0 + record.y.cwiseAbs().maxCoeff() + record.u.cwiseAbs().maxCoeff();
    ProbedResiduals residuals;
    plant_residuals(model, record, 0, {}, residuals);
    const Eigen::VectorXd p = unknown_of(model, plant);
    const Eigen::VectorXd theta = impulse_parameters(plant, record.period);
    ProbedResiduals prediction;
    prediction_residuals(model, record, KnownTerms::kOnce, prediction);
    // c = coefficients of 1/A
    const Eigen::VectorXd c =
        impulse_parameters({plant.a, Eigen::VectorXd::Constant(1, 1.0), 1}, record.period);
    for (Eigen::Index n = 0; n < record.probe.size(); ++n) {
      for (int i = 1; i <= record.period; ++i) {
        const int t = record.period * static_cast<int>(n) + i - 1;
        const auto row = residuals.values.row(n).segment((i - 1) * residuals.width(), residuals.width());
        const double e = row(0) - row.tail(p.size()).dot(p);
        EXPECT_NEAR(e, record.probe(n) * noise[static_cast<std::size_t>(t)], 1e-13 * size);
        // v~ of the prediction: past outputs and inputs through 1/A, less what is known of them.
        double memory = 0.0;
        for (int m = 1; m <= i; ++m) {
          const int time = t - i + m;
          double past = noise[static_cast<std::size_t>(time)];
          for (int j = m; j <= static_cast<int>(na); ++j) {
            past -= plant.a(j - 1) * record.y_at(time - j);
          }
          for (int j = plant.delay + m; j < plant.delay + static_cast<int>(terms); ++j) {
            past += plant.b(j - plant.delay) * record.u_at(time - j);
          }
          memory += c(i - m) * past;
        }
        for (int j = i; j <= static_cast<int>(na); ++j) {
          const auto& known = model.a[static_cast<std::size_t>(j - 1)];
          memory += known ? *known * record.y_at(t - j) : 0.0;
        }
        for (int j = plant.delay + i; j < plant.delay + static_cast<int>(terms); ++j) {
          const auto& known = model.b[static_cast<std::size_t>(j - plant.delay)];
          memory -= known ? *known * record.u_at(t - j) : 0.0;
        }
        const auto line = prediction.values.row(n).segment((i - 1) * prediction.width(), prediction.width());
        EXPECT_NEAR(line(0) - line.tail(theta.size()).dot(theta), record.probe(n) * memory, 1e-13 * size);
      }
    }
  }
}

TEST(RegionPlant, PolePlacementGivesTheClosedLoop) {
  const Plant plant{vector({-2.0, 1.0}), vector({1.0, 1.6}), 1};
  PolePlacement placement;
  LinearFeedback feedback;
  ASSERT_TRUE(placement.place(plant, {}, feedback));
  EXPECT_LT((feedback.output - vector({-170.0 / 169.0, 105.0 / 169.0})).norm(), 1e-14);
  EXPECT_NEAR(feedback.input(0), -168.0 / 169.0, 1e-14);
  // A factor common to A and B cannot be moved.
  EXPECT_FALSE(placement.place({vector({0.25, -0.125}), vector({1.0, 0.5}), 1}, {}, feedback));
  // Delay 3 without dynamics: the characteristic polynomial is reached from a unit step in the noise.
  ASSERT_TRUE(placement.place({vector({-0.9}), vector({2.0}), 3}, repeated_pole(0.3, 1), feedback));
  ProbedRecord record;
  record.period = 1;
  record.probe.setZero(30);
  simulate_loop(
      Plant{vector({-0.9}), vector({2.0}), 3}, feedback,
      [](const LoopView& view) { return view.time == 0 ? 1.0 : 0.0; }, record);
  const Eigen::VectorXd y = record.y.tail(30);
  for (Eigen::Index t = 4; t < 20; ++t) {
    EXPECT_NEAR(y(t), 0.3 * y(t - 1), 1e-12);
  }
}

}  // namespace
