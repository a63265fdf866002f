// The public half of the key that signs releases. docs/security.md says how it is made and printed. All zeros:
// there is none yet, and a build that asks for a release key does not compile.
#pragma once
#include <algorithm>

#include "firmware/update/update_key.hpp"

namespace rotorloop::firmware {

inline constexpr UpdateKey kReleaseKey{KeyKind::release, {}};
inline constexpr bool kHasReleaseKey = std::any_of(kReleaseKey.key.begin(), kReleaseKey.key.end(), [](std::uint8_t b) { return b != 0; });

}  // namespace rotorloop::firmware
