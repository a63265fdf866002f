#include "host/tools/bridge.hpp"

namespace rotorloop::tools {

std::size_t Bridge::forward(std::size_t limit) {
  std::size_t forwarded = 0;
  for (bool any = true; any && forwarded < limit;) {
    any = false;
    for (std::size_t from = 0; from < buses_.size(); ++from) {
      const auto received = buses_[from]->receive_any();
      if (!received) continue;
      any = true;
      ++forwarded;
      ++counters_[from].taken;
      if (tap_) tap_(from, *received);
      for (std::size_t to = 0; to < buses_.size(); ++to) {
        if (to == from) continue;
        ++(buses_[to]->send_any(received->frame) == SendStatus::queued ? counters_[to].given : counters_[to].refused);
      }
    }
  }
  return forwarded;
}

}  // namespace rotorloop::tools
