// SPDX-License-Identifier: Apache-2.0
#include "io/raw_problem.hpp"

#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "trammel/core/error.hpp"

namespace {

using trammel::io::parse_raw_problem;
using trammel::io::RawProblem;

std::string error_of(const std::string& text) {
  try {
    (void)parse_raw_problem(text, "p.json");
  } catch (const trammel::Error& error) {
    return error.what();
  }
  return "no error";
}

std::string problem(const std::string& information, const std::string& criterion,
                    const std::string& ellipsoids) {
  return "{" + information + ", " + criterion + ", \"ellipsoids\": " + ellipsoids + "}";
}

const std::string kInformation = R"("information_factor": [[1, 0], [0, 2], [1, 1]])";
const std::string kCriterion = R"("criterion_factor": [[1, 1]])";
const std::string kEllipsoids = R"([{"factor": [[1, 0], [0, 1]]}])";

TEST(RawProblemReader, FactorsAreTakenAsTheyAre) {
  const RawProblem raw = parse_raw_problem(
      R"({"title": "t", )" + problem(kInformation, kCriterion, kEllipsoids).substr(1), "p.json");
  EXPECT_EQ(raw.title, "t");
  EXPECT_EQ(raw.problem.information_factor, (Eigen::MatrixXd(3, 2) << 1, 0, 0, 2, 1, 1).finished());
  EXPECT_EQ(raw.problem.criterion_factor, (Eigen::MatrixXd(1, 2) << 1, 1).finished());
  ASSERT_EQ(raw.problem.ellipsoids.size(), 1U);
  EXPECT_EQ(raw.sha256.size(), 64U);
}

TEST(RawProblemReader, MatricesAreFactored) {
  // Rank one, rank two in very different units, and zero.
  const RawProblem raw = parse_raw_problem(
      problem(R"("information": [[4, 2e-5], [2e-5, 1e-10]])", R"("criterion": [[2e10, 1], [1, 1e-10]])",
              R"([{"matrix": [[0, 0], [0, 9]]}, {"matrix": [[0, 0], [0, 0]]}])"),
      "p.json");
  const auto square = [](const Eigen::MatrixXd& factor) -> Eigen::MatrixXd {
    return factor.transpose() * factor;
  };
  EXPECT_EQ(raw.problem.information_factor.rows(), 1);
  EXPECT_NEAR(square(raw.problem.information_factor)(1, 1) / 1e-10, 1.0, 1e-14);
  EXPECT_NEAR(square(raw.problem.information_factor)(0, 1) / 2e-5, 1.0, 1e-14);
  EXPECT_EQ(raw.problem.criterion_factor.rows(), 2);
  EXPECT_NEAR(square(raw.problem.criterion_factor)(1, 1) / 1e-10, 1.0, 1e-14);
  EXPECT_NEAR(square(raw.problem.criterion_factor)(0, 0) / 2e10, 1.0, 1e-14);
  EXPECT_EQ(square(raw.problem.ellipsoids[0]), (Eigen::MatrixXd(2, 2) << 0, 0, 0, 9).finished());
  EXPECT_EQ(raw.problem.ellipsoids[1].rows(), 0);
  EXPECT_EQ(raw.problem.ellipsoids[1].cols(), 2);
}

TEST(RawProblemReader, NoMeasurementIsAnEmptyArray) {
  const RawProblem raw =
      parse_raw_problem(problem(R"("information_factor": [])", kCriterion, kEllipsoids), "p.json");
  EXPECT_EQ(raw.problem.information_factor.rows(), 0);
  EXPECT_EQ(raw.problem.information_factor.cols(), 2);
}

TEST(RawProblemReader, EveryMistakeIsNamed) {
  const std::vector<std::pair<std::string, std::string>> cases{
      {problem(R"("information": [[1, 2], [2, 1]])", kCriterion, kEllipsoids),
       "p.json: information: found a matrix with a negative eigenvalue (a pivot of -3.000000 after scaling "
       "to a "
       "unit diagonal), expected a positive semidefinite matrix"},
      {problem(R"("information": [[0, 1], [1, 1]])", kCriterion, kEllipsoids),
       "p.json: information: found a matrix with a negative eigenvalue"},
      {problem(R"("information": [[1, 0.5], [0.4, 1]])", kCriterion, kEllipsoids),
       "p.json: information: found entry [1][0] = 0.400000 and its mirror image = 0.500000, expected a "
       "symmetric matrix"},
      {problem(R"("information": [[1, 0]])", kCriterion, kEllipsoids),
       "p.json: information: found a 1 x 2 matrix, expected a square matrix"},
      {problem(R"("information_factor": [[1, 0, 0]])", kCriterion, kEllipsoids),
       "p.json: information_factor: found 3 columns, expected 2 columns, as the criterion has"},
      {problem(R"("information_factor": [[1, NaN]])", kCriterion, kEllipsoids), "p.json: information_factor"},
      {problem(R"("information_factor": [[1, 1e80]])", kCriterion, kEllipsoids),
       "p.json: information_factor: found a number of size 80"},
      {problem(kInformation, kCriterion, R"([{"factor": [[1, 0]]}, {"matrix": [[1]]}])"),
       "p.json: ellipsoids[1].matrix: found 1 columns, expected 2 columns"},
      {problem(kInformation, kCriterion, R"([{"factor": [[1, 0]], "matrix": [[1]]}])"),
       "p.json: ellipsoids[0]: found both, expected one of the keys factor and matrix"},
      {problem(kInformation, kCriterion, R"([{"factr": [[1, 0]]}])"),
       "p.json: ellipsoids[0]: found neither, expected one of the keys factor and matrix"},
      {problem(kInformation, kCriterion, R"([{"factor": [[1, 0]], "radius": 1}])"),
       "p.json: ellipsoids[0].radius"},
      {problem(kInformation, R"("criterion_factor": [])", kEllipsoids),
       "found a criterion without columns, expected at least one parameter"},
      {"{" + kCriterion + ", \"ellipsoids\": []}",
       "found neither, expected one of the keys information_factor and information"},
      {"{" + kCriterion + ", " + kInformation + "}", "ellipsoids"},
      {"", "p.json"},
      {"[1, 2]", "p.json"},
  };
  for (const auto& [text, expected] : cases) {
    const std::string message = error_of(text);
    EXPECT_NE(message.find(expected), std::string::npos)
        << "found:    " << message << "\nexpected: " << expected;
  }
}

}  // namespace
