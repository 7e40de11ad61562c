// SPDX-License-Identifier: Apache-2.0
#include "trammel/filter/batch_bound.hpp"
#include "trammel/filter/batch_bound_impl.hpp"
#include "trammel/filter/general_method.hpp"
#include "trammel/filter/general_method_impl.hpp"
