// SPDX-License-Identifier: Apache-2.0
#include "filter_run.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <optional>
#include <utility>

#include "trammel/core/error.hpp"
#include "trammel/filter/design_runner.hpp"
#include "trammel/filter/tracker.hpp"
#include "trammel/filter/worst_case.hpp"

namespace trammel::program {

namespace {

using filter::SampleUse;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

/// One column's filter behind one interface: time since the last row, the cell, estimates out.
struct StepResult {
  SampleUse use = SampleUse::kMissing;
  double innovation = kNan;
  std::vector<double> estimate;
};
using Stepper = std::function<StepResult(double dt_s, std::optional<double> cell)>;

/// Number of sampling intervals in dt, which must be whole; 0 at the first row.
int whole_intervals(double dt_s, double sampling_s) {
  constexpr double kSlack = 1e-3;  // of an interval: clocks jitter
  constexpr double kMost = 1e7;
  const double count = std::round(dt_s / sampling_s);
  if (!(std::abs(dt_s / sampling_s - count) <= kSlack) || count > kMost) {
    return -1;
  }
  return static_cast<int>(count);
}

std::vector<double> to_vector(const Eigen::Ref<const Eigen::VectorXd>& values) {
  return {values.begin(), values.end()};
}

template <int Order>
Stepper make_tracker(const FilterReport& report) {
  const io::FilterFile& file = report.file;
  filter::TrackerSettings settings = file.tracker;
  if (!file.use_fading_memory) {
    settings.memory_s = 0.0;
  }
  if (file.bound) {
    settings.measurement_std = file.bound->measurement_std;
    settings.manoeuvre_margin =
        file.bound->derivative_bound *
        filter::worst_case_bias(report.design, {.row = 0, .predicted = true}).arbitrary;
  }
  using Track = filter::Tracker<double, Order>;
  Track track(filter::constant_gains(file.specification), report.analysis.covariance(0, 0),
              report.analysis.prediction_noise_gain, settings);
  return [track, settings](double dt_s, std::optional<double> cell) mutable {
    const bool irregular = settings.memory_s > 0.0;
    double last_s = dt_s;
    if (!irregular) {
      const int intervals = whole_intervals(dt_s, settings.sampling_s);
      for (int i = 1; i < intervals; ++i) {
        track.step(std::nullopt);
      }
      last_s = settings.sampling_s;
    }
    StepResult result;
    // A copy predicts, so that the innovation can be told.
    Track ahead = track;
    ahead.step(last_s, std::nullopt);
    std::optional<typename Track::Measurement> measurement;
    if (cell) {
      result.innovation = *cell - ahead.state()(0, 0);
      measurement = typename Track::Measurement(*cell);
    }
    result.use = track.step(last_s, measurement);
    result.estimate = to_vector(track.state().col(0));
    return result;
  };
}

Stepper make_runner(const FilterReport& report) {
  filter::DesignRunner runner(report.design);
  const double sampling_s = report.design.specification.sampling_s;
  const int rows = report.design.specification.rows;
  return [runner, sampling_s, rows, started = false](double dt_s, std::optional<double> cell) mutable {
    StepResult result;
    if (!started) {
      if (cell) {
        runner.start_at_rest(*cell);
        started = true;
        result.use = SampleUse::kStartUp;
        result.estimate = to_vector(runner.estimate());
      } else {
        result.estimate.assign(static_cast<std::size_t>(rows), kNan);
      }
      return result;
    }
    const int intervals = whole_intervals(dt_s, sampling_s);
    for (int i = 1; i < intervals; ++i) {
      runner.step(std::nullopt);
    }
    const double predicted = runner.step(cell);
    if (cell) {
      result.use = SampleUse::kUsed;
      result.innovation = *cell - predicted;
    }
    result.estimate = to_vector(runner.estimate());
    return result;
  };
}

/// True if a track with start-up, gate and fading memory exists for this filter.
bool has_tracker(const FilterReport& report) {
  constexpr int kLargestOrder = 4;
  const filter::FilterSpecification& s = report.file.specification;
  return s.mode == filter::FilterMode::kDerivatives && s.rows == s.order && s.order <= kLargestOrder &&
         filter::constant_gains(s).size() > 0;
}

/// True if samples may come at any times.
bool takes_any_times(const FilterReport& report) {
  return report.file.use_fading_memory && has_tracker(report);
}

Stepper make_stepper(const FilterReport& report) {
  if (has_tracker(report)) {
    switch (report.file.specification.order) {
      case 1:
        return make_tracker<1>(report);
      case 2:
        return make_tracker<2>(report);
      case 3:
        return make_tracker<3>(report);
      case 4:
        return make_tracker<4>(report);
      default:
        break;
    }
  }
  require(report.file.tracker.gate == 0.0 && !report.file.memory_given, "run", "a gate or memory_s",
          "a filter with rows = order <= 4 and constant gains for them");
  return make_runner(report);
}

}  // namespace

std::vector<FilteredColumn> run_filter(const FilterReport& report, const io::CsvTable& table) {
  require(report.analysis.stable, "design", "an unstable filter", "a stable one");
  require(!table.rows.empty(), table.file, "no rows", "at least one measurement");
  require(report.file.tracker.gate == 0.0 || report.file.bound.has_value(), "run.gate",
          "a gate without a measurement deviation", "bound = {derivative_bound, measurement_std}");
  const std::size_t time_column = table.column("t_s");
  const bool irregular = takes_any_times(report);
  std::vector<double> steps;
  for (std::size_t row = 0; row < table.rows.size(); ++row) {
    const double t_s = table.number(row, time_column);
    const double dt_s =
        row == 0 ? report.file.specification.sampling_s : t_s - table.number(row - 1, time_column);
    if (!(dt_s > 0.0)) {
      throw Error({table.where(row) + ": t_s", shortest(t_s), "times that increase"});
    }
    if (!irregular && whole_intervals(dt_s, report.file.specification.sampling_s) < 1) {
      throw Error({table.where(row) + ": t_s", "a step of " + shortest(dt_s) + " s",
                   "whole multiples of sampling_s = " + shortest(report.file.specification.sampling_s) +
                       ", or run = {memory_s = ..} for samples at any times"});
    }
    steps.push_back(dt_s);
  }
  std::vector<FilteredColumn> columns;
  for (std::size_t column = 0; column < table.header.size(); ++column) {
    if (column == time_column) {
      continue;
    }
    if (std::count(table.header.begin(), table.header.end(), table.header[column]) > 1) {
      throw Error({table.file, "two columns '" + table.header[column] + "'", "columns of different names"});
    }
    FilteredColumn result{.name = table.header[column], .estimates = {}, .innovations = {}, .use = {}};
    Stepper step = make_stepper(report);
    for (std::size_t row = 0; row < table.rows.size(); ++row) {
      const bool present = column < table.rows[row].size() && !table.rows[row][column].empty();
      StepResult one = step(steps[row], present ? std::optional(table.number(row, column)) : std::nullopt);
      result.use.push_back(one.use);
      result.innovations.push_back(one.innovation);
      result.estimates.push_back(std::move(one.estimate));
    }
    columns.push_back(std::move(result));
  }
  require(!columns.empty(), table.file, "only a column t_s", "at least one column of a coordinate");
  return columns;
}

std::string format_filtered(const io::CsvTable& table, const std::vector<FilteredColumn>& columns) {
  std::string text = "t_s";
  for (const FilteredColumn& column : columns) {
    text += "," + column.name;
    for (std::size_t i = 1; i < column.estimates.front().size(); ++i) {
      text += "," + column.name + "_d" + std::to_string(i);
    }
    text += "," + column.name + "_innovation," + column.name + "_use";
  }
  text += "\n";
  const std::size_t time_column = table.column("t_s");
  const auto cell = [](double value) { return std::isfinite(value) ? "," + shortest(value) : ","; };
  for (std::size_t row = 0; row < table.rows.size(); ++row) {
    text += shortest(table.number(row, time_column));
    for (const FilteredColumn& column : columns) {
      for (const double value : column.estimates[row]) {
        text += cell(value);
      }
      text += cell(column.innovations[row]) + "," + std::string(to_string(column.use[row]));
    }
    text += "\n";
  }
  return text;
}

}  // namespace trammel::program
