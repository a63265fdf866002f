#include "firmware/app/b_g431b_esc1/faults.hpp"

#include <bit>

#include "firmware/board/g431/flash.hpp"

namespace rotorloop::b_g431b_esc1 {
namespace {

constexpr std::uint32_t kRecords = g431::kPageBytes / sizeof(FaultRecord), kBase = kFaultPage * g431::kPageBytes;

// The first place whose bytes are all erased; kRecords when there is none.
std::uint32_t free_place() {
  for (std::uint32_t n = 0; n < kRecords; ++n) {
    std::array<std::uint8_t, sizeof(FaultRecord)> bytes{};
    if (!g431::read_flash(kBase + n * static_cast<std::uint32_t>(bytes.size()), bytes)) continue;  // torn: passed over
    bool erased = true;
    for (const std::uint8_t b : bytes) erased = erased && b == 0xFF;
    if (erased) return n;
  }
  return kRecords;
}

}  // namespace

bool keep_fault_record(const FaultRecord& record) {
  std::uint32_t place = free_place();
  if (place == kRecords) {
    if (!g431::erase_page(kFaultPage, nullptr)) return false;
    place = 0;
  }
  const auto words = std::bit_cast<std::array<std::uint64_t, sizeof(FaultRecord) / 8>>(record);
  bool kept = true;
  for (std::uint32_t i = 0; i < words.size(); ++i)
    kept = g431::program_word(kBase + place * static_cast<std::uint32_t>(sizeof record) + 8 * i, words[i], nullptr) && kept;
  return kept;
}

}  // namespace rotorloop::b_g431b_esc1
