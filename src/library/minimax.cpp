// SPDX-License-Identifier: Apache-2.0
#include "trammel/minimax/interior_point_impl.hpp"
#include "trammel/minimax/newton_multipliers_impl.hpp"
#include "trammel/minimax/newton_system_impl.hpp"
#include "trammel/minimax/prior_state_impl.hpp"
#include "trammel/minimax/reduced_solution_impl.hpp"
#include "trammel/minimax/reduction_impl.hpp"
#include "trammel/minimax/separable_gram_impl.hpp"
#include "trammel/minimax/solve_impl.hpp"
