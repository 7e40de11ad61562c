// SPDX-License-Identifier: Apache-2.0
// The report page in a real browser: it renders, its plots are not empty, and nothing is reported as an
// error.
#include <cstdio>
#include <functional>
#include <string>

#include <gtest/gtest.h>

#include "io/file.hpp"
#include "io/temporary_folder.hpp"
#include "report/report.hpp"
#include "sample_estimate.hpp"

namespace {

using namespace trammel;

/// What the page says about itself after drawing.
struct PageCheck {
  io::Json errors;
  io::Json drawn;
  std::string dom;
};

#ifdef TRAMMEL_CHROMIUM

std::string output_of(const std::string& command) {
  std::string text;
  const std::unique_ptr<FILE, int (*)(FILE*)> pipe(::popen(command.c_str(), "r"), ::pclose);
  std::array<char, 65536> buffer{};
  while (const std::size_t count = std::fread(buffer.data(), 1, buffer.size(), pipe.get())) {
    text.append(buffer.data(), count);
  }
  return text;
}

std::string unescaped(std::string text) {
  for (const auto& [from, to] :
       {std::pair<std::string, std::string>{"&quot;", "\""}, {"&lt;", "<"}, {"&amp;", "&"}}) {
    for (auto at = text.find(from); at != std::string::npos; at = text.find(from, at + 1)) {
      text.replace(at, from.size(), to);
    }
  }
  return text;
}

PageCheck open_page(const std::string& html) {
  const test::TemporaryFolder folder;
  const auto page = folder.write("report.html", html);
  PageCheck check;
  check.dom = output_of(
      "HOME=" + folder.path().string() +
      " timeout 120 " TRAMMEL_CHROMIUM
      " --headless --no-sandbox --disable-gpu --disable-background-networking --disable-dev-shm-usage"
      " --window-size=1200,900 --virtual-time-budget=8000 --user-data-dir=" +
      (folder.path() / "profile").string() + " --dump-dom 'file://" + page.string() + "#check' 2>" +
      (folder.path() / "log").string());
  const std::string mark = "data-check=\"";
  const auto begin = check.dom.find(mark);
  if (begin == std::string::npos) {
    ADD_FAILURE() << "the page did not check itself: " << io::read_text(folder.path() / "log");
    return check;
  }
  const auto end = check.dom.find('"', begin + mark.size());
  const io::Json json =
      io::Json::parse(unescaped(check.dom.substr(begin + mark.size(), end - begin - mark.size())));
  check.errors = json.at("errors");
  check.drawn = json.at("drawn");
  return check;
}

#endif

class ReportPage : public ::testing::Test {
 protected:
  void SetUp() override {
#ifndef TRAMMEL_CHROMIUM
    GTEST_SKIP() << "no chromium on this machine";
#endif
  }
  static PageCheck open(const report::ReportInput& input) {
#ifdef TRAMMEL_CHROMIUM
    return open_page(report::report_html(input));
#else
    (void)input;
    return {};
#endif
  }
};

constexpr int kManyPixels = 3000;   // axes' text and grid alone stay below
constexpr int kLongCurve_px = 300;  // a curve across a good part of the plan view

TEST_F(ReportPage, DrawsEveryPlotWithoutErrors) {
  const io::ScenarioInput scenario = test::sample_scenario();
  const estimate::TrajectoryEstimate estimate = test::sample_estimate();
  const auto truth = report::compare_with_truth(scenario.scenario, estimate, test::sample_truth());
  const PageCheck check = open({scenario, estimate, &truth});
  EXPECT_EQ(check.errors, io::Json::array());
  for (const std::string plot : {"height", "error", "acceleration", "worst", "residuals"}) {
    EXPECT_GT(check.drawn.value(plot, 0), kManyPixels) << plot;
  }
  for (const std::string curve : {"plan-estimate", "plan-gauss_markov", "plan-nominal", "plan-truth"}) {
    EXPECT_GT(check.drawn.value(curve, 0), kLongCurve_px) << curve;
  }
  EXPECT_NE(check.dom.find("a &lt;b&gt;turn&lt;/b&gt; &lt;/script&gt; &amp; \"climb\""), std::string::npos);
  EXPECT_NE(check.dom.find("Actual rms error"), std::string::npos);
  EXPECT_NE(check.dom.find("radar"), std::string::npos);
}

TEST_F(ReportPage, DesignWithoutMeasuredValues) {
  const io::ScenarioInput scenario = test::sample_scenario();
  estimate::TrajectoryEstimate estimate = test::sample_estimate();
  estimate.observed.reset();
  const PageCheck check = open({scenario, estimate});
  EXPECT_EQ(check.errors, io::Json::array());
  EXPECT_GT(check.drawn.value("plan-nominal", 0), kLongCurve_px);
  EXPECT_GT(check.drawn.value("error", 0), kManyPixels);
  EXPECT_FALSE(check.drawn.contains("residuals"));
}

TEST_F(ReportPage, UnboundedResultNamesTheDirection) {
  const io::ScenarioInput scenario = test::sample_scenario();
  estimate::TrajectoryEstimate estimate;
  estimate.solution.status = SolveStatus::kUnbounded;
  estimate.guaranteed_rms_m = std::numeric_limits<double>::infinity();
  estimate.nominal = test::sample_path(0.0);
  estimate.unbounded_directions = {"acceleration of segment 3 z"};
  const PageCheck check = open({scenario, estimate});
  EXPECT_EQ(check.errors, io::Json::array());
  EXPECT_NE(check.dom.find("acceleration of segment 3 z"), std::string::npos);
  EXPECT_NE(check.dom.find("bound the direction named"), std::string::npos);
}

TEST_F(ReportPage, LoadsNothingFromElsewhere) {
  const io::ScenarioInput scenario = test::sample_scenario();
  const estimate::TrajectoryEstimate estimate = test::sample_estimate();
  const std::string html = report::report_html({scenario, estimate});
  for (const std::string loader : {"<link", "src=", "@import", "url(http", "fetch(", "XMLHttpRequest"}) {
    EXPECT_EQ(html.find(loader), std::string::npos) << loader;
  }
}

}  // namespace
