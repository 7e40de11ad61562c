// SPDX-License-Identifier: Apache-2.0
/// @file
/// The `rule` key of a filter design file.
#pragma once

#include <string>

#include <Eigen/Core>

#include "document.hpp"
#include "filter_file.hpp"

namespace trammel::io {

/// Gains of the rule that `rule` names; fills what `file` keeps of a rule (goal, guarantee, memory).
[[nodiscard]] Eigen::VectorXd apply_rule(const Node& rule, int order, double sampling_s, FilterFile& file);

/// The rules with their parameters, one per line.
[[nodiscard]] std::string rules_help();

}  // namespace trammel::io
