# SPDX-License-Identifier: Apache-2.0
# cmake -DWAY=installed|subdirectory -DSOURCE=.. -DBUILD=.. -DWORK=.. -DGENERATOR=.. -DCOMPILER=.. -P this file
cmake_minimum_required(VERSION 3.25)

function(run)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE result)
  if(NOT result EQUAL 0)
    message(FATAL_ERROR "failed (${result}): ${ARGN}")
  endif()
endfunction()

file(REMOVE_RECURSE "${WORK}")
if(WAY STREQUAL "installed")
  # The library target may not have been built for the tests, which link its tuned twin.
  run("${CMAKE_COMMAND}" --build "${BUILD}" --target trammel trammel_program)
  run("${CMAKE_COMMAND}" --install "${BUILD}" --prefix "${WORK}/prefix")
  set(origin "-DCMAKE_PREFIX_PATH=${WORK}/prefix")
  set(type Release)
  set(targets consumer_headers consumer_trammel)
else()
  set(origin "-DTRAMMEL_SOURCE=${SOURCE}")
  set(type Debug)  # checks Eigen's assertions; without symbols it also compiles in a fraction of the time
  # That there is a target trammel::trammel is checked at generation; compiling all of it again is not worth
  # the minutes.
  set(targets consumer_headers)
endif()
run("${CMAKE_COMMAND}" -S "${SOURCE}/tests/package/consumer" -B "${WORK}/build" -G "${GENERATOR}"
  "-DCMAKE_CXX_COMPILER=${COMPILER}" "-DCMAKE_CXX_COMPILER_LAUNCHER=${LAUNCHER}" -DCMAKE_BUILD_TYPE=${type} -DCMAKE_CXX_FLAGS_DEBUG=-O0 ${origin})
run("${CMAKE_COMMAND}" --build "${WORK}/build" --parallel 2 --target ${targets})
foreach(target IN LISTS targets)
  run("${WORK}/build/${target}")
endforeach()
