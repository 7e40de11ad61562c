// SPDX-License-Identifier: Apache-2.0
#include "page.hpp"

#include "report_assets.hpp"
#include "trammel/core/error.hpp"

namespace trammel::report {

namespace {

/// Inside a script element "</script>" and "<!--" must not occur.
std::string script_safe(std::string text) {
  for (std::size_t at = text.find('<'); at != std::string::npos; at = text.find('<', at + 1)) {
    text.replace(at, 1, "\\u003c");
  }
  return text;
}

/// Fills the places marked @@NAME@@ of a template; text filled in is not searched again.
class Template {
 public:
  explicit Template(std::string_view text) : rest_(text) {}

  Template& fill(std::string_view mark, std::string_view value) {
    const auto at = rest_.find(mark);
    require(at != std::string_view::npos, "report template", "no place for the next part", mark);
    text_ += rest_.substr(0, at);
    text_ += value;
    rest_.remove_prefix(at + mark.size());
    return *this;
  }
  [[nodiscard]] std::string finish() { return text_ + std::string(rest_); }

 private:
  std::string text_;
  std::string_view rest_;
};

}  // namespace

std::string render_page(std::string_view html, const io::Json& data, std::string_view script) {
  return Template(html)
      .fill("@@UPLOT_CSS@@", assets::kPlotCss)
      .fill("@@PAGE_CSS@@", assets::kPageCss)
      .fill("@@DATA@@", script_safe(data.dump()))
      .fill("@@UPLOT_JS@@", assets::kPlotScript)
      .fill("@@TOOLS_JS@@", assets::kToolsScript)
      .fill("@@PAGE_JS@@", script)
      .finish();
}

}  // namespace trammel::report
