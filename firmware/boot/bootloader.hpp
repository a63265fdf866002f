// What runs after every reset, over any flash and any bus: an update when its record says so, the application when it is whole, and else a
// node that waits on the bus for an image and says why.
//   Bootloader boot(flash, config);
//   loop: while (frame) boot.on_frame(frame, now); boot.poll(now); while (mailbox free) send(boot.next_frame()); boot.next(now)
// On the bus it is the node that the application is: the same unique id, the id that is stored or else one from an allocator.
#pragma once
#include <array>
#include <cstdint>
#include <optional>

#include "firmware/boot/handover.hpp"
#include "firmware/update/updater.hpp"

namespace rotorloop::firmware {

// Why it does not start the application. In NodeStatus as vendor code kWaiting + reason, in words as LogMessage.
enum class BootReason : std::uint8_t {
  none,  // it does, or will
  update,
  no_application,
  damaged_application,
  wrong_vectors,
  failing_application,
  button,
};
inline constexpr std::uint16_t kWaiting = 0x8000;

constexpr const char* boot_reason_text(BootReason reason) {
  constexpr std::array<const char*, 7> kTexts{"starting the application",
                                              "update under way",
                                              "waiting for an image: there is no application",
                                              "waiting for an image: the application is damaged",
                                              "waiting for an image: stack pointer or entry of the application is no such address",
                                              "waiting for an image: the application failed three times in a row within 10 s",
                                              "waiting for an image: the button was held at power-up"};
  return kTexts[static_cast<std::size_t>(reason)];
}

// Where a stack and an entry may be; of the STM32G431.
struct BootMemory {
  std::uint32_t flash = 0x0800'0000, ram = 0x2000'0000, ram_bytes = 32 * 1024, fast_ram = 0x1000'0000, fast_ram_bytes = 10 * 1024;
};

struct BootConfig {
  UpdaterConfig updater{};  // own_id: as the application has stored it; 0: an allocator is asked
  ResetCause cause = ResetCause::unknown;
  std::uint8_t failures = 0;  // failures_after()
  bool button = false;        // held
  BootMemory memory{};
};

enum class BootStep : std::uint8_t {
  stay,
  start,  // the application, as the chip is after a reset
  reset,  // decide anew: an update has ended
};

template <UpdateFlash Flash>
class Bootloader {
 public:
  static constexpr std::uint64_t kWindow_us = 100'000;  // after a power-up: time for a BeginFirmwareUpdate
  static constexpr std::uint64_t kSayAgain_us = 10'000'000;

  Bootloader(Flash& flash, const BootConfig& config)
      : flash_(flash),
        layout_(config.updater.layout),
        memory_(config.memory),
        first_(config.failures >= Handover::kMostFailures   ? BootReason::failing_application
               : config.button && at_power_up(config.cause) ? BootReason::button
                                                            : BootReason::none),
        window_us_(at_power_up(config.cause) ? kWindow_us : 0),
        updater_(flash, config.updater) {
    vectors_are_right_ = vectors_right();
  }

  void on_frame(const CanFrame& frame, std::uint64_t now_us) { updater_.on_frame(frame, now_us); }
  std::optional<CanFrame> next_frame() { return updater_.next_frame(); }

  void poll(std::uint64_t now_us) {
    if (!started_) {
      started_ = true;
      end_of_window_us_ = now_us + window_us_;
    }
    const BootReason why = reason();
    updater_.set_waiting(static_cast<std::uint16_t>(kWaiting + static_cast<unsigned>(why)),
                         why == BootReason::none || why == BootReason::button ? protocols::Health::ok : protocols::Health::error);
    updater_.poll(now_us);
    if (why == said_ && now_us < say_again_us_) return;
    if (why == BootReason::none || why == BootReason::update || updater_.own_id() == 0) return;
    said_ = why;
    say_again_us_ = now_us + kSayAgain_us;
    updater_.say(protocols::LogMessage::Level::warning, boot_reason_text(why), now_us);
  }

  BootReason reason() const {
    if (updater_.has_job()) return BootReason::update;
    if (!updater_.may_start()) return first_word_missing() ? BootReason::no_application : BootReason::damaged_application;
    return vectors_are_right_ ? first_ : BootReason::wrong_vectors;
  }

  // After poll().
  BootStep next(std::uint64_t now_us) const {
    if (updater_.finished(now_us)) return BootStep::reset;
    if (updater_.has_job() || reason() != BootReason::none) return BootStep::stay;
    return now_us >= end_of_window_us_ ? BootStep::start : BootStep::stay;
  }
  // Whether the application that failed before is no longer there.
  bool installed_another() const { return updater_.end() == UpdateEnd::installed; }

  Updater<Flash>& updater() { return updater_; }

 private:
  static constexpr bool at_power_up(ResetCause cause) {
    return cause == ResetCause::power_on || cause == ResetCause::brown_out || cause == ResetCause::pin;
  }

  bool first_word_missing() const {
    std::array<std::uint8_t, 4> b{};
    return flash_.flash_read(layout_.first_page, 0, b) && detail::little_endian(b, 0, 4) != kImageMagic;
  }
  // The first two words of the payload, as the processor takes them: a stack pointer in a RAM, a Thumb address in the payload.
  bool vectors_right() const {
    std::array<std::uint8_t, 8> b{};
    if (!updater_.application() || !flash_.flash_read(layout_.first_page, kImageHeaderBytes, b)) return true;  // told otherwise
    const auto stack = static_cast<std::uint32_t>(detail::little_endian(b, 0, 4));
    const auto entry = static_cast<std::uint32_t>(detail::little_endian(b, 4, 4));
    const std::uint32_t first = memory_.flash + layout_.first_page * Flash::kFlashPageBytes + kImageHeaderBytes;
    const bool in_ram = (stack > memory_.ram && stack <= memory_.ram + memory_.ram_bytes) ||
                        (stack > memory_.fast_ram && stack <= memory_.fast_ram + memory_.fast_ram_bytes);
    return in_ram && stack % 8 == 0 && entry % 2 == 1 && entry > first && entry < first + updater_.application()->size;
  }

  Flash& flash_;
  UpdateLayout layout_;
  BootMemory memory_;
  BootReason first_, said_ = BootReason::none;
  std::uint64_t window_us_, end_of_window_us_ = 0, say_again_us_ = 0;
  Updater<Flash> updater_;
  bool started_ = false, vectors_are_right_ = true;
};

}  // namespace rotorloop::firmware
