// SPDX-License-Identifier: Apache-2.0
// The command campaign: the same bytes for any number of shards, and whatever is killed.
#include <algorithm>
#include <csignal>
#include <filesystem>
#include <string>

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include "io/csv.hpp"
#include "program/run_program.hpp"
#include "trammel/core/random.hpp"

namespace {

using trammel::io::read_text;
using trammel::test::ProgramRun;
using trammel::test::run_program;

class CampaignProgram : public testing::Test {
 protected:
  void SetUp() override { (void)folder_.write("a.toml", trammel::test::small_scenario()); }
  ProgramRun run(const std::string& arguments) { return run_program(folder_, arguments); }
  void expect_solved(const std::string& arguments) {
    const ProgramRun result = run(arguments);
    EXPECT_EQ(result.exit_code, 0) << arguments << ": " << result.errors;
  }
  [[nodiscard]] std::string text(const std::string& name) const { return read_text(folder_.path() / name); }
  [[nodiscard]] std::string error_of(const std::string& arguments) {
    const ProgramRun result = run(arguments);
    EXPECT_EQ(result.exit_code, 2) << arguments;
    return result.errors;
  }
  /// The merged table must list every run of every scenario once, in order.
  void expect_all_runs(const std::string& merged, std::size_t scenarios, std::size_t runs) const {
    const trammel::io::CsvTable table = trammel::io::read_csv(folder_.path() / merged);
    ASSERT_EQ(table.rows.size(), scenarios * runs);
    for (std::size_t row = 0; row < table.rows.size(); ++row) {
      EXPECT_EQ(table.number(row, table.column("run")), static_cast<double>(row % runs));
    }
  }

  trammel::test::TemporaryFolder folder_;
};

TEST_F(CampaignProgram, TheMergedTableDoesNotDependOnTheShards) {
  (void)folder_.write("b.toml", trammel::test::small_scenario("[criterion]\nkind = \"final\"\n"));
  std::string first;
  for (const int shards : {1, 2, 7}) {
    const std::string name = "c" + std::to_string(shards);
    expect_solved("campaign plan a.toml b.toml --runs 45 --seed 18446744073709551615 --parts 11 --out " +
                  name);
    for (int shard = shards; shard >= 1; --shard) {
      expect_solved("campaign run " + name + " --threads " + std::to_string(1 + shard % 2) + " --shard " +
                    std::to_string(shard) + "/" + std::to_string(shards));
    }
    expect_solved("campaign merge " + name);
    const std::string merged = text(name + "/merged.csv");
    first = first.empty() ? merged : first;
    EXPECT_EQ(merged, first) << shards;
  }
  expect_all_runs("c7/merged.csv", 2, 45);
  // The number of parts changes the files, not the table; shards of different N complete each other.
  expect_solved("campaign plan a.toml b.toml --runs 45 --seed 18446744073709551615 --parts 4 --out other");
  expect_solved("campaign run other --shard 2/3");
  expect_solved("campaign run other");
  expect_solved("campaign merge other --out other.csv");
  EXPECT_EQ(text("other.csv"), first);

  const ProgramRun report = run("campaign report c2 --json");
  EXPECT_EQ(report.exit_code, 0);
  EXPECT_EQ(report.output, text("c2/report.json"));
  const trammel::io::Json json = report.json();
  ASSERT_EQ(json["studies"].size(), 2U);
  EXPECT_EQ(json["contradicted"], 0);
  EXPECT_EQ(json["studies"][1]["runs"], 45);
  const double ratio = json["studies"][0]["ratio"].get<double>();
  EXPECT_GT(ratio, 0.2);
  EXPECT_LT(json["studies"][0]["ratio_interval"][0].get<double>(), ratio);
}

TEST_F(CampaignProgram, SkipsWhatIsCompleteAndRepairsWhatIsNot) {
  expect_solved("campaign plan a.toml --runs 30 --parts 5 --out c");
  expect_solved("campaign run c");
  expect_solved("campaign merge c");
  const std::string merged = text("c/merged.csv");
  EXPECT_EQ(run("campaign run c").output.substr(0, 16), "0 parts computed");
  // Cut off, changed by one digit, of another campaign, empty, gone: each is computed again.
  const std::string part = text("c/parts/2.csv");
  std::string changed = part;
  changed[part.find(",0.") + 3] ^= 1;
  for (const std::string& bad :
       {part.substr(0, part.size() - 70), changed, text("c/parts/3.csv"), std::string()}) {
    (void)folder_.write("c/parts/2.csv", bad);
    EXPECT_NE(error_of("campaign merge c").find("parts 2"), std::string::npos);
    EXPECT_EQ(run("campaign run c").output.substr(0, 16), "1 parts computed");
    EXPECT_EQ(text("c/parts/2.csv"), part);
  }
  std::filesystem::remove(folder_.path() / "c/parts/5.csv");
  EXPECT_NE(error_of("campaign report c").find("parts 5"), std::string::npos);
  EXPECT_EQ(run("campaign run c --shard 1/2").output.substr(0, 16), "1 parts computed");
  expect_solved("campaign merge c");
  EXPECT_EQ(text("c/merged.csv"), merged);
}

/// Kills a process of the campaign somewhere in its work; the last part of the work it does itself.
TEST_F(CampaignProgram, NothingIsLostOrDoubleAfterFiftyKills) {
  constexpr int kKills = 50;
  constexpr std::uint64_t kSeed = 4711;
  expect_solved("campaign plan a.toml --runs 10000 --parts 200 --out whole");
  expect_solved("campaign run whole");
  expect_solved("campaign merge whole");
  expect_solved("campaign plan a.toml --runs 10000 --parts 200 --out killed");
  trammel::RandomStream random(kSeed);
  std::size_t complete = 0;
  int died = 0;
  const std::filesystem::path parts = folder_.path() / "killed/parts";
  const auto count = [&] {
    return static_cast<std::size_t>(
        std::count_if(std::filesystem::directory_iterator(parts), {}, [](const auto& entry) {
          return entry.path().filename().string().find("unfinished") == std::string::npos;
        }));
  };
  for (int kill = 0; kill < kKills; ++kill) {
    const pid_t child = ::fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
      std::freopen("/dev/null", "w", stdout);
      ::execl(TRAMMEL_PROGRAM, "trammel", "campaign", "run", (folder_.path() / "killed").c_str(), "--threads",
              kill % 2 == 0 ? "1" : "2", nullptr);
      ::_exit(127);
    }
    constexpr double kLongest_us = 40000;  // start and a few parts; all of them take far longer
    ::usleep(static_cast<useconds_t>(kLongest_us * random.uniform()));
    ::kill(child, SIGKILL);
    int status = 0;
    ASSERT_EQ(::waitpid(child, &status, 0), child);
    died += WIFSIGNALED(status) ? 1 : 0;
    const std::size_t now = count();
    EXPECT_GE(now, complete);  // what was complete stays
    complete = now;
  }
  EXPECT_GT(died, kKills / 2) << "seed " << kSeed;
  EXPECT_GT(complete, 0U);
  const std::string last = run("campaign run killed").output;
  EXPECT_EQ(last.substr(0, last.find(' ')), std::to_string(200 - complete));
  expect_solved("campaign merge killed");
  EXPECT_EQ(text("killed/merged.csv"), text("whole/merged.csv"));
  expect_all_runs("killed/merged.csv", 1, 10000);
  EXPECT_EQ(count(), 200U);
  for (const auto& entry : std::filesystem::directory_iterator(parts)) {
    EXPECT_EQ(entry.path().extension(), ".csv") << "left behind: " << entry.path();
  }
}

TEST_F(CampaignProgram, AnArchiveOfFlights) {
  (void)folder_.write("truth.csv", trammel::test::kSmallTruth);
  expect_solved("simulate a.toml truth.csv --seed 4 --out y.csv");
  (void)folder_.write("flight.toml", trammel::test::small_scenario("[observations]\nfile = \"y.csv\"\n"));
  std::string open = trammel::test::small_scenario();
  open.replace(open.find("position_m = 50"), 15, "position_m = inf");
  open.replace(open.find("start = 0, stop = 30, step = 1"), 30, "start = 0, stop = 0, step = 1 ");
  (void)folder_.write("open.toml", open.replace(open.find("velocity_mps = 5"), 16, "velocity_mps = inf"));
  std::string close = trammel::test::small_scenario();  // passes through the ranging station
  (void)folder_.write("close.toml", close.replace(close.find("[5000, 0, 0]"), 12, "[1090, 2000, 503]"));
  expect_solved("campaign plan flight.toml open.toml close.toml a.toml --out c");
  expect_solved("campaign run c");
  const ProgramRun report = run("campaign report c --json");
  EXPECT_EQ(report.exit_code, 0) << report.errors;
  EXPECT_EQ(report.json()["status"]["optimal"], 2);
  EXPECT_EQ(report.json()["status"]["unbounded"], 1);
  EXPECT_EQ(report.json()["status"]["bad_input"], 1);
  const trammel::io::CsvTable table = trammel::io::read_csv(folder_.path() / "c/merged.csv");
  ASSERT_EQ(table.rows.size(), 4U);
  const trammel::io::Json single = run("estimate flight.toml --bounds-only --json").json();
  EXPECT_EQ(table.number(0, table.column("guaranteed_rms_m")), single["guaranteed_rms_m"].get<double>());
  EXPECT_EQ(table.number(0, table.column("chi2")), single["chi2"].get<double>());
  EXPECT_EQ(table.rows[1][table.column("guaranteed_rms_m")], "inf");
  EXPECT_EQ(table.rows[3][table.column("chi2")], "");
  EXPECT_NE(table.rows[2][table.column("message")].find("station"), std::string::npos);
  // A measurement changed after planning is noticed, not mixed in.
  (void)folder_.write("y.csv", text("y.csv") + "1.5,ranger,4000\n");
  std::filesystem::remove(folder_.path() / "c/parts/1.csv");
  EXPECT_NE(error_of("campaign run c").find("changed"), std::string::npos);
}

TEST_F(CampaignProgram, BadInput) {
  expect_solved("campaign plan a.toml --runs 3 --out c");
  for (const char* shard : {"0/2", "3/2", "1", "1/", "/2", "a/b", "1/2/3", "-1/2"}) {
    EXPECT_NE(error_of("campaign run c --shard '" + std::string(shard) + "'"), "") << shard;
  }
  EXPECT_NE(error_of("campaign run c --threads -2").find("--threads"), std::string::npos);
  EXPECT_NE(error_of("campaign plan a.toml --runs 4 --out c").find("another campaign"), std::string::npos);
  expect_solved("campaign plan a.toml --runs 3 --out c");
  EXPECT_NE(error_of("campaign plan a.toml --runs 3 --motion wild --out d").find("boundary"),
            std::string::npos);
  EXPECT_NE(error_of("campaign plan a.toml --runs 0 --out d"), "");
  EXPECT_NE(error_of("campaign plan missing.toml --out d").find("missing.toml"), std::string::npos);
  EXPECT_NE(error_of("campaign run d").find("manifest.json"), std::string::npos);
  (void)folder_.write("c/estimator_1.json", text("c/estimator_1.json") + " ");
  EXPECT_NE(error_of("campaign run c").find("estimator_1.json"), std::string::npos);
}

}  // namespace
