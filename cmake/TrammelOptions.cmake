# SPDX-License-Identifier: Apache-2.0
# Options, warning flags and the helpers that make targets.
option(TRAMMEL_BUILD_PROGRAM "Build the command-line program" ${PROJECT_IS_TOP_LEVEL})
option(TRAMMEL_BUILD_TESTS "Build the tests" ${PROJECT_IS_TOP_LEVEL})
option(TRAMMEL_BUILD_BENCH "Build the benchmarks" OFF)
option(TRAMMEL_INSTALL "Make install rules" ${PROJECT_IS_TOP_LEVEL})
option(TRAMMEL_WERROR "Treat warnings as errors" OFF)
option(TRAMMEL_TUNED "Use x86-64-v3 instructions in program, tests and benchmarks where this machine has them"
  ${PROJECT_IS_TOP_LEVEL})

if(PROJECT_IS_TOP_LEVEL AND NOT CMAKE_BUILD_TYPE AND NOT CMAKE_CONFIGURATION_TYPES)
  set(CMAKE_BUILD_TYPE Release CACHE STRING "Build type" FORCE)
endif()

# SuiteSparse component: sparse factorisations by CHOLMOD. Link trammel::suitesparse beside trammel::headers.
find_path(TRAMMEL_CHOLMOD_INCLUDE cholmod.h PATH_SUFFIXES suitesparse)
find_library(TRAMMEL_CHOLMOD_LIBRARY cholmod)
mark_as_advanced(TRAMMEL_CHOLMOD_INCLUDE TRAMMEL_CHOLMOD_LIBRARY)

set(TRAMMEL_TUNED_FLAGS "")
if(TRAMMEL_TUNED AND NOT CMAKE_CROSSCOMPILING)
  include(CheckCXXSourceRuns)
  set(CMAKE_REQUIRED_FLAGS "-march=x86-64-v3")
  check_cxx_source_runs([[
    int main() { return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") &&
                        __builtin_cpu_supports("bmi2") ? 0 : 1; }]] TRAMMEL_HAS_X86_64_V3)
  unset(CMAKE_REQUIRED_FLAGS)
  if(TRAMMEL_HAS_X86_64_V3)
    set(TRAMMEL_TUNED_FLAGS "-march=x86-64-v3")
  endif()
endif()

# Strict warnings for the project's own targets; private, so users' builds keep their own.
# (-Wrestrict is off: GCC 12 reports std::string concatenation, its bug 105651.)
add_library(trammel_warnings INTERFACE)
target_compile_options(trammel_warnings INTERFACE
  $<$<CXX_COMPILER_ID:GNU,Clang>:-Wall;-Wextra;-Wpedantic;-Wshadow;-Wnon-virtual-dtor;-Wold-style-cast;-Wcast-qual;-Wunused;-Woverloaded-virtual;$<$<CXX_COMPILER_ID:GNU>:-Wno-restrict>>
  $<$<BOOL:${TRAMMEL_WERROR}>:-Werror>)

# Settings shared by the library and its tuned twin. No fused contraction: the certified bounds are
# evaluated exactly as written.
function(trammel_configure_library target)
  target_link_libraries(${target} PUBLIC trammel_headers PRIVATE $<BUILD_INTERFACE:trammel_warnings>)
  target_compile_definitions(${target} PUBLIC TRAMMEL_COMPILED)
  target_compile_options(${target} PRIVATE $<$<CXX_COMPILER_ID:GNU,Clang>:-ffp-contract=off>)
  set_target_properties(${target} PROPERTIES POSITION_INDEPENDENT_CODE ON)
endfunction()

# trammel_add_test(NAME name SOURCES a.cpp ... [LIBRARIES lib ...] [LABELS label ...])
# Makes one test executable and registers each of its tests with ctest.
function(trammel_add_test)
  cmake_parse_arguments(PARSE_ARGV 0 ARG "" "NAME" "SOURCES;LIBRARIES;LABELS")
  add_executable(test_${ARG_NAME} ${ARG_SOURCES})
  target_link_libraries(test_${ARG_NAME} PRIVATE trammel_tuned trammel_warnings GTest::gtest_main ${ARG_LIBRARIES})
  target_include_directories(test_${ARG_NAME} PRIVATE "${PROJECT_SOURCE_DIR}/src" "${PROJECT_SOURCE_DIR}/tests")
  target_compile_definitions(test_${ARG_NAME} PRIVATE
    TRAMMEL_SOURCE_DIR="${PROJECT_SOURCE_DIR}" TRAMMEL_BINARY_DIR="${PROJECT_BINARY_DIR}")
  # Names as in --gtest_filter: the values of parameters without a printer would be bytes.
  gtest_discover_tests(test_${ARG_NAME} TEST_PREFIX "${ARG_NAME}." NO_PRETTY_VALUES DISCOVERY_TIMEOUT 120
    PROPERTIES TIMEOUT 600 LABELS "${ARG_LABELS}")
endfunction()
