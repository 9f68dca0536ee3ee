# Writes OUTPUT, a header that says which commit of SOURCE is built; leaves it alone where it says so already.
# Changed pages change no program: bench.sh writes its figures into them while it measures.
cmake_minimum_required(VERSION 3.22)
find_program(git git)
set(description "")
if(git)
  execute_process(COMMAND ${git} -C ${SOURCE} describe --tags --always
    OUTPUT_VARIABLE description OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
  execute_process(COMMAND ${git} -C ${SOURCE} diff --quiet HEAD -- . ":(exclude)docs" ":(exclude)*.md"
    RESULT_VARIABLE changed OUTPUT_QUIET ERROR_QUIET)
  if(description AND NOT changed EQUAL 0)
    string(APPEND description "-changed")
  endif()
endif()
if(NOT description MATCHES "^[A-Za-z0-9._-]+$")
  set(description "no git")
endif()
file(CONFIGURE OUTPUT ${OUTPUT} @ONLY CONTENT "#pragma once
namespace lumi {
inline constexpr const char* kGitDescription = \"@description@\";
}
")
