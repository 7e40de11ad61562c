// SPDX-License-Identifier: Apache-2.0
// The report page in a real browser: it renders, its plots are not empty, and nothing is reported as an
// error.
#include <cstdio>
#include <functional>
#include <string>

#include <gtest/gtest.h>

#include "browser.hpp"
#include "io/file.hpp"
#include "io/temporary_folder.hpp"
#include "report/report.hpp"
#include "sample_estimate.hpp"

namespace {

using namespace trammel;
using test::PageCheck;

class ReportPage : public ::testing::Test {
 protected:
  void SetUp() override {
#ifndef TRAMMEL_CHROMIUM
    GTEST_SKIP() << "no chromium on this machine";
#endif
  }
  static PageCheck open(const report::ReportInput& input) {
#ifdef TRAMMEL_CHROMIUM
    return test::open_page(report::report_html(input));
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

TEST_F(ReportPage, ShowsWhatTheStatedErrorIsMadeOf) {
  const io::ScenarioInput scenario = test::sample_scenario();
  const estimate::TrajectoryEstimate estimate = test::sample_estimate();
  const localise::Statement statement = test::sample_statement();
  const PageCheck check = open({scenario, estimate, nullptr, &statement});
  EXPECT_EQ(check.errors, io::Json::array());
  EXPECT_NE(check.dom.find("Stated rms error"), std::string::npos);
  EXPECT_NE(check.dom.find("curvature of the measurements"), std::string::npos);
}

TEST_F(ReportPage, DrawsEverySolutionOfAmbiguousData) {
  const io::ScenarioInput scenario = test::sample_scenario();
  const estimate::TrajectoryEstimate estimate = test::sample_estimate();
  const localise::Statement statement = test::ambiguous_statement();
  const PageCheck check = open({scenario, estimate, nullptr, &statement});
  EXPECT_EQ(check.errors, io::Json::array());
  EXPECT_GT(check.drawn.value("plan-solution 2", 0), kLongCurve_px);
  EXPECT_NE(check.dom.find("no single value: the data are ambiguous"), std::string::npos);
  EXPECT_NE(check.dom.find("ambiguous</span>"), std::string::npos);
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
