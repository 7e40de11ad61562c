// SPDX-License-Identifier: Apache-2.0
#include "trammel/localise/suggest_impl.hpp"
