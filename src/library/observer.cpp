// SPDX-License-Identifier: Apache-2.0
#include "trammel/observer/compare_impl.hpp"
#include "trammel/observer/flight_impl.hpp"
#include "trammel/observer/general_weight_impl.hpp"
#include "trammel/observer/monte_carlo_impl.hpp"
#include "trammel/observer/plan_impl.hpp"
#include "trammel/observer/plan_limits_impl.hpp"
#include "trammel/observer/plan_problem_impl.hpp"
#include "trammel/observer/range_grid_filter_impl.hpp"
