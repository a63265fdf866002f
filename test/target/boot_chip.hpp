// The linked bootloader on the emulated chip and its board, with a tool on the same virtual bus. The chip moves the bus.
#pragma once
#include <algorithm>
#include <cmath>
#include <cstring>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "firmware/core/node/parameter_store.hpp"
#include "firmware/update/image.hpp"
#include "firmware/update/update_record.hpp"
#include "host/base/toml_file.hpp"
#include "host/tools/firmware_update.hpp"
#include "protocols/crc.hpp"
#include "sim/mcu/board/esc_board.hpp"
#include "sim/mcu/elf/elf_file.hpp"
#include "sim/mcu/g431/blocks.hpp"
#include "sim/mcu/g431/fdcan/virtual_bus_medium.hpp"
#include "test/unit/firmware/update/signer.hpp"

namespace rotorloop::boot_chip {

inline std::string boot_elf, application_elf, release_boot_elf;  // as the command line names them

using namespace mcu;
using namespace mcu::g431;

inline constexpr std::uint8_t kNode = 42;
inline constexpr std::uint32_t kArea = 0x0800'6000, kRecordPage = 60, kParameterPage = 62, kPage = 2048;

// Flash of the chip while it has no power, as a programmer writes it. Pages from `first` on.
class ProgrammedFlash {
 public:
  static constexpr std::uint32_t kFlashPageBytes = kPage;
  ProgrammedFlash(Chip& chip, std::uint32_t first) : chip_(chip), first_(first) {}
  bool flash_read(std::uint32_t page, std::uint32_t offset, std::span<std::uint8_t> out) const {
    std::copy_n(at(page, offset), out.size(), out.begin());
    return true;
  }
  bool flash_erase(std::uint32_t page) { return std::fill_n(at(page, 0), kPage, std::uint8_t{0xFF}), true; }
  bool flash_program(std::uint32_t page, std::uint32_t offset, std::uint64_t word) { return std::memcpy(at(page, offset), &word, 8), true; }

 private:
  std::uint8_t* at(std::uint32_t page, std::uint32_t offset) const { return &chip_.flash()[(first_ + page) * kPage + offset]; }
  Chip& chip_;
  std::uint32_t first_;
};

inline std::vector<std::uint8_t> test_signed(std::vector<std::uint8_t> image) {
  return firmware::Signer::test_key().signed_image(std::move(image));
}
// An image whose program is given as half words behind 512 bytes of vectors. Not signed.
inline std::vector<std::uint8_t> unsigned_image_of(std::vector<std::uint16_t> code, std::uint32_t size, std::uint32_t stack,
                                                   std::uint32_t security_version) {
  std::vector<std::uint8_t> image(firmware::kImageHeaderBytes + size, 0xFF);
  for (std::uint32_t i = 0; i < size; ++i) image[firmware::kImageHeaderBytes + i] = static_cast<std::uint8_t>(i * 31 + i / 256);
  const std::uint32_t entry = kArea + firmware::kImageHeaderBytes + 512 + 1;
  std::memcpy(&image[firmware::kImageHeaderBytes], &stack, 4);
  std::memcpy(&image[firmware::kImageHeaderBytes + 4], &entry, 4);
  std::memcpy(&image[firmware::kImageHeaderBytes + 512], code.data(), 2 * code.size());
  protocols::Crc64 crc;
  crc.add(std::span<const std::uint8_t>(image).subspan(firmware::kImageHeaderBytes));
  const firmware::ImageHeader h{
      .board = firmware::board_name("b_g431b_esc1"), .size = size, .security_version = security_version, .major = 1, .crc = crc.value()};
  firmware::write_image_fields(h, image);
  return image;
}
inline std::vector<std::uint8_t> image_of(std::vector<std::uint16_t> code, std::uint32_t size, std::uint32_t stack = 0x2000'2000,
                                          std::uint32_t security_version = 0) {
  return test_signed(unsigned_image_of(std::move(code), size, stack, security_version));
}
// Feeds the watchdog for ever: movw r0, 0x3000; movt r0, 0x4000; movw r1, 0xAAAA; str r1, [r0]; b to the store.
inline std::vector<std::uint16_t> lives() { return {0xF243, 0x0000, 0xF2C4, 0x0000, 0xF64A, 0x21AA, 0x6001, 0xE7FD}; }
inline std::vector<std::uint16_t> hangs() { return {0xE7FE}; }
inline std::vector<std::uint16_t> crashes() { return {0xDE00}; }  // udf: a fault before there is a handler

inline void load_program(Chip& chip, const std::string& elf) {
  for (const ElfSection& s : read_elf(elf).sections)
    if (!s.bytes.empty())
      std::copy(s.bytes.begin(), s.bytes.end(), chip.memory(s.load_address, static_cast<std::uint32_t>(s.bytes.size())));
}
inline void store_node_id(Chip& chip, std::uint8_t id) {
  firmware::Parameters p;
  p.node_id = id;
  ProgrammedFlash pages(chip, kParameterPage);
  firmware::ParameterStore(pages).save(p);
}
// As an application leaves it that was asked to update by the tool.
inline void write_job(Chip& chip) {
  ProgrammedFlash pages(chip, 0);
  firmware::UpdateRecord(pages, kRecordPage).begin({.server = 126, .own_id = kNode, .path = "fw"});
}

// A virtual bus with a tool's port on it, and what the tool sees of it. Who has the chips moves it in wait_until().
class ToolBus : public TimedBus {
 public:
  SendStatus send_any(const BusFrame& f) override { return port_.send(*f.classic()); }
  std::optional<StampedBusFrame> receive_any() override {
    take();
    return std::exchange(waiting_, std::nullopt);
  }
  BusState state() const override { return port_.state(); }
  PortCounters counters() const override { return port_.counters(); }
  std::string name() const override { return "chips:"; }

  sim::VirtualBus bus;

 protected:
  explicit ToolBus(sim::BusConfig config) : bus(std::move(config)), port_(bus.attach({.name = "tool"})) {}
  // A frame is there to be received.
  bool take() {
    if (waiting_) return true;
    if (const auto f = port_.receive()) waiting_ = StampedBusFrame{.frame = BusFrame(f->frame), .time_ns = f->time_ns};
    return waiting_.has_value();
  }

 private:
  CanBus& port_;
  std::optional<StampedBusFrame> waiting_;
};

class BootChip : public ToolBus {
 public:
  explicit BootChip(const std::string& program, std::vector<sim::BusFault> faults = {}, std::uint64_t seed = 1)
      : ToolBus({.seed = seed, .faults = std::move(faults)}),
        medium_(bus, chip.blocks().fdcan, true),
        board(read_board(TomlFile::read(ROTORLOOP_SOURCE_DIR "/vehicles/boards/b_g431b_esc1.toml")), {}, chip, 1) {
    load_program(chip, program);
    store_node_id(chip, kNode);
    board.press(false);
    board.drive().set_bus_V(14.8);
  }
  void install(const std::vector<std::uint8_t>& image) { std::copy(image.begin(), image.end(), chip.memory(kArea, 1)); }
  void write_job() { boot_chip::write_job(chip); }
  bool holds(const std::vector<std::uint8_t>& image) { return std::equal(image.begin(), image.end(), chip.memory(kArea, 1)); }
  bool in_application() { return chip.core().state.r[kPc] >= kArea && chip.core().state.r[kPc] < kArea + 48 * kPage; }

  // False: the power was cut, or the program did what the chip does not have.
  bool run_to(std::int64_t time_ns) {
    while (end == End::at_cycle && now_ns() < time_ns) {
      const std::int64_t next = std::min(time_ns, now_ns() + 200'000);
      // The controller hears what the tool has sent frame by frame, not all of it at the program's next access.
      chip.reschedule(chip.blocks().fdcan);
      end = chip.run_until(std::max(chip.cycle_at(static_cast<double>(next) * 1e-9), chip.cycle() + 1));
      bus.set_now(std::max(bus.now_ns(), chip_ns()));
      board.advance();
      if (take()) break;
    }
    return end == End::at_cycle;
  }

  void run_to_cycle(std::uint64_t cycle) {
    end = chip.run_until(cycle);
    bus.set_now(std::max(bus.now_ns(), chip_ns()));
  }

  // TimedBus
  std::int64_t now_ns() const override { return std::max(bus.now_ns(), chip_ns()); }
  void wait_until(std::int64_t deadline_ns) override {
    run_to(deadline_ns);
    if (end != End::at_cycle) bus.set_now(std::max(bus.now_ns(), deadline_ns));
  }

  Chip chip;
  VirtualBusMedium medium_;
  EscBoard board;
  End end = End::at_cycle;

 private:
  std::int64_t chip_ns() const { return std::llround(chip.time_s() * 1e9); }
};

}  // namespace rotorloop::boot_chip
