#include "host/cli/identify_progress.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace rotorloop::cli {
namespace {
constexpr int kUsualIterations = 12;  // with noise by EM; more only moves the estimate of the time left
}

void IdentifyProgressLine::erase() {
  if (on_screen_) fmt::print(out_, "\r\033[K");
  on_screen_ = false;
}

void IdentifyProgressLine::operator()(const bench::IdentifyProgress& p) {
  if (style_ == ProgressStyle::silent) return;
  const auto now = Clock::now();
  const bool new_part = p.part_number != part_;
  if (new_part) part_begun_ = now;
  part_ = p.part_number;
  if (style_ == ProgressStyle::lines) {
    if (new_part) fmt::print(out_, "[{}/{}] {}\n", p.part_number, p.parts, p.part);
    std::fflush(out_);
    return;
  }
  const double spent_s = std::chrono::duration<double>(now - part_begun_).count();
  std::string left;
  if (p.fit.iteration > 0) {
    const int more = std::max(1, kUsualIterations - p.fit.iteration);
    left = fmt::format(", about {} left in this part", duration_text(spent_s / p.fit.iteration * more));
  }
  fmt::print(out_, "\r\033[K[{}/{}] {}: iteration {}, cost {:.6g}, still to fall {:.2g}, noise round {}{}", p.part_number, p.parts, p.part,
             p.fit.iteration, p.fit.cost, p.fit.decrement, p.fit.noise_round, left);
  std::fflush(out_);
  on_screen_ = true;
}

}  // namespace rotorloop::cli
