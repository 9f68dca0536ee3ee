# The three kinds of target this project has, so that every folder's CMakeLists.txt is a list of names.
#
#   lumi_library(NAME [COLD] SOURCES ... [PUBLIC libs...] [PRIVATE libs...])   a stage's library (or scene)
#   lumi_program(NAME main.cc [LIBS libs...])                           a program of a few lines
#   lumi_test(NAME SOURCES ... [LIBS libs...] [LABELS labels...] [SECONDS s])   a GoogleTest executable, a ctest entry each

add_library(lumi_warnings INTERFACE)
target_compile_options(lumi_warnings INTERFACE
  -Wall -Wextra -Wpedantic -Wshadow -Wnon-virtual-dtor -Wcast-align -Woverloaded-virtual -Wno-unknown-pragmas)

# The Python module links the libraries, so that their code must run wherever it is loaded. A function that is seen from
# outside is still inlined: nobody puts another one in its place.
if(LUMI_PYTHON)
  # By hand: CMake's own property gives programs -fPIE, which cannot share precompiled headers with libraries.
  add_compile_options(-fPIC -fno-semantic-interposition)
endif()

# Third-party headers are SYSTEM: their warnings are not ours to mend.
set(CMAKE_NO_SYSTEM_FROM_IMPORTED OFF)

# Half of a file's compile time goes into headers and templates that its neighbours share: ten files at a time, twenty of tests, save
# half of a build from nothing. Sources with options of their own (the kernels) stay alone. A name in an unnamed namespace is
# therefore to be unique in its target.
option(LUMI_UNITY "Compile several files of a target at once" ON)
if(LUMI_UNITY)
  # g++ takes a file of a batch for a header; clang does not know the warning.
  target_compile_options(lumi_warnings INTERFACE $<$<CXX_COMPILER_ID:GNU>:-Wno-subobject-linkage>)
endif()
# A single file is compiled faster alone: LUMI_UNITY=OFF is for long work on one.
function(lumi_unity name batch)
  set_target_properties(${name} PROPERTIES UNITY_BUILD ${LUMI_UNITY} UNITY_BUILD_BATCH_SIZE ${batch})
endfunction()

# The headers that most files include, compiled once for each set of flags. A file still names what it uses: a build with
# LUMI_PCH off shows where one does not.
option(LUMI_PCH "Precompile the headers that most files include" ON)
set(LUMI_PCH_HEADERS <algorithm> <array> <chrono> <cmath> <filesystem> <fstream> <functional> <limits> <map> <memory> <optional>
  <random> <set> <sstream> <string> <utility> <vector> <Eigen/Dense> <fmt/format.h> <nlohmann/json.hpp>
  ${CMAKE_CURRENT_LIST_DIR}/json_instances.h)
set(LUMI_JSON_INSTANCES ${CMAKE_CURRENT_LIST_DIR}/json_instances.cc)
function(lumi_pch name kind)
  if(NOT LUMI_PCH)
    return()
  endif()
  if(NOT TARGET lumi_json)
    add_library(lumi_json STATIC ${LUMI_JSON_INSTANCES})
    target_link_libraries(lumi_json PUBLIC nlohmann_json::nlohmann_json)
    target_compile_options(lumi_json PRIVATE $<$<CONFIG:Release>:-O1>)
  endif()
  if(NOT TARGET lumi_pch_${kind})
    file(CONFIGURE OUTPUT ${CMAKE_BINARY_DIR}/pch/empty.cc CONTENT "")
    add_library(lumi_pch_${kind} OBJECT ${CMAKE_BINARY_DIR}/pch/empty.cc)
    target_link_libraries(lumi_pch_${kind} PRIVATE Eigen3::Eigen nlohmann_json::nlohmann_json fmt::fmt lumi_warnings)
    if(kind STREQUAL test)
      target_link_libraries(lumi_pch_${kind} PRIVATE GTest::gmock GTest::gtest)
      target_precompile_headers(lumi_pch_${kind} PRIVATE ${LUMI_PCH_HEADERS} <gmock/gmock.h>)
    else()
      target_precompile_headers(lumi_pch_${kind} PRIVATE ${LUMI_PCH_HEADERS})
    endif()
    if(NOT kind STREQUAL hot)
      target_compile_options(lumi_pch_${kind} PRIVATE $<$<CONFIG:Release>:-O1>)
    endif()
  endif()
  target_link_libraries(${name} PRIVATE fmt::fmt lumi_json)  # their macros and declarations are part of what was precompiled
  target_precompile_headers(${name} REUSE_FROM lumi_pch_${kind})
endfunction()

# COLD: nothing in it is waited for; it is compiled quickly rather than for speed.
function(lumi_library name)
  cmake_parse_arguments(arg "COLD" "" "SOURCES;PUBLIC;PRIVATE" ${ARGN})
  add_library(${name} STATIC ${arg_SOURCES})
  target_include_directories(${name} PUBLIC $<BUILD_INTERFACE:${CMAKE_SOURCE_DIR}> $<INSTALL_INTERFACE:include/lumigraph>)
  target_link_libraries(${name} PUBLIC ${arg_PUBLIC} PRIVATE ${arg_PRIVATE} $<BUILD_INTERFACE:lumi_warnings>)
  lumi_unity(${name} 10)
  if(arg_COLD)
    target_compile_options(${name} PRIVATE $<$<CONFIG:Release>:-O1>)
    lumi_pch(${name} cold)
  else()
    lumi_pch(${name} hot)
  endif()
endfunction()

function(lumi_program name main)
  cmake_parse_arguments(arg "" "" "LIBS" ${ARGN})
  add_executable(${name} ${main})
  target_link_libraries(${name} PRIVATE ${arg_LIBS} lumi_warnings)
  target_compile_options(${name} PRIVATE $<$<CONFIG:Release>:-O1>)
  lumi_pch(${name} cold)
  if(name MATCHES "^lumi-")  # else it is a benchmark's
    install(TARGETS ${name} RUNTIME COMPONENT programs)
  endif()
endfunction()

# Programs that measure are no part of `all`, so that tests need not wait for them: bench.sh builds them by name, test.sh
# --all builds the target `benchmarks`.
function(lumi_benchmarks)
  set_target_properties(${ARGN} PROPERTIES EXCLUDE_FROM_ALL ON)
  if(NOT TARGET benchmarks)
    add_custom_target(benchmarks)
  endif()
  add_dependencies(benchmarks ${ARGN})
endfunction()

function(lumi_test name)
  cmake_parse_arguments(arg "" "SECONDS" "SOURCES;LIBS;LABELS" ${ARGN})
  add_executable(${name} ${arg_SOURCES})
  lumi_unity(${name} 20)
  target_link_libraries(${name} PRIVATE ${arg_LIBS} lumi_test_main GTest::gmock GTest::gtest lumi_warnings)
  # Tests are read more often than they are waited for: the compiler's time counts, the libraries keep their own flags.
  target_compile_options(${name} PRIVATE $<$<CONFIG:Release>:-O1>)
  lumi_pch(${name} test)
  target_compile_definitions(${name} PRIVATE
    LUMI_BIN_DIR="${CMAKE_RUNTIME_OUTPUT_DIRECTORY}" LUMI_SOURCE_DIR="${CMAKE_SOURCE_DIR}")
  # One entry an executable: a process a test would spend most of the time loading shared libraries.
  add_test(NAME ${name} COMMAND ${name} --gtest_brief=1)
  # What is slow here takes several times as long on a busy machine. 77: nothing ran but what was skipped.
  set(timeout 600)
  if(slow IN_LIST arg_LABELS)
    set(timeout 1800)
  endif()
  set_tests_properties(${name} PROPERTIES TIMEOUT ${timeout} SKIP_RETURN_CODE 77)
  if(arg_SECONDS)  # the longest first: a fresh clone has no record of what tests cost
    set_tests_properties(${name} PROPERTIES COST ${arg_SECONDS})
  endif()
  if(arg_LABELS)
    set_tests_properties(${name} PROPERTIES LABELS "${arg_LABELS}")
  endif()
endfunction()
