// SPDX-License-Identifier: Apache-2.0
#include "trammel/sdp/detail/interior_point.hpp"

template class trammel::sdp::detail::InteriorPoint<double>;
