// SPDX-License-Identifier: Apache-2.0
// The commands region and wind, run as a user does.
#include <cmath>
#include <string>

#include <gtest/gtest.h>

#include "run_program.hpp"

namespace {

using trammel::io::Json;
using trammel::test::ProgramRun;
using trammel::test::run_program;
using trammel::test::TemporaryFolder;

/// The published example; `method` and `rest` are lines of [method] and further tables.
std::string example(const std::string& method, const std::string& rest = "[truth]\na1 = -2.0\nb1 = 1.0\n") {
  return "[plant]\nna = 2\nnb = 2\ndelay = 1\nknown = { a2 = 1.0, b2 = 1.6 }\n[method]\n" + method + "\n" +
         rest;
}

class RegionProgram : public testing::Test {
 protected:
  void write(const std::string& name, const std::string& text) {
    trammel::io::write_atomically(folder_.path() / name, text);
  }
  ProgramRun run(const std::string& arguments) { return run_program(folder_, arguments); }
  /// Simulates data.csv with the specification and builds the region of it.
  Json region(const std::string& spec, int seed = 3) {
    write("spec.toml", spec);
    EXPECT_EQ(run("region simulate spec.toml --out data.csv --seed " + std::to_string(seed)).exit_code, 0);
    const ProgramRun result = run("region spec.toml data.csv --json");
    EXPECT_EQ(result.errors, "");
    EXPECT_EQ(result.exit_code, result.output.find("\"status\": \"unbounded\"") == std::string::npos ? 0 : 3);
    return result.json();
  }
  /// The message for a specification or a data file that is wrong.
  std::string rejected(const std::string& spec, const std::string& data) {
    write("spec.toml", spec);
    write("data.csv", data);
    const ProgramRun result = run("region spec.toml data.csv");
    EXPECT_EQ(result.exit_code, 2) << result.output;
    EXPECT_EQ(result.output, "");
    return result.errors;
  }
  TemporaryFolder folder_;
};

/// true inside, with every interval and vertex in order.
void expect_sound(const Json& result) {
  for (const auto& [name, interval] : result["box"].items()) {
    if (!interval[0].is_null() && !interval[1].is_null()) {
      EXPECT_LT(interval[0].get<double>(), interval[1].get<double>()) << name;
    }
  }
  EXPECT_TRUE(result["contains_truth"].is_boolean());
  EXPECT_FALSE(result["assumptions"].empty());
}

TEST_F(RegionProgram, EveryMethodOfTheExample) {
  const Json full = region(example("M = 480\nq = 6"));
  expect_sound(full);
  EXPECT_EQ(full["method"], "full_residual_lscr");
  EXPECT_DOUBLE_EQ(full["level"].get<double>(), 0.95);
  EXPECT_EQ(full["level_is"], "at_least");
  EXPECT_DOUBLE_EQ(full["channel_level"].get<double>(), 0.975);
  EXPECT_EQ(full["channel_level_is"], "exact");
  EXPECT_TRUE(full["exact"].get<bool>());
  EXPECT_EQ(full["polygon_is"], "exact");
  EXPECT_NEAR(full["estimate"]["a1"].get<double>(), -2.0, 0.3);
  EXPECT_NEAR(full["estimate"]["b1"].get<double>(), 1.0, 0.1);

  const Json paper = region(example("name = \"paper_lscr\"\nM = 480\nq = 6"));
  expect_sound(paper);
  EXPECT_FALSE(paper["exact"].get<bool>());
  EXPECT_EQ(paper["level_is"], "approximate");
  EXPECT_GT(paper["area"].get<double>(), 5.0 * full["area"].get<double>());
  EXPECT_TRUE(paper["theta"]["polygon"].is_array());

  const Json sps = region(example("name = \"sps\"\nM = 100\nlevel = 0.95"));
  expect_sound(sps);
  EXPECT_EQ(sps["q"], 5);
  EXPECT_EQ(sps["level_is"], "exact");
  EXPECT_TRUE(sps["channel_level"].is_null());
  EXPECT_EQ(sps["polygon_is"], "outer");

  const Json ellipsoid = region(example("name = \"ellipsoid\"\nM = 100\nlevel = 0.95"));
  expect_sound(ellipsoid);
  for (const char* name : {"a1", "b1"}) {
    EXPECT_LE(ellipsoid["box"][name][0].get<double>(), sps["sections"][name][0][0].get<double>());
    EXPECT_GE(ellipsoid["box"][name][1].get<double>(), sps["sections"][name][0][1].get<double>());
  }

  const Json anytime = region(example("name = \"self_normalised\"\nlevel = 0.95"));
  expect_sound(anytime);
  EXPECT_TRUE(anytime["contains_truth"].get<bool>());
  EXPECT_EQ(anytime["channel_level_is"], "at_least");
}

/// One, three and four unknown coefficients, delays and other masks.
TEST_F(RegionProgram, OtherOrders) {
  const Json one = region(
      "[plant]\nna = 1\nnb = 2\ndelay = 2\nknown = { a1 = -0.5 }\n[method]\nM = 100\nq = 5\n"
      "[truth]\nb2 = 2.0\n[simulation]\nfeedback = \"none\"\nprobes = 200\n");
  expect_sound(one);
  EXPECT_EQ(one["box_is"], "exact");
  EXPECT_EQ(one["level_is"], "exact");
  const Json three = region(
      "[plant]\nna = 2\nnb = 2\nknown = { b2 = 0.4 }\n[method]\nname = \"sps\"\nM = 40\nq = 4\n"
      "[truth]\na1 = -0.5\na2 = 0.2\nb1 = 1.0\n[simulation]\nfeedback = \"placed\"\n"
      "probes = 400\n[probe]\ngain = 3.0\n");
  expect_sound(three);
  EXPECT_EQ(three["parameters"].size(), 3U);
  EXPECT_TRUE(three["polygon"].is_null());
  const Json four = region(
      "[plant]\nna = 2\nnb = 2\n[method]\nname = \"ellipsoid\"\nM = 40\nq = 4\n[truth]\n"
      "a1 = -0.5\na2 = 0.2\nb1 = 1.0\nb2 = 0.4\n[simulation]\nfeedback = \"none\"\n"
      "probes = 500\n[probe]\ngain = 3.0\n");
  expect_sound(four);
  EXPECT_EQ(four["parameters"].size(), 4U);
}

TEST_F(RegionProgram, SameSeedSameResultOtherSeedOtherRegion) {
  const Json first = region(example("M = 100\nq = 2\nseed = 8"));
  const Json again = region(example("M = 100\nq = 2\nseed = 8"));
  EXPECT_EQ(first, again);
  const Json other = region(example("M = 100\nq = 2\nseed = 9"));
  EXPECT_NE(first["area"], other["area"]);
  EXPECT_EQ(first["estimate"], other["estimate"]);
}

TEST_F(RegionProgram, BlocksAndRenamedColumns) {
  write("spec.toml", example("M = 60\nq = 2"));
  ASSERT_EQ(run("region simulate spec.toml --out data.csv").exit_code, 0);
  std::string text = trammel::io::read_text(folder_.path() / "data.csv");
  text.replace(0, text.find('\n'), "time,input,output,Delta");
  write("data.csv", text);
  write("spec.toml", example("M = 60\nq = 2",
                             "[columns]\nt = \"time\"\nu = \"input\"\ny = \"output\"\n"
                             "probe = \"Delta\"\n[probe]\nfirst = 100\ncount = 200\n"));
  const ProgramRun result = run("region spec.toml data.csv --json --picture page.html --out result.json");
  EXPECT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_EQ(result.json()["probes"], 200);
  EXPECT_TRUE(result.json()["contains_truth"].is_null());
  EXPECT_NE(trammel::io::read_text(folder_.path() / "page.html").find("<polygon"), std::string::npos);
  EXPECT_EQ(trammel::io::read_text(folder_.path() / "result.json"), result.output);
}

TEST_F(RegionProgram, BadSpecifications) {
  const std::string data = "t,u,y,probe\n-1,1,,1\n0,0,1,\n1,0,1,-1\n2,0,1,\n";
  EXPECT_NE(rejected("", data).find("plant"), std::string::npos);
  EXPECT_NE(rejected(example("nane = \"sps\""), data).find("method.nane"), std::string::npos);
  EXPECT_NE(rejected(example("name = \"lscr\""), data).find("full_residual_lscr"), std::string::npos);
  EXPECT_NE(rejected(example("q = 0"), data).find("method.q"), std::string::npos);
  EXPECT_NE(rejected(example("q = 121"), data).find("1 to 120"), std::string::npos);
  EXPECT_NE(rejected(example("q = 6\nlevel = 0.9"), data).find("one of them"), std::string::npos);
  EXPECT_NE(rejected(example("level = 1.5"), data).find("between 0 and 1"), std::string::npos);
  EXPECT_NE(rejected(example("level = nan"), data).find("method.level"), std::string::npos);
  EXPECT_NE(rejected(example("M = 10\nlevel = 0.99"), data).find("larger M"), std::string::npos);
  EXPECT_NE(rejected(example("filter = \"fir\""), data).find("filter_taps"), std::string::npos);
  EXPECT_NE(rejected(example("filter = \"fir\"\nfilter_taps = [0, 0]"), data).find("only zeros"),
            std::string::npos);
  EXPECT_NE(rejected(example("M = 1000000"), data).find("method.M"), std::string::npos);
  EXPECT_NE(rejected(example("", "[truth]\na1 = 1\n"), data).find("truth"), std::string::npos);
  EXPECT_NE(rejected(example("", "[truth]\na1 = 1\nb3 = 1\n"), data).find("b3"), std::string::npos);
  EXPECT_NE(rejected(example("", "[probe]\nperiod = 0\n"), data).find("probe.period"), std::string::npos);
  EXPECT_NE(rejected("[plant]\nna = 0\nnb = 1\nknown = { b1 = 1 }\n", data).find("at least one"),
            std::string::npos);
  EXPECT_NE(rejected("[plant]\nna = 1\nnb = 1\ndelay = 2\n", data).find("plant.nb"), std::string::npos);
  EXPECT_NE(rejected("[plant]\nna = 1\nnb = 1\nknown = { a1 = inf }\n", data).find("a1"), std::string::npos);
}

TEST_F(RegionProgram, BadData) {
  const std::string spec = example("M = 4\nq = 1");
  EXPECT_NE(rejected(spec, "").find("data.csv"), std::string::npos);
  EXPECT_NE(rejected(spec, "t,u,y\n").find("data.csv"), std::string::npos);
  EXPECT_NE(rejected(spec, "t,u,y\n0,1,1\n").find("probe"), std::string::npos);
  EXPECT_NE(rejected(spec, "t,u,y,probe\n-1,1,,1\n1,0,1,\n0,0,1,\n").find("data.csv:3"), std::string::npos);
  EXPECT_NE(rejected(spec, "t,u,y,probe\n-1,1,,1\n0,nan,1,\n1,0,1,1\n").find("data.csv:3"),
            std::string::npos);
  EXPECT_NE(rejected(spec, "t,u,y,probe\n-1,1,,1\n0,0,inf,\n1,0,1,1\n").find("data.csv:3"),
            std::string::npos);
  EXPECT_NE(rejected(spec, "t,u,y,probe\n-1,1,,1\n0,0,1,1\n1,0,1,1\n").find("probes are due"),
            std::string::npos);
  EXPECT_NE(rejected(spec, "t,u,y,probe\n-1,1,,1\n0,0,,\n1,0,1,1\n").find("data.csv:3"), std::string::npos);
  EXPECT_NE(rejected(spec, "t,u,y,probe\n0,1,1,\n1,0,1,1\n2,0,1,\n3,0,1,1\n").find("first probe"),
            std::string::npos);
  EXPECT_NE(rejected(spec, "t,u,y,probe\n-1,1,,1\n0,0,1,\n1,0,1,1\n")
                .find("spec.toml: method.M: found 4, expected at most 2^1"),
            std::string::npos);
  EXPECT_EQ(run("region spec.toml").exit_code, 2);
  EXPECT_EQ(run("region missing.toml data.csv").exit_code, 2);
}

TEST_F(RegionProgram, CoverageDoesNotDependOnThreads) {
  write("spec.toml", example("M = 40\nq = 2",
                             "[truth]\na1 = -2\nb1 = 1\n[simulation]\nnoise = \"cauchy\"\n"
                             "probes = 60\n"));
  const ProgramRun one = run("region simulate spec.toml --runs 300 --threads 1 --json");
  const ProgramRun two = run("region simulate spec.toml --runs 300 --threads 2 --json");
  EXPECT_EQ(one.exit_code, 0);
  EXPECT_EQ(one.output, two.output);
  const double share = one.json()["coverage"]["full_residual_lscr_1"].get<double>();
  EXPECT_NEAR(share, 0.9, 5.0 * std::sqrt(0.9 * 0.1 / 300.0));
}

TEST_F(RegionProgram, WindFlights) {
  const ProgramRun result = run("wind simulate --correction lms --noise constant --flights 200 --json");
  EXPECT_EQ(result.exit_code, 0);
  ASSERT_EQ(result.json()["results"].size(), 1U);
  EXPECT_NEAR(result.json()["results"][0]["mean_deviation_m"].get<double>(), 383.4,
              4.0 * 225.4 / std::sqrt(200.0));
  EXPECT_EQ(run("wind simulate --correction best").exit_code, 2);
  EXPECT_EQ(run("wind simulate --flights 0").exit_code, 2);
  EXPECT_EQ(run("wind simulate --correction none --noise constant --flights 1 --path path.csv").exit_code, 0);
  EXPECT_EQ(trammel::io::read_text(folder_.path() / "path.csv").substr(0, 12), "t_s,x_m,y_m,");
}

}  // namespace
