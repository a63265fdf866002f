// What the compiler calls by itself. Words where both ends are words; nothing of it may become a call of itself.
#include <cstddef>
#include <cstdint>

extern "C" {

void* memcpy(void* __restrict to, const void* __restrict from, std::size_t bytes);
void* memmove(void* to, const void* from, std::size_t bytes);
void* memset(void* to, int value, std::size_t bytes);
int memcmp(const void* a, const void* b, std::size_t bytes);

void* memcpy(void* __restrict to, const void* __restrict from, std::size_t bytes) {
  auto* t = static_cast<std::uint8_t*>(to);
  const auto* f = static_cast<const std::uint8_t*>(from);
  if (((reinterpret_cast<std::uintptr_t>(t) | reinterpret_cast<std::uintptr_t>(f)) & 3u) == 0) {
    for (; bytes >= 4; bytes -= 4, t += 4, f += 4) *reinterpret_cast<std::uint32_t*>(t) = *reinterpret_cast<const std::uint32_t*>(f);
  }
  for (; bytes != 0; --bytes) *t++ = *f++;
  return to;
}

void* memmove(void* to, const void* from, std::size_t bytes) {
  auto* t = static_cast<std::uint8_t*>(to);
  const auto* f = static_cast<const std::uint8_t*>(from);
  if (t < f) {
    for (; bytes != 0; --bytes) *t++ = *f++;
  } else {
    for (; bytes != 0; --bytes) t[bytes - 1] = f[bytes - 1];
  }
  return to;
}

void* memset(void* to, int value, std::size_t bytes) {
  auto* t = static_cast<std::uint8_t*>(to);
  const auto byte = static_cast<std::uint8_t>(value);
  if ((reinterpret_cast<std::uintptr_t>(t) & 3u) == 0) {
    for (const std::uint32_t word = byte * 0x01010101u; bytes >= 4; bytes -= 4, t += 4) *reinterpret_cast<std::uint32_t*>(t) = word;
  }
  for (; bytes != 0; --bytes) *t++ = byte;
  return to;
}

int memcmp(const void* a, const void* b, std::size_t bytes) {
  const auto *x = static_cast<const std::uint8_t*>(a), *y = static_cast<const std::uint8_t*>(b);
  for (; bytes != 0; --bytes, ++x, ++y) {
    if (*x != *y) return *x < *y ? -1 : 1;
  }
  return 0;
}

int __aeabi_atexit(void*, void (*)(void*), void*);
int __aeabi_atexit(void*, void (*)(void*), void*) { return 0; }  // nothing here ever ends
extern void* __dso_handle;
void* __dso_handle = nullptr;

}  // extern "C"
