# The commit that a run folder names; "unknown" in a source archive. Stamped at every build, because run folders carry it:
# the header changes, and its users are compiled again, only when the commit did.
add_library(rl_version INTERFACE)
target_include_directories(rl_version INTERFACE $<BUILD_INTERFACE:${CMAKE_BINARY_DIR}/generated>)
set(ROTORLOOP_STAMP ${CMAKE_COMMAND} -DSOURCE=${CMAKE_SOURCE_DIR} -DBINARY=${CMAKE_BINARY_DIR} -DPROJECT_VERSION=${PROJECT_VERSION}
  -P ${CMAKE_SOURCE_DIR}/cmake/stamp_version.cmake)
execute_process(COMMAND ${ROTORLOOP_STAMP})  # so that the header is there when dependencies are scanned
add_custom_target(rl_version_stamp COMMAND ${ROTORLOOP_STAMP} BYPRODUCTS ${CMAKE_BINARY_DIR}/generated/rotorloop_version.hpp)
add_dependencies(rl_version rl_version_stamp)
