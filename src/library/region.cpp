// SPDX-License-Identifier: Apache-2.0
#include "trammel/region/estimate_impl.hpp"
#include "trammel/region/level_walk_impl.hpp"
#include "trammel/region/lscr_impl.hpp"
#include "trammel/region/planar_impl.hpp"
#include "trammel/region/plant_impl.hpp"
#include "trammel/region/residuals_impl.hpp"
#include "trammel/region/strings_impl.hpp"
