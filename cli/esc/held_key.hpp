// A dead-man's switch on a terminal: true while a key is held down, which a terminal shows by repeating it. The terminal is as before when
// this is gone.
#pragma once
#include <termios.h>

#include <cstdint>

namespace rotorloop::cli {

class HeldKey {
 public:
  static constexpr std::int64_t kLongestPause_ns = 1'000'000'000;  // keyboards wait up to about 0.7 s before they repeat

  HeldKey();
  ~HeldKey();
  HeldKey(const HeldKey&) = delete;
  HeldKey& operator=(const HeldKey&) = delete;
  bool pressed(std::int64_t now_ns);  // a key came since the last call, or within the pause

 private:
  termios before_{};
  bool changed_ = false;
  std::int64_t last_ns_ = INT64_MIN / 2;
};

}  // namespace rotorloop::cli
