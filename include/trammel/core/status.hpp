// SPDX-License-Identifier: Apache-2.0
/// @file
/// Why a solver stopped and what is proved about its answer: two different things.
#pragma once

#include <array>
#include <string_view>

#include "trammel/core/config.hpp"

namespace trammel::inline TRAMMEL_ABI {

/// Why a solver stopped.
enum class SolveStatus {
  kOptimal,
  kIterationLimit,
  kNumericalTrouble,
  kUnbounded,
};

/// What is proved about the bounds of a result.
enum class Claim {
  kNone,         ///< nothing: do not quote the bounds
  kApproximate,  ///< feasible points evaluated in double precision, rounding errors not enclosed
  kVerified,     ///< enclosed by the independent verifier, proof against rounding errors
};

/// One row of the table that documentation, `--help` and the report print.
struct StatusText {
  SolveStatus status;
  std::string_view name;    ///< as in result files
  std::string_view cause;   ///< what happened
  std::string_view remedy;  ///< what to do about it
};

inline constexpr std::array<StatusText, 4> kStatusTable{{
    {SolveStatus::kOptimal, "optimal",
     "the certified interval is as narrow as asked for, or verified and within a hundred times of that",
     "use the result"},
    {SolveStatus::kIterationLimit, "iteration_limit",
     "the iteration limit was reached before the certified interval became narrow enough",
     "the interval stated is still valid; raise solver.max_iterations or relax solver.relative_gap"},
    {SolveStatus::kNumericalTrouble, "numerical_trouble",
     "rounding errors stopped the progress before the certified interval became narrow enough",
     "the interval stated is still valid; check bounds and covariances for wrong units, or relax "
     "solver.relative_gap"},
    {SolveStatus::kUnbounded, "unbounded",
     "a motion that neither the bounds nor the measurements limit changes what is to be estimated",
     "bound the direction named, or add measurements that see it"},
}};

/// Row of kStatusTable for `status`.
[[nodiscard]] constexpr const StatusText& describe(SolveStatus status) noexcept {
  return kStatusTable[static_cast<std::size_t>(status)];
}

/// Name of a claim as in result files.
[[nodiscard]] constexpr std::string_view to_string(Claim claim) noexcept {
  switch (claim) {
    case Claim::kApproximate:
      return "approximate";
    case Claim::kVerified:
      return "verified";
    case Claim::kNone:
      break;
  }
  return "none";
}

}  // namespace trammel::inline TRAMMEL_ABI
