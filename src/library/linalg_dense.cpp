// SPDX-License-Identifier: Apache-2.0
#include "trammel/linalg/dense_kernels_impl.hpp"
#include "trammel/linalg/extended_double.hpp"

template struct trammel::linalg::Dense<double>;
template struct trammel::linalg::Dense<trammel::linalg::ExtendedDouble>;
