// SPDX-License-Identifier: Apache-2.0
/// @file
/// Report pages: one file each, with style, plotting and data inside.
#pragma once

#include <string>
#include <string_view>

#include "../io/json_output.hpp"

namespace trammel::report {

/// Fills a page's marks @@UPLOT_CSS@@, @@PAGE_CSS@@, @@DATA@@, @@UPLOT_JS@@, @@TOOLS_JS@@, @@PAGE_JS@@, in
/// this order. `script` draws `data`, which it finds as `data`.
[[nodiscard]] std::string render_page(std::string_view html, const io::Json& data, std::string_view script);

}  // namespace trammel::report
