// SPDX-License-Identifier: Apache-2.0
/// @file
/// Raw problems: the guaranteed problem of a user's own linear model.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "trammel/problem/guaranteed_problem.hpp"

namespace trammel::io {

/// A raw problem file.
struct RawProblem {
  std::string title;
  GuaranteedProblem problem;
  std::string sha256;     ///< of the file
  bool factored = false;  ///< a matrix was given and factored in floating point
};

/// Reads {"title", "information_factor": F | "information": J, "criterion_factor": C | "criterion": S,
/// "ellipsoids": [{"factor": a_l} | {"matrix": H_l}, ...]} from JSON or TOML; matrices are arrays of rows,
/// F may be [] (no measurement). Matrices given instead of factors are factored. Throws Error that names
/// file, key, found and expected for wrong shapes, asymmetric or indefinite matrices, numbers that are not
/// finite and unknown keys.
[[nodiscard]] RawProblem read_raw_problem(const std::filesystem::path& file);

/// The same from JSON text; `name` stands for the file in messages.
[[nodiscard]] RawProblem parse_raw_problem(std::string_view text, const std::string& name);

}  // namespace trammel::io
