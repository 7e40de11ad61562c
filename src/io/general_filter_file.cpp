// SPDX-License-Identifier: Apache-2.0
#include "general_filter_file.hpp"

#include <algorithm>
#include <cstdint>
#include <vector>

#include "trammel/core/error.hpp"
#include "trammel/filter/design.hpp"

namespace trammel::io {

namespace {

int small_integer(const Node& node, int low, int high) {
  const std::int64_t value = node.integer();
  if (value < low || value > high) {
    node.fail(node.describe(), "a whole number from " + std::to_string(low) + " to " + std::to_string(high));
  }
  return static_cast<int>(value);
}

/// Rows of polynomials (numbers or lists of coefficients in ascending powers of z^-1).
filter::PolynomialMatrix polynomial_matrix(const Node& node, int order) {
  const std::vector<Node>& rows = node.items();
  if (rows.empty() || rows.size() > static_cast<std::size_t>(order)) {
    node.fail(std::to_string(rows.size()) + " rows", "1 to " + std::to_string(order) + " rows, k <= v");
  }
  const auto size = static_cast<Eigen::Index>(rows.size());
  filter::PolynomialMatrix matrix{Eigen::MatrixXd::Zero(size, size)};
  for (Eigen::Index i = 0; i < size; ++i) {
    const std::vector<Node>& entries = rows[static_cast<std::size_t>(i)].items();
    if (entries.size() != rows.size()) {
      rows[static_cast<std::size_t>(i)].fail(std::to_string(entries.size()) + " entries",
                                             std::to_string(rows.size()) + ", as many as rows");
    }
    for (Eigen::Index j = 0; j < size; ++j) {
      const Node& entry = entries[static_cast<std::size_t>(j)];
      const std::vector<double> coefficients =
          entry.kind() == Node::Kind::kNumber ? std::vector<double>{entry.number()} : entry.numbers();
      constexpr std::size_t kMostCoefficients = 50;
      if (coefficients.empty() || coefficients.size() > kMostCoefficients) {
        entry.fail(std::to_string(coefficients.size()) + " coefficients", "1 to 50 of them");
      }
      for (std::size_t s = 0; s < coefficients.size(); ++s) {
        if (matrix.size() <= s) {
          matrix.emplace_back(Eigen::MatrixXd::Zero(size, size));
        }
        matrix[s](i, j) = coefficients[s];
      }
    }
  }
  return matrix;
}

}  // namespace

std::string general_filter_help() {
  return "Matrices file (TOML, or the same as JSON):\n"
         "  order = v               order of astatism, 1 to 10\n"
         "  sampling_s = T          interval between samples\n"
         "  A = [[p, ..], ..]       k x k polynomials in z^-1 (numbers or lists of coefficients), k <= v,\n"
         "                          A(0) = I, A x = 0 for every polynomial trajectory of degree below v\n"
         "and exactly one of\n"
         "  B = [[p, ..], ..]       the same condition: accuracy of the estimate\n"
         "  S = [[p, ..], ..]       operator from innovation to residual, any polynomials\n"
         "optional\n"
         "  samples = n             length of the responses and series printed; default 10\n"
         "Both closures are given: \"vector\" (each row compares its own noisy derivative) and \"scalar\"\n"
         "(one innovation, the filter that is used).\n";
}

GeneralFilterFile read_general_filter(const Document& document) {
  const Node& root = document.root();
  GeneralFilterFile file;
  file.order = small_integer(root.at("order"), 1, filter::kMaxOrder);
  const Node& sampling = root.at("sampling_s");
  file.sampling_s = sampling.number();
  if (!(file.sampling_s > 0.0)) {
    sampling.fail(sampling.describe(), "a positive number");
  }
  file.a = polynomial_matrix(root.at("A"), file.order);
  if (root.has("B") == root.has("S")) {
    root.fail(root.has("B") ? "both B and S" : "neither B nor S", "exactly one of them");
  }
  file.operator_given = root.has("S");
  const Node& other = root.at(file.operator_given ? "S" : "B");
  file.other = polynomial_matrix(other, file.order);
  if (file.other[0].rows() != file.a[0].rows()) {
    other.fail(std::to_string(file.other[0].rows()) + " rows",
               std::to_string(file.a[0].rows()) + ", as many as A has");
  }
  if (const Node* samples = root.find("samples")) {
    constexpr int kMostSamples = 10000;
    file.samples = small_integer(*samples, 1, kMostSamples);
  }
  (void)root.find("title");
  document.reject_unknown();
  return file;
}

filter::GeneralMethod make_general_method(const Document& document, const GeneralFilterFile& file) {
  try {
    return file.operator_given
               ? filter::GeneralMethod::from_operator(file.a, file.other, file.order, file.sampling_s)
               : filter::GeneralMethod::from_matrices(file.a, file.other, file.order, file.sampling_s);
  } catch (const Error& error) {
    const Node* node = document.root().find(error.detail().where);
    if (node == nullptr) {
      throw;
    }
    node->fail(error.detail().found, error.detail().expected);
  }
}

}  // namespace trammel::io
