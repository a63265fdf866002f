#include "cli/ending/stop_signals.hpp"

namespace rotorloop::cli {
namespace {

// A signal handler may touch no more than this.
std::atomic<bool> g_asked{false};
std::atomic<int> g_signal{0};
static_assert(std::atomic<bool>::is_always_lock_free && std::atomic<int>::is_always_lock_free);

void on_signal(int signal) {
  g_signal.store(signal, std::memory_order_relaxed);
  g_asked.store(true, std::memory_order_relaxed);
}

}  // namespace

StopSignals::StopSignals() {
  g_asked = false;
  g_signal = 0;
  struct sigaction action {};
  action.sa_handler = on_signal;
  action.sa_flags = static_cast<int>(SA_RESETHAND);
  sigaction(SIGINT, &action, &previous_int_);
  sigaction(SIGTERM, &action, &previous_term_);
}
StopSignals::~StopSignals() {
  sigaction(SIGINT, &previous_int_, nullptr);
  sigaction(SIGTERM, &previous_term_, nullptr);
}

const std::atomic<bool>* StopSignals::flag() const { return &g_asked; }
bool StopSignals::asked() const { return g_asked.load(std::memory_order_relaxed); }
int StopSignals::exit_code() const { return asked() ? 128 + g_signal.load(std::memory_order_relaxed) : 0; }
std::string StopSignals::name() const { return !asked() ? "" : g_signal.load(std::memory_order_relaxed) == SIGTERM ? "SIGTERM" : "SIGINT"; }

}  // namespace rotorloop::cli
