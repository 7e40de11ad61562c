#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Installs what is missing, builds and runs all tests: sh cmake/check.sh
set -eu
cd "$(dirname "$0")/.."
. cmake/packages.sh

# shellcheck disable=SC2086  # lists of words
install_missing $packages_build $packages_test
install_missing $packages_oracle || echo "no GeographicLib: its comparison will be left out" >&2
install_missing $packages_browser || echo "no browser: the tests that look at the report page will be skipped" >&2

cmake --preset release
cmake --build --preset release
ctest --preset release "$@"
