// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definition of run_double_double.
#pragma once

#include "trammel/linalg/extended_double.hpp"
#include "trammel/sdp/detail/interior_point.hpp"

namespace trammel::inline TRAMMEL_ABI::sdp::detail {

TRAMMEL_INLINE Outcome run_double_double(const Model& model, const Settings& settings,
                                         const ProgressObserver& observe, const Start& start) {
  return InteriorPoint<linalg::ExtendedDouble>(model, settings, observe).run(&start);
}

}  // namespace trammel::inline TRAMMEL_ABI::sdp::detail
