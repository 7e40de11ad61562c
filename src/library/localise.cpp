// SPDX-License-Identifier: Apache-2.0
#include "trammel/localise/fit_problem_impl.hpp"
#include "trammel/localise/flight_estimate_impl.hpp"
#include "trammel/localise/interior_motion_impl.hpp"
#include "trammel/localise/levenberg_marquardt_impl.hpp"
#include "trammel/localise/locate_impl.hpp"
#include "trammel/localise/outliers_impl.hpp"
#include "trammel/localise/stated_value_impl.hpp"
