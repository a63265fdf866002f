#include "cli/progress/identify_progress.hpp"

#include <fmt/format.h>

namespace rotorloop::cli {

void IdentifyProgressLine::erase() {
  if (on_screen_) fmt::print(out_, "\r\033[K");
  on_screen_ = false;
}

void IdentifyProgressLine::operator()(const identify::IdentifyProgress& p) {
  if (style_ == ProgressStyle::silent) return;
  const auto line = text_(p, std::chrono::duration<double>(Clock::now() - begun_).count());
  if (style_ == ProgressStyle::lines) {
    if (line.due) fmt::print(out_, "{}\n", line.text);
  } else {
    fmt::print(out_, "\r\033[K{}", line.text);
    on_screen_ = true;
  }
  std::fflush(out_);
}

}  // namespace rotorloop::cli
