// SPDX-License-Identifier: Apache-2.0
#include "trammel/campaign/motion_study_impl.hpp"
