// SPDX-License-Identifier: Apache-2.0
#include "trammel/window/banded_certificate_impl.hpp"
#include "trammel/window/diagonal_cover_impl.hpp"
#include "trammel/window/enclosed_band_impl.hpp"
#include "trammel/window/fixed_lag_impl.hpp"
#include "trammel/window/flight_impl.hpp"
#include "trammel/window/local_window_impl.hpp"
#include "trammel/window/solve_impl.hpp"
