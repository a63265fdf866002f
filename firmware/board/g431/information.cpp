#include "firmware/board/g431/information.hpp"

#include "firmware/board/g431/flash.hpp"
#include "firmware/board/g431/rcc.hpp"

namespace rotorloop::g431 {

std::array<std::uint8_t, 16> unique_id() {
  std::array<std::uint8_t, 16> id{};
  for (std::size_t i = 0; i < 12; ++i) id[i] = static_cast<std::uint8_t>(unique_id_registers().word[i / 4].read() >> (8u * (i % 4)));
  return id;
}

firmware::ResetCause take_reset_cause() {
  const std::uint32_t flags = rcc().csr.read();
  rcc().csr.set(rcc_bits::kClearResetFlags);
  return reset_cause_of(flags);
}

OptionBytes read_options() { return {flash_registers().optr.read(), flash_registers().wrp1ar.read()}; }

bool write_options(const OptionBytes& options) {
  using namespace flash_bits;
  FlashRegisters& f = flash_registers();
  f.keyr.write(kKey1);
  f.keyr.write(kKey2);
  f.optkeyr.write(kOptionKey1);
  f.optkeyr.write(kOptionKey2);
  if (f.cr.has(kOptionLock)) return false;
  f.optr.write(options.optr);
  f.wrp1ar.write(options.wrp1ar);
  f.cr.set(kOptionStart);
  if (!wait_for([&] { return !f.sr.has(kBusy); }, 1'000'000)) return false;
  f.cr.set(kOptionLaunch);  // resets
  return false;
}

}  // namespace rotorloop::g431
