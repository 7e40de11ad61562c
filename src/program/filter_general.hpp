// SPDX-License-Identifier: Apache-2.0
/// @file
/// Results of `trammel filter general` as JSON.
#pragma once

#include "../io/general_filter_file.hpp"
#include "../io/json_output.hpp"

namespace trammel::program {

[[nodiscard]] io::Json general_filter_json(const io::GeneralFilterFile& file,
                                           const filter::GeneralMethod& method);

}  // namespace trammel::program
