// SPDX-License-Identifier: Apache-2.0
/// @file
/// Runs any design, also with polynomial smoothing, fewer rows than order, or the published diagonal form.
#pragma once

#include <optional>

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/core/error.hpp"
#include "trammel/filter/analysis.hpp"
#include "trammel/filter/design.hpp"

namespace trammel::inline TRAMMEL_ABI::filter {

/// One coordinate through the transfer functions of a design, sample by sample, uniform sampling only. The
/// state is that of DeltaRealisation, so long memories keep their digits. Memory is taken at construction
/// only. For constant gains and k = v FixedGainFilter gives the same numbers faster.
class DesignRunner {
 public:
  explicit DesignRunner(const FilterDesign& design)
      : realisation_(design.denominator_d),
        outputs_(design.specification.rows, realisation_.states() + 1),
        at_rest_(1.0 / design.denominator_d[0]),
        state_(Eigen::VectorXd::Zero(realisation_.states() + 1)),
        next_(state_),
        estimate_(Eigen::VectorXd::Zero(design.specification.rows)) {
    require(is_stable(design.denominator_d), "design", "an unstable filter", "a stable one");
    double factor = 1.0;
    for (int i = 0; i < design.specification.rows; ++i, factor /= design.specification.sampling_s) {
      outputs_.row(i) =
          realisation_.output_row(design.numerators_d[static_cast<std::size_t>(i)]).transpose() * factor;
    }
    prediction_ = realisation_.output_row(add(design.denominator_d, design.innovation_numerator_d, -1.0));
  }

  /// State of a coordinate that has been at `value` for ever.
  void start_at_rest(double value) {
    state_.setZero();
    // s_0 = value / P(d = 0), in the scaled coordinates of the realisation.
    state_[0] = value * at_rest_ * realisation_.input()[0];
    estimate_.noalias() = outputs_ * state_;
  }

  /// One interval forward; without a measurement the prediction is taken for it. Returns the prediction.
  double step(const std::optional<double>& measurement) {
    next_.noalias() = realisation_.transition() * state_.head(realisation_.states());
    const double predicted = prediction_.dot(next_);
    next_ += realisation_.input() * measurement.value_or(predicted);
    state_.swap(next_);
    estimate_.noalias() = outputs_ * state_;
    return predicted;
  }

  /// Rows x, x', ... at the latest sample.
  [[nodiscard]] const Eigen::VectorXd& estimate() const { return estimate_; }

 private:
  DeltaRealisation realisation_;
  Eigen::MatrixXd outputs_;
  Eigen::VectorXd prediction_;
  double at_rest_;
  Eigen::VectorXd state_;
  Eigen::VectorXd next_;
  Eigen::VectorXd estimate_;
};

}  // namespace trammel::inline TRAMMEL_ABI::filter
