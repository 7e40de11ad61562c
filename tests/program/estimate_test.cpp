// SPDX-License-Identifier: Apache-2.0
// The commands estimate, design and simulate through the program itself.
#include <chrono>
#include <cmath>
#include <numbers>
#include <string>
#include <thread>

#include <gtest/gtest.h>

#include <fcntl.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include "io/csv.hpp"
#include "io/replaced.hpp"
#include "run_program.hpp"
#include "trammel/localise/locate.hpp"

namespace {

using namespace trammel;
using test::replaced;
using test::run_program;

constexpr const char* kObserved = "[observations]\nfile = \"obs.csv\"\n";

TEST(Design, PrintsTheContractAndNothingElse) {
  const test::TemporaryFolder folder;
  (void)folder.write("s.toml", test::small_scenario());
  const auto run = run_program(folder, "design s.toml --json");
  EXPECT_EQ(run.exit_code, 0);
  EXPECT_EQ(run.errors, "");
  const io::Json json = run.json();
  EXPECT_EQ(json.at("status"), "optimal");
  EXPECT_EQ(json.at("parameters"), 15);
  EXPECT_EQ(json.at("observations"), 34);
  EXPECT_LE(json.at("relative_gap").get<double>(), 1e-8);
  const double upper = json.at("guaranteed_rms_m");
  EXPECT_GE(upper, json.at("lower_bound_rms_m").get<double>());
  EXPECT_LT(upper, json.at("gauss_markov_rms_m").get<double>());
  EXPECT_EQ(json.at("lambda_m2").size(), 5U);
  EXPECT_FALSE(json.contains("estimate"));
}

TEST(Design, ProfileNamesThePhases) {
  const test::TemporaryFolder folder;
  (void)folder.write("s.toml", test::small_scenario());
  const auto run = run_program(folder, "design s.toml --profile");
  EXPECT_EQ(run.exit_code, 0);
  for (const char* phase :
       {"reading the scenario", "solving", "proving the bounds", "near-optimality", "in all"}) {
    EXPECT_NE(run.errors.find(phase), std::string::npos) << phase << " in\n" << run.errors;
  }
  EXPECT_EQ(run.output.find("proving"), std::string::npos);
}

// A long scenario by windows: the same result, other ways to be wrong.
TEST(Estimate, ByWindows) {
  const test::TemporaryFolder folder;
  const std::string solver = "[solver]\nmethod = \"windows\"\nwindow_segments = 10\nwindow_overlap = 12\n";
  const std::string plan = replaced(
      replaced(replaced(test::small_scenario(), "[0, 10, 20, 30]", "{start = 0, stop = 240, step = 8}"),
               "stop = 30, step = 1", "stop = 240, step = 1"),
      "covariance = [[1e-5, 0, 0], [0, 1e-5, 0], [0, 0, 25]]",
      "covariance = [[1e-6, 0, 0], [0, 1e-6, 0], [0, 0, 25]]");
  (void)folder.write("plan.toml", plan);
  (void)folder.write("truth.csv", "t_s,x_m,y_m,z_m\n0,1000,2000,500\n240,8200,2000,740\n");
  ASSERT_EQ(run_program(folder, "simulate plan.toml truth.csv --seed 4 --out obs.csv").exit_code, 0);
  (void)folder.write("w.toml", plan + kObserved + solver + "relative_gap = 0.02\n");
  const auto run = run_program(folder, "estimate w.toml --truth truth.csv --json --out out");
  EXPECT_EQ(run.exit_code, 0) << run.output;
  const io::Json json = run.json();
  EXPECT_EQ(json.at("method"), "windows");
  EXPECT_EQ(json.at("claim"), "verified");
  EXPECT_EQ(json.at("lambda_m2").size(), 32U);
  EXPECT_LT(json.at("truth").at("actual_rms_error_m").get<double>(),
            2.0 * json.at("guaranteed_rms_m").get<double>());
  EXPECT_EQ(io::read_csv(folder.path() / "out/trajectory.csv").rows.size(), 211U);
  (void)folder.write("d.toml", plan + kObserved);
  const auto dense = run_program(folder, "estimate d.toml --bounds-only --json").json();
  EXPECT_LE(json.at("lower_bound_rms_m").get<double>(), 1.001 * dense.at("guaranteed_rms_m").get<double>());
  EXPECT_GE(1.001 * json.at("guaranteed_rms_m").get<double>(), dense.at("lower_bound_rms_m").get<double>());
  const auto refused = [&](const std::string& text, const std::string& expected) {
    (void)folder.write("bad.toml", plan + kObserved + text);
    const auto failed = run_program(folder, "estimate bad.toml");
    EXPECT_EQ(failed.exit_code, 2) << text;
    EXPECT_NE(failed.errors.find(expected), std::string::npos) << failed.errors;
  };
  refused("[solver]\nwindow_overlap = 3\n", "method = \"windows\" beside it");
  refused("[solver]\nmethod = \"windows\"\nwindow_overlap = 0\n", "a whole number from 1 to 1000");
  refused("[solver]\nmethod = \"windows\"\ncross_fit = true\n", "method \"structured\"");
  refused("[criterion]\nkind = \"final\"\n" + solver, "the integral over the whole flight");
}

// A station on the move, readings and clock off: from the files to the biases in the result.
TEST(Estimate, OfStationsThatMoveAndErr) {
  const test::TemporaryFolder folder;
  const std::string still = test::small_scenario();
  const std::string moving = replaced(
      still, "position_m = [0, 0, 0]",
      "track = [[0, 0, 0, 0], [15, 100, 50, 0], [30, 250, 80, 0]]\nbias = {range_m = 40, time_s = 0.2}");
  (void)folder.write("truth.csv", "t_s,x_m,y_m,z_m\n0,1000,2000,500\n30,1900,2000,530\n");
  (void)folder.write("plan.toml", moving);
  ASSERT_EQ(run_program(folder, "simulate plan.toml truth.csv --seed 4 --out obs.csv").exit_code, 0);
  (void)folder.write("s.toml", moving + kObserved);
  const auto run = run_program(folder, "estimate s.toml --bounds-only --json");
  EXPECT_EQ(run.exit_code, 0) << run.errors;
  const io::Json json = run.json();
  EXPECT_EQ(json.at("parameters"), 17);
  EXPECT_EQ(json.at("claim"), "verified");
  const io::Json& biases = json.at("estimate").at("biases");
  ASSERT_EQ(biases.size(), 2U);
  EXPECT_EQ(biases[0].at("component"), "range_m");
  EXPECT_EQ(biases[1].at("component"), "time_s");
  EXPECT_EQ(biases[1].at("semi_axis"), 0.2);
  EXPECT_LT(std::abs(biases[0].at("estimate").get<double>()), 40.0);
  EXPECT_EQ(json.at("lambda_stations_m2").size(), 2U);
  // Not knowing the biases costs accuracy; knowing that there are none gives it back.
  (void)folder.write("sound.toml", replaced(moving, "\nbias = {range_m = 40, time_s = 0.2}", ""));
  const auto sound = run_program(folder, "design sound.toml --bounds-only --json").json();
  EXPECT_LT(sound.at("guaranteed_rms_m").get<double>(), json.at("guaranteed_rms_m").get<double>());
  (void)folder.write("short.toml", replaced(moving, "[30, 250, 80, 0]", "[29, 250, 80, 0]"));
  const auto uncovered = run_program(folder, "design short.toml");
  EXPECT_EQ(uncovered.exit_code, 2);
  EXPECT_NE(uncovered.errors.find("expected a track that covers the times of the station's measurements"),
            std::string::npos)
      << uncovered.errors;
}

TEST(Estimate, RejectsOutliersWhenAsked) {
  const test::TemporaryFolder folder;
  (void)folder.write("truth.csv", "t_s,x_m,y_m,z_m\n0,1000,2000,500\n30,1900,2000,530\n");
  (void)folder.write("plan.toml", test::small_scenario());
  ASSERT_EQ(run_program(folder, "simulate plan.toml truth.csv --seed 4 --out obs.csv").exit_code, 0);
  const std::string sound = io::read_text(folder.path() / "obs.csv");
  (void)folder.write("obs.csv", sound + "12.5,radar,0.9,0.22,2600\n17,ranger,9000\n");
  (void)folder.write("kept.toml", test::small_scenario() + kObserved);
  (void)folder.write("s.toml", test::small_scenario() + kObserved + "reject_outliers = true\n");
  const io::Json kept = run_program(folder, "estimate kept.toml --bounds-only --json").json();
  EXPECT_FALSE(kept.contains("rejected"));
  const auto run = run_program(folder, "estimate s.toml --bounds-only --json");
  EXPECT_EQ(run.exit_code, 0) << run.errors;
  const io::Json json = run.json();
  EXPECT_EQ(json.at("observations").get<int>(), kept.at("observations").get<int>() - 2);
  EXPECT_LT(json.at("chi2").get<double>(), 0.01 * kept.at("chi2").get<double>());
  ASSERT_EQ(json.at("rejected").size(), 2U);
  const io::Json& ranger = json.at("rejected")[1];
  EXPECT_EQ(ranger.at("station"), "ranger");
  EXPECT_EQ(ranger.at("t_s"), 17.0);
  EXPECT_EQ(ranger.at("components"), io::Json::array({"range_m"}));
  EXPECT_GT(ranger.at("residual")[0].get<double>(), ranger.at("worst_case")[0].get<double>());
  EXPECT_NE(ranger.at("reason").get<std::string>().find("ranger at 17 s: range_m is"), std::string::npos);
  EXPECT_TRUE(json.at("outlier_test").at("settled").get<bool>());
  const auto words = run_program(folder, "estimate s.toml --bounds-only --out result");
  EXPECT_NE(words.output.find("2 measurements were rejected"), std::string::npos) << words.output;
  EXPECT_NE(io::read_text(folder.path() / "result/report.html").find("2 measurements were rejected"),
            std::string::npos);
}

// The keys that suggest prints, put into the scenario, are accepted and hold the data.
TEST(Suggest, PrintsKeysThatCanBeUsed) {
  const test::TemporaryFolder folder;
  (void)folder.write("truth.csv",
                     "t_s,x_m,y_m,z_m\n0,1000,2000,500\n10,1300,2005,510\n20,1600,2020,520\n"
                     "30,1900,2045,530\n");
  (void)folder.write("plan.toml", test::small_scenario());
  ASSERT_EQ(run_program(folder, "simulate plan.toml truth.csv --seed 4 --out obs.csv").exit_code, 0);
  (void)folder.write("s.toml", test::small_scenario() + kObserved);
  const auto run = run_program(folder, "suggest s.toml --lengths 5,10 --json");
  EXPECT_EQ(run.exit_code, 0) << run.errors;
  const io::Json json = run.json();
  EXPECT_EQ(json.at("trials").size(), 2U);
  EXPECT_TRUE(json.at("fits").get<bool>());
  const std::string keys = json.at("keys");
  std::string used = replaced(test::small_scenario(), "[model]\nknots_s = [0, 10, 20, 30]\n", "");
  used = replaced(used, "[bounds]\n", keys);
  used = replaced(used, "acceleration_mps2 = 2\n", "");
  (void)folder.write("used.toml", used + kObserved);
  const auto estimate = run_program(folder, "estimate used.toml --bounds-only --json");
  EXPECT_EQ(estimate.exit_code, 0) << estimate.errors << used;
  const auto words = run_program(folder, "suggest s.toml --lengths 5,10");
  EXPECT_NE(words.output.find("<- suggested"), std::string::npos);
  EXPECT_NE(words.output.find(keys), std::string::npos);
  const auto track = run_program(folder, "suggest truth.csv --lengths 10 --sigma-m 5 --json");
  EXPECT_EQ(track.exit_code, 0) << track.errors;
  EXPECT_EQ(run_program(folder, "suggest plan.toml").exit_code, 2);
}

TEST(Design, MatchesThePublishedExampleOfUniformMotion) {
  // Bounds on start and velocity only, one station at 40 times: guaranteed 215.703247 m, Gauss-Markov
  // 363.391937 m.
  const test::TemporaryFolder folder;
  std::string times;
  for (int k = 0; k < 40; ++k) {
    times += (k == 0 ? "" : ", ") + shortest(10.0 * k / 39);
  }
  (void)folder.write("s.toml",
                     "[model]\nknots_s = [0, 10]\n[nominal]\nposition_m = [-1000, 25000, 9500]\n"
                     "velocity_mps = [70, 90, 5]\n[bounds]\nposition_m = 250\nvelocity_mps = 25\n"
                     "acceleration_mps2 = 0\n[criterion]\nkind = \"times\"\ntimes_s = [" +
                         times +
                         "]\n[[station]]\nname = \"one\"\nkind = \"direction_cosines_range\"\n"
                         "position_m = [0, 0, 0]\ncovariance = [[302e-6, 44.4e-6, -20.84e-3], "
                         "[44.4e-6, 414e-6, 30.63e-3], [-20.84e-3, 30.63e-3, 403.17]]\ntimes_s = [" +
                         times + "]\n");
  const io::Json json = run_program(folder, "design s.toml --json").json();
  EXPECT_EQ(json.at("parameters"), 6);
  EXPECT_NEAR(json.at("guaranteed_rms_m").get<double>(), 215.70324665, 1e-7 * 215.7);
  EXPECT_NEAR(json.at("lower_bound_rms_m").get<double>(), 215.70324665, 1e-7 * 215.7);
  EXPECT_NEAR(json.at("gauss_markov_rms_m").get<double>(), 363.39193713820873, 1e-7 * 363.4);
}

TEST(Design, EveryMethodGivesTheSameAnswer) {
  const test::TemporaryFolder folder;
  (void)folder.write("a.toml", test::small_scenario());
  (void)folder.write("b.toml", test::small_scenario("[solver]\nmethod = \"sdp\"\n"));
  (void)folder.write("c.toml", test::small_scenario("[solver]\nmethod = \"conditional-gradient\"\n"));
  (void)folder.write("d.toml", test::small_scenario("[solver]\nmethod = \"conditional-gradient\"\n"
                                                    "variant = \"plain\"\nmax_iterations = 30\n"));
  (void)folder.write("e.toml", test::small_scenario("[solver]\nvariant = \"plain\"\n"));
  const io::Json structured = run_program(folder, "design a.toml --json").json();
  const double upper = structured.at("guaranteed_rms_m");
  for (const auto& [file, method] :
       {std::pair{"b.toml", "semidefinite"}, std::pair{"c.toml", "conditional_gradient"}}) {
    const auto run = run_program(folder, std::string("design --json ") + file);
    EXPECT_EQ(run.exit_code, 0) << file << run.errors;
    EXPECT_EQ(run.json().at("method"), method);
    EXPECT_NEAR(run.json().at("guaranteed_rms_m").get<double>(), upper, 1e-7 * upper);
    EXPECT_NEAR(run.json().at("lower_bound_rms_m").get<double>(), upper, 1e-7 * upper);
  }
  const auto plain = run_program(folder, "design d.toml --json");
  EXPECT_EQ(plain.exit_code, 4);
  EXPECT_EQ(plain.json().at("status"), "iteration_limit");
  EXPECT_GT(plain.json().at("relative_gap").get<double>(), 1e-8);
  EXPECT_LE(plain.json().at("lower_bound_rms_m").get<double>(), upper * (1 + 1e-9));
  const auto lonely = run_program(folder, "design e.toml");
  EXPECT_EQ(lonely.exit_code, 2);
  EXPECT_NE(lonely.errors.find("solver.variant"), std::string::npos) << lonely.errors;
}

TEST(Simulate, TheSameSeedGivesTheSameMeasurements) {
  const test::TemporaryFolder folder;
  (void)folder.write("s.toml", test::small_scenario(kObserved));  // obs.csv need not exist yet
  (void)folder.write("truth.csv", test::kSmallTruth);
  const auto first = run_program(folder, "simulate s.toml truth.csv --seed 7");
  EXPECT_EQ(first.exit_code, 0) << first.errors;
  EXPECT_EQ(first.output, run_program(folder, "simulate s.toml truth.csv --seed 7").output);
  EXPECT_NE(first.output, run_program(folder, "simulate s.toml truth.csv --seed 8").output);
  EXPECT_EQ(first.output.rfind("t_s,station,y1,y2,y3\n0,radar,", 0), 0U) << first.output.substr(0, 80);
}

TEST(Estimate, WritesResultTrajectoryAndReport) {
  const test::TemporaryFolder folder;
  (void)folder.write("s.toml", test::small_scenario(kObserved));
  (void)folder.write("truth.csv", test::kSmallTruth);
  ASSERT_EQ(run_program(folder, "simulate s.toml truth.csv --seed 3 --out obs.csv").exit_code, 0);
  const auto run = run_program(folder, "estimate s.toml --truth truth.csv --out result --json");
  ASSERT_EQ(run.exit_code, 0) << run.errors;
  EXPECT_EQ(run.errors, "");
  EXPECT_EQ(run.output, io::read_text(folder.path() / "result/result.json"));
  const io::Json json = run.json();
  EXPECT_EQ(json.at("estimate").at("theta").size(), 15U);
  EXPECT_GT(json.at("chi2").get<double>(), 30.0);
  EXPECT_LT(json.at("chi2").get<double>(), 200.0);
  EXPECT_GT(json.at("truth").at("actual_rms_error_m").get<double>(), 0.0);
  ASSERT_EQ(json.at("inputs").size(), 3U);
  EXPECT_EQ(json.at("inputs")[1].at("sha256"), io::sha256(io::read_text(folder.path() / "obs.csv")));
  const io::CsvTable table = io::read_csv(folder.path() / "result/trajectory.csv");
  EXPECT_EQ(table.number(0, table.column("t_s")), 0.0);
  EXPECT_EQ(table.number(table.rows.size() - 1, table.column("t_s")), 30.0);
  EXPECT_NE(io::read_text(folder.path() / "result/report.html").find("</html>"), std::string::npos);
  EXPECT_EQ(json.at("consistency"), "self_consistent");
  EXPECT_EQ(json.at("independence"), "same_data");
  EXPECT_EQ(json.at("guaranteed_rms_m"), json.at("linear_guarantee_rms_m"));
  EXPECT_GT(json.at("stated_rms_m").get<double>(), json.at("guaranteed_rms_m").get<double>());
  EXPECT_EQ(json.at("linearisation").at("iterations"), 1);
}

TEST(Estimate, AboutTheGivenReferenceItSolvesWhatDesignSolves) {
  const test::TemporaryFolder folder;
  (void)folder.write("s.toml",
                     test::small_scenario(std::string(kObserved) + "[solver]\nrelinearise = false\n"));
  (void)folder.write("truth.csv", test::kSmallTruth);
  ASSERT_EQ(run_program(folder, "simulate s.toml truth.csv --seed 3 --out obs.csv").exit_code, 0);
  const io::Json json = run_program(folder, "estimate s.toml --bounds-only --json").json();
  EXPECT_EQ(json.at("independence"), "fixed_reference");
  EXPECT_EQ(json.at("linearisation").at("iterations"), 0);
  const io::Json design = run_program(folder, "design s.toml --bounds-only --json").json();
  const double guaranteed = design.at("guaranteed_rms_m");
  EXPECT_NEAR(json.at("guaranteed_rms_m").get<double>(), guaranteed, 1e-8 * guaranteed);
}

/// A descent seen by one station that measures direction cosines and range: the path mirrored in the
/// antenna's plane explains the data too.
std::string descent_scenario(const std::string& bounds) {
  return "[model]\nknots_s = {start = 0, stop = 70, step = 10}\n[nominal]\nposition_m = [1000, 1000, 5000]\n"
         "velocity_mps = [212, 212, 0]\n[bounds]\nposition_m = 100\nvelocity_mps = 10\nacceleration_mps2 = "
         "37\n" +
         bounds +
         "[[station]]\nname = \"one\"\nkind = \"direction_cosines_range\"\nposition_m = [0, 0, 0]\n"
         "covariance = [[6.04e-5, 8.88e-6, -0.004168], [8.88e-6, 8.28e-5, 0.006126], [-0.004168, 0.006126, "
         "80.63]]\n"
         "times_s = {start = 0, stop = 70, step = 1}\n" +
         kObserved;
}

std::string descent_truth() {
  std::string text = "t_s,x_m,y_m,z_m\n";
  for (int t = 0; t <= 70; ++t) {
    const double share = t < 30 ? 0.0 : t > 50 ? 1.0 : (1 - std::cos(std::numbers::pi * (t - 30) / 20)) / 2;
    text += std::to_string(t) + "," + shortest(1000 + 212.0 * t) + "," + shortest(1000 + 212.0 * t) + "," +
            shortest(5000 - 3000 * share) + "\n";
  }
  return text;
}

TEST(Estimate, AmbiguousDataAreSaidToBeAndAFloorDecides) {
  const test::TemporaryFolder folder;
  (void)folder.write("open.toml", descent_scenario(""));
  (void)folder.write("floor.toml", descent_scenario("minimum_height_m = 0\n"));
  (void)folder.write("truth.csv", descent_truth());
  ASSERT_EQ(run_program(folder, "simulate open.toml truth.csv --seed 4 --out obs.csv").exit_code, 0);
  const auto open = run_program(folder, "estimate open.toml --bounds-only --json --out open");
  EXPECT_EQ(open.exit_code, 4) << open.errors;
  EXPECT_EQ(open.json().at("status"), "ambiguous");
  EXPECT_TRUE(open.json().at("stated_rms_m").is_null());
  const io::Json others = open.json().at("competing_solutions");
  ASSERT_GE(others.size(), 1U);
  const io::CsvTable other = io::read_csv(folder.path() / "open" / others[0].at("file").get<std::string>());
  const io::CsvTable best = io::read_csv(folder.path() / "open/trajectory.csv");
  const auto end = [](const io::CsvTable& path) {
    return path.number(path.rows.size() - 1, path.column("z_m"));
  };
  EXPECT_LT(end(other) * end(best), 0.0);  // one above the antenna's plane, one below
  ASSERT_GT(open.json().at("floor_test").size(), 0U);
  const io::Json test = open.json().at("floor_test")[0];
  EXPECT_EQ(test.at("height_m"), 0.0);
  EXPECT_LT(test.at("cost_difference").get<double>(), localise::kDecisiveFloorCost);
  EXPECT_GT(test.at("distance_m").get<double>(), 0.0);
  // The two sides part where the path is linearised about, if not at the minima.
  EXPECT_GT(test.at("reference_cost_difference").get<double>(), 0.0);
  EXPECT_LT(test.at("reference_cost_difference").get<double>(), localise::kDecisiveFloorCost);
  EXPECT_GT(test.at("reference_distance_m").get<double>(), 100.0);

  const auto floor = run_program(folder, "estimate floor.toml --bounds-only --json --truth truth.csv");
  EXPECT_EQ(floor.exit_code, 0) << floor.errors;
  EXPECT_EQ(floor.json().at("status"), "optimal");
  const double stated = floor.json().at("stated_rms_m");
  EXPECT_GT(stated, floor.json().at("guaranteed_rms_m").get<double>());
  EXPECT_LT(floor.json().at("truth").at("actual_rms_error_m").get<double>(), stated);
  EXPECT_EQ(floor.json().at("reference").at("minimum_height_m"), 0.0);

  (void)folder.write("high.toml", descent_scenario("minimum_height_m = 20000\n"));
  const auto high = run_program(folder, "estimate high.toml --bounds-only");
  EXPECT_EQ(high.exit_code, 2);
  EXPECT_NE(high.errors.find("minimum_height_m"), std::string::npos) << high.errors;
}

TEST(Estimate, CrossFitStatesItsIndependence) {
  const test::TemporaryFolder folder;
  (void)folder.write("s.toml", test::small_scenario(std::string(kObserved) + "[solver]\ncross_fit = true\n"));
  (void)folder.write("truth.csv", test::kSmallTruth);
  ASSERT_EQ(run_program(folder, "simulate s.toml truth.csv --seed 3 --out obs.csv").exit_code, 0);
  const auto run = run_program(folder, "estimate s.toml --truth truth.csv --out result --json");
  ASSERT_EQ(run.exit_code, 0) << run.errors;
  const io::Json json = run.json();
  EXPECT_EQ(json.at("independence"), "cross_fit");
  EXPECT_LT(json.at("truth").at("actual_rms_error_m").get<double>(),
            2 * json.at("stated_rms_m").get<double>());
  EXPECT_TRUE(json.at("attained_fraction").is_null());
  EXPECT_EQ(json.at("tube").at("rms_m").size(), json.at("observations").get<std::size_t>());
}

TEST(Estimate, SaysHowGoodItsGuaranteeIs) {
  const test::TemporaryFolder folder;
  (void)folder.write("s.toml", test::small_scenario());
  const auto run = run_program(folder, "design s.toml --out result --monte-carlo");
  ASSERT_EQ(run.exit_code, 0) << run.errors;
  EXPECT_NE(run.output.find("(verified)"), std::string::npos) << run.output;
  EXPECT_NE(run.output.find("attained by an admissible motion"), std::string::npos) << run.output;
  EXPECT_NE(run.output.find("worst_case.csv"), std::string::npos) << run.output;
  const io::Json json = io::Json::parse(io::read_text(folder.path() / "result/result.json"));
  EXPECT_EQ(json.at("claim"), "verified");
  EXPECT_GE(json.at("inflation").get<double>(), 0.0);
  EXPECT_NEAR(json.at("attained_fraction").get<double>(), 1.0, 1e-6);
  const double guaranteed = json.at("guaranteed_rms_m");
  const double proved = json.at("any_estimator_proved_rms_m");
  EXPECT_GT(proved, 0.5 * guaranteed);
  EXPECT_LE(proved, json.at("lower_bound_rms_m").get<double>());
  EXPECT_GE(json.at("any_estimator_lower_bound_rms_m").get<double>(), proved);
  EXPECT_LE(json.at("any_estimator_lower_bound_rms_m").get<double>(), guaranteed);
  EXPECT_NE(json.at("any_estimator_bound_kind"), "none");
  EXPECT_EQ(json.at("monte_carlo_confidence"), 0.999);
  // The motion in the file is the one in the result: reference plus theta.
  const auto worst = json.at("worst_case");
  const io::CsvTable table = io::read_csv(folder.path() / "result" / worst.at("file").get<std::string>());
  EXPECT_NEAR(table.number(0, table.column("x_m")), 1000.0 + worst.at("theta")[0].get<double>(), 1e-9);
  EXPECT_NEAR(table.number(0, table.column("vz_mps")), 1.0 + worst.at("theta")[5].get<double>(), 1e-9);
  EXPECT_LE(std::hypot(worst.at("theta")[0].get<double>(), worst.at("theta")[1].get<double>(),
                       worst.at("theta")[2].get<double>()),
            50.0 * (1.0 + 1e-9));
  const auto quick = run_program(folder, "design s.toml --json --bounds-only");
  EXPECT_EQ(quick.json().at("claim"), "verified");
  EXPECT_TRUE(quick.json().at("attained_fraction").is_null());
  EXPECT_FALSE(quick.json().contains("worst_case"));
  EXPECT_EQ(run_program(folder, "design s.toml --bounds-only --monte-carlo").exit_code, 2);
}

TEST(Estimate, SummaryIsForPeople) {
  const test::TemporaryFolder folder;
  (void)folder.write("s.toml", test::small_scenario());
  const auto run = run_program(folder, "estimate s.toml");
  EXPECT_EQ(run.exit_code, 0);
  EXPECT_NE(run.output.find("guaranteed rms error"), std::string::npos);
  EXPECT_NE(run.output.find("No measured values"), std::string::npos);
}

TEST(ExitCodes, UnboundedNamesTheDirectionAndIterationLimitIsSaid) {
  const test::TemporaryFolder folder;
  std::string unbounded =
      test::replaced(test::small_scenario(), "velocity_mps = 5", "velocity_mps = [5, 5, inf]");
  unbounded = unbounded.substr(0, unbounded.find("[[station]]"));  // bounds alone
  (void)folder.write("u.toml", unbounded);
  const auto run = run_program(folder, "design u.toml --json --out u");
  EXPECT_EQ(run.exit_code, 3) << run.errors;
  EXPECT_EQ(run.json().at("status"), "unbounded");
  EXPECT_TRUE(run.json().at("guaranteed_rms_m").is_null());
  EXPECT_NE(run.json().at("unbounded_directions").dump().find("velocity z"), std::string::npos);
  EXPECT_TRUE(std::filesystem::exists(folder.path() / "u/report.html"));

  (void)folder.write("l.toml", test::small_scenario("[solver]\nmax_iterations = 1\nrelative_gap = 1e-12\n"));
  const auto limited = run_program(folder, "design l.toml --json --out l");
  EXPECT_EQ(limited.exit_code, 4);
  EXPECT_EQ(limited.json().at("status"), "iteration_limit");
  EXPECT_TRUE(std::filesystem::exists(folder.path() / "l/result.json"));
}

TEST(Interrupt, LeavesNoHalfWrittenFile) {
  const test::TemporaryFolder folder;
  (void)folder.write("s.toml", test::replaced(test::small_scenario(), "[0, 10, 20, 30]",
                                              "{start = 0, stop = 3000, step = 10}"));
  std::filesystem::create_directory(folder.path() / "out");
  (void)folder.write("out/result.json", "old");
  const pid_t child = ::fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    ::close(STDOUT_FILENO);
    ::execl(TRAMMEL_PROGRAM, "trammel", "design", (folder.path() / "s.toml").c_str(), "--out",
            (folder.path() / "out").c_str(), static_cast<char*>(nullptr));
    ::_exit(127);
  }
  std::this_thread::sleep_for(std::chrono::milliseconds(700));
  ::kill(child, SIGINT);
  int status = 0;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 130);
  EXPECT_EQ(io::read_text(folder.path() / "out/result.json"), "old");
  for (const auto& entry : std::filesystem::directory_iterator(folder.path() / "out")) {
    EXPECT_EQ(entry.path().filename(), "result.json");
  }
}

}  // namespace
