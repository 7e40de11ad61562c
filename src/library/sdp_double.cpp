// SPDX-License-Identifier: Apache-2.0
#include "trammel/sdp/detail/run_double_impl.hpp"
