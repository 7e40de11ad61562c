// SPDX-License-Identifier: Apache-2.0
// Whole arrays of the reference file, where it lies beside the source; the numbers that matter most are in
// the other tests too.
#include <filesystem>
#include <fstream>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "example_data.hpp"
#include "trammel/region/lscr.hpp"
#include "trammel/region/sps.hpp"
#include "trammel/region/wind_drift.hpp"

namespace {

using namespace trammel::region;
using nlohmann::json;

class ReferenceFile : public testing::Test {
 protected:
  void SetUp() override {
    const std::filesystem::path file =
        std::filesystem::path(TRAMMEL_SOURCE_DIR) / ".." / "shared/reference/randomised/reference.json";
    std::ifstream stream(file);
    if (!stream) {
      GTEST_SKIP() << "no reference file at " << file;
    }
    stream >> data_;
  }
  static void expect_near(double found, const json& expected, double size = 0.0) {
    EXPECT_NEAR(found, expected.get<double>(), 1e-12 * std::max({1.0, std::abs(found), size}));
  }
  json data_;
};

TEST_F(ReferenceFile, EverySumOfTheSmallExample) {
  const json& reference = data_["lscr_small"];
  const trammel::test::ExampleData data = trammel::test::small_example();
  const std::vector<char> ties(31, 0);
  for (Eigen::Index t = 0; t < 64; ++t) {
    expect_near(data.record.y(t + 1), reference["y_t0"][static_cast<std::size_t>(t)]);
  }
  for (Eigen::Index t = 0; t < 65; ++t) {
    expect_near(data.record.u(t), reference["u_tm1"][static_cast<std::size_t>(t)]);
  }
  ProbedResiduals residuals;
  LscrRegion region;
  for (const bool printed : {true, false}) {
    const json& form = reference[printed ? "paper_psi" : "corrected_psi"];
    prediction_residuals(trammel::test::example_model(), data.record,
                         printed ? KnownTerms::kPrinted : KnownTerms::kOnce, residuals);
    region.assign(residuals, data.strings, ties, 2, ResidualForm::kPrediction);
    for (int j = 0; j < 31; ++j) {
      const auto k = static_cast<std::size_t>(j);
      expect_near(region.constant(j, 0), form["P"][k]);
      expect_near(region.slope(j, 0, 0), form["Q"][k]);
      EXPECT_EQ(region.slope(j, 0, 1), 0.0);
      expect_near(region.constant(j, 1), form["P2"][k]);
      expect_near(region.slope(j, 1, 0), form["R2"][k]);
      expect_near(region.slope(j, 1, 1), form["Q"][k]);
    }
  }
  for (const bool demeaned : {false, true}) {
    const json& form = reference[demeaned ? "full_demean" : "full"];
    const ResidualFilter filter{.kind = demeaned ? ResidualFilter::Kind::kMean : ResidualFilter::Kind::kNone,
                                .period = 0,
                                .taps = {}};
    plant_residuals(trammel::test::example_model(), data.record, 0, filter, residuals);
    region.assign(residuals, data.strings, ties, 2, ResidualForm::kPlant);
    for (int channel = 0; channel < 2; ++channel) {
      const json& c_a_b = form["C_A_B"][static_cast<std::size_t>(channel)];
      for (int j = 0; j < 31; ++j) {
        const auto k = static_cast<std::size_t>(j);
        expect_near(region.constant(j, channel), c_a_b[0][k]);
        expect_near(-region.slope(j, channel, 0), c_a_b[1][k]);
        expect_near(region.slope(j, channel, 1), c_a_b[2][k]);
      }
    }
    SpsRegion sps;
    sps.assign(residuals, data.signs, std::vector<char>(19, 0), 2);
    const json& expected = form["sps"];
    Eigen::VectorXd constant;
    Eigen::MatrixXd matrix;
    for (int j = 0; j < 5; ++j) {
      sps.affine_sum(j, constant, matrix);
      const double size = constant.squaredNorm();
      const Eigen::VectorXd sum = constant - matrix * Eigen::Vector2d(-2.0, 1.0);
      if (j == 0) {
        expect_near(sum(0), expected["S0_true"][0], constant.norm());
        expect_near(sum(1), expected["S0_true"][1], constant.norm());
      }
      expect_near(sum.squaredNorm(), expected["norm2_true_first5"][static_cast<std::size_t>(j)], size);
    }
  }
}

TEST_F(ReferenceFile, EveryStoredStepOfTheFlights) {
  const auto correction_of = [](const std::string& name) {
    return static_cast<WindCorrection>(std::string("NRKL").find(name));
  };
  const auto draws_for = [](const WindFlight& flight, int noise) {
    trammel::SplitMix64 random(2013);
    WindDraws draws;
    draw_wind(random, flight, static_cast<WindNoise>(noise - 1), draws);
    return draws;
  };
  for (const char* kind : {"radian_wind", "degree_wind"}) {
    WindFlight flight;
    if (std::string(kind) == "radian_wind") {
      flight.wind_step_rad = 8.0;
    }
    for (const json& item : data_["uav"][kind]) {
      PrintedCorrection correction;
      correction.kind = correction_of(item["alg"]);
      const WindDraws draws = draws_for(flight, item["noise"]);
      std::vector<WindStep> path;
      const WindResult result = fly_as_printed(flight, correction, draws, &path);
      expect_near(result.mean_deviation_m, item["mean_deviation"]);
      expect_near(result.x_m, item["X_end"]);
      expect_near(result.y_m, item["Y_end"]);
      expect_near(result.estimate, item["theta_hat_end"]);
      for (std::size_t t = 0; t < item["first_steps"].size(); ++t) {
        const json& step = item["first_steps"][t];
        expect_near(draws.theta_rad(static_cast<Eigen::Index>(t)), step["theta"]);
        expect_near(draws.noise_m(static_cast<Eigen::Index>(t)), step["v"]);
        expect_near(path[t].course_rad, step["u"]);
        expect_near(path[t].residual, step["eps"]);
        expect_near(path[t].estimate, step["theta_hat"]);
        expect_near(path[t].x_m, step["X"]);
        expect_near(path[t].y_m, step["Y"]);
      }
    }
  }
  WindFlight flight;
  flight.max_steps = 260;
  for (const json& item : data_["uav_dwell"]["runs"]) {
    DwellCorrection correction;
    correction.kind = correction_of(item["alg"]);
    std::vector<WindStep> path;
    const WindResult result = fly_with_dwell(flight, correction, draws_for(flight, item["noise"]), &path);
    expect_near(result.mean_deviation_m, item["time_mean_deviation"]);
    expect_near(result.time_s, item["time"]);
    expect_near(result.estimate, item["d_hat_end"]);
    for (std::size_t t = 0; t < item["first_steps"].size(); ++t) {
      const json& step = item["first_steps"][t];
      expect_near(path[t].course_rad, step["u"]);
      expect_near(path[t].residual, step["z"]);
      expect_near(path[t].estimate, step["d_hat"]);
      expect_near(path[t].x_m, step["X"]);
    }
  }
}

}  // namespace
