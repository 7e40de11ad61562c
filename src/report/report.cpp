// SPDX-License-Identifier: Apache-2.0
#include "report.hpp"

#include <array>
#include <cstdio>

#include "page.hpp"
#include "report_assets.hpp"
#include "trammel/core/status.hpp"

namespace trammel::report {

std::string rounded(double value, int digits) {
  std::array<char, 32> buffer{};
  std::snprintf(buffer.data(), buffer.size(), "%.*g", digits, value);
  return buffer.data();
}

Outcome outcome(const ReportInput& input) {
  const StatusText& status = describe(input.estimate.solution.status);
  if (input.statement != nullptr && input.statement->ambiguous && status.status != SolveStatus::kUnbounded) {
    return {.name = "ambiguous",
            .cause = "motions too far apart explain the measurements nearly equally well",
            .remedy =
                "exclude the false ones: give bounds.minimum_height_m (mirrored paths), tighter bounds, or "
                "a further station"};
  }
  return {.name = status.name,
          .cause = status.cause,
          .remedy = status.remedy,
          .solved = status.status == SolveStatus::kOptimal};
}

std::string report_html(const ReportInput& input) {
  return render_page(assets::kPageHtml, report_data(input), assets::kPageScript);
}

}  // namespace trammel::report
