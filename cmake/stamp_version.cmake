# Run as a script by cmake/version.cmake.
find_package(Git QUIET)
set(ROTORLOOP_GIT "unknown")
if(GIT_FOUND AND EXISTS ${SOURCE}/.git)
  execute_process(COMMAND ${GIT_EXECUTABLE} describe --always --dirty --abbrev=12
    WORKING_DIRECTORY ${SOURCE} OUTPUT_VARIABLE ROTORLOOP_GIT OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
endif()
configure_file(${SOURCE}/cmake/version.hpp.in ${BINARY}/generated/rotorloop_version.hpp @ONLY)
