# SPDX-License-Identifier: Apache-2.0
# Sourced by demo.sh and check.sh: the packages the project needs on Debian and Ubuntu, and their installation.

# Build and libraries of the program.
packages_build="cmake ninja-build g++ pkg-config libeigen3-dev libcli11-dev nlohmann-json3-dev libtomlplusplus-dev libssl-dev libsuitesparse-dev"
# Tests: GoogleTest, automatic differentiation (Ceres), property tests, exact arithmetic, independent readers.
packages_test="libgtest-dev libgmock-dev libceres-dev librapidcheck-dev libboost-dev python3"
# Not under this name everywhere: the test that compares with it is left out where it cannot be installed.
packages_oracle="libgeographiclib-dev"
# The browser that looks at the report page; tests that need it are skipped where it cannot be installed.
packages_browser="chromium"

# Format and static analysis, for .ci/run.
packages_check="clang-format clang-tidy git"

# missing_of PACKAGE... prints those that are not installed.
missing_of() {
  for package in "$@"; do
    dpkg-query -W -f='${Status}' "$package" 2>/dev/null | grep -q 'ok installed' || printf '%s ' "$package"
  done
}

# as_root COMMAND... runs it with sudo where that is needed.
as_root() {
  if [ "$(id -u)" -eq 0 ]; then "$@"; else sudo "$@"; fi
}

# install_missing PACKAGE... installs what is missing; no call of apt when nothing is.
install_missing() {
  missing=$(missing_of "$@")
  [ -n "$missing" ] || return 0
  if ! command -v apt-get >/dev/null 2>&1; then
    echo "missing packages (Debian names): $missing" >&2
    echo "this script installs them with apt on Debian or Ubuntu; elsewhere install their equivalents" >&2
    return 1
  fi
  echo "installing: $missing"
  as_root apt-get update -q || return 1
  # shellcheck disable=SC2086  # a list of words
  as_root env DEBIAN_FRONTEND=noninteractive apt-get install -y -q --no-install-recommends $missing
}
