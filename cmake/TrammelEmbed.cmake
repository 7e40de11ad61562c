# SPDX-License-Identifier: Apache-2.0
# Text files as string constants of the program, made at build time.
#
# trammel_embed(target HEADER name.hpp NAMESPACE ns FILES constant=path ...)
# adds a generated header with one `inline constexpr std::string_view` per file to the target's include path.
if(CMAKE_SCRIPT_MODE_FILE)
  # Run by the build: cmake -DOUTPUT=.. -DNAMESPACE=.. "-DFILES=a=path;b=path" -P TrammelEmbed.cmake
  set(text "// Made at build time from the files named below.\n#pragma once\n\n#include <string_view>\n\n")
  string(APPEND text "namespace ${NAMESPACE} {\n\n")
  foreach(entry IN LISTS FILES)
    string(REGEX MATCH "^([A-Za-z_]+)=(.*)$" matched "${entry}")
    set(name "${CMAKE_MATCH_1}")
    set(file "${CMAKE_MATCH_2}")
    file(SIZE "${file}" size)
    string(APPEND text "inline constexpr std::string_view ${name} =")
    # In pieces: compilers limit the length of one literal. Read by bytes in hexadecimal, since CMake's
    # strings would swallow brackets and semicolons.
    file(READ "${file}" bytes HEX)
    string(REGEX REPLACE "([0-9a-f][0-9a-f])" "\\\\x\\1" bytes "${bytes}")
    set(piece 16000)
    math(EXPR length "${size} * 4")
    set(position 0)
    while(position LESS length)
      string(SUBSTRING "${bytes}" ${position} ${piece} part)
      string(APPEND text "\n    \"${part}\"")
      math(EXPR position "${position} + ${piece}")
    endwhile()
    string(APPEND text ";\n\n")
  endforeach()
  string(APPEND text "}  // namespace ${NAMESPACE}\n")
  file(WRITE "${OUTPUT}" "${text}")
  return()
endif()

set(TRAMMEL_EMBED_SCRIPT "${CMAKE_CURRENT_LIST_FILE}")

function(trammel_embed target)
  cmake_parse_arguments(PARSE_ARGV 1 ARG "" "HEADER;NAMESPACE" "FILES")
  set(folder "${CMAKE_CURRENT_BINARY_DIR}/embedded")
  set(output "${folder}/${ARG_HEADER}")
  set(sources "")
  set(entries "")
  foreach(entry IN LISTS ARG_FILES)
    string(REGEX MATCH "^([A-Za-z_]+)=(.*)$" matched "${entry}")
    list(APPEND sources "${CMAKE_CURRENT_SOURCE_DIR}/${CMAKE_MATCH_2}")
    list(APPEND entries "${CMAKE_MATCH_1}=${CMAKE_CURRENT_SOURCE_DIR}/${CMAKE_MATCH_2}")
  endforeach()
  add_custom_command(OUTPUT "${output}"
    COMMAND "${CMAKE_COMMAND}" "-DOUTPUT=${output}" "-DNAMESPACE=${ARG_NAMESPACE}" "-DFILES=${entries}"
            -P "${TRAMMEL_EMBED_SCRIPT}"
    DEPENDS ${sources} "${TRAMMEL_EMBED_SCRIPT}"
    COMMENT "Embedding ${ARG_HEADER}" VERBATIM)
  target_sources(${target} PRIVATE "${output}")
  target_include_directories(${target} PRIVATE "${folder}")
endfunction()
