# Debian packages only (scripts/packages.txt); system headers are not held to our warnings.
find_package(Eigen3 3.4 REQUIRED NO_MODULE)
find_package(fmt REQUIRED)
find_package(nlohmann_json REQUIRED)
find_package(CLI11 REQUIRED)
find_package(tomlplusplus REQUIRED)
find_package(GTest REQUIRED)
find_package(benchmark REQUIRED)
find_package(Ceres REQUIRED)
find_package(OpenSSL 3.0 REQUIRED COMPONENTS Crypto)
find_package(Threads REQUIRED)
# libmodbus (Debian's package has no CMake files): opens serial ports and TCP connections of instruments.
find_path(MODBUS_INCLUDE_DIR modbus/modbus.h REQUIRED)
find_library(MODBUS_LIBRARY modbus REQUIRED)
add_library(modbus::modbus UNKNOWN IMPORTED)
set_target_properties(modbus::modbus PROPERTIES IMPORTED_LOCATION ${MODBUS_LIBRARY} INTERFACE_INCLUDE_DIRECTORIES ${MODBUS_INCLUDE_DIR})
find_package(Python3 REQUIRED COMPONENTS Interpreter)
# cpp-httplib comes without a CMake package in Debian 12; its classes depend on the options that the library was compiled with.
find_path(ROTORLOOP_HTTPLIB_INCLUDE httplib.h REQUIRED)
find_library(ROTORLOOP_HTTPLIB cpp-httplib REQUIRED)
add_library(cpp-httplib::cpp-httplib SHARED IMPORTED)
set_target_properties(cpp-httplib::cpp-httplib PROPERTIES IMPORTED_LOCATION ${ROTORLOOP_HTTPLIB} INTERFACE_INCLUDE_DIRECTORIES ${ROTORLOOP_HTTPLIB_INCLUDE}
  INTERFACE_SYSTEM_INCLUDE_DIRECTORIES ${ROTORLOOP_HTTPLIB_INCLUDE}
  INTERFACE_COMPILE_DEFINITIONS "CPPHTTPLIB_OPENSSL_SUPPORT;CPPHTTPLIB_ZLIB_SUPPORT;CPPHTTPLIB_BROTLI_SUPPORT")
# libusb 1.0 (Debian's package has no CMake files): adapters of CAN without a kernel driver.
find_path(LIBUSB_INCLUDE_DIR libusb.h PATH_SUFFIXES libusb-1.0 REQUIRED)
find_library(LIBUSB_LIBRARY usb-1.0 REQUIRED)
add_library(libusb::libusb UNKNOWN IMPORTED)
set_target_properties(libusb::libusb PROPERTIES IMPORTED_LOCATION ${LIBUSB_LIBRARY} INTERFACE_INCLUDE_DIRECTORIES ${LIBUSB_INCLUDE_DIR})
