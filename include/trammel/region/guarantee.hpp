// SPDX-License-Identifier: Apache-2.0
/// @file
/// What a confidence region promises, under which assumptions, and what every region can do.
#pragma once

#include <array>
#include <concepts>
#include <span>
#include <string_view>

#include <Eigen/Core>

#include "trammel/core/config.hpp"
#include "trammel/region/interval.hpp"

namespace trammel::inline TRAMMEL_ABI::region {

/// How a stated level relates to the probability that the region contains the true parameters.
enum class LevelKind {
  kExact,        ///< equal to it, for any number of data
  kAtLeast,      ///< not larger than it, for any number of data
  kApproximate,  ///< close to it for long records and ordinary feedback; can be wrong for special ones
};

[[nodiscard]] constexpr std::string_view to_string(LevelKind kind) noexcept {
  switch (kind) {
    case LevelKind::kExact:
      return "exact";
    case LevelKind::kAtLeast:
      return "at_least";
    case LevelKind::kApproximate:
      break;
  }
  return "approximate";
}

/// An assumption under which a level holds.
struct Assumption {
  std::string_view name;
  std::string_view text;
};

inline constexpr Assumption kSymmetricProbe{
    "symmetric_probe", "the probes are independent of each other and each is symmetric about zero"};
inline constexpr Assumption kIndependentNoise{"noise_independent_of_all_probes",
                                              "the whole noise sequence is independent of the whole probe "
                                              "sequence; apart from that it may be anything"};
inline constexpr Assumption kCausalNoise{
    "noise_may_react_to_past_probes",
    "each probe is independent of the noise up to the end of its own group of samples; later noise may react "
    "to it"};
inline constexpr Assumption kAnyFeedback{"any_causal_feedback",
                                         "the feedback may be any causal law, also one that adapts"};
inline constexpr Assumption kSmallMemory{"memory_of_past_probes_negligible",
                                         "the size of the residuals hardly depends on the signs of earlier "
                                         "probes (the published claim of an exact "
                                         "level is wrong: the residual contains past outputs)"};
inline constexpr Assumption kModelOrders{"orders_and_known_coefficients_right",
                                         "orders, delay and the known coefficients are those of the plant"};

/// The promise of a region: plain data, to be printed beside every result.
struct Guarantee {
  std::string_view method;                     ///< name as in result files
  double level = 0.0;                          ///< for all parameters together
  LevelKind level_kind = LevelKind::kAtLeast;  ///< of `level`
  double channel_level = 0.0;                  ///< for each residual channel alone; NaN where there is none
  LevelKind channel_kind = LevelKind::kExact;  ///< of `channel_level`
  std::span<const Assumption> assumptions;     ///< static data
  std::string_view source;                     ///< where the method is from
};

/// A confidence region for d parameters.
/// - `contains(p)`: membership of a point, ties broken by a random order fixed with the region.
/// - `section(p, direction, out)`: all t for which p + t direction belongs to it, exact.
/// - `excludes(centre, generators)`: true only if no point of the parallelepiped
///   { centre + generators z, |z_k| <= 1 } belongs to it (false proves nothing). Outer summaries
///   (support.hpp) rest on it.
template <class Region>
concept ConfidenceRegion = requires(const Region& region, const Eigen::VectorXd& point,
                                    const Eigen::MatrixXd& generators, IntervalList& out) {
  { region.dimension() } -> std::convertible_to<Eigen::Index>;
  { region.contains(point) } -> std::same_as<bool>;
  { region.section(point, point, out) } -> std::same_as<void>;
  { region.excludes(point, generators) } -> std::same_as<bool>;
  { region.guarantee() } -> std::same_as<Guarantee>;
};

}  // namespace trammel::inline TRAMMEL_ABI::region
