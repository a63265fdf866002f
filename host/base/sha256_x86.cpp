// SHA-256 with the SHA extensions of x86. Only the function that the CPU was asked for uses them, so the rest of the program runs
// on any x86-64; on another architecture this file says that there are none.
#include "host/base/sha256_blocks.hpp"

#if defined(__x86_64__)
#include <cpuid.h>
#include <immintrin.h>

namespace rotorloop::detail {
namespace {

// Four rounds at a time. The instructions keep the state as a, b, e, f and c, d, g, h, highest word first.
__attribute__((target("sha,sse4.1"))) void blocks(Sha256State& state, const std::uint8_t* data, std::size_t count) {
  const auto word = [&](std::size_t i) { return static_cast<int>(state[i]); };
  __m128i abef = _mm_set_epi32(word(0), word(1), word(4), word(5));
  __m128i cdgh = _mm_set_epi32(word(2), word(3), word(6), word(7));
  const __m128i big_endian = _mm_set_epi8(12, 13, 14, 15, 8, 9, 10, 11, 4, 5, 6, 7, 0, 1, 2, 3);
  for (; count > 0; --count, data += 64) {
    const __m128i abef_before = abef, cdgh_before = cdgh;
    __m128i w[4];  // the last 16 words of the message schedule
#pragma GCC unroll 16
    for (int i = 0; i < 16; ++i) {
      __m128i& now = w[i & 3];
      if (i < 4) {
        now = _mm_shuffle_epi8(_mm_loadu_si128(reinterpret_cast<const __m128i*>(data + 16 * i)), big_endian);
      } else {
        const __m128i &next = w[(i + 1) & 3], &last = w[(i + 3) & 3];
        const __m128i seven_before = _mm_alignr_epi8(last, w[(i + 2) & 3], 4);
        now = _mm_sha256msg2_epu32(_mm_add_epi32(_mm_sha256msg1_epu32(now, next), seven_before), last);
      }
      const __m128i keyed = _mm_add_epi32(now, _mm_load_si128(reinterpret_cast<const __m128i*>(kSha256Rounds.data() + 4 * i)));
      cdgh = _mm_sha256rnds2_epu32(cdgh, abef, keyed);
      abef = _mm_sha256rnds2_epu32(abef, cdgh, _mm_shuffle_epi32(keyed, 0x0E));
    }
    abef = _mm_add_epi32(abef, abef_before);
    cdgh = _mm_add_epi32(cdgh, cdgh_before);
  }
  const auto put = [&](std::size_t i, int value) { state[i] = static_cast<std::uint32_t>(value); };
  put(0, _mm_extract_epi32(abef, 3)), put(1, _mm_extract_epi32(abef, 2));
  put(4, _mm_extract_epi32(abef, 1)), put(5, _mm_extract_epi32(abef, 0));
  put(2, _mm_extract_epi32(cdgh, 3)), put(3, _mm_extract_epi32(cdgh, 2));
  put(6, _mm_extract_epi32(cdgh, 1)), put(7, _mm_extract_epi32(cdgh, 0));
}

bool cpu_has_sha() {
  constexpr unsigned kExtendedFeatures = 7, kShaBit = 1u << 29;  // of EBX
  unsigned eax = 0, ebx = 0, ecx = 0, edx = 0;
  return __get_cpuid_count(kExtendedFeatures, 0, &eax, &ebx, &ecx, &edx) != 0 && (ebx & kShaBit) != 0 && __builtin_cpu_supports("sse4.1");
}

}  // namespace

Sha256Blocks sha256_blocks_of_cpu() {
  static const Sha256Blocks found = cpu_has_sha() ? &blocks : nullptr;
  return found;
}

}  // namespace rotorloop::detail

#else

namespace rotorloop::detail {
Sha256Blocks sha256_blocks_of_cpu() { return nullptr; }
}  // namespace rotorloop::detail

#endif
