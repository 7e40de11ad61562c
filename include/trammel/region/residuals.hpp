// SPDX-License-Identifier: Apache-2.0
/// @file
/// Records of a probed closed loop and the residuals that are affine in the unknown parameters.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/region/plant.hpp"

namespace trammel::inline TRAMMEL_ABI::region {

/// Dense matrix stored row by row: one row per probe or per string.
using RowMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// What was applied and measured. Sample k of y and u belongs to time first_time + k; before that both are
/// zero. Probe n was added to the input at time first_probe_time + period n, and the outputs from delay
/// samples later on, `period` of them, are its own group (in Amelin 2013, first_probe_time = -delay).
struct ProbedRecord {
  Eigen::VectorXd y;         ///< outputs
  Eigen::VectorXd u;         ///< inputs as applied, probes included; as long as y
  Eigen::VectorXd probe;     ///< Delta_n, symmetric random numbers drawn by the user
  int first_time = 0;        ///< time of the first sample of y and u
  int first_probe_time = 0;  ///< time of the input that carries probe 0
  int period = 1;            ///< s, samples from one probe to the next
  double gain = 1.0;         ///< beta, factor of the probe in the input; positive

  [[nodiscard]] double y_at(int time) const { return at(y, time); }
  [[nodiscard]] double u_at(int time) const { return at(u, time); }

 private:
  [[nodiscard]] double at(const Eigen::VectorXd& series, int time) const {
    const int k = time - first_time;
    return k < 0 ? 0.0 : series(k);
  }
};

/// Throws Error naming the member that is not finite, too short, or out of range.
void validate(const ProbedRecord& record);

/// A fixed linear operation on the residual sequence. At the true parameters the result still depends on the
/// noise alone, so levels stay exact; what it takes out of the noise makes regions smaller.
struct ResidualFilter {
  enum class Kind {
    kNone,
    kMean,      ///< subtract the mean
    kTrend,     ///< subtract the straight line of least squares
    kPeriodic,  ///< subtract the mean of each phase of `period` samples
    kFir,       ///< sum_k taps_k e_{t-k}, zero before the first residual
  };
  Kind kind = Kind::kNone;
  int period = 0;            ///< samples, kPeriodic only
  std::vector<double> taps;  ///< kFir only
};

/// Residuals times probes: for channel i = 1 ... channels and probe n
///   x_n^(i)(p) = Delta_n e_{t(n) + i - 1}(p) = values(n, column) - sum_k values(n, column + k) p_k,
/// k = 1 ... dimension, column = (i - 1)(dimension + 1), t(n) the time of the first output that probe n
/// reaches. Reused between calls, it does not allocate once the sizes are the same.
struct ProbedResiduals {
  int channels = 0;
  int dimension = 0;  ///< d, number of parameters
  RowMatrix values;   ///< probes x channels (d + 1)
  RowMatrix series;   ///< work: residual columns in order of time

  [[nodiscard]] int width() const { return dimension + 1; }
  [[nodiscard]] Eigen::Index probes() const { return values.rows(); }
};

/// Which part of the known terms the prediction of Amelin (2013) takes into account.
enum class KnownTerms {
  /// psi holds every known term that does not depend on the probe of its own group.
  kOnce,
  /// As printed there for example 1: known input coefficients inside the group are counted a second time.
  kPrinted,
};

/// Residuals of the plant equation, e_t(p) = A_p y_t - B_p u_t, in the unknown coefficients p. At the true
/// ones e = v, whatever the feedback was. `channels` is at least 1; as many as the period (0) is usual, more
/// is allowed.
void plant_residuals(const PlantModel& model, const ProbedRecord& record, int channels,
                     const ResidualFilter& filter, ProbedResiduals& out);

/// Residuals of the prediction in the impulse parameters theta (Amelin 2013, eqs. (2) and (4)):
///   e_{sn+i-1} = y_{sn+i-1} - theta_i u_{sn-l} - sum_{j=1}^{i-1} theta_{i-j} u_{sn-l+j} - psi_{sn+i-1},
/// one channel per sample of the period. At the true parameters they contain past outputs, which is why
/// levels are approximate for this form.
void prediction_residuals(const PlantModel& model, const ProbedRecord& record, KnownTerms terms,
                          ProbedResiduals& out);

}  // namespace trammel::inline TRAMMEL_ABI::region

#ifndef TRAMMEL_COMPILED
#include "trammel/region/residuals_impl.hpp"
#endif
