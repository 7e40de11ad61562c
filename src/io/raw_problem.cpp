// SPDX-License-Identifier: Apache-2.0
#include "raw_problem.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "document.hpp"
#include "file.hpp"
#include "trammel/linalg/semidefinite_factor.hpp"

namespace trammel::io {

namespace {

/// Entries across the diagonal may differ by this much relative to the diagonal: printed digits.
constexpr double kAsymmetry = 1e-12;
/// Numbers beyond this (or nonzero ones below its inverse) overflow when squared and squared again.
constexpr double kLargestNumber = 1e75;

std::string shape(const Eigen::MatrixXd& matrix) {
  return std::to_string(matrix.rows()) + " x " + std::to_string(matrix.cols());
}

Eigen::MatrixXd read_matrix(const Node& node) {
  Eigen::MatrixXd matrix = node.matrix();
  for (const double entry : matrix.reshaped()) {
    if (std::abs(entry) > kLargestNumber || (entry != 0.0 && std::abs(entry) < 1.0 / kLargestNumber)) {
      node.fail("a number of size " + std::to_string(std::log10(std::abs(entry))) + " decades",
                "numbers between 1e-75 and 1e75 in size (choose other units)");
    }
  }
  return matrix;
}

/// A factor of the symmetric positive semidefinite matrix at `node`.
Eigen::MatrixXd factor_of(const Node& node) {
  const Eigen::MatrixXd matrix = read_matrix(node);
  if (matrix.rows() != matrix.cols()) {
    node.fail("a " + shape(matrix) + " matrix", "a square matrix");
  }
  for (Eigen::Index i = 0; i < matrix.rows(); ++i) {
    for (Eigen::Index j = 0; j < i; ++j) {
      const double size = std::sqrt(std::abs(matrix(i, i) * matrix(j, j)));
      if (std::abs(matrix(i, j) - matrix(j, i)) > kAsymmetry * size) {
        const std::string entry = "[" + std::to_string(i) + "][" + std::to_string(j) + "]";
        node.fail("entry " + entry + " = " + std::to_string(matrix(i, j)) +
                      " and its mirror image = " + std::to_string(matrix(j, i)),
                  "a symmetric matrix");
      }
    }
  }
  const linalg::SemidefiniteFactor result = linalg::semidefinite_factor((matrix + matrix.transpose()) / 2.0);
  if (result.negative_pivot < 0.0) {
    node.fail("a matrix with a negative eigenvalue (a pivot of " + std::to_string(result.negative_pivot) +
                  " after scaling to a unit diagonal)",
              "a positive semidefinite matrix");
  }
  if (result.factor.rows() == 0) {
    return Eigen::MatrixXd::Zero(0, matrix.cols());
  }
  return result.factor;
}

/// The factor under `factor_key`, or of the matrix under `matrix_key`; exactly one must be there.
Eigen::MatrixXd read_factor(const Node& table, std::string_view factor_key, std::string_view matrix_key) {
  const Node* const factor = table.find(factor_key);
  const Node* const matrix = table.find(matrix_key);
  const std::string expected =
      "one of the keys " + std::string(factor_key) + " and " + std::string(matrix_key);
  if (factor != nullptr && matrix != nullptr) {
    table.fail("both", expected);
  }
  if (factor != nullptr) {
    return read_matrix(*factor);
  }
  if (matrix != nullptr) {
    return factor_of(*matrix);
  }
  table.fail("neither", expected);
}

void require_columns(const Node& table, std::string_view factor_key, std::string_view matrix_key,
                     const Eigen::MatrixXd& factor, Eigen::Index parameters) {
  if (factor.cols() != parameters) {
    const Node* const given = table.find(factor_key);
    (given != nullptr ? *given : table.at(matrix_key))
        .fail(std::to_string(factor.cols()) + " columns",
              std::to_string(parameters) + " columns, as the criterion has");
  }
}

RawProblem read(const Document& document) {
  const Node& root = document.root();
  RawProblem raw;
  if (const Node* const title = root.find("title")) {
    raw.title = title->text();
  }
  GuaranteedProblem& problem = raw.problem;
  problem.criterion_factor = read_factor(root, "criterion_factor", "criterion");
  const Eigen::Index parameters = problem.parameters();
  if (parameters == 0) {
    root.fail("a criterion without columns", "at least one parameter");
  }
  problem.information_factor = read_factor(root, "information_factor", "information");
  if (problem.information_factor.size() == 0) {
    problem.information_factor = Eigen::MatrixXd::Zero(0, parameters);
  }
  require_columns(root, "information_factor", "information", problem.information_factor, parameters);
  const std::vector<Node>& ellipsoids = root.at("ellipsoids").items();
  for (const Node& ellipsoid : ellipsoids) {
    problem.ellipsoids.push_back(read_factor(ellipsoid, "factor", "matrix"));
    require_columns(ellipsoid, "factor", "matrix", problem.ellipsoids.back(), parameters);
  }
  raw.factored = root.find("information") != nullptr || root.find("criterion") != nullptr ||
                 std::any_of(ellipsoids.begin(), ellipsoids.end(),
                             [](const Node& ellipsoid) { return ellipsoid.find("matrix") != nullptr; });
  document.reject_unknown();
  return raw;
}

}  // namespace

RawProblem read_raw_problem(const std::filesystem::path& file) {
  RawProblem raw = read(Document::load(file));
  raw.sha256 = sha256(read_text(file));
  return raw;
}

RawProblem parse_raw_problem(std::string_view text, const std::string& name) {
  RawProblem raw = read(Document::parse_json(text, name));
  raw.sha256 = sha256(text);
  return raw;
}

}  // namespace trammel::io
