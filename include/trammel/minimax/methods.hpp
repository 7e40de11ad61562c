// SPDX-License-Identifier: Apache-2.0
/// @file
/// The methods that solve the guaranteed problem, by name.
#pragma once

#include <string>
#include <string_view>

#include "trammel/core/error.hpp"
#include "trammel/core/progress.hpp"
#include "trammel/minimax/conditional_gradient.hpp"
#include "trammel/minimax/matrix_inequality.hpp"
#include "trammel/minimax/solve.hpp"

namespace trammel::inline TRAMMEL_ABI::minimax {

/// Which method to use; Solution::method tells which algorithm made the result.
enum class RequestedMethod {
  kStructured,           ///< `solve`
  kSemidefinite,         ///< `solve_semidefinite`
  kConditionalGradient,  ///< `solve_by_conditional_gradient`
};

/// Name of a method in scenario files and options; throws Error for a name that is none.
[[nodiscard]] inline RequestedMethod method_of(std::string_view name) {
  return name == "sdp"                    ? RequestedMethod::kSemidefinite
         : name == "conditional-gradient" ? RequestedMethod::kConditionalGradient
         : name == "structured"
             ? RequestedMethod::kStructured
             : throw Error({"method", std::string(name), "structured, sdp or conditional-gradient"});
}

/// A method and, for the conditional gradient, its variant.
struct MethodChoice {
  RequestedMethod method = RequestedMethod::kStructured;
  ConditionalGradientVariant variant = ConditionalGradientVariant::kFullyCorrective;
};

/// Solves `problem` by the method chosen.
[[nodiscard]] inline Solution solve_with(const MethodChoice& choice, const GuaranteedProblem& problem,
                                         const SolverSettings& settings = {},
                                         const ProgressObserver& observe = {}) {
  switch (choice.method) {
    case RequestedMethod::kSemidefinite:
      return solve_semidefinite(problem, settings, observe);
    case RequestedMethod::kConditionalGradient:
      return solve_by_conditional_gradient(problem, settings, choice.variant, observe);
    case RequestedMethod::kStructured:
      break;
  }
  return solve(problem, settings, observe);
}

}  // namespace trammel::inline TRAMMEL_ABI::minimax
