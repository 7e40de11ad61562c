// SPDX-License-Identifier: Apache-2.0
#include "trammel/certify/certificate_impl.hpp"
#include "trammel/certify/congruence_basis_impl.hpp"
#include "trammel/certify/environment_impl.hpp"
#include "trammel/certify/gain_rounding_impl.hpp"
#include "trammel/certify/matrix_inequality_impl.hpp"
#include "trammel/certify/verified_cholesky_impl.hpp"
#include "trammel/linalg/coarse_product_impl.hpp"
#include "trammel/linalg/double_double_impl.hpp"
