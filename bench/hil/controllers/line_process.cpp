#include "bench/hil/controllers/line_process.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>

#include "host/base/error.hpp"

namespace rotorloop::hil {
namespace {

constexpr std::size_t kLongestLine = 1 << 20;
constexpr int kLookForStop_ms = 100;  // how often a wait looks whether the run was interrupted
constexpr int kGrace_ms = 2000;       // to end by itself once its input is closed

// Our end, and the one that is the child's standard input and output.
std::pair<Descriptor, Descriptor> stream(const std::string& command) {
  int ends[2];
  if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0)
    throw Error({"controller", fmt::format("\"{}\" cannot be started", command), strerror(errno), "close other programs and fly again"},
                ExitCode::device);
  return {Descriptor(ends[0]), Descriptor(ends[1])};
}

}  // namespace

LineProcess::LineProcess(const std::string& command, const std::filesystem::path& error_log)
    : LineProcess(stream(command), command, error_log.empty() ? Descriptor() : output_file(error_log)) {}

LineProcess::LineProcess(std::pair<Descriptor, Descriptor> ends, const std::string& command, Descriptor error_log)
    : socket_(std::move(ends.first)),
      child_({.program = "/bin/sh",
              .arguments = {"-c", command},
              .input = ends.second.get(),
              .output = ends.second.get(),
              .errors = error_log.get(),
              .own_group = true}) {}

LineProcess::~LineProcess() {
  shutdown(socket_.get(), SHUT_WR);
  child_.wait(kGrace_ms);
}

bool LineProcess::send(std::string_view line) {
  while (!line.empty()) {
    const ssize_t n = ::send(socket_.get(), line.data(), line.size(), MSG_NOSIGNAL);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return false;
    line.remove_prefix(static_cast<std::size_t>(n));
  }
  return true;
}

LineProcess::Wait LineProcess::receive(std::string& line, double timeout_s, const std::atomic<bool>* stop) {
  auto left_ms = static_cast<std::int64_t>(std::ceil(timeout_s * 1e3));
  for (;;) {
    if (const auto end = buffer_.find('\n'); end != std::string::npos) {
      line.assign(buffer_, 0, end);
      buffer_.erase(0, end + 1);
      return Wait::line;
    }
    if (buffer_.size() > kLongestLine) return Wait::ended;
    const auto slice_ms = static_cast<int>(std::min<std::int64_t>(left_ms, kLookForStop_ms));
    pollfd ready{.fd = socket_.get(), .events = POLLIN, .revents = 0};
    const int n = poll(&ready, 1, slice_ms);
    if (stop && stop->load(std::memory_order_relaxed)) return Wait::stopped;
    if (n < 0 && errno == EINTR) continue;
    if (n == 0) {
      left_ms -= slice_ms;
      if (left_ms <= 0) return Wait::timeout;
      continue;
    }
    char bytes[8192];
    const ssize_t got = read(socket_.get(), bytes, sizeof bytes);
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return Wait::ended;
    buffer_.append(bytes, static_cast<std::size_t>(got));
  }
}

std::string LineProcess::ending() {
  const auto end = child_.wait(kGrace_ms);
  if (!end) return "closed its output";
  // A shell that started the program says by its own exit code which signal ended it.
  const int signal = end->signal > 0 ? end->signal : end->exit_code - 128;
  if (signal > 0 && signal < NSIG) return fmt::format("ended by signal {} ({})", signal, strsignal(signal));
  return fmt::format("ended with exit code {}", end->exit_code);
}

}  // namespace rotorloop::hil
