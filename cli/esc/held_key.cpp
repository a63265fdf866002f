#include "cli/esc/held_key.hpp"

#include <poll.h>
#include <unistd.h>

#include <array>

namespace rotorloop::cli {

HeldKey::HeldKey() {
  if (::tcgetattr(STDIN_FILENO, &before_) != 0) return;
  termios single = before_;
  single.c_lflag &= static_cast<tcflag_t>(~(ICANON | ECHO));  // keys at once; Ctrl-C still interrupts
  changed_ = ::tcsetattr(STDIN_FILENO, TCSANOW, &single) == 0;
}

HeldKey::~HeldKey() {
  if (!changed_) return;
  ::tcflush(STDIN_FILENO, TCIFLUSH);
  ::tcsetattr(STDIN_FILENO, TCSANOW, &before_);
}

bool HeldKey::pressed(std::int64_t now_ns) {
  pollfd input{.fd = STDIN_FILENO, .events = POLLIN, .revents = 0};
  while (::poll(&input, 1, 0) > 0 && (input.revents & POLLIN) != 0) {
    std::array<char, 64> keys{};
    if (::read(STDIN_FILENO, keys.data(), keys.size()) <= 0) break;
    last_ns_ = now_ns;
  }
  return now_ns - last_ns_ < kLongestPause_ns;
}

}  // namespace rotorloop::cli
