// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of residuals.hpp.
#pragma once

#include <string>

#include "trammel/core/error.hpp"
#include "trammel/region/plant_impl.hpp"
#include "trammel/region/residuals.hpp"

namespace trammel::inline TRAMMEL_ABI::region {

namespace detail {

/// Adds factor times the series `source` delayed by `lag` to column `column` of out.series, whose first row
/// is time `first`.
template <class Source>
void add_delayed(const Source& source, int first, int lag, double factor, Eigen::Index column,
                 RowMatrix& series) {
  for (Eigen::Index k = 0; k < series.rows(); ++k) {
    series(k, column) += factor * source(first + static_cast<int>(k) - lag);
  }
}

TRAMMEL_INLINE void subtract_phase_means(int period, RowMatrix& series) {
  for (Eigen::Index column = 0; column < series.cols(); ++column) {
    for (Eigen::Index phase = 0; phase < period && phase < series.rows(); ++phase) {
      double sum = 0.0;
      double count = 0.0;
      for (Eigen::Index k = phase; k < series.rows(); k += period) {
        sum += series(k, column);
        count += 1.0;
      }
      for (Eigen::Index k = phase; k < series.rows(); k += period) {
        series(k, column) -= sum / count;
      }
    }
  }
}

TRAMMEL_INLINE void subtract_line(RowMatrix& series) {
  const double middle = static_cast<double>(series.rows() - 1) / 2.0;
  for (Eigen::Index column = 0; column < series.cols(); ++column) {
    double moment = 0.0;
    double square = 0.0;
    const double mean = series.col(column).mean();
    for (Eigen::Index k = 0; k < series.rows(); ++k) {
      const double x = static_cast<double>(k) - middle;
      moment += x * series(k, column);
      square += x * x;
    }
    const double slope = square > 0.0 ? moment / square : 0.0;
    for (Eigen::Index k = 0; k < series.rows(); ++k) {
      series(k, column) -= mean + slope * (static_cast<double>(k) - middle);
    }
  }
}

TRAMMEL_INLINE void filter_in_place(const std::vector<double>& taps, RowMatrix& series) {
  for (Eigen::Index column = 0; column < series.cols(); ++column) {
    for (Eigen::Index k = series.rows() - 1; k >= 0; --k) {
      double sum = 0.0;
      for (Eigen::Index lag = 0; lag < static_cast<Eigen::Index>(taps.size()) && lag <= k; ++lag) {
        sum += taps[static_cast<std::size_t>(lag)] * series(k - lag, column);
      }
      series(k, column) = sum;
    }
  }
}

TRAMMEL_INLINE void apply_filter(const ResidualFilter& filter, RowMatrix& series) {
  switch (filter.kind) {
    case ResidualFilter::Kind::kNone:
      break;
    case ResidualFilter::Kind::kMean:
      subtract_phase_means(1, series);
      break;
    case ResidualFilter::Kind::kTrend:
      subtract_line(series);
      break;
    case ResidualFilter::Kind::kPeriodic:
      require(filter.period >= 1 && 2 * filter.period <= series.rows(), [&] {
        return ErrorDetail{"residual filter: period", std::to_string(filter.period),
                           "1 to half of the " + std::to_string(series.rows()) + " residuals"};
      });
      subtract_phase_means(filter.period, series);
      break;
    case ResidualFilter::Kind::kFir:
      require(!filter.taps.empty(), "residual filter: taps", "none", "at least one");
      filter_in_place(filter.taps, series);
      break;
  }
}

/// Groups rows of out.series (one residual per sample) by probe and multiplies by it.
TRAMMEL_INLINE void group_by_probe(const ProbedRecord& record, ProbedResiduals& out) {
  const Eigen::Index width = out.width();
  out.values.resize(record.probe.size(), out.channels * width);
  for (Eigen::Index n = 0; n < record.probe.size(); ++n) {
    for (Eigen::Index i = 0; i < out.channels; ++i) {
      out.values.row(n).segment(i * width, width) = record.probe(n) * out.series.row(record.period * n + i);
    }
  }
}

TRAMMEL_INLINE void require_covered(const ProbedRecord& record, int last_time) {
  const int last = record.first_time + static_cast<int>(record.y.size()) - 1;
  require(last >= last_time, [&] {
    return ErrorDetail{"record.y", "the last time " + std::to_string(last),
                       "outputs up to time " + std::to_string(last_time) + " (the group of the last probe)"};
  });
}

}  // namespace detail

TRAMMEL_INLINE void validate(const ProbedRecord& record) {
  require(record.y.size() >= 1, "record.y", "no sample", "at least one");
  require(record.u.size() == record.y.size(), [&] {
    return ErrorDetail{"record.u", std::to_string(record.u.size()) + " samples",
                       "as many as outputs, " + std::to_string(record.y.size())};
  });
  require(record.probe.size() >= 1, "record.probe", "no probe", "at least one");
  require(record.period >= 1, [&] {
    return ErrorDetail{"record.period", std::to_string(record.period), "at least 1"};
  });
  require(record.gain > 0.0, [&] {
    return ErrorDetail{"record.gain", std::to_string(record.gain), "a positive number"};
  });
  require(record.first_probe_time >= record.first_time, [&] {
    return ErrorDetail{"record.first_probe_time", std::to_string(record.first_probe_time),
                       "not before the first sample, " + std::to_string(record.first_time)};
  });
  require(record.y.allFinite(), "record.y", "a value that is not finite", "finite numbers");
  require(record.u.allFinite(), "record.u", "a value that is not finite", "finite numbers");
  require(record.probe.allFinite(), "record.probe", "a value that is not finite", "finite numbers");
}

TRAMMEL_INLINE void plant_residuals(const PlantModel& model, const ProbedRecord& record, int channels,
                                    const ResidualFilter& filter, ProbedResiduals& out) {
  validate(model);
  validate(record);
  require(channels >= 0, [&] {
    return ErrorDetail{"plant_residuals: channels", std::to_string(channels), "at least 1, or 0"};
  });
  out.channels = channels == 0 ? record.period : channels;
  out.dimension = static_cast<int>(unknown_count(model));
  const int first = record.first_probe_time + model.delay;
  const int length =
      record.period * (static_cast<int>(record.probe.size()) - 1) + std::max(out.channels, record.period);
  detail::require_covered(record, first + length - 1);
  out.series.setZero(length, out.width());
  const auto output = [&](int time) { return record.y_at(time); };
  const auto input = [&](int time) { return record.u_at(time); };
  detail::add_delayed(output, first, 0, 1.0, 0, out.series);
  Eigen::Index column = 1;
  detail::for_each_coefficient(model, [&](bool is_a, int index, const std::optional<double>& value) {
    // Known terms go to the target; e = target - sum regressor p, so regressors have the opposite sign.
    const double sign = is_a ? 1.0 : -1.0;
    const double factor = value ? sign * *value : -sign;
    const Eigen::Index target = value ? 0 : column++;
    if (is_a) {
      detail::add_delayed(output, first, index, factor, target, out.series);
    } else {
      detail::add_delayed(input, first, index, factor, target, out.series);
    }
  });
  detail::apply_filter(filter, out.series);
  detail::group_by_probe(record, out);
}

TRAMMEL_INLINE void prediction_residuals(const PlantModel& model, const ProbedRecord& record,
                                         KnownTerms terms, ProbedResiduals& out) {
  validate(model);
  validate(record);
  const int period = record.period;
  out.channels = period;
  out.dimension = period;
  const int first = record.first_probe_time + model.delay;
  const int length = period * static_cast<int>(record.probe.size());
  detail::require_covered(record, first + length - 1);
  out.series.setZero(length, out.width());
  for (int k = 0; k < length; ++k) {
    const int n = k / period;
    const int i = k % period + 1;
    const int time = first + k;
    const int probed = record.first_probe_time + period * n;
    double target = record.y_at(time);
    detail::for_each_coefficient(model, [&](bool is_a, int index, const std::optional<double>& value) {
      if (!value) {
        return;
      }
      if (is_a) {
        target += index >= i ? *value * record.y_at(time - index) : 0.0;
      } else if (index >= model.delay + i) {
        target -= *value * record.u_at(time - index);
      } else if (terms == KnownTerms::kPrinted && index > model.delay) {
        const int source = time - index;  // the feedback's own part of the input counts
        const double probe = source == probed ? record.gain * record.probe(n) : 0.0;
        target -= *value * (record.u_at(source) - probe);
      }
    });
    out.series(k, 0) = target;
    for (int j = 0; j < i; ++j) {
      out.series(k, i - j) = record.u_at(probed + j);
    }
  }
  detail::group_by_probe(record, out);
}

}  // namespace trammel::inline TRAMMEL_ABI::region
