// The wall clock of a run: when it started and how long it took, for people. Nothing that is flown, judged or hashed sees it.
#pragma once
#include <chrono>
#include <ctime>
#include <string>

namespace rotorloop {

class RunClock {
 public:
  std::string started_utc() const {
    const std::time_t t = std::chrono::system_clock::to_time_t(utc_);
    std::tm parts{};
    gmtime_r(&t, &parts);
    char text[32];
    std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &parts);
    return text;
  }
  double elapsed_s() const { return std::chrono::duration<double>(std::chrono::steady_clock::now() - started_).count(); }

 private:
  std::chrono::system_clock::time_point utc_ = std::chrono::system_clock::now();
  std::chrono::steady_clock::time_point started_ = std::chrono::steady_clock::now();
};

}  // namespace rotorloop
