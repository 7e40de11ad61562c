// SPDX-License-Identifier: Apache-2.0
#include "trammel/sdp/sdpa_format.hpp"

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "small_problems.hpp"
#include "trammel/core/error.hpp"
#include "trammel/sdp/solve.hpp"

namespace {

using trammel::sdp::BlockKind;
using trammel::sdp::Entry;
using trammel::sdp::kConstant;
using trammel::sdp::parse_sdpa;
using trammel::sdp::Problem;
using trammel::sdp::to_sdpa;

constexpr const char* kExample = R"("A comment
* and another one
2 = number of variables
 3 =nBLOCK
{2, -3, +1} = bLOCKsTRUCT
{+1.5, -2e-3}
0 1 1 2 0.5
1 1 1 1 1.0
1 2 3 3 +1.0e+00
2 1 2 1 -4
2, 3, 1, 1, 7
0 2 1 1 0.0
)";

std::string error_of(const std::string& text) {
  try {
    (void)parse_sdpa(text, "p.dat-s");
  } catch (const trammel::Error& error) {
    return error.what();
  }
  return "accepted";
}

void expect_same(const Problem& a, const Problem& b) {
  ASSERT_EQ(a.blocks.size(), b.blocks.size());
  for (std::size_t k = 0; k < a.blocks.size(); ++k) {
    EXPECT_EQ(a.blocks[k].kind, b.blocks[k].kind);
    EXPECT_EQ(a.blocks[k].size, b.blocks[k].size);
  }
  EXPECT_EQ(a.cost, b.cost);
  ASSERT_EQ(a.entries.size(), b.entries.size());
  for (std::size_t k = 0; k < a.entries.size(); ++k) {
    EXPECT_EQ(a.entries[k].variable, b.entries[k].variable);
    EXPECT_EQ(a.entries[k].block, b.entries[k].block);
    EXPECT_EQ(a.entries[k].row, b.entries[k].row);
    EXPECT_EQ(a.entries[k].column, b.entries[k].column);
    EXPECT_EQ(a.entries[k].value, b.entries[k].value);
  }
}

TEST(SdpaFormat, ReadsCommentsBracesCommasSignsAndMirroredEntries) {
  const Problem problem = parse_sdpa(kExample, "p.dat-s");
  ASSERT_EQ(problem.blocks.size(), 3U);
  EXPECT_EQ(problem.blocks[0].kind, BlockKind::kDense);
  EXPECT_EQ(problem.blocks[1].kind, BlockKind::kDiagonal);
  EXPECT_EQ(problem.blocks[1].size, 3);
  EXPECT_EQ(problem.cost, Eigen::Vector2d(1.5, -2e-3));
  Problem expected = problem;
  expected.entries = {
      {kConstant, 0, 0, 1, 0.5}, {0, 0, 0, 0, 1.0}, {0, 1, 2, 2, 1.0}, {1, 0, 0, 1, -4.0}, {1, 2, 0, 0, 7.0}};
  expect_same(problem, expected);
}

TEST(SdpaFormat, LineEndsAndNumbersOverSeveralLines) {
  std::string windows = kExample;
  for (std::size_t k = windows.find('\n'); k != std::string::npos; k = windows.find('\n', k + 2)) {
    windows.insert(k, "\r");
  }
  expect_same(parse_sdpa(windows, "w"), parse_sdpa(kExample, "p"));
  const Problem split = parse_sdpa("2\n2\n2\n-1\n1\n2\n1 1 1 1 1 2 2 1 1 1", "s");
  EXPECT_EQ(split.blocks[1].size, 1);
  EXPECT_EQ(split.cost, Eigen::Vector2d(1.0, 2.0));
  EXPECT_EQ(split.entries.size(), 2U);
}

TEST(SdpaFormat, ErrorsNameFileAndLine) {
  const std::string head = "2\n2\n3 -2\n1 1\n";
  const std::vector<std::pair<std::string, std::string>> cases{
      {"", "p.dat-s:0: found the end of the file"},
      {"* only a comment\n", "p.dat-s:1: found the end of the file"},
      {"two\n", "p.dat-s:1: found \"two\""},
      {"2.5\n1\n1\n1 1\n", "p.dat-s:1: found \"2.5\""},
      {"0\n", "p.dat-s:1: found \"0\""},
      {"-1\n", "p.dat-s:1: found \"-1\""},
      {"99999999999\n", "p.dat-s:1: found \"99999999999\""},
      {"2\n0\n", "p.dat-s:2: found \"0\""},
      {"2\n2\n3\n", "p.dat-s:3: found the end of the file"},
      {"2\n2\n3 0\n", "p.dat-s:3: found 0"},
      {"2\n2\n3 x\n", "p.dat-s:3: found \"x\""},
      {"2\n2\n3 -2 4\n1 1\n", "p.dat-s:3: found one more number, \"4\""},
      {"2\n2\n3 -2\n1\n", "p.dat-s:4: found the end of the file"},
      {"2\n2\n3 -2\n1 nan\n", "p.dat-s:4: found \"nan\""},
      {"2\n2\n3 -2\n1 inf\n", "p.dat-s:4: found \"inf\""},
      {"2\n2\n3 -2\n1 1e999\n", "p.dat-s:4: found \"1e999\""},
      {"2\n2\n3 -2\n1 1 1\n", "p.dat-s:4: found one more number, \"1\""},
      {head + "3 1 1 1 1\n", "p.dat-s:5: found matrix 3, expected 0 to 2"},
      {head + "-1 1 1 1 1\n", "p.dat-s:5: found matrix -1, expected 0 to 2"},
      {head + "1 1 1 1 1\n1 3 1 1 1\n", "p.dat-s:6: found block 3, expected 1 to 2"},
      {head + "1 0 1 1 1\n", "p.dat-s:5: found block 0, expected 1 to 2"},
      {head + "1 1 4 1 1\n", "p.dat-s:5: found row or column 4, expected 1 to 3 in block 1"},
      {head + "1 1 1 0 1\n", "p.dat-s:5: found row or column 0, expected 1 to 3 in block 1"},
      {head + "1 2 1 2 1\n", "p.dat-s:5: found row 1, column 2, expected equal row and column"},
      {head + "1 1 1 1\n", "p.dat-s:5: found the end of the line"},
      {head + "1 1 1 1 1 1\n", "p.dat-s:5: found the end of the line"},
      {head + "1 1 1 1 1,0x\n", "p.dat-s:5: found \"0x\""},
      {head + "1 1 1 1 NaN\n", "p.dat-s:5: found \"NaN\""},
      {head + "1 1 1 1 +-1\n", "p.dat-s:5: found \"+-1\""},
      {head + "1 1 1.0 1 1\n", "p.dat-s:5: found \"1.0\""},
      {head + "1 1 1 2 1\n\n1 1 2 1 1\n", "p.dat-s:7: found an entry that line 5 gave already"},
  };
  for (const auto& [text, expected] : cases) {
    const std::string message = error_of(text);
    EXPECT_EQ(message.rfind(expected, 0), 0U) << message << "\ninstead of " << expected;
    EXPECT_NE(message.find("expected"), std::string::npos) << message;
  }
}

TEST(SdpaFormat, WhatIsWrittenReadsBackTheSame) {
  trammel::RandomStream random(41);
  Problem problem = trammel::test::cut_bound(12, random);
  problem.blocks.push_back({BlockKind::kDiagonal, 2});
  problem.entries.push_back({3, 1, 1, 1, 1.0 / 3.0});
  problem.entries.push_back({kConstant, 1, 0, 0, -4.9e-324});
  problem.cost[2] = 0.1;
  const std::string text = to_sdpa(problem, "a title\nof two lines");
  const Problem back = parse_sdpa(text, "written");
  expect_same(parse_sdpa(to_sdpa(back), "again"), back);
  EXPECT_EQ(back.cost, problem.cost);
  EXPECT_EQ(back.entries.size(), problem.entries.size());
  const auto given = solve(problem);
  const auto read = solve(back);
  EXPECT_EQ(given.x, read.x);
}

TEST(SdpaFormat, FreeBlocksAndLowRankTermsAreWrittenOut) {
  Problem problem = trammel::test::theta_of_cycle(5);
  problem.blocks.push_back({BlockKind::kFree, 1});
  problem.entries.push_back({1, 1, 0, 0, 2.0});
  problem.entries.push_back({kConstant, 1, 0, 0, 1.0});
  problem.low_rank.push_back({2, 0, Eigen::VectorXd::Unit(5, 4), Eigen::VectorXd::Constant(1, 0.5)});
  const auto given = solve(problem);
  const Problem back = parse_sdpa(to_sdpa(problem), "written");
  EXPECT_EQ(back.blocks[1].size, 2);
  EXPECT_TRUE(back.low_rank.empty());
  const auto read = solve(back);
  EXPECT_NEAR(given.primal_objective, read.primal_objective, 1e-7);
}

}  // namespace
