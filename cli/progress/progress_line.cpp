#include "cli/progress/progress_line.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>

namespace rotorloop::cli {
namespace {

constexpr auto kRedraw = std::chrono::milliseconds(100);
constexpr int kBar = 28;
constexpr double kSettled = 0.02;  // share of the work after which an estimate of the rest is worth showing

std::string flight_text(const hil::FlightResult& f) {
  const auto& e = f.tracking.truth;
  std::string out = fmt::format("{} {} seed {}: ", f.flight, hil::variant_name(f.variant), f.seed);
  if (f.end != hil::FlightEnd::completed)
    out += fmt::format("{}{}", hil::flight_end_name(f.end), f.end_detail.empty() ? "" : ", " + f.end_detail);
  else if (std::isnan(e.mean_3d_cm))
    out += "completed";
  else
    out += fmt::format("error {:.2f} cm (|z| {:.2f} cm)", e.mean_3d_cm, e.mean_z_cm);
  return out;
}

}  // namespace

ProgressStyle progress_style(bool quiet) {
  if (quiet) return ProgressStyle::silent;
  const char* term = std::getenv("TERM");
  return ::isatty(STDERR_FILENO) == 1 && term && std::strcmp(term, "dumb") != 0 ? ProgressStyle::redrawn : ProgressStyle::lines;
}

std::string duration_text(double seconds) {
  const auto s = static_cast<long long>(std::ceil(std::clamp(seconds, 0.0, 1e9)));
  return s < 3600 ? fmt::format("{}:{:02}", s / 60, s % 60) : fmt::format("{}:{:02}:{:02}", s / 3600, s / 60 % 60, s % 60);
}

ProgressLine::~ProgressLine() {
  const std::lock_guard lock(mutex_);
  erase();
}

void ProgressLine::begin(std::size_t flights, double virtual_s_total) {
  const std::lock_guard lock(mutex_);
  flights_ = flights;
  total_s_ = virtual_s_total;
  done_ = 0;
  flown_s_ = 0.0;
  begun_ = Clock::now();
  if (style_ == ProgressStyle::redrawn) draw(begun_);
}

void ProgressLine::advance(double virtual_s) {
  const std::lock_guard lock(mutex_);
  flown_s_ += virtual_s;
  if (style_ != ProgressStyle::redrawn) return;
  if (const auto now = Clock::now(); now - drawn_ >= kRedraw) draw(now);
}

void ProgressLine::finished(const hil::FlightResult& flight) {
  const std::lock_guard lock(mutex_);
  ++done_;
  if (style_ == ProgressStyle::lines) fmt::print(out_, "[{}/{}] {}\n", done_, flights_, flight_text(flight));
  if (style_ == ProgressStyle::redrawn) {
    if (flight.end != hil::FlightEnd::completed) {
      erase();
      fmt::print(out_, "{}\n", flight_text(flight));
    }
    draw(Clock::now());
  }
  std::fflush(out_);
}

void ProgressLine::warn(const std::string& where, const std::string& what) {
  if (style_ == ProgressStyle::silent) return;
  const std::lock_guard lock(mutex_);
  erase();
  fmt::print(out_, "{}{}warning: {}\n", where, where.empty() ? "" : ": ", what);
}

void ProgressLine::end() {
  const std::lock_guard lock(mutex_);
  erase();
  if (style_ != ProgressStyle::silent) {
    const double wall_s = std::chrono::duration<double>(Clock::now() - begun_).count();
    fmt::print(out_, "{} flights, {:.0f} s of flight in {} ({:.1f} x real time)\n", done_, flown_s_, duration_text(wall_s),
               wall_s > 0 ? flown_s_ / wall_s : 0.0);
    std::fflush(out_);
  }
}

void ProgressLine::draw(Clock::time_point now) {
  const double share = total_s_ > 0 ? std::clamp(flown_s_ / total_s_, 0.0, 1.0) : 0.0;
  const double elapsed_s = std::chrono::duration<double>(now - begun_).count();
  const int filled = static_cast<int>(share * kBar);
  const auto rest = share > kSettled ? " left " + duration_text(elapsed_s * (1 - share) / share) : std::string();
  fmt::print(out_, "\r\x1b[K[{}{}] {:3.0f} %  flight {}/{}  {}{}", std::string(static_cast<std::size_t>(filled), '#'),
             std::string(static_cast<std::size_t>(kBar - filled), '.'), 100 * share, std::min(done_ + 1, flights_), flights_,
             duration_text(elapsed_s), rest);
  std::fflush(out_);
  drawn_ = now;
  on_screen_ = true;
}

void ProgressLine::erase() {
  if (!on_screen_) return;
  std::fputs("\r\x1b[K", out_);
  on_screen_ = false;
}

}  // namespace rotorloop::cli
