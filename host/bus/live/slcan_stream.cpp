#include "host/bus/live/slcan_stream.hpp"

#include <unistd.h>

#include <array>
#include <cerrno>

namespace rotorloop {

SlcanStream::~SlcanStream() { ::close(descriptor_); }

bool SlcanStream::write(std::string_view bytes) {
  if (gone_ || out_.size() + bytes.size() > kQueue_B) return false;
  out_ += bytes;
  flush();
  return true;
}

void SlcanStream::flush() {
  while (!out_.empty()) {
    const ssize_t taken = ::write(descriptor_, out_.data(), out_.size());
    if (taken < 0) {
      if (errno != EAGAIN && errno != EINTR) gone_ = true;
      return;
    }
    out_.erase(0, static_cast<std::size_t>(taken));
  }
}

std::optional<std::string> SlcanStream::next_line() {
  while (true) {
    if (auto line = lines_.next()) return line;
    std::array<char, 4096> bytes{};
    const ssize_t size = ::read(descriptor_, bytes.data(), bytes.size());
    if (size > 0) {
      lines_.add({bytes.data(), static_cast<std::size_t>(size)});
    } else {
      if (size == 0 || (errno != EAGAIN && errno != EINTR)) gone_ = true;
      return std::nullopt;
    }
  }
}

}  // namespace rotorloop
