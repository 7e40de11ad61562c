// SPDX-License-Identifier: Apache-2.0
#include "trammel/problem/assemble_impl.hpp"
#include "trammel/problem/banded_problem_impl.hpp"
#include "trammel/problem/motion_coordinates_impl.hpp"
#include "trammel/problem/zoo_impl.hpp"
