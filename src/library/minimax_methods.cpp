// SPDX-License-Identifier: Apache-2.0
#include "trammel/minimax/conditional_gradient_impl.hpp"
#include "trammel/minimax/matrix_inequality_impl.hpp"
#include "trammel/minimax/worst_prior_impl.hpp"
