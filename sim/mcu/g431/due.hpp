// When each block has its next event, and whose is the first: a tree of minima, for the first is asked for far more often than a search
// among all blocks could be afforded.
#pragma once
#include <array>
#include <cstdint>

namespace rotorloop::mcu::g431 {

class Due {
 public:
  static constexpr uint32_t kBlocks = 64;
  Due() { cycles_.fill(~uint64_t{0}); }
  void set(uint32_t block, uint64_t cycle) {
    uint32_t n = kBlocks + block;
    cycles_[n] = cycle;
    while ((n >>= 1) != 0) {
      const uint64_t least = cycles_[2 * n + 1] < cycles_[2 * n] ? cycles_[2 * n + 1] : cycles_[2 * n];
      if (cycles_[n] == least) return;
      cycles_[n] = least;
    }
  }
  uint64_t first() const { return cycles_[1]; }
  // The block of that event; of several at one cycle, the one that comes first in the order of blocks.
  uint32_t whose() const {
    uint32_t n = 1;
    while (n < kBlocks) n = 2 * n + (cycles_[2 * n] == cycles_[1] ? 0 : 1);
    return n - kBlocks;
  }

 private:
  std::array<uint64_t, 2 * kBlocks> cycles_{};  // of node n the least of 2 n and 2 n + 1; leaves from kBlocks on
};

}  // namespace rotorloop::mcu::g431
