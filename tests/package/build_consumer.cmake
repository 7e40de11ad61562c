# SPDX-License-Identifier: Apache-2.0
# cmake -DWAY=installed|subdirectory -DSOURCE=.. -DBUILD=.. -DWORK=.. -DCERES=ON|OFF -DGENERATOR=.. -DCOMPILER=.. -P this file
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
  if(CERES)
    list(APPEND targets consumer_ceres)
  endif()
else()
  set(origin "-DTRAMMEL_SOURCE=${SOURCE}")
  set(type Debug)  # checks Eigen's assertions; without symbols it also compiles in a fraction of the time
  # That there is a target trammel::trammel is checked at generation; compiling all of it again is not worth
  # the minutes.
  set(targets consumer_headers)
endif()
set(configure "${CMAKE_COMMAND}" -S "${SOURCE}/tests/package/consumer" -G "${GENERATOR}"
  "-DCMAKE_CXX_COMPILER=${COMPILER}" "-DCMAKE_CXX_COMPILER_LAUNCHER=${LAUNCHER}" -DCMAKE_BUILD_TYPE=${type}
  -DCMAKE_CXX_FLAGS_DEBUG=-O0 ${origin})
run(${configure} -B "${WORK}/build" -DCERES=${CERES})
run("${CMAKE_COMMAND}" --build "${WORK}/build" --parallel 2 --target ${targets})
foreach(target IN LISTS targets)
  run("${WORK}/build/${target}")
endforeach()

if(WAY STREQUAL "installed")
  # Where Ceres is missing, who asks for the component is told so.
  execute_process(COMMAND ${configure} -B "${WORK}/without_ceres" -DCERES=ON -DCMAKE_DISABLE_FIND_PACKAGE_Ceres=ON
    RESULT_VARIABLE result OUTPUT_QUIET ERROR_VARIABLE message)
  string(REGEX REPLACE "[ \n]+" " " message "${message}")
  if(result EQUAL 0 OR NOT message MATCHES "Component ceres needs the Ceres Solver .*, which was not found")
    message(FATAL_ERROR "without Ceres (${result}): ${message}")
  endif()
endif()
