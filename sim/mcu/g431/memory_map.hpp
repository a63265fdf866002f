// Where the memories of the STM32G431 lie (RM0440, 2.2; category 2 devices).
#pragma once
#include <cstdint>

namespace rotorloop::mcu::g431 {

inline constexpr uint32_t kFlashBase = 0x08000000, kFlashBytes = 128 * 1024;
inline constexpr uint32_t kSramBase = 0x20000000, kSramBytes = 22 * 1024, kCcmBase = 0x10000000, kCcmBytes = 10 * 1024;
inline constexpr uint32_t kInformationBase = 0x1FFF0000, kInformationBytes = 32 * 1024;  // boot code, OTP, identity, option bytes

}  // namespace rotorloop::mcu::g431
