// SPDX-License-Identifier: Apache-2.0
#include "trammel/certify/attained_impl.hpp"
#include "trammel/certify/block_structure_impl.hpp"
#include "trammel/certify/correlated_prior_impl.hpp"
#include "trammel/certify/near_optimality_impl.hpp"
#include "trammel/certify/palindromic_impl.hpp"
#include "trammel/certify/scalar_priors_impl.hpp"
#include "trammel/certify/van_trees_impl.hpp"
