// What a simulated ESC has in its flash and what it starts after a reset: the updater while an update is under way or when no image is
// whole, the application otherwise. The payload of an image is not executed: what runs is always the firmware core of this build; the
// header says as which version it answers.
#pragma once
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bench/hil/live/file_flash.hpp"
#include "firmware/core/node/esc_node.hpp"
#include "firmware/update/application_area.hpp"
#include "firmware/update/updater.hpp"

namespace rotorloop::live {

inline constexpr const char* kEscBoard = "b_g431b_esc1";  // whose scales the simulated ESC has

// Pages of the flash: 0 to 7 a bootloader's, 8 to 59 the application, 60 the record of an update, 62 and 63 parameters.
class EscFlash {
 public:
  using Updater = firmware::Updater<FileFlash>;

  // An empty flash gets an image, as a board leaves its factory with one.
  explicit EscFlash(const std::string& path);

  // The image to start; none: the updater has to run.
  std::optional<firmware::ImageHeader> to_start();
  std::unique_ptr<Updater> make_updater(std::uint8_t own_id, const std::array<std::uint8_t, 16>& unique_id);
  // Two pages of parameters and the record of an update.
  BoardPages application_pages() { return {flash_, {kParameterPage, kParameterPage + 1, layout_.record_page}}; }

  std::uint64_t busy_us() const { return flash_.busy_us(); }
  // The first bytes of the application area.
  std::vector<std::uint8_t> application(std::size_t size) const;

 private:
  static constexpr std::uint32_t kParameterPage = 62;
  void install_first_image();

  firmware::UpdateLayout layout_{};
  FileFlash flash_;
};

}  // namespace rotorloop::live
