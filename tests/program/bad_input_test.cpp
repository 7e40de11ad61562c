// SPDX-License-Identifier: Apache-2.0
// Bad input of every kind ends with exit code 2 and one line that says where, what was found, what was
// expected.
#include <string>

#include <gtest/gtest.h>

#include "io/replaced.hpp"
#include "run_program.hpp"

namespace {

using namespace trammel;
using test::run_program;

void expect_refused(const test::ProgramRun& run, const std::string& words) {
  EXPECT_EQ(run.exit_code, 2) << run.errors;
  EXPECT_EQ(run.output, "");
  EXPECT_NE(run.errors.find(words), std::string::npos) << run.errors;
  EXPECT_EQ(run.errors.rfind("trammel: ", 0), 0U) << run.errors;
}

TEST(BadInput, ScenarioErrorsReachTheUser) {
  const test::TemporaryFolder folder;
  const std::vector<std::array<std::string, 3>> cases{
      {"position_m = 50", "position_m = -50", "s.toml:7: bounds.position_m: found -50"},
      {"position_m = 50", "position_m = nan", "s.toml:7: bounds.position_m: found nan"},
      {"[0, 10, 20, 30]", "[0, 20, 10, 30]", "s.toml:2: model.knots_s: found 10 after 20"},
      {"[[9]]", "[[9, 1]]", "station[1] covariance"},
      {"[[9]]", "[[0]]", "station[1] covariance"},
      {"[3, 11, 27]", "[3, 11, 37]", "s.toml:21: station[1].times_s: found time 37 s"},
      {"[[station]]", "[[stations]]", "stations: found an unknown key"},
      // The reference passes (1300, 2000, 510) at 10 s, where the second station measures.
      {"[5000, 0, 0]\ncovariance = [[9]]\ntimes_s = [3, 11, 27]",
       "[1300, 2000, 510]\ncovariance = [[9]]\ntimes_s = [10]", "ranger"},
  };
  for (const auto& [from, to, words] : cases) {
    (void)folder.write("s.toml", test::replaced(test::small_scenario(), from, to));
    expect_refused(run_program(folder, "design s.toml --json"), words);
  }
  (void)folder.write("s.toml", "");
  expect_refused(run_program(folder, "design s.toml"), "s.toml");
}

TEST(BadInput, Paths) {
  const test::TemporaryFolder folder;
  (void)folder.write("s.toml", test::small_scenario());
  (void)folder.write("file", "not a folder");
  expect_refused(run_program(folder, "estimate absent.toml"), "absent.toml: found No such file or directory");
  expect_refused(run_program(folder, "estimate ."), ".");
  expect_refused(run_program(folder, "estimate s.toml --out file"), "file: found");
  expect_refused(run_program(folder, "estimate s.toml --out file/below"), "file/below: found");
  expect_refused(run_program(folder, "estimate s.toml --truth absent.csv"), "absent.csv");
  (void)folder.write("truth.csv", test::kSmallTruth);
  expect_refused(run_program(folder, "simulate s.toml truth.csv --out absent/obs.csv"), "absent/obs.csv");
  (void)folder.write("empty.csv", "");
  expect_refused(run_program(folder, "simulate s.toml empty.csv"), "empty.csv: found an empty file");
  (void)folder.write("short.csv", "t_s,x_m,y_m,z_m\n0,1,2,3\n10,1,2,3\n");
  expect_refused(run_program(folder, "simulate s.toml short.csv"), "short.csv: found samples from 0 to 10 s");
}

TEST(BadInput, CommandLine) {
  const test::TemporaryFolder folder;
  for (const std::string arguments :
       {"", "guess", "estimate", "estimate s.toml --wrong", "simulate s.toml t.csv --seed x"}) {
    const auto run = run_program(folder, arguments);
    EXPECT_EQ(run.exit_code, 2) << arguments;
    EXPECT_NE(run.errors, "") << arguments;
  }
  EXPECT_EQ(run_program(folder, "--help").exit_code, 0);
  EXPECT_EQ(run_program(folder, "--version").output.rfind("trammel ", 0), 0U);
}

}  // namespace
