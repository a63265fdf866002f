#include "bench/hil/live/file_flash.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>

#include "host/base/error.hpp"

namespace rotorloop::live {

FileFlash::FileFlash(const std::string& path) : bytes_(kPages * std::size_t{kFlashPageBytes}, 0xFF) {
  if (path.empty()) return;
  file_ = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644);
  if (file_ < 0)
    throw Error({path, std::string("cannot open the flash of the ESC: ") + std::strerror(errno), "",
                 "check that the folder exists and may be written"},
                ExitCode::device);
  const auto refuse = [&](Error error) {
    ::close(file_);
    throw error;
  };
  if (::flock(file_, LOCK_EX | LOCK_NB) != 0)
    refuse(
        Error({path, "is the flash of an ESC that runs", "another esc-sim was started with this file", "give each ESC a file of its own"},
              ExitCode::device));
  const off_t size = ::lseek(file_, 0, SEEK_END);
  if (size == 0) {
    if (!keep(0, bytes_.size()))
      refuse(Error({path, std::string("cannot write the flash of the ESC: ") + std::strerror(errno), "the disk is full", "make room"},
                   ExitCode::device));
  } else if (size != static_cast<off_t>(bytes_.size()) ||
             ::pread(file_, bytes_.data(), bytes_.size(), 0) != static_cast<ssize_t>(bytes_.size())) {
    refuse(Error({path, "has " + std::to_string(size) + " bytes, the flash of an ESC has " + std::to_string(bytes_.size()),
                  "this is another file", "give a new path, or the file that an earlier esc-sim made"}));
  }
  is_new_ = std::all_of(bytes_.begin(), bytes_.end(), [](std::uint8_t b) { return b == 0xFF; });
}

FileFlash::~FileFlash() {
  if (file_ >= 0) ::close(file_);
}

bool FileFlash::flash_read(std::uint32_t page, std::uint32_t offset, std::span<std::uint8_t> out) const {
  if (!inside(page, offset, out.size())) return false;
  std::copy_n(bytes_.begin() + static_cast<std::ptrdiff_t>(page * kFlashPageBytes + offset), out.size(), out.begin());
  return true;
}

bool FileFlash::flash_erase(std::uint32_t page) {
  if (!inside(page, 0, kFlashPageBytes)) return false;
  busy_us_ += firmware::EmulatedFlash::kErase_us;
  const std::size_t at = page * std::size_t{kFlashPageBytes};
  std::fill_n(bytes_.begin() + static_cast<std::ptrdiff_t>(at), kFlashPageBytes, std::uint8_t{0xFF});
  return keep(at, kFlashPageBytes);
}

bool FileFlash::flash_program(std::uint32_t page, std::uint32_t offset, std::uint64_t word) {
  if (!inside(page, offset, 8) || offset % 8 != 0) return false;
  const std::size_t at = page * std::size_t{kFlashPageBytes} + offset;
  const auto old = std::span(bytes_).subspan(at, 8);
  if (!std::all_of(old.begin(), old.end(), [](std::uint8_t b) { return b == 0xFF; })) return false;
  busy_us_ += firmware::EmulatedFlash::kProgram_us;
  for (std::size_t i = 0; i < 8; ++i) old[i] = static_cast<std::uint8_t>(word >> (8 * i) & 0xFFu);
  return keep(at, 8);
}

bool FileFlash::keep(std::size_t at, std::size_t size) {
  return file_ < 0 || ::pwrite(file_, bytes_.data() + at, size, static_cast<off_t>(at)) == static_cast<ssize_t>(size);
}

}  // namespace rotorloop::live
