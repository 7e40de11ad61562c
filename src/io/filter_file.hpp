// SPDX-License-Identifier: Apache-2.0
/// @file
/// Reads the design file of `trammel filter`: what is to be synthesised, by which rule, and how it is used.
#pragma once

#include <optional>
#include <string>

#include "document.hpp"
#include "trammel/filter/design.hpp"
#include "trammel/filter/tracker.hpp"
#include "trammel/filter/worst_case.hpp"

namespace trammel::io {

/// A bound on the manoeuvre, as the guarantee needs it.
struct ManoeuvreBound {
  double derivative_bound = 1.0;  ///< omega: |x^(v)| <= omega
  double measurement_std = 1.0;   ///< sigma
};

/// Everything a design file says.
struct FilterFile {
  filter::FilterSpecification specification;
  std::string rule;  ///< name of the rule, "" where gains or polynomials were given
  /// The output a rule's guarantee is for, and its value (squared error in units of the measurement).
  std::optional<filter::FilterOutput> goal;
  std::optional<double> guaranteed_mse;
  std::optional<ManoeuvreBound> bound;
  std::optional<int> batch_samples;  ///< window of the batch estimate to compare with
  filter::TrackerSettings tracker;   ///< key `run`
  bool use_fading_memory = false;    ///< run.memory_s given, or rule fading_memory: any sample times
  bool memory_given = false;         ///< run.memory_s given
};

/// Text for `--help`: keys and rules with their parameters.
[[nodiscard]] std::string filter_file_help();

/// Reads a design file; Error with file, line or key for anything unknown, missing or out of range.
[[nodiscard]] FilterFile read_filter_file(const Document& document);

}  // namespace trammel::io
