#include "bench/hil/controllers/child_process.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>

#include "host/base/error.hpp"

extern char** environ;

namespace rotorloop::hil {
namespace {

constexpr std::size_t kLongestLine = 1 << 20;
constexpr int kLookForStop_ms = 100;  // how often a wait looks whether the run was interrupted
constexpr int kGrace_ms = 2000;       // to end by itself once its input is closed

[[noreturn]] void cannot_start(const std::string& command, int error) {
  throw Error({"controller", fmt::format("\"{}\" cannot be started", command), strerror(error), "close other programs and fly again"},
              ExitCode::device);
}

}  // namespace

ChildProcess::ChildProcess(const std::string& command, const std::filesystem::path& error_log) {
  int ends[2];
  if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0) cannot_start(command, errno);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, ends[1], STDIN_FILENO);
  posix_spawn_file_actions_adddup2(&actions, ends[1], STDOUT_FILENO);
  if (!error_log.empty()) posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, error_log.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644);
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  sigset_t none, defaults;
  sigemptyset(&none);
  sigemptyset(&defaults);
  for (const int s : {SIGPIPE, SIGINT, SIGTERM}) sigaddset(&defaults, s);
  posix_spawnattr_setsigmask(&attributes, &none);
  posix_spawnattr_setsigdefault(&attributes, &defaults);
  posix_spawnattr_setpgroup(&attributes, 0);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP | POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);
  std::string shell = "/bin/sh", option = "-c", line = command;
  char* words[] = {shell.data(), option.data(), line.data(), nullptr};
  const int error = posix_spawn(&child_, shell.c_str(), &actions, &attributes, words, environ);
  posix_spawn_file_actions_destroy(&actions);
  posix_spawnattr_destroy(&attributes);
  close(ends[1]);
  socket_ = ends[0];
  if (error != 0) {
    close(socket_);
    cannot_start(command, error);
  }
  exit_watch_ = static_cast<int>(syscall(SYS_pidfd_open, child_, 0));
}

ChildProcess::~ChildProcess() {
  shutdown(socket_, SHUT_WR);
  const bool ended = wait_for_end(kGrace_ms);
  kill(-child_, SIGKILL);  // also what it has started and left behind
  if (!ended) waitpid(child_, nullptr, 0);
  close(socket_);
  if (exit_watch_ >= 0) close(exit_watch_);
}

bool ChildProcess::wait_for_end(int timeout_ms) {
  if (reaped_) return true;
  pollfd watch{.fd = exit_watch_, .events = POLLIN, .revents = 0};
  if (exit_watch_ >= 0)
    while (poll(&watch, 1, timeout_ms) < 0 && errno == EINTR) {
    }
  reaped_ = waitpid(child_, &status_, WNOHANG) == child_;
  return reaped_;
}

bool ChildProcess::send(std::string_view line) {
  while (!line.empty()) {
    const ssize_t n = ::send(socket_, line.data(), line.size(), MSG_NOSIGNAL);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return false;
    line.remove_prefix(static_cast<std::size_t>(n));
  }
  return true;
}

ChildProcess::Wait ChildProcess::receive(std::string& line, double timeout_s, const std::atomic<bool>* stop) {
  auto left_ms = static_cast<std::int64_t>(std::ceil(timeout_s * 1e3));
  for (;;) {
    if (const auto end = buffer_.find('\n'); end != std::string::npos) {
      line.assign(buffer_, 0, end);
      buffer_.erase(0, end + 1);
      return Wait::line;
    }
    if (buffer_.size() > kLongestLine) return Wait::ended;
    const auto slice_ms = static_cast<int>(std::min<std::int64_t>(left_ms, kLookForStop_ms));
    pollfd ready{.fd = socket_, .events = POLLIN, .revents = 0};
    const int n = poll(&ready, 1, slice_ms);
    if (stop && stop->load(std::memory_order_relaxed)) return Wait::stopped;
    if (n < 0 && errno == EINTR) continue;
    if (n == 0) {
      left_ms -= slice_ms;
      if (left_ms <= 0) return Wait::timeout;
      continue;
    }
    char bytes[8192];
    const ssize_t got = read(socket_, bytes, sizeof bytes);
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return Wait::ended;
    buffer_.append(bytes, static_cast<std::size_t>(got));
  }
}

std::string ChildProcess::ending() {
  if (!wait_for_end(kGrace_ms)) return "closed its output";
  // A shell that started the program says by its own exit code which signal ended it.
  const int signal = WIFSIGNALED(status_) ? WTERMSIG(status_) : WEXITSTATUS(status_) > 128 ? WEXITSTATUS(status_) - 128 : 0;
  if (signal > 0 && signal < NSIG) return fmt::format("ended by signal {} ({})", signal, strsignal(signal));
  return fmt::format("ended with exit code {}", WEXITSTATUS(status_));
}

}  // namespace rotorloop::hil
