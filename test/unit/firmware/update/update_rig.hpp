// An updater on a bus of 1 Mbit/s with a file server, over emulated flash: virtual time, losses, power cuts.
#pragma once
#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "firmware/board/fake/emulated_flash.hpp"
#include "firmware/update/updater.hpp"
#include "host/base/random.hpp"
#include "protocols/bus_load.hpp"
#include "protocols/receiver.hpp"

namespace rotorloop::firmware {

inline constexpr std::uint8_t kNode = 42, kServer = 126;

struct ImageOptions {
  std::uint32_t size = 65536 - kImageHeaderBytes;
  const char* board = "b_g431b_esc1";
  std::uint32_t security_version = 0;
  std::uint64_t seed = 1;
};

inline void put_little_endian(std::vector<std::uint8_t>& out, std::size_t at, std::uint64_t v, std::size_t n) {
  for (std::size_t k = 0; k < n; ++k) out[at + k] = static_cast<std::uint8_t>(v >> (8 * k) & 0xFF);
}

inline std::vector<std::uint8_t> make_image(const ImageOptions& o = {}) {
  std::vector<std::uint8_t> image(kImageHeaderBytes + o.size, 0xFF);
  const RandomStream random(o.seed, 0x1A6E);
  for (std::size_t k = kImageHeaderBytes; k < image.size(); ++k) image[k] = static_cast<std::uint8_t>(random.bits(k) >> 56);
  put_little_endian(image, 0, kImageMagic, 4);
  put_little_endian(image, 4, kImageHeaderVersion, 2);
  put_little_endian(image, 6, kImageHeaderBytes, 2);
  const auto board = board_name(o.board);
  std::copy(board.begin(), board.end(), image.begin() + 8);
  put_little_endian(image, 24, o.size, 4);
  put_little_endian(image, 28, o.security_version, 4);
  image[32] = 1;
  image[33] = static_cast<std::uint8_t>(o.seed);
  put_little_endian(image, 36, 0, 4);
  protocols::Crc64 payload, header;
  payload.add(std::span<const std::uint8_t>(image).subspan(kImageHeaderBytes));
  put_little_endian(image, 40, payload.value(), 8);
  header.add(std::span<const std::uint8_t>(image).first(48));
  put_little_endian(image, 48, header.value(), 8);
  return image;
}

// Answers GetInfo and Read at once, as a tool does.
class FileServer {
 public:
  std::vector<std::uint8_t> file;
  bool answers = true;

  void on_frame(const CanFrame& f, std::uint64_t now_us, std::vector<CanFrame>& out) {
    const auto t = receiver_.accept(f, now_us);
    if (!t || !answers) return;
    if (t->id.data_type_id == protocols::FileGetInfo::kType.id) {
      respond(*t, protocols::FileGetInfoResponse{.size = file.size(), .error = {}, .entry = {protocols::EntryType::kFile}}, out);
      return;
    }
    protocols::FileRead q;
    if (!decode(t->payload, q)) return;
    protocols::FileReadResponse r;
    const std::size_t from = std::min<std::size_t>(q.offset, file.size());
    r.data.assign(std::span<const std::uint8_t>(file).subspan(from, std::min<std::size_t>(256, file.size() - from)));
    respond(*t, r, out);
  }

 private:
  template <class T>
  static void respond(const protocols::Transfer& q, const T& value, std::vector<CanFrame>& out) {
    std::array<std::uint8_t, protocols::max_bytes<T>()> payload{};
    const std::size_t size = encode(value, payload);
    protocols::encode_transfer({.kind = protocols::TransferKind::response,
                                .priority = q.id.priority,
                                .data_type_id = T::kType.id,
                                .source = kServer,
                                .destination = q.id.source},
                               T::kType.crc_seed(), q.transfer_id, {payload.data(), size}, [&](const CanFrame& f) {
                                 out.push_back(f);
                                 return true;
                               });
  }
  static constexpr std::array kWanted{protocols::subscribe(protocols::TransferKind::request, protocols::FileGetInfo::kType),
                                      protocols::subscribe(protocols::TransferKind::request, protocols::FileRead::kType)};
  protocols::Receiver<4, 220> receiver_{kServer, kWanted};
};

class UpdateRig {
 public:
  EmulatedFlash flash{64};
  FileServer server;
  UpdaterConfig config;
  std::unique_ptr<Updater<EmulatedFlash>> updater;
  std::uint64_t now_us = 1'000'000;
  double loss = 0.0;           // each frame at its receiver
  double other_load = 0.0;     // share of the bus that frames of higher priority take
  std::vector<CanFrame> sent;  // by the updater
  RandomStream random{1, 0xB05};

  UpdateRig() { config.own_id = kNode; }

  void install(const std::vector<std::uint8_t>& image) {
    for (std::uint32_t p = 0; p * 2048 < image.size(); ++p) flash.flash_erase(config.layout.first_page + p);
    ApplicationArea area(flash, config.layout);
    area.program(0, image);
    area.release(std::span<const std::uint8_t>(image).first(8));
  }
  // What the application does before it resets, and the reset.
  void hand_over(const char* path = "fw.bin") {
    UpdateRecord(flash, config.layout.record_page).begin({.server = kServer, .own_id = kNode, .path = path});
  }
  // A server asks a node that waits.
  void ask_to_begin(const char* path = "fw.bin") {
    protocols::BeginFirmwareUpdate q{.source_node_id = kServer, .path = {}};
    q.path.path = path;
    std::array<std::uint8_t, protocols::max_bytes<protocols::BeginFirmwareUpdate>()> payload{};
    const std::size_t size = encode(q, payload);
    protocols::encode_transfer({.kind = protocols::TransferKind::request,
                                .priority = 16,
                                .data_type_id = protocols::BeginFirmwareUpdate::kType.id,
                                .source = kServer,
                                .destination = kNode},
                               protocols::BeginFirmwareUpdate::kType.crc_seed(), asked_++, {payload.data(), size}, [&](const CanFrame& f) {
                                 updater->on_frame(f, now_us);
                                 return true;
                               });
  }
  void reset() {
    updater = std::make_unique<Updater<EmulatedFlash>>(flash, config);
    to_server_.clear();
    to_updater_.clear();
    busy_us_ = flash.busy_us();
  }

  // Until it is finished, the power is cut, or the time is over.
  void run(double most_s) {
    const std::uint64_t end_us = now_us + static_cast<std::uint64_t>(most_s * 1e6);
    while (now_us < end_us && flash.powered() && !updater->finished(now_us)) {
      updater->poll(now_us);
      while (const auto f = updater->next_frame()) {
        to_server_.push_back(*f);
        sent.push_back(*f);
      }
      step_bus();
      // The processor stands still while its flash works.
      now_us += flash.busy_us() - busy_us_;
      busy_us_ = flash.busy_us();
    }
  }

  // Bytes of the application area, as they are.
  std::vector<std::uint8_t> area_bytes(std::size_t size) const {
    std::vector<std::uint8_t> out(size);
    for (std::size_t at = 0; at < size; at += 256) {
      flash.flash_read(config.layout.first_page + static_cast<std::uint32_t>(at / 2048), static_cast<std::uint32_t>(at % 2048),
                       std::span(out).subspan(at, std::min<std::size_t>(256, size - at)));
    }
    return out;
  }
  std::optional<ImageHeader> installed() { return ApplicationArea(flash, config.layout).installed(config.board, config.key); }

  std::vector<std::string> logs() const {
    static constexpr std::array kWanted{protocols::subscribe(protocols::TransferKind::message, protocols::LogMessage::kType)};
    protocols::Receiver<2, 130> receiver(kServer, kWanted);
    std::vector<std::string> lines;
    for (const CanFrame& f : sent) {
      protocols::LogMessage m;
      const auto t = receiver.accept(f, 1);
      if (t && decode(t->payload, m)) lines.emplace_back(m.text.items.begin(), m.text.items.begin() + m.text.count);
    }
    return lines;
  }

 private:
  bool lost() { return loss > 0.0 && random.uniform(n_++) < loss; }

  void step_bus() {
    if (to_server_.empty() && to_updater_.empty()) {
      now_us += 100;
      return;
    }
    const bool ours = !to_server_.empty() && (to_updater_.empty() || protocols::arbitration_key(to_server_.front()) <=
                                                                         protocols::arbitration_key(to_updater_.front()));
    auto& queue = ours ? to_server_ : to_updater_;
    const CanFrame f = queue.front();
    queue.erase(queue.begin());
    now_us += static_cast<std::uint64_t>(protocols::worst_frame_bits(f.extended, f.length) / (1.0 - other_load) + 0.5);
    if (lost()) return;
    if (ours) {
      server.on_frame(f, now_us, to_updater_);
    } else {
      updater->on_frame(f, now_us);
    }
  }
  std::vector<CanFrame> to_server_, to_updater_;
  std::uint64_t busy_us_ = 0, n_ = 0;
  std::uint8_t asked_ = 0;
};

}  // namespace rotorloop::firmware
