// The live page of a run (bench/hil/live): shows what the session says, takes its stop. The run goes on whether anybody looks or not.
#pragma once
#include <atomic>
#include <chrono>
#include <memory>

#include "bench/hil/live/live_server.hpp"
#include "bench/stand/run/session.hpp"

namespace rotorloop::cli {

class RunPage {
 public:
  // Says the page's address on stderr. Throws Error (device) when the port is taken.
  explicit RunPage(int port);
  ~RunPage();  // after the pages have had time to get the last values
  // In the session's thread, as often as one likes: hands values over twenty times a second and passes on a stop.
  void operator()(stand_run::Session& session);

 private:
  std::atomic<int> stops_{0};  // pressed, by the server's threads
  int passed_on_ = 0;
  std::chrono::steady_clock::time_point next_{};
  std::unique_ptr<live::LiveServer> server_;
};

// Holds virtual time back to the clock's.
class RunPace {
 public:
  // Seconds of the stand in one of the clock; 0: as fast as it goes.
  explicit RunPace(double pace) : pace_(pace) {}
  void wait(double now_s);

 private:
  double pace_, begun_s_ = -1.0;
  std::chrono::steady_clock::time_point begun_{};
};

}  // namespace rotorloop::cli
