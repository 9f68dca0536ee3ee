# Writes OUTPUT, a header that says which commit of SOURCE is built; leaves it alone where it says so already.
find_program(git git)
set(description "")
if(git)
  execute_process(COMMAND ${git} -C ${SOURCE} describe --tags --always --dirty=-changed
    OUTPUT_VARIABLE description OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
endif()
if(NOT description MATCHES "^[A-Za-z0-9._-]+$")
  set(description "no git")
endif()
file(CONFIGURE OUTPUT ${OUTPUT} @ONLY CONTENT "#pragma once
namespace lumi {
inline constexpr const char* kGitDescription = \"@description@\";
}
")
