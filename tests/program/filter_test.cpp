// SPDX-License-Identifier: Apache-2.0
// The commands filter design and filter run, run as a user does.
#include <cmath>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "run_program.hpp"

namespace {

using trammel::io::Json;
using trammel::test::ProgramRun;
using trammel::test::run_program;
using trammel::test::TemporaryFolder;

/// Cells of the line of a table that begins with `time`.
std::vector<std::string> cells_at(const std::string& table, const std::string& time) {
  std::istringstream lines(table);
  std::string line;
  while (std::getline(lines, line)) {
    if (line.starts_with(time + ",")) {
      std::vector<std::string> cells;
      std::istringstream parts(line);
      for (std::string cell; std::getline(parts, cell, ',');) {
        cells.push_back(cell);
      }
      return cells;
    }
  }
  return {};
}

class FilterProgram : public testing::Test {
 protected:
  void write(const std::string& name, const std::string& text) {
    trammel::io::write_atomically(folder_.path() / name, text);
  }
  ProgramRun run(const std::string& arguments) { return run_program(folder_, arguments); }
  ProgramRun design(const std::string& spec, const std::string& options = " --json") {
    write("spec.toml", spec);
    return run("filter design spec.toml" + options);
  }
  std::string filtered(const std::string& spec, const std::string& data, int exit_code = 0) {
    write("spec.toml", spec);
    write("data.csv", data);
    const ProgramRun result = run("filter run spec.toml data.csv");
    EXPECT_EQ(result.exit_code, exit_code) << result.errors;
    return exit_code == 0 ? result.output : result.errors;
  }
  TemporaryFolder folder_;
};

TEST_F(FilterProgram, DesignPrintsTheContract) {
  const ProgramRun result = design("order = 2\nsampling_s = 0.25\ngains = [0.5, 0.3]\n");
  EXPECT_EQ(result.exit_code, 0) << result.errors;
  const Json json = result.json();
  for (const char* key : {"denominator", "numerators", "prediction_numerator", "poles", "stable", "astatism",
                          "noise_gain", "prediction_noise_gain", "error_coefficients",
                          "prediction_error_coefficients", "gains", "guaranteed_mse"}) {
    EXPECT_TRUE(json.contains(key)) << key;
  }
  EXPECT_NEAR(json["noise_gain"][1].get<double>(), 2.0 + 2.0 / 15.0, 1e-10);
  EXPECT_NEAR(json["error_coefficients"][1][2].get<double>(), 7.0 / 24.0, 1e-9);
  EXPECT_EQ(json["error_coefficients"][0].size(), 4U);
  EXPECT_EQ(json["prediction_error_coefficients"].size(), 4U);
  EXPECT_TRUE(json["guaranteed_mse"].is_null());
  EXPECT_NE(design("order = 2\nsampling_s = 0.25\ngains = [0.5, 0.3]\n", "").output.find("stable"),
            std::string::npos);
}

TEST_F(FilterProgram, UnstableDesignsHaveNoNumbers) {
  const ProgramRun result = design("order = 2\nsampling_s = 1\ngains = [0.5, 3.5]\n");
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_FALSE(result.json()["stable"].get<bool>());
  EXPECT_TRUE(result.json()["noise_gain"][0].is_null());
  EXPECT_TRUE(result.json()["error_coefficients"][0][2].is_null());
}

TEST_F(FilterProgram, GuaranteedRuleAndBatchEstimate) {
  const ProgramRun result = design(
      "order = 2\nsampling_s = 0.5\nbatch = {samples = 11}\n"
      "rule = {name = \"guaranteed\", derivative_bound = 8, measurement_std = 2}\n");
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  const Json json = result.json();
  EXPECT_NEAR(json["guaranteed_mse"].get<double>(), 4 * 0.832358, 4e-6);
  const Json batch = json["guarantee"][0]["batch"];
  EXPECT_NEAR(batch["lower_mse"].get<double>(), 4 * 0.825, 1e-6);
  EXPECT_GE(batch["ratio"].get<double>(), 1.0);
  // Without a window it is one that is long enough: 8 / 1 + 8 samples.
  const ProgramRun plain = design(
      "order = 2\nsampling_s = 0.5\n"
      "rule = {name = \"guaranteed\", derivative_bound = 8, measurement_std = 2}\n");
  ASSERT_EQ(plain.exit_code, 0) << plain.errors;
  const Json chosen = plain.json()["guarantee"][0]["batch"];
  EXPECT_EQ(chosen["samples"], 16);
  EXPECT_NEAR(chosen["lower_mse"].get<double>(), 4 * 0.825, 1e-6);
}

TEST_F(FilterProgram, BadDesignsAreRefused) {
  for (const std::string& spec :
       {std::string(), std::string("order = 2\nrows = 3\nsampling_s = 1\ngains = [1, 1, 1]\n"),
        std::string("order = 2\nsampling_s = 0\ngains = [0.5, 0.3]\n"),
        std::string("order = 1\nsampling_s = 1\na = [[0.5]]\nb = [[0.5]]\n"),
        std::string("order = 2\nsampling_s = 1\nrule = {name = \"unheard of\"}\n"),
        std::string("order = 2\nsampling_s = 1\nrule = {name = \"kalman\", measurement_std = 1, "
                    "process_noise = [[1, 2], [2, 1]]}\n")}) {
    const ProgramRun result = design(spec);
    EXPECT_EQ(result.exit_code, 2) << spec;
    EXPECT_EQ(result.output, "") << spec;
    EXPECT_NE(result.errors.find("spec.toml"), std::string::npos) << result.errors;
  }
}

TEST_F(FilterProgram, GeneralMethodTellsBothClosures) {
  // A = I - q Phi, S = diag(1 - alpha, 1 - beta): the alpha-beta filter by its scalar closure, poles
  // 1 - alpha and 1 - beta by the vector closure.
  const std::string a = "order = 2\nsampling_s = 0.5\nA = [[[1, -1], [0, -0.5]], [0, [1, -1]]]\n";
  write("spec.toml", a + "S = [[0.5, 0], [0, 0.7]]\nsamples = 6\n");
  const ProgramRun result = run("filter general spec.toml --json");
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  const Json json = result.json();
  const auto expect_list = [](const Json& list, const std::vector<double>& expected) {
    ASSERT_EQ(list.size(), expected.size()) << list.dump();
    for (std::size_t i = 0; i < expected.size(); ++i) {
      EXPECT_NEAR(list[i].get<double>(), expected[i], 1e-12) << list.dump();
    }
  };
  expect_list(json["scalar"]["denominator"], {1.0, -1.2, 0.5});
  expect_list(json["scalar"]["numerators"][0], {0.5, -0.2});
  expect_list(json["scalar"]["numerators"][1], {0.6, -0.6});
  EXPECT_TRUE(json["scalar"]["stable"].get<bool>());
  expect_list(json["vector"]["denominator"], {1.0, -1.2, 0.35});
  EXPECT_EQ(json["vector"]["impulse"][0].size(), 6U);
  EXPECT_EQ(json["C"].size(), 2U);

  for (const auto& [spec, words] : std::vector<std::pair<std::string, std::string>>{
           {a, "exactly one of them"},
           {a + "S = [[0.5]]\n", "spec.toml:4: S: found 1 rows"},
           {a + "B = [[1, 0], [0, 1]]\n", "spec.toml:4: B: found a relative residual"},
           {a + "S = [[0.5, 0], [0, nan]]\n", "spec.toml:4: S[1][1]: found nan"},
           {"order = 2\nsampling_s = 1\nA = [[1, 0], [0, 1]]\nS = [[0, 0], [0, 0]]\n", "spec.toml:3: A"},
           {"order = 1\nsampling_s = 1\nA = [[1, 0], [0, 1]]\nS = [[0, 0], [0, 0]]\n", "k <= v"}}) {
    write("spec.toml", spec);
    const ProgramRun refused = run("filter general spec.toml");
    EXPECT_EQ(refused.exit_code, 2) << spec;
    EXPECT_EQ(refused.output, "") << spec;
    EXPECT_NE(refused.errors.find(words), std::string::npos) << refused.errors;
  }
}

TEST_F(FilterProgram, RunStartsUpBridgesGapsAndRejectsOutliers) {
  std::string data = "t_s,x_m,y_m\n";
  for (int n = 0; n < 40; ++n) {
    if (n == 20 || n == 21) {
      continue;  // a gap in the times
    }
    const std::string x = n == 25 ? "" : std::to_string(100.0 + 2.0 * n);
    data += std::to_string(0.5 * n) + "," + x + "," + (n == 30 ? "500" : std::to_string(-3.0 * n)) + "\n";
  }
  const std::string out = filtered(
      "order = 2\nsampling_s = 0.5\nrule = {name = \"kalata\", tracking_index = 0.3}\n"
      "bound = {derivative_bound = 1, measurement_std = 1}\nrun = {gate = 4}\n",
      data);
  const std::vector<std::string> cells = cells_at(out, "12.5");
  ASSERT_EQ(cells.size(), 9U) << out;
  EXPECT_NEAR(std::stod(cells[1]), 150.0, 1e-9);
  EXPECT_NEAR(std::stod(cells[2]), 4.0, 1e-9);
  EXPECT_EQ(cells[3], "");
  EXPECT_EQ(cells[4], "missing");
  EXPECT_NEAR(std::stod(cells[6]), -6.0, 1e-9);
  EXPECT_NE(out.find(",rejected\n"), std::string::npos);
  EXPECT_EQ(out.find("restarted"), std::string::npos);
}

TEST_F(FilterProgram, RunNamesTheLineOfBadData) {
  const std::string spec = "order = 2\nsampling_s = 0.5\ngains = [0.5, 0.3]\n";
  EXPECT_NE(filtered(spec, "t_s,x\n0,1\n0.3,2\n", 2).find("data.csv:3"), std::string::npos);
  EXPECT_NE(filtered(spec, "t_s,x\n0,1\n0,2\n", 2).find("data.csv:3"), std::string::npos);
  EXPECT_NE(filtered(spec, "t_s,x\n0,nan\n", 2).find("data.csv:2"), std::string::npos);
  EXPECT_NE(filtered(spec, "t_s\n0\n", 2).find("column"), std::string::npos);
  EXPECT_NE(filtered(spec, "t_s,x,x\n0,1,2\n", 2).find("two columns 'x'"), std::string::npos);
  EXPECT_NE(filtered(spec, "t_s,x\n", 2).find("data.csv"), std::string::npos);
  EXPECT_NE(filtered("order = 2\nsampling_s = 0.5\ngains = [0.5, 3.5]\n", "t_s,x\n0,1\n", 2).find("unstable"),
            std::string::npos);
  // Irregular times are welcome with a fading memory.
  const std::string any = "order = 2\nsampling_s = 0.5\nrule = {name = \"fading_memory\", theta = 0.8}\n";
  const std::vector<std::string> cells = cells_at(filtered(any, "t_s,x\n0,1\n0.3,1.6\n1,3\n"), "1");
  ASSERT_EQ(cells.size(), 5U);
  EXPECT_NEAR(std::stod(cells[2]), 2.0, 1e-12);
}

}  // namespace
