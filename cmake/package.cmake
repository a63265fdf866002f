# The library that `cmake --install` leaves: static libraries, public headers and find_package(rotorloop COMPONENTS …).
# A component is the face of one or more rooms; whatever the libraries named here link is found by walking, so that a new library of a
# room needs no line here. A library belongs to the first component that reaches it; components that need others say so by themselves.
include(CMakePackageConfigHelpers)
include(GNUInstallDirs)

set(ROTORLOOP_COMPONENTS protocols control log estimate identify diagnose sim)  # in this order: what stands later may need what stands before
set(ROTORLOOP_LIBRARIES_options rl_options)                # these two are not to be asked for
set(ROTORLOOP_LIBRARIES_base rl_base rl_bench_render)
set(ROTORLOOP_LIBRARIES_protocols rl_protocols)
set(ROTORLOOP_LIBRARIES_control rl_control rl_control_file rl_estimate rl_effects rl_effects_file rl_user_terms rl_vehicle_file)
set(ROTORLOOP_LIBRARIES_log rl_flight_log rl_identify_checks rl_flight_set)
set(ROTORLOOP_LIBRARIES_estimate rl_identify rl_identify_ceres rl_identify_prediction)
set(ROTORLOOP_LIBRARIES_identify rl_identify_run rl_identify_report)
set(ROTORLOOP_LIBRARIES_diagnose rl_diagnose rl_diagnose_report)
set(ROTORLOOP_LIBRARIES_sim rl_hil_loop)
# The headers that a component is used through; those that they include come along. docs/library.md lists what each is for.
set(ROTORLOOP_FACES
  protocols/*.hpp
  host/control/*.hpp host/control/*.h host/effects/*.hpp host/estimate/*.hpp host/vehicle/*.hpp
  bench/sysid/log/read_flight.hpp bench/sysid/log/log_summary.hpp bench/sysid/log/check/checks.hpp
  bench/sysid/estimate/estimator.hpp bench/sysid/estimate/staged_fit.hpp bench/sysid/estimate/ceres_solver.hpp
  bench/sysid/score/prediction.hpp bench/sysid/score/one_step.hpp bench/sysid/score/multi_step_fit.hpp bench/sysid/score/noise_floor.hpp
  bench/sysid/identify/identification_run.hpp bench/sysid/identify/identified_vehicle.hpp
  bench/sysid/identify/report/identify_text.hpp bench/sysid/identify/report/identify_report.hpp
  bench/sysid/diagnose/diagnosis_run.hpp bench/sysid/diagnose/manoeuvre/manoeuvre_search.hpp bench/sysid/diagnose/residuals/residual_findings.hpp
  bench/sysid/diagnose/report/diagnosis_text.hpp bench/sysid/diagnose/report/diagnosis_report.hpp
  bench/hil/flight/runner.hpp bench/hil/flight/flight.hpp)

# Adds what `target` links to the lists REACHED (targets of this tree) and OUTSIDE (imported ones, "Eigen3::Eigen").
function(rl_walk target)
  get_target_property(links ${target} INTERFACE_LINK_LIBRARIES)
  if(NOT links)
    return()
  endif()
  foreach(link IN LISTS links)
    string(REGEX REPLACE "^\\$<LINK_ONLY:(.*)>$" "\\1" link "${link}")
    if(link MATCHES "::" AND NOT link MATCHES "^\\$<")
      list(APPEND OUTSIDE ${link})
    elseif(TARGET ${link} AND NOT link IN_LIST REACHED)
      list(APPEND REACHED ${link})
      rl_walk(${link})
    endif()
  endforeach()
  set(REACHED "${REACHED}" PARENT_SCOPE)
  set(OUTSIDE "${OUTSIDE}" PARENT_SCOPE)
endfunction()

set(ROTORLOOP_PLACES "")  # for the config file: what each component needs
set(rl_placed "")
foreach(component options base ${ROTORLOOP_COMPONENTS})
  add_library(rotorloop_${component} INTERFACE)
  target_link_libraries(rotorloop_${component} INTERFACE ${ROTORLOOP_LIBRARIES_${component}})
  set_target_properties(rotorloop_${component} PROPERTIES EXPORT_NAME ${component})
  add_library(rotorloop::${component} ALIAS rotorloop_${component})
  set(REACHED rotorloop_${component})
  set(OUTSIDE "")
  rl_walk(rotorloop_${component})
  set(mine "")
  set(needs "")
  set(packages "")
  foreach(target IN LISTS REACHED)
    if(target IN_LIST rl_placed)
      list(APPEND needs ${rl_place_of_${target}})
    else()
      list(APPEND mine ${target})
      list(APPEND rl_placed ${target})
      set(rl_place_of_${target} ${component})
    endif()
  endforeach()
  foreach(target IN LISTS OUTSIDE)
    string(REGEX REPLACE "::.*" "" package ${target})
    list(APPEND packages ${package})
  endforeach()
  list(REMOVE_DUPLICATES needs)
  list(REMOVE_DUPLICATES packages)
  string(APPEND ROTORLOOP_PLACES "set(_rotorloop_needs_${component} ${needs})\nset(_rotorloop_packages_${component} ${packages})\n")
  install(TARGETS ${mine} EXPORT rotorloop-${component} ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR}/rotorloop COMPONENT development)
  install(EXPORT rotorloop-${component} NAMESPACE rotorloop:: DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/rotorloop COMPONENT development)
endforeach()
# Headers keep the paths of their rooms below one folder, so that an #include is spelt alike in the tree and outside it.
target_include_directories(rl_options INTERFACE $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}/rotorloop>)

# Debug information of the libraries is five sixths of their size, and of use beside the source alone.
install(CODE "file(GLOB libraries \"\$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}/${CMAKE_INSTALL_LIBDIR}/rotorloop/*.a\")
execute_process(COMMAND ${CMAKE_STRIP} --strip-debug \${libraries} COMMAND_ERROR_IS_FATAL ANY)" COMPONENT development)
install(CODE "set(ROTORLOOP_FACES \"${ROTORLOOP_FACES}\")
set(ROTORLOOP_SOURCE \"${CMAKE_SOURCE_DIR}\")
set(ROTORLOOP_INCLUDE \"\${CMAKE_INSTALL_PREFIX}/${CMAKE_INSTALL_INCLUDEDIR}/rotorloop\")" COMPONENT development)
install(SCRIPT ${CMAKE_CURRENT_LIST_DIR}/install_headers.cmake COMPONENT development)
configure_package_config_file(${CMAKE_CURRENT_LIST_DIR}/rotorloopConfig.cmake.in ${CMAKE_BINARY_DIR}/generated/rotorloopConfig.cmake
  INSTALL_DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/rotorloop PATH_VARS CMAKE_INSTALL_DATADIR NO_SET_AND_CHECK_MACRO)
write_basic_package_version_file(${CMAKE_BINARY_DIR}/generated/rotorloopConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_BINARY_DIR}/generated/rotorloopConfig.cmake ${CMAKE_BINARY_DIR}/generated/rotorloopConfigVersion.cmake
  DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/rotorloop COMPONENT development)
