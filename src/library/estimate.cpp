// SPDX-License-Identifier: Apache-2.0
#include "trammel/estimate/observed_impl.hpp"
#include "trammel/estimate/pointwise_guarantee_impl.hpp"
#include "trammel/estimate/trajectory_estimate_impl.hpp"
