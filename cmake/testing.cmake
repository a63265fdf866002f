enable_testing()
# A hundred programs are linked here: lld needs a third of the CPU time of GNU ld for each. The command itself keeps GNU ld, which
# takes instances of inline functions in the order of libraries that its speed was measured with.
find_program(ROTORLOOP_LLD ld.lld)
# `cmake --build … --target full` builds what the fast tier does not need: tests of the full tier, statistics, speed measurements.
add_custom_target(full)
# rl_full(TARGET…): built by target full alone.
function(rl_full)
  set_target_properties(${ARGN} PROPERTIES EXCLUDE_FROM_ALL ON)
  add_dependencies(full ${ARGN})
endfunction()

# rl_test(NAME SOURCES… DEPENDS… [LABELS…] [ALONE…] [IN_GUEST]): one GoogleTest binary, one ctest entry per binary.
# The files of one program are compiled together (rl_unity): a test spends most of its compiling on the headers that they share.
# ALONE: those of them that are not, for a name of theirs is another file's too, or they replace what the whole program uses.
# Label "full" keeps a test out of the fast tier (scripts/check runs without it, scripts/check --full with it).
# IN_GUEST: no entry of its own; it is run in a guest by those of test/vm.
function(rl_test name)
  cmake_parse_arguments(ARG "IN_GUEST" "TIMEOUT" "SOURCES;DEPENDS;LABELS;ALONE" ${ARGN})
  if(NOT ARG_TIMEOUT)
    set(ARG_TIMEOUT 300)
  endif()
  add_executable(${name} ${ARG_SOURCES})
  target_link_libraries(${name} PRIVATE rl_options ${ARG_DEPENDS} GTest::gtest GTest::gmock GTest::gtest_main)
  target_compile_definitions(${name} PRIVATE ROTORLOOP_SOURCE_DIR="${CMAKE_SOURCE_DIR}")
  rl_unity(${name} 8)
  if(ARG_ALONE)
    set_source_files_properties(${ARG_ALONE} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
  endif()
  rl_precompiled(${name} rl_pch_test)
  if("full" IN_LIST ARG_LABELS)
    rl_full(${name})
  endif()
  if(ROTORLOOP_LLD)
    target_link_options(${name} PRIVATE -fuse-ld=lld)
  endif()
  set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/test-bin)
  if(NOT ARG_IN_GUEST)
    add_test(NAME ${name} COMMAND ${name})
    set_tests_properties(${name} PROPERTIES TIMEOUT ${ARG_TIMEOUT} LABELS "googletest;${ARG_LABELS}")
  endif()
endfunction()

# rl_live(TEST…): tests of processes in real time, which wait for a minute or two and compute for seconds. One at a time and first, beside
# the tests that compute.
function(rl_live)
  set_tests_properties(${ARGN} PROPERTIES RESOURCE_LOCK real_time COST 1000)
endfunction()
