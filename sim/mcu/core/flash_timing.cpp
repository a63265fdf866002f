// What fetches and loads wait for the flash of an STM32G4 (RM0440, 3.3.5 "Adaptive real-time memory accelerator"): 64-bit reads, prefetch
// of the next word, an instruction cache of 32 lines of 32 bytes and a data cache of 8. A model from the text of the manual: replacement
// in turn, a line filled word by word as it is read. Not checked on silicon.
#include "sim/mcu/core/core.hpp"

namespace rotorloop::mcu {
namespace {

constexpr uint32_t kWordsOfLine = 4;

// Where a line is; kLines where it is not. The one that came last is asked for most often.
template <size_t kLines>
uint32_t place_of(const FlashCache<kLines>& cache, uint32_t line) {
  const uint32_t last = (cache.next + kLines - 1) % kLines;
  if (cache.line[last] == line && cache.valid[last] != 0) return last;
  for (uint32_t i = 0; i < kLines; ++i)
    if (cache.line[i] == line && cache.valid[i] != 0) return i;
  return kLines;
}

// Whether a 64-bit word is in the cache; if not it is put there, and `left` is the line that had to leave.
template <size_t kLines>
bool cached(FlashCache<kLines>& cache, uint32_t word, uint32_t& left) {
  const uint32_t line = word / kWordsOfLine;
  const auto bit = static_cast<uint8_t>(1u << (word % kWordsOfLine));
  uint32_t place = place_of(cache, line);
  if (place == kLines) {
    place = cache.next;
    cache.next = (place + 1) % kLines;
    left = cache.line[place];
    cache.line[place] = line;
    cache.valid[place] = 0;
  }
  const bool hit = (cache.valid[place] & bit) != 0;
  cache.valid[place] |= bit;
  return hit;
}

}  // namespace

void Core::add_waits(uint32_t cycles) {
  state.flash_waits += cycles;
  if (clocking_ == Clocking::flash) state.cycle += cycles;
}

// Called when an instruction ends in another 64-bit word than the one before it.
void Core::wait_for_flash_code(uint32_t pc, uint32_t last_word) {
  FlashPortState& f = state.flash;
  const uint32_t first_word = pc >> 3;
  const bool straight_on = first_word == f.current_word;
  if (!memories_->at(pc).behind_flash_port) {
    f.current_word = last_word;
    return;
  }
  const uint64_t now = state.cycle + (clocking_ == Clocking::flash ? 0 : state.flash_waits);
  for (uint32_t word = straight_on ? last_word : first_word; word <= last_word; ++word) {
    if (word == f.prefetched_word) {
      if (f.prefetch_ready_cycle > now) add_waits(static_cast<uint32_t>(f.prefetch_ready_cycle - now));
    } else {
      uint32_t left = ~0u;
      const bool hit = cached(f.code, word, left);
      for (uint32_t i = 0; left != ~0u && i < kWordsOfLine; ++i)
        if (uint32_t& known = ready_words_[(left * kWordsOfLine + i) % ready_words_.size()]; known == left * kWordsOfLine + i) known = ~0u;
      ready_words_[word % ready_words_.size()] = word;
      if (hit) continue;  // it starts no prefetch: the flash stays free for data
      add_waits(wait_states_);
    }
    f.prefetched_word = word + 1;
    f.prefetch_ready_cycle = state.cycle + (clocking_ == Clocking::flash ? 0 : state.flash_waits) + wait_states_ + 1;
  }
  f.current_word = last_word;
}

void Core::wait_for_flash_data(uint32_t address) {
  FlashPortState& f = state.flash;
  uint32_t left = 0;
  if (wait_states_ != 0 && !cached(f.data, address >> 3, left)) add_waits(wait_states_);
}

}  // namespace rotorloop::mcu
