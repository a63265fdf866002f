# Precompiled headers: what nearly every file includes is parsed once per set of flags instead of once per file.
# They are an aid of the build alone: files still include what they use, and -DCMAKE_DISABLE_PRECOMPILE_HEADERS=ON builds without.
# gcc takes a precompiled header only where optimisation flags and the macros that its headers look at are the same, and
# -Winvalid-pch with -Werror says so where they are not.
set(ROTORLOOP_PCH <algorithm> <array> <cmath> <cstdint> <filesystem> <functional> <limits> <map> <memory> <numbers> <optional> <set> <span>
  <string> <string_view> <vector> <fmt/format.h> <nlohmann/json.hpp> <Eigen/Core> <Eigen/Geometry> <Eigen/Cholesky>)
set(ROTORLOOP_INNER_LOOP_OPTIONS -O3 -fno-trapping-math)
get_target_property(ROTORLOOP_FMT_DEFINITIONS fmt::fmt INTERFACE_COMPILE_DEFINITIONS)
file(CONFIGURE OUTPUT ${CMAKE_BINARY_DIR}/generated/precompile.cpp CONTENT "")

# rl_precompile(NAME DEPENDS… HEADERS… [OPTIONS…]): a precompiled header for targets of one set of flags.
function(rl_precompile name)
  cmake_parse_arguments(ARG "" "" "DEPENDS;HEADERS;OPTIONS" ${ARGN})
  add_library(${name} OBJECT EXCLUDE_FROM_ALL ${CMAKE_BINARY_DIR}/generated/precompile.cpp)
  target_link_libraries(${name} PRIVATE rl_options fmt::fmt Eigen3::Eigen ${ARG_DEPENDS})
  target_compile_options(${name} PRIVATE ${ARG_OPTIONS})
  target_precompile_headers(${name} PRIVATE ${ARG_HEADERS})
endfunction()

# rl_precompiled(TARGET PCH): sets or exchanges the precompiled header of a target.
function(rl_precompiled target pch)
  set_target_properties(${target} PROPERTIES PRECOMPILE_HEADERS_REUSE_FROM ${pch})
  target_compile_definitions(${target} PRIVATE ${ROTORLOOP_FMT_DEFINITIONS})  # the fmt of the precompiled header, used or not
  # From a precompiled header g++ 12 takes the standard library for our code, and warns where a std::string is moved into a vector.
  target_compile_options(${target} PRIVATE -Wno-array-bounds -Wno-restrict -Wno-stringop-overflow -Wno-stringop-overread -Wno-maybe-uninitialized)
endfunction()

# rl_inner_loop(TARGET): -O3 for a library in which a command spends its time; no bit of a result changes by it, because
# no floating-point exception is ever looked at.
function(rl_inner_loop target)
  target_compile_options(${target} PRIVATE ${ROTORLOOP_INNER_LOOP_OPTIONS})
  rl_precompiled(${target} rl_pch_inner_loop)
endfunction()

rl_precompile(rl_pch HEADERS ${ROTORLOOP_PCH})
rl_precompile(rl_pch_inner_loop HEADERS ${ROTORLOOP_PCH} OPTIONS ${ROTORLOOP_INNER_LOOP_OPTIONS})
rl_precompile(rl_pch_test DEPENDS GTest::gtest GTest::gmock HEADERS ${ROTORLOOP_PCH} <gtest/gtest.h> <gmock/gmock.h>)
