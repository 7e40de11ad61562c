// SPDX-License-Identifier: Apache-2.0
#include "report.hpp"

#include "page.hpp"
#include "report_assets.hpp"

namespace trammel::report {

std::string report_html(const ReportInput& input) {
  return render_page(assets::kPageHtml, report_data(input), assets::kPageScript);
}

}  // namespace trammel::report
