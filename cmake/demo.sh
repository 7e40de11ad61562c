#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Installs what is missing, builds the program and estimates a real flight: sh cmake/demo.sh
# Results go to out/demo; the last lines are the numbers to look at and the path of the report.
set -eu
cd "$(dirname "$0")/.."
. cmake/packages.sh

# shellcheck disable=SC2086  # a list of words
install_missing $packages_build

build=build/demo
cmake -S . -B "$build" -G Ninja -DCMAKE_BUILD_TYPE=Release -DTRAMMEL_BUILD_TESTS=OFF
cmake --build "$build" --target trammel_program
trammel="$build/bin/trammel"

out=out/demo
mkdir -p "$out"
cp src/examples/paraglider/scenario.toml src/examples/paraglider/nominal.csv src/examples/paraglider/truth.csv "$out"
"$trammel" simulate "$out/scenario.toml" "$out/truth.csv" --seed 1 --out "$out/measurements.csv"
"$trammel" estimate "$out/scenario.toml" --truth "$out/truth.csv" --out "$out"

# number KEY prints the first value of a key of result.json.
number() {
  sed -n "s/^ *\"$1\": \\([^,]*\\),\\{0,1\\}\$/\\1/p" "$out/result.json" | head -n 1
}
echo
echo "stated rms error        $(number stated_rms_m) m"
echo "  linear guarantee      $(number guaranteed_rms_m) m, certified"
echo "certified lower bound   $(number lower_bound_rms_m) m"
echo "Gauss-Markov rms error  $(number gauss_markov_rms_m) m"
echo "actual rms error        $(number actual_rms_error_m) m"
echo "report                  $(pwd)/$out/report.html"
