// SPDX-License-Identifier: Apache-2.0
// trammel solve, run as a user runs it.
#include <sys/wait.h>

#include <cstdlib>
#include <filesystem>
#include <string>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "io/file.hpp"

namespace {

struct Outcome {
  int exit_code = -1;
  std::string output;
  std::string errors;
};

Outcome run_solve(const std::string& problem, const std::string& options) {
  const std::filesystem::path folder = std::filesystem::path(testing::TempDir()) /
                                       testing::UnitTest::GetInstance()->current_test_info()->name();
  std::filesystem::create_directories(folder);
  trammel::io::write_atomically(folder / "problem.json", problem);
  const std::string command = "\"" TRAMMEL_BINARY_DIR "/bin/trammel\" solve \"" +
                              (folder / "problem.json").string() + "\" " + options + " >\"" +
                              (folder / "out").string() + "\" 2>\"" + (folder / "err").string() + "\"";
  Outcome outcome;
  const int status = std::system(command.c_str());
  outcome.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  outcome.output = trammel::io::read_text(folder / "out");
  outcome.errors = trammel::io::read_text(folder / "err");
  std::filesystem::remove_all(folder);
  return outcome;
}

/// One parameter within [-1, 1], signal-to-noise ratio 3: guaranteed squared error 4/(1 + 3) = 1.
const std::string kOneParameter =
    R"({"title": "one", "information": [[3]], "criterion_factor": [[2]], "ellipsoids": [{"factor": [[1]]}]})";

TEST(SolveCommand, PrintsTheCertifiedInterval) {
  const Outcome outcome = run_solve(kOneParameter, "--json --estimator");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.errors;
  const auto json = nlohmann::json::parse(outcome.output);
  EXPECT_EQ(json["title"], "one");
  EXPECT_EQ(json["status"], "optimal");
  EXPECT_EQ(json["claim"], "verified");
  EXPECT_LE(json["lower"].get<double>(), 1.0 + 1e-15);
  EXPECT_GE(json["upper"].get<double>(), 1.0 - 1e-15);
  EXPECT_LE(json["relative_gap"].get<double>(), 2e-8);
  EXPECT_NEAR(json["estimator"][0][0].get<double>(), 0.25, 1e-4);
  EXPECT_EQ(json["lambda"].size(), 1U);
  EXPECT_GE(json["inflation"].get<double>(), 0.0);
  EXPECT_NEAR(json["attained_fraction"].get<double>(), 1.0, 1e-6);
  EXPECT_LE(json["any_estimator_lower_bound"].get<double>(), 1.0);
  EXPECT_EQ(json["inputs"][0]["name"], "problem.json");
}

TEST(SolveCommand, BoundsOnlyLeavesNearOptimalityOut) {
  const auto json = nlohmann::json::parse(run_solve(kOneParameter, "--json --bounds-only").output);
  EXPECT_EQ(json["status"], "optimal");
  EXPECT_TRUE(json["attained_fraction"].is_null());
  EXPECT_TRUE(json["any_estimator_lower_bound"].is_null());
  EXPECT_EQ(run_solve(kOneParameter, "--bounds-only --monte-carlo").exit_code, 2);
}

TEST(SolveCommand, SaysWhatTheClaimIsAbout) {
  const auto from_matrix = nlohmann::json::parse(run_solve(kOneParameter, "--json").output);
  EXPECT_NE(from_matrix["claim_covers"].get<std::string>().find("computed in floating point"),
            std::string::npos);
  const auto from_factors = nlohmann::json::parse(
      run_solve(
          R"({"information_factor": [[2]], "criterion_factor": [[2]], "ellipsoids": [{"factor": [[1]]}]})",
          "--json")
          .output);
  EXPECT_NE(from_factors["claim_covers"].get<std::string>().find("as given"), std::string::npos);
}

TEST(SolveCommand, TextIsForReading) {
  const Outcome outcome = run_solve(kOneParameter, "");
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_NE(outcome.output.find("claim                   verified"), std::string::npos) << outcome.output;
  EXPECT_NE(outcome.output.find("no estimator of any kind"), std::string::npos) << outcome.output;
}

TEST(SolveCommand, NamesUnboundedDirectionsAndEndsWithThree) {
  const Outcome outcome = run_solve(
      R"({"information_factor": [[1, 0]], "criterion_factor": [[1, 1]], "ellipsoids": [{"factor": [[1, 0]]}]})",
      "--json");
  EXPECT_EQ(outcome.exit_code, 3);
  const auto json = nlohmann::json::parse(outcome.output);
  EXPECT_EQ(json["status"], "unbounded");
  EXPECT_TRUE(json["upper"].is_null());
  EXPECT_TRUE(json["attained_fraction"].is_null());
  ASSERT_EQ(json["unbounded_directions"].size(), 1U);
  EXPECT_NEAR(json["unbounded_directions"][0][0].get<double>(), 0.0, 1e-12);
  EXPECT_NE(json["unbounded_directions"][0][1].get<double>(), 0.0);
}

TEST(SolveCommand, BadInputEndsWithTwoAndNamesTheKey) {
  const Outcome wrong =
      run_solve(R"({"information": [[-1]], "criterion": [[1]], "ellipsoids": []})", "--json");
  EXPECT_EQ(wrong.exit_code, 2);
  EXPECT_NE(wrong.errors.find("problem.json: information: found a matrix with a negative eigenvalue"),
            std::string::npos)
      << wrong.errors;
  EXPECT_EQ(wrong.output, "");
  EXPECT_EQ(run_solve("", "--json").exit_code, 2);
  EXPECT_EQ(run_solve(kOneParameter, "--relative-gap 2").exit_code, 2);
  EXPECT_EQ(run_solve(kOneParameter, "--no-such-option").exit_code, 2);
}

TEST(SolveCommand, TooFewIterationsEndWithFourAndAValidInterval) {
  const Outcome outcome = run_solve(
      R"({"information_factor": [[1, 2], [0, 1]], "criterion_factor": [[1, 1]],
          "ellipsoids": [{"factor": [[1, 0]]}, {"factor": [[1, 1]]}]})",
      "--json --max-iterations 1");
  EXPECT_EQ(outcome.exit_code, 4);
  const auto json = nlohmann::json::parse(outcome.output);
  EXPECT_NE(json["status"], "optimal");
  if (json["claim"] == "verified") {
    EXPECT_LE(json["lower"].get<double>(), json["upper"].get<double>());
  }
}

}  // namespace
