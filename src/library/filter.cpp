// SPDX-License-Identifier: Apache-2.0
#include "trammel/filter/analysis.hpp"
#include "trammel/filter/analysis_impl.hpp"
#include "trammel/filter/design.hpp"
#include "trammel/filter/design_impl.hpp"
#include "trammel/filter/polynomial.hpp"
#include "trammel/filter/polynomial_impl.hpp"
#include "trammel/filter/worst_case.hpp"
#include "trammel/filter/worst_case_impl.hpp"
