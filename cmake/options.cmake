# Compiler options every target shares. Exact floating point is part of the product: runs are compared bit by bit.
set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/bin)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
option(ROTORLOOP_SANITIZE "AddressSanitizer and UndefinedBehaviourSanitizer" OFF)
option(ROTORLOOP_FIRMWARE "cross build of protocols, firmware and the controller" OFF)
option(ROTORLOOP_UNITY "compile the files of a library together: less CPU time for a whole build, more after an edit (preset develop: OFF)" ON)

add_library(rl_options INTERFACE)
target_include_directories(rl_options INTERFACE $<BUILD_INTERFACE:${CMAKE_SOURCE_DIR}>)
target_compile_features(rl_options INTERFACE cxx_std_20)
# Whoever links the installed libraries takes the floating point of its headers along, and keeps warnings of its own (cmake/package.cmake).
target_compile_options(rl_options INTERFACE
  "$<BUILD_INTERFACE:-Wall;-Wextra;-Wconversion;-Wshadow;-Wnon-virtual-dtor;-Wdouble-promotion;-Werror>"
  -ffp-contract=off -fno-math-errno)
if(ROTORLOOP_SANITIZE)
  target_compile_options(rl_options INTERFACE -fsanitize=address,undefined -fno-sanitize-recover=all -fno-omit-frame-pointer)
  target_link_options(rl_options INTERFACE -fsanitize=address,undefined)
  # Eigen pads what it allocates under the address sanitizer, and Debian's Ceres, whose Eigen functions the linker shares with ours, does not:
  # memory of one would be given back by the other's rule.
  target_compile_definitions(rl_options INTERFACE EIGEN_MALLOC_ALREADY_ALIGNED=1)
endif()

# rl_unity(TARGET BATCH): compiles its files together, at most BATCH at a time (0: all), so that the templates they share are
# instantiated once. Sources with options or definitions of their own stay alone. Names in anonymous namespaces must differ within a target.
function(rl_unity target batch)
  if(ROTORLOOP_UNITY AND NOT ROTORLOOP_FIRMWARE)
    set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE ${batch})
  endif()
endfunction()

# rl_library(NAME SOURCES… DEPENDS… [NO_PCH] [UNITY_BATCH N]): a static library of one room; header-only when it has no sources.
# NO_PCH: it includes next to nothing (cmake/precompile.cmake). UNITY_BATCH: files compiled together, all of them unless said.
function(rl_library name)
  cmake_parse_arguments(ARG "NO_PCH" "UNITY_BATCH" "SOURCES;DEPENDS" ${ARGN})
  if(ARG_SOURCES)
    add_library(${name} STATIC ${ARG_SOURCES})
    target_link_libraries(${name} PUBLIC rl_options ${ARG_DEPENDS})
    if(NOT DEFINED ARG_UNITY_BATCH)
      set(ARG_UNITY_BATCH 0)
    endif()
    rl_unity(${name} ${ARG_UNITY_BATCH})
    if(NOT ARG_NO_PCH AND NOT ROTORLOOP_FIRMWARE)
      rl_precompiled(${name} rl_pch)
    endif()
  else()
    add_library(${name} INTERFACE)
    target_link_libraries(${name} INTERFACE rl_options ${ARG_DEPENDS})
  endif()
endfunction()
