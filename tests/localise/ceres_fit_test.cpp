// SPDX-License-Identifier: Apache-2.0
// Ceres and the built-in minimiser end in the same minimum.
#include "trammel/localise/ceres_fit.hpp"

#include <functional>
#include <optional>
#include <string>

#include <gtest/gtest.h>

#include "localise/reference_cases.hpp"

namespace {

using namespace trammel;

struct Case {
  std::string name;
  std::function<Scenario()> scenario;
  std::optional<double> floor;
};

/// The turn by ranges with biased readings and a clock that is off.
Scenario biased_turn() {
  Scenario scenario = test::turn_by_ranges();
  scenario.stations[0].bias = {.components = Eigen::VectorXd{{20.0}}, .time_s = 0.0};
  scenario.stations[1].bias = {.components = {}, .time_s = 0.1};
  return scenario;
}

class CeresFit : public testing::TestWithParam<Case> {};

TEST_P(CeresFit, AgreesWithTheBuiltInMinimiser) {
  const localise::FitProblem fit(GetParam().scenario(), GetParam().floor);
  constexpr localise::FitSettings kTight{.max_systems = 5000, .relative_decrease = 1e-14};
  Eigen::VectorXd start = Eigen::VectorXd::Zero(fit.parameters());
  for (const double mu : {30.0, 4.5}) {
    const localise::Fit ours = localise::fit_levenberg_marquardt(fit, start, mu, kTight);
    const localise::Fit theirs = localise::fit_ceres(fit, start, mu, kTight);
    EXPECT_TRUE(ours.converged);
    EXPECT_TRUE(theirs.converged);
    EXPECT_TRUE(fit.inside(theirs.z));
    EXPECT_NEAR(theirs.cost, ours.cost, 1e-9 * std::abs(ours.cost)) << "barrier " << mu;
    EXPECT_NEAR(theirs.chi2, ours.chi2, 1e-5 * ours.chi2);
    EXPECT_LT(theirs.decrement, 1e-8);
    EXPECT_LT(fit.distance_m(ours.z, theirs.z), 0.01) << "barrier " << mu;
    start = ours.z;
  }
}

INSTANTIATE_TEST_SUITE_P(
    Localise, CeresFit,
    testing::Values(Case{"descent_above_ground", [] { return test::descent_scenario(1, 1); }, 0.0},
                    Case{"turn_by_radar", test::turn_by_radar, std::nullopt},
                    Case{"turn_by_ranges", test::turn_by_ranges, 0.0}, Case{"biased_turn", biased_turn, 0.0}),
    [](const auto& tested) { return tested.param.name; });

TEST(CeresFit, NeedsAStartInside) {
  const localise::FitProblem fit(test::turn_by_radar(), 1e4);
  EXPECT_THROW((void)localise::fit_ceres(fit, Eigen::VectorXd::Zero(fit.parameters()), 1.0), Error);
}

}  // namespace
