// What an updater is told, how an update ends, and what it counts.
#pragma once
#include <array>
#include <cstdint>

#include "firmware/update/application_area.hpp"
#include "firmware/update/image.hpp"
#include "firmware/update/update_key.hpp"

namespace rotorloop::firmware {

struct UpdaterConfig {
  std::array<char, 16> board = board_name("b_g431b_esc1");
  const char* name = "org.rotorloop.esc";
  std::array<std::uint8_t, 16> unique_id{};
  std::uint8_t own_id = 0;  // when no job says it: as stored by the application; 0: an allocator is asked
  UpdateLayout layout{};
  UpdateKey key = kNoKey;  // whose images it takes; said in GetNodeInfo, behind the name, and at every update
};

enum class UpdateEnd : std::uint8_t {
  none,
  installed,  // the new image is whole
  refused,    // by its header: image_fault()
  failed,     // no answer for 30 s, or an error of the server: the old image is untouched
};

struct UpdateCounters {
  std::uint32_t blocks = 0;    // good ones
  std::uint32_t repeated = 0;  // requests after a time-out
  std::uint32_t stray = 0;     // answers to nothing that was asked
  std::uint32_t flash_errors = 0;
  std::uint32_t resumed_pages = 0;  // found in place after a reset
};

}  // namespace rotorloop::firmware
