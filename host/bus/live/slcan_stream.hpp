// A serial line or pty that carries SLCAN, read and written without blocking: what both ends of the protocol share.
#pragma once
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include "host/bus/live/slcan_line.hpp"

namespace rotorloop {

class SlcanStream {
 public:
  static constexpr std::size_t kQueue_B = std::size_t{1} << 16;  // about 2000 frames; beyond it frames are refused

  explicit SlcanStream(int descriptor) : descriptor_(descriptor) {}
  ~SlcanStream();
  SlcanStream(const SlcanStream&) = delete;
  SlcanStream& operator=(const SlcanStream&) = delete;

  int descriptor() const { return descriptor_; }
  // False when the queue is full and nothing of it was taken.
  bool write(std::string_view bytes);
  void flush();
  bool output_waits() const { return !out_.empty(); }
  // The next line that came. `gone` is set when the device is not there any more.
  std::optional<std::string> next_line();
  bool gone() const { return gone_; }
  std::uint64_t overlong() const { return lines_.overlong(); }

 private:
  int descriptor_;
  std::string out_;
  SlcanLines lines_;
  bool gone_ = false;
};

}  // namespace rotorloop
