// SPDX-License-Identifier: Apache-2.0
/// @file
/// Errors of the library told with the file their setting stands in.
#pragma once

#include <string>

#include "trammel/core/error.hpp"

namespace trammel::program {

/// Runs `work`; an Error of the library about a setting also says in which file the setting stands.
template <class Work>
auto in_file(const std::string& file, const Work& work) {
  try {
    return work();
  } catch (const Error& error) {
    throw Error({file + ": " + error.detail().where, error.detail().found, error.detail().expected});
  }
}

}  // namespace trammel::program
