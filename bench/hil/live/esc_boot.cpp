#include "bench/hil/live/esc_boot.hpp"

#include <algorithm>
#include <string_view>

namespace rotorloop::live {
namespace {

constexpr std::string_view kFirstPayload = "the firmware core of this build of rotorloop";

}  // namespace

EscFlash::EscFlash(const std::string& path) : flash_(path) {
  if (flash_.is_new()) install_first_image();
}

void EscFlash::install_first_image() {
  const firmware::NodeIdentity built;  // of this build
  std::vector<std::uint8_t> image(firmware::kImageHeaderBytes, 0xFF);
  image.insert(image.end(), kFirstPayload.begin(), kFirstPayload.end());
  protocols::Crc64 crc;
  crc.add(std::span<const std::uint8_t>(image).subspan(firmware::kImageHeaderBytes));
  firmware::write_image_fields({.board = firmware::board_name(kEscBoard),
                                .size = static_cast<std::uint32_t>(kFirstPayload.size()),
                                .major = built.software_major,
                                .minor = built.software_minor,
                                .vcs_commit = built.vcs_commit,
                                .crc = crc.value()},
                               image);
  firmware::ApplicationArea area(flash_, layout_);
  area.program(0, image);
  area.release(std::span<const std::uint8_t>(image).first(8));
}

std::optional<firmware::ImageHeader> EscFlash::to_start() {
  if (firmware::UpdateRecord(flash_, layout_.record_page).job()) return std::nullopt;
  return firmware::ApplicationArea(flash_, layout_).installed(firmware::board_name(kEscBoard), firmware::kNoKey);
}

std::unique_ptr<EscFlash::Updater> EscFlash::make_updater(std::uint8_t own_id, const std::array<std::uint8_t, 16>& unique_id) {
  firmware::UpdaterConfig config;
  config.board = firmware::board_name(kEscBoard);
  config.unique_id = unique_id;
  config.own_id = own_id;
  config.layout = layout_;
  return std::make_unique<Updater>(flash_, config);
}

std::vector<std::uint8_t> EscFlash::application(std::size_t size) const {
  std::vector<std::uint8_t> out(size);
  for (std::size_t at = 0; at < size; at += FileFlash::kFlashPageBytes) {
    flash_.flash_read(layout_.first_page + static_cast<std::uint32_t>(at / FileFlash::kFlashPageBytes), 0,
                      std::span(out).subspan(at, std::min<std::size_t>(FileFlash::kFlashPageBytes, size - at)));
  }
  return out;
}

}  // namespace rotorloop::live
