// SPDX-License-Identifier: Apache-2.0
#include "trammel/certify/certificate.hpp"

#include <gtest/gtest.h>
TEST(A, B) {}
