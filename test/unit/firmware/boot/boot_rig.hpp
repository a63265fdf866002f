// A chip in its simplest form around a bootloader: flash, 8 bytes of RAM that outlive a reset, a bus of 1 Mbit/s with a file server.
#pragma once
#include <algorithm>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "firmware/boot/bootloader.hpp"
#include "test/unit/firmware/update/update_rig.hpp"

namespace rotorloop::firmware {

inline constexpr std::uint32_t kStackTop = 0x2000'2000, kEntry = 0x0800'6200 + 0x201;

// An image whose first two words are a stack pointer and an entry.
inline std::vector<std::uint8_t> bootable(const ImageOptions& o, std::uint32_t stack = kStackTop, std::uint32_t entry = kEntry) {
  auto image = make_image(o);
  put_little_endian(image, kImageHeaderBytes, stack, 4);
  put_little_endian(image, kImageHeaderBytes + 4, entry, 4);
  protocols::Crc64 payload, header;
  payload.add(std::span<const std::uint8_t>(image).subspan(kImageHeaderBytes));
  put_little_endian(image, 40, payload.value(), 8);
  header.add(std::span<const std::uint8_t>(image).first(48));
  put_little_endian(image, 48, header.value(), 8);
  return image;
}

class BootRig {
 public:
  EmulatedFlash flash{64};
  FileServer server;
  BootConfig config;
  Handover ram;
  std::unique_ptr<Bootloader<EmulatedFlash>> boot;
  std::uint64_t now_us = 1'000'000, began_us = 0;
  bool started = false;  // the application runs
  int resets = 0;
  std::vector<CanFrame> sent;  // by the bootloader

  BootRig() { config.updater.own_id = kNode; }

  void install(const std::vector<std::uint8_t>& image) {
    for (std::uint32_t p = 0; p < config.updater.layout.pages; ++p) flash.flash_erase(config.updater.layout.first_page + p);
    ApplicationArea area(flash, config.updater.layout);
    area.program(0, image);
    area.release(std::span<const std::uint8_t>(image).first(8));
  }
  // What an application does before it resets.
  void hand_over() {
    UpdateRecord(flash, config.updater.layout.record_page).begin({.server = kServer, .own_id = kNode, .path = "fw.bin"});
    ram = {.stage = BootStage::restart};
  }
  // Of any length, as a program may send it that does not keep to what a path has room for.
  void begin_update(const std::string& path = "fw.bin") {
    std::vector<std::uint8_t> payload{0};  // the server is the caller
    payload.insert(payload.end(), path.begin(), path.end());
    using protocols::TransferKind;
    protocols::encode_transfer({.kind = TransferKind::request,
                                .priority = 24,
                                .data_type_id = protocols::BeginFirmwareUpdate::kType.id,
                                .source = kServer,
                                .destination = boot->updater().own_id()},
                               protocols::BeginFirmwareUpdate::kType.crc_seed(), transfer_.next(), payload, [&](const CanFrame& f) {
                                 to_boot_.push_back(f);
                                 return true;
                               });
  }
  void hear(const CanFrame& f) { to_boot_.push_back(f); }

  void reset(ResetCause cause) {
    config.cause = cause;
    config.failures = failures_after(cause, ram);
    ram = {.failures = config.failures, .cause = cause};
    boot = std::make_unique<Bootloader<EmulatedFlash>>(flash, config);
    to_server_.clear();
    to_boot_.clear();
    busy_us_ = flash.busy_us();
    began_us = now_us;
    started = false;
    ++resets;
  }

  // Until the application runs, the power is cut, or the time is over. As main.cpp of a board has it.
  void run(double most_s) {
    const std::uint64_t end_us = now_us + static_cast<std::uint64_t>(most_s * 1e6);
    while (now_us < end_us && flash.powered() && !started) {
      boot->poll(now_us);
      while (const auto f = boot->next_frame()) {
        to_server_.push_back(*f);
        sent.push_back(*f);
      }
      step_bus();
      now_us += flash.busy_us() - busy_us_;
      busy_us_ = flash.busy_us();
      const BootStep step = boot->next(now_us);
      if (step == BootStep::stay || !flash.powered()) continue;
      ram = {.failures = boot->installed_another() ? std::uint8_t{0} : config.failures, .cause = config.cause};
      if (step == BootStep::reset) {
        reset(ResetCause::software);
      } else {
        started = true;
        ram.stage = BootStage::started;
      }
    }
  }

  std::vector<std::uint8_t> area_bytes(std::size_t size) const {
    std::vector<std::uint8_t> out(size);
    for (std::size_t at = 0; at < size; at += 256) {
      flash.flash_read(config.updater.layout.first_page + static_cast<std::uint32_t>(at / 2048), static_cast<std::uint32_t>(at % 2048),
                       std::span(out).subspan(at, std::min<std::size_t>(256, size - at)));
    }
    return out;
  }

  // What it sent of a type, oldest first.
  template <class T>
  std::vector<T> said(protocols::TransferKind kind = protocols::TransferKind::message) const {
    const std::array wanted{protocols::subscribe(kind, T::kType)};
    protocols::Receiver<2, 130> receiver(kServer, wanted);
    std::vector<T> all;
    for (const CanFrame& f : sent) {
      T m;
      const auto t = receiver.accept(f, 1);
      if (t && t->id.source == boot->updater().own_id() && decode(t->payload, m)) all.push_back(m);
    }
    return all;
  }
  std::vector<std::string> logs() const {
    std::vector<std::string> lines;
    for (const auto& m : said<protocols::LogMessage>()) lines.emplace_back(m.text.items.begin(), m.text.items.begin() + m.text.count);
    return lines;
  }
  bool said_text(const std::string& text) const {
    const auto lines = logs();
    return std::find(lines.begin(), lines.end(), text) != lines.end();
  }

 private:
  void step_bus() {
    if (to_server_.empty() && to_boot_.empty()) {
      now_us += 100;
      return;
    }
    const bool ours = !to_server_.empty() &&
                      (to_boot_.empty() || protocols::arbitration_key(to_server_.front()) <= protocols::arbitration_key(to_boot_.front()));
    auto& queue = ours ? to_server_ : to_boot_;
    const CanFrame f = queue.front();
    queue.erase(queue.begin());
    now_us += static_cast<std::uint64_t>(protocols::worst_frame_bits(f.extended, f.length));
    ours ? server.on_frame(f, now_us, to_boot_) : boot->on_frame(f, now_us);
  }
  std::vector<CanFrame> to_server_, to_boot_;
  protocols::TransferIdCounter transfer_;
  std::uint64_t busy_us_ = 0;
};

}  // namespace rotorloop::firmware
