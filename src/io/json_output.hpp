// SPDX-License-Identifier: Apache-2.0
/// @file
/// JSON results: full precision, null for what was not computed.
#pragma once

#include <cmath>

#include <Eigen/Core>
#include <nlohmann/json.hpp>

namespace trammel::io {

using Json = nlohmann::ordered_json;

/// A number, or null where it is NaN or infinite (JSON has neither).
[[nodiscard]] inline Json to_json(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

/// Array of numbers.
[[nodiscard]] inline Json to_json(const Eigen::Ref<const Eigen::VectorXd>& values) {
  Json array = Json::array();
  for (const double value : values) {
    array.push_back(to_json(value));
  }
  return array;
}

/// Array of rows.
[[nodiscard]] inline Json matrix_to_json(const Eigen::Ref<const Eigen::MatrixXd>& matrix) {
  Json rows = Json::array();
  for (Eigen::Index i = 0; i < matrix.rows(); ++i) {
    rows.push_back(to_json(matrix.row(i).transpose().eval()));
  }
  return rows;
}

/// Text of a result file: two spaces of indentation, a newline at the end.
[[nodiscard]] inline std::string dump(const Json& json) { return json.dump(2) + "\n"; }

}  // namespace trammel::io
