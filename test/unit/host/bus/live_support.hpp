// What tests of live buses share: a frame whose bytes all differ, and the message of what is refused.
#pragma once
#include <gtest/gtest.h>

#include <functional>
#include <string>

#include "host/base/error.hpp"
#include "host/bus/bus_frame.hpp"

namespace rotorloop::test {

inline BusFrame frame_of(std::uint32_t id, bool extended, std::size_t length, bool fd = false) {
  BusFrame f;
  f.id = id;
  f.extended = extended;
  f.fd = fd;
  f.bit_rate_switch = fd;
  f.length = static_cast<std::uint8_t>(length);
  for (std::size_t i = 0; i < length; ++i) f.data[i] = static_cast<std::uint8_t>(7 * i + 1);
  return f;
}

inline std::string refused(const std::function<void()>& action, ExitCode code = ExitCode::device) {
  try {
    action();
  } catch (const Error& e) {
    EXPECT_EQ(e.exit_code(), code) << e.what();
    return e.what();
  }
  return "nothing was refused";
}

}  // namespace rotorloop::test
