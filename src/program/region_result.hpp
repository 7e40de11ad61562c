// SPDX-License-Identifier: Apache-2.0
/// @file
/// From a record to the region asked for, as JSON and as text.
#pragma once

#include <string>

#include "../io/json_output.hpp"
#include "../io/region_spec.hpp"

namespace trammel::program {

/// Everything `trammel region` prints; "status" is "bounded", "unbounded" or "empty".
[[nodiscard]] io::Json region_result(const io::RegionSpec& spec, const region::ProbedRecord& record);

/// The same for a reader at a terminal.
[[nodiscard]] std::string region_text(const io::Json& result);

/// A self-contained page with a picture of the region of two unknown coefficients: published form, residuals
/// of the plant equation, and these without their mean, from the same strings. Error unless there are two
/// unknown coefficients and the period is 2.
[[nodiscard]] std::string region_picture(const io::RegionSpec& spec, const region::ProbedRecord& record);

}  // namespace trammel::program
