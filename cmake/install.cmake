# What `cmake --install` leaves for users of the command: <prefix>/bin, share/rotorloop (vehicles, scenarios, catalogue of effects, devices,
# docs, in the order of the tree, so that links and relative paths hold), man page and completion. The library: package.cmake.
include(GNUInstallDirs)
set(ROTORLOOP_SHARE ${CMAKE_INSTALL_DATADIR}/rotorloop)
install(CODE "set(CMAKE_INSTALL_DO_STRIP 1)" COMPONENT command)  # symbols are of use beside the source alone
install(TARGETS rotorloop RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT command)
install(DIRECTORY vehicles scenarios effects devices docs DESTINATION ${ROTORLOOP_SHARE} COMPONENT command)
install(FILES README.md DESTINATION ${ROTORLOOP_SHARE} COMPONENT command)
install(FILES LICENSE RENAME copyright DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/rotorloop COMPONENT command)
install(FILES CHANGELOG.md DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/rotorloop COMPONENT command)

# Adapters of CAN for whoever is logged in: udev reads it below /usr and /usr/local.
install(FILES host/bus/live/gs_usb/70-rotorloop-can.rules DESTINATION lib/udev/rules.d COMPONENT command)

# Both say what the command itself says of its options.
set(ROTORLOOP_MANUAL ${CMAKE_BINARY_DIR}/generated/rotorloop.1)
set(ROTORLOOP_COMPLETION ${CMAKE_BINARY_DIR}/generated/rotorloop.bash)
add_custom_command(OUTPUT ${ROTORLOOP_MANUAL} ${ROTORLOOP_COMPLETION} VERBATIM
  COMMAND ${Python3_EXECUTABLE} ${CMAKE_SOURCE_DIR}/cmake/man_page.py $<TARGET_FILE:rotorloop> ${ROTORLOOP_MANUAL}
  COMMAND rotorloop completion bash --out ${ROTORLOOP_COMPLETION} --force
  DEPENDS rotorloop ${CMAKE_SOURCE_DIR}/cmake/man_page.py COMMENT "Manual page and completion")
add_custom_target(rl_manual ALL DEPENDS ${ROTORLOOP_MANUAL} ${ROTORLOOP_COMPLETION})
install(FILES ${ROTORLOOP_MANUAL} DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT command)
install(FILES ${ROTORLOOP_COMPLETION} RENAME rotorloop DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions COMPONENT command)
