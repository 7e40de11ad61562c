// SPDX-License-Identifier: Apache-2.0
#include "trammel/sdp/detail/face_impl.hpp"
#include "trammel/sdp/detail/model_impl.hpp"
#include "trammel/sdp/problem_impl.hpp"
#include "trammel/sdp/sdpa_format_impl.hpp"
#include "trammel/sdp/solve_impl.hpp"
