#include "cli/stand/run_page.hpp"

#include <fmt/format.h>

#include <cstdio>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>

#include "bench/hil/live/live_assets.hpp"
#include "bench/stand/run/live_values.hpp"
#include "host/base/error.hpp"

namespace rotorloop::cli {
namespace {
constexpr std::chrono::milliseconds kPublish{50}, kLastValues{300};
}

RunPage::RunPage(int port) {
  if (port < 0 || port > 65535)
    throw Error({"--port", fmt::format("{} is out of range: 0 to 65535", port), "", "0 takes one that is free"});
  server_ = std::make_unique<live::LiveServer>(
      live::LiveServerConfig{port, std::string(live::kStandPage), std::string(live::kStandScript), "Run on a stand"},
      [this](std::string_view what) -> std::string {
        if (what != "stop") return "unknown order";
        return ++stops_ == 1 ? "stop asked for: the motor is ramped down and disarmed"
                             : "stop asked for again: the motor is disarmed at once";
      });
  fmt::print(stderr, "page: {}\n", server_->address());
}

RunPage::~RunPage() { std::this_thread::sleep_for(kLastValues); }

void RunPage::operator()(stand_run::Session& session) {
  for (; passed_on_ < stops_; ++passed_on_) session.ask_stop("page");
  const auto now = std::chrono::steady_clock::now();
  if (now < next_ && !session.done()) return;
  next_ = now + kPublish;
  server_->publish(stand_run::live_values(session).dump());
}

void RunPace::wait(double now_s) {
  if (pace_ == 0.0) return;
  if (begun_s_ < 0.0) {
    begun_s_ = now_s;
    begun_ = std::chrono::steady_clock::now();
  }
  const std::chrono::duration<double> since((now_s - begun_s_) / pace_);
  std::this_thread::sleep_until(begun_ + std::chrono::duration_cast<std::chrono::steady_clock::duration>(since));
}

}  // namespace rotorloop::cli
