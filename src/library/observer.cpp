// SPDX-License-Identifier: Apache-2.0
#include "trammel/observer/general_weight_impl.hpp"
#include "trammel/observer/plan_impl.hpp"
#include "trammel/observer/plan_problem_impl.hpp"
