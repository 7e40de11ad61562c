// SPDX-License-Identifier: Apache-2.0
#include "trammel/core/config.hpp"
