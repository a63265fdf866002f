# The commit that a run folder names; "unknown" in a source archive.
find_package(Git QUIET)
set(ROTORLOOP_GIT "unknown")
if(GIT_FOUND AND EXISTS ${CMAKE_SOURCE_DIR}/.git)
  execute_process(COMMAND ${GIT_EXECUTABLE} describe --always --dirty --abbrev=12
    WORKING_DIRECTORY ${CMAKE_SOURCE_DIR} OUTPUT_VARIABLE ROTORLOOP_GIT
    OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
endif()
configure_file(${CMAKE_SOURCE_DIR}/cmake/version.hpp.in ${CMAKE_BINARY_DIR}/generated/rotorloop_version.hpp)
add_library(rl_version INTERFACE)
target_include_directories(rl_version INTERFACE ${CMAKE_BINARY_DIR}/generated)
