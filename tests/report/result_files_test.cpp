// SPDX-License-Identifier: Apache-2.0
#include "report/result_files.hpp"

#include <cmath>
#include <limits>
#include <string>

#include <gtest/gtest.h>

#include "io/csv.hpp"
#include "io/temporary_folder.hpp"
#include "sample_estimate.hpp"

namespace {

using namespace trammel;

TEST(ResultJson, HasTheRequiredFields) {
  const io::ScenarioInput scenario = test::sample_scenario();
  const estimate::TrajectoryEstimate estimate = test::sample_estimate();
  const io::Json json = report::result_json({scenario, estimate});
  EXPECT_EQ(json.at("status"), "optimal");
  EXPECT_EQ(json.at("method"), "interior_point");
  EXPECT_EQ(json.at("parameters"), 30);
  EXPECT_EQ(json.at("observations"), 120);
  EXPECT_EQ(json.at("iterations"), 21);
  EXPECT_EQ(json.at("guaranteed_rms_m"), 4.0);
  EXPECT_EQ(json.at("lower_bound_rms_m"), estimate.lower_bound_rms_m);
  EXPECT_NEAR(json.at("relative_gap").get<double>(), 1e-7 / 16.0, 1e-15);
  EXPECT_EQ(json.at("gauss_markov_rms_m"), 5.0);
  EXPECT_EQ(json.at("prior_rms_m"), 800.0);
  EXPECT_EQ(json.at("lambda_m2").size(), 10U);
  EXPECT_EQ(json.at("solve_time_s"), 0.25);
  EXPECT_EQ(json.at("library_version"), kVersion);
  EXPECT_EQ(json.at("inputs")[0].at("name"), "sample.toml");
  EXPECT_EQ(json.at("inputs")[0].at("sha256"), std::string(64, 'a'));
  EXPECT_EQ(json.at("chi2"), 250.0);
  EXPECT_EQ(json.at("estimate").at("theta").size(), 30U);
  EXPECT_EQ(json.at("estimate").at("position_m").size(), 9U);
  EXPECT_EQ(json.at("estimate").at("velocity_mps")[8].size(), 3U);
  EXPECT_EQ(json.at("linearisation").at("ratio"), 0.02);
  EXPECT_EQ(json.at("linearisation").at("converged"), false);
  EXPECT_FALSE(json.contains("truth"));
  EXPECT_EQ(json.at("claim"), "approximate");
  EXPECT_NE(json.at("claim_covers").get<std::string>().find("floating point"), std::string::npos);
  EXPECT_EQ(json.at("inflation"), 0x1p-40);
  EXPECT_EQ(json.at("attained_fraction"), 1.0);
  EXPECT_EQ(json.at("any_estimator_lower_bound_rms_m"), 3.5);
  EXPECT_EQ(json.at("any_estimator_bound_kind"), "van_trees_coherent_groups");
  EXPECT_EQ(json.at("worst_case").at("file"), report::kWorstCaseFile);
  EXPECT_EQ(json.at("worst_case").at("theta").size(), 30U);
  EXPECT_FALSE(json.contains("monte_carlo_confidence"));
}

TEST(ResultJson, TheSharperOfTheBoundsOverAllEstimatorsIsNamed) {
  const io::ScenarioInput scenario = test::sample_scenario();
  estimate::TrajectoryEstimate estimate = test::sample_estimate();
  estimate.near_optimality->confidence = 0.999;
  estimate.near_optimality->monte_carlo = certify::PalindromicBound{.bound = 14.0625};
  const io::Json sharper = report::result_json({scenario, estimate});
  EXPECT_EQ(sharper.at("any_estimator_lower_bound_rms_m"), 3.75);
  EXPECT_EQ(sharper.at("any_estimator_bound_kind"), "palindromic_monte_carlo");
  EXPECT_EQ(sharper.at("any_estimator_proved_rms_m"), 3.5);
  EXPECT_EQ(sharper.at("monte_carlo_confidence"), 0.999);
  estimate.near_optimality->monte_carlo->bound = 9.0;
  const io::Json weaker = report::result_json({scenario, estimate});
  EXPECT_EQ(weaker.at("any_estimator_lower_bound_rms_m"), 3.5);
  EXPECT_EQ(weaker.at("any_estimator_bound_kind"), "van_trees_coherent_groups");
  estimate.near_optimality.reset();
  EXPECT_TRUE(report::result_json({scenario, estimate}).at("attained_fraction").is_null());
}

TEST(Sentence, IsInTheSummaryAndInThePage) {
  const io::ScenarioInput scenario = test::sample_scenario();
  const estimate::TrajectoryEstimate estimate = test::sample_estimate();
  const std::string sentence =
      "Guaranteed rms error 4 m, attained by an admissible motion; no estimator of any kind, however "
      "computed, can guarantee less than 3.5 m (proved): at most 12.5 % can be gained.";
  EXPECT_NE(report::summary({scenario, estimate}).find(sentence), std::string::npos);
  EXPECT_NE(report::report_data({scenario, estimate}).at("meaning").get<std::string>().find(sentence),
            std::string::npos);
}

TEST(WorstCaseCsv, IsTheReferencePlusTheDeviation) {
  const test::TemporaryFolder folder;
  const estimate::TrajectoryEstimate estimate = test::sample_estimate();
  const io::PathSamples path = io::read_path(folder.write("worst_case.csv", report::worst_case_csv(estimate)),
                                             0.0, test::kSampleEnd_s);
  ASSERT_EQ(path.positions_m.size(), estimate.nominal.times_s.size());
  const Eigen::Vector3d expected =
      (estimate.nominal.position_m.row(40) + estimate.worst_case_motion.position_m.row(40)).transpose();
  EXPECT_EQ(path.positions_m[40], expected);
}

TEST(ResultJson, NothingComputedIsNullAndDesignHasNoEstimate) {
  const io::ScenarioInput scenario = test::sample_scenario();
  estimate::TrajectoryEstimate estimate = test::sample_estimate();
  estimate.observed.reset();
  estimate.gauss_markov_rms_m = std::numeric_limits<double>::infinity();
  estimate.prior_rms_m = std::numeric_limits<double>::quiet_NaN();
  estimate.solution.status = SolveStatus::kUnbounded;
  estimate.unbounded_directions = {"velocity y"};
  const io::Json json = report::result_json({scenario, estimate});
  EXPECT_TRUE(json.at("gauss_markov_rms_m").is_null());
  EXPECT_TRUE(json.at("prior_rms_m").is_null());
  EXPECT_EQ(json.at("status"), "unbounded");
  EXPECT_EQ(json.at("unbounded_directions")[0], "velocity y");
  EXPECT_FALSE(json.contains("estimate"));
  EXPECT_FALSE(json.contains("chi2"));
  const std::string text = report::summary({scenario, estimate});
  EXPECT_NE(text.find("velocity y"), std::string::npos);
  EXPECT_NE(text.find("bound the direction named"), std::string::npos);
}

TEST(TrajectoryCsv, ReadsBack) {
  const test::TemporaryFolder folder;
  const estimate::TrajectoryEstimate estimate = test::sample_estimate();
  const auto file = folder.write("trajectory.csv", report::trajectory_csv(estimate));
  const io::CsvTable table = io::read_csv(file);
  ASSERT_EQ(table.rows.size(), estimate.observed->path.times_s.size());
  EXPECT_EQ(table.number(40, table.column("x_m")), estimate.observed->path.position_m(40, 0));
  EXPECT_EQ(table.number(40, table.column("vz_mps")), estimate.observed->path.velocity_mps(40, 2));
  EXPECT_EQ(table.number(40, table.column("guaranteed_rms_m")), estimate.guaranteed_rms_at_m[40]);
  const io::PathSamples path = io::read_path(file, 0.0, test::kSampleEnd_s);
  EXPECT_EQ(path.times_s, estimate.observed->path.times_s);
}

TEST(StatementJson, HasEveryPartOfTheStatedValue) {
  const io::ScenarioInput scenario = test::sample_scenario();
  const estimate::TrajectoryEstimate estimate = test::sample_estimate();
  const localise::Statement statement = test::sample_statement();
  const io::Json json = report::result_json({scenario, estimate, nullptr, &statement});
  EXPECT_EQ(json.at("status"), "optimal");
  EXPECT_EQ(json.at("stated_rms_m"), 4.75);
  EXPECT_EQ(json.at("stated_rms_fixed_point_m"), 4.75);
  EXPECT_EQ(json.at("linear_guarantee_rms_m"), 4.0);
  EXPECT_EQ(json.at("curvature_rms_m"), 0.5);
  EXPECT_EQ(json.at("curvature_lower_rms_m"), 0.375);
  EXPECT_EQ(json.at("model_error_rms_m"), 0.25);
  EXPECT_EQ(json.at("kappa"), 0.125);
  EXPECT_EQ(json.at("consistency"), "self_consistent");
  EXPECT_EQ(json.at("independence"), "same_data");
  EXPECT_EQ(json.at("reference").at("starts"), 18);
  EXPECT_EQ(json.at("reference").at("chi2"), 200.0);
  EXPECT_TRUE(json.at("reference").at("minimum_height_m").is_null());
  EXPECT_EQ(json.at("tube").at("rms_m")[1], 2.0);
  EXPECT_NEAR(std::pow(json.at("tube").at("factor").get<double>(), 4), 3.0, 1e-15);
  EXPECT_TRUE(json.at("competing_solutions").empty());
  EXPECT_EQ(json.at("assumed").size(), 4U);
  EXPECT_NE(json.at("proved").get<std::string>().find("curvature term"), std::string::npos);
  const std::string text = report::summary({scenario, estimate, nullptr, &statement});
  EXPECT_NE(text.find("4.75 m (4 m linear + 0.5 m curvature + 0.25 m model error, settled), self-consistent"),
            std::string::npos)
      << text;
}

TEST(StatementJson, AmbiguousDataStateNoSingleValue) {
  const io::ScenarioInput scenario = test::sample_scenario();
  const estimate::TrajectoryEstimate estimate = test::sample_estimate();
  const localise::Statement statement = test::ambiguous_statement();
  const report::ReportInput input{scenario, estimate, nullptr, &statement};
  EXPECT_FALSE(report::outcome(input).solved);
  const io::Json json = report::result_json(input);
  EXPECT_EQ(json.at("status"), "ambiguous");
  EXPECT_TRUE(json.at("stated_rms_m").is_null());
  EXPECT_EQ(json.at("conditional_rms_m"), 4.75);
  EXPECT_EQ(json.at("competing_solutions")[0].at("cost_difference"), 3.5);
  EXPECT_EQ(json.at("competing_solutions")[0].at("stated_rms_m"), 8.0);
  EXPECT_EQ(json.at("competing_solutions")[0].at("file"), "competing_2.csv");
  const std::string text = report::summary(input);
  EXPECT_NE(text.find("none: the data are ambiguous"), std::string::npos) << text;
  EXPECT_NE(text.find("if solution 2 is true"), std::string::npos) << text;
  const test::TemporaryFolder folder;
  const io::PathSamples path = io::read_path(
      folder.write("c.csv", report::competing_csv(statement.competing[0])), 0.0, test::kSampleEnd_s);
  EXPECT_EQ(path.times_s, estimate.nominal.times_s);
}

TEST(Warnings, CurvatureAndResiduals) {
  const io::ScenarioInput scenario = test::sample_scenario();
  estimate::TrajectoryEstimate estimate = test::sample_estimate();
  localise::Statement statement = test::sample_statement();
  const auto warnings = [&] { return report::warnings({scenario, estimate, nullptr, &statement}); };
  EXPECT_TRUE(warnings().empty());
  statement.consistency = localise::Consistency::kCurvatureDominated;
  statement.kappa = 0.75;
  ASSERT_EQ(warnings().size(), 1U);
  EXPECT_NE(warnings()[0].find("0.75 of the linear guarantee"), std::string::npos);
  estimate.observed->chi2 = 1000.0;
  EXPECT_EQ(warnings().size(), 2U);
}

}  // namespace
