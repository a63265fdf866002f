// The public half of the key that signs releases: its 32 bytes, put in by the build from a PEM file (-DROTORLOOP_RELEASE_KEY=PUBLIC.pem;
// docs/security.md). Without one they are zeros, and a build that asks for a release key does not compile.
#pragma once
#include <algorithm>

#include "firmware/update/update_key.hpp"

#ifndef ROTORLOOP_RELEASE_KEY
#define ROTORLOOP_RELEASE_KEY 0
#endif

namespace rotorloop::firmware {

inline constexpr UpdateKey kReleaseKey{KeyKind::release, {ROTORLOOP_RELEASE_KEY}};
inline constexpr bool kHasReleaseKey = std::any_of(kReleaseKey.key.begin(), kReleaseKey.key.end(), [](std::uint8_t b) { return b != 0; });
static_assert(kReleaseKey.key != kTestKey.key, "everybody has the private half of the test key");

}  // namespace rotorloop::firmware
