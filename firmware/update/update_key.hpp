// Whose images a program accepts: the public key that is compiled in, and what the node says about it.
#pragma once
#include <cstdint>

#include "firmware/update/signature.hpp"

namespace rotorloop::firmware {

enum class KeyKind : std::uint8_t {
  none,     // for one's own board: any image that is whole
  test,     // its private half is in this repository: it protects nothing
  release,  // its private half is with who makes releases (release_key.hpp)
};

struct UpdateKey {
  KeyKind kind = KeyKind::none;
  PublicKey key{};
};

inline constexpr UpdateKey kNoKey{};
// Its private half is the 32 characters "rotorloop test key, not a secret" (scripts/firmware_image.py).
inline constexpr UpdateKey kTestKey{KeyKind::test,
                                    {0x63, 0x1e, 0x69, 0xd8, 0x75, 0x97, 0xde, 0x6d, 0x63, 0x31, 0x61, 0xc0, 0x09, 0x68, 0xcb, 0xbc,
                                     0x04, 0xcf, 0xd1, 0x38, 0xd7, 0x66, 0x1b, 0xba, 0xbf, 0xa6, 0x13, 0xa7, 0x80, 0xb1, 0xed, 0xeb}};

// Behind the name in GetNodeInfo, whose characters are a to z, 0 to 9, dot, dash, underscore.
constexpr const char* key_name_suffix(KeyKind kind) {
  return kind == KeyKind::none ? ".unsigned_accepted" : kind == KeyKind::test ? ".test_key" : "";
}
// In a LogMessage of every update that begins; empty for a release key.
constexpr const char* key_warning(KeyKind kind) {
  return kind == KeyKind::none   ? "unsigned accepted: this program has no key"
         : kind == KeyKind::test ? "test key: anybody can sign for this program"
                                 : "";
}

}  // namespace rotorloop::firmware
