#include "bench/hil/closed_loop/child_process.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>

#include "host/base/error.hpp"

namespace rotorloop::closed_loop {
namespace fs = std::filesystem;
namespace {

constexpr int kPoll_ms = 200;
constexpr unsigned kCloseOnExec = 4;  // CLOSE_RANGE_CLOEXEC, include/uapi/linux/close_range.h

[[noreturn]] void cannot_start(const fs::path& program, const std::string& why) {
  throw Error({program.generic_string(), "cannot be run: " + why, "", "check the program and the space on the disk"}, ExitCode::device);
}

struct File {
  int fd;
  explicit File(const fs::path& path) : fd(::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644)) {
    if (fd < 0) throw Error({path.generic_string(), std::strerror(errno), "", "choose another folder with --out"}, ExitCode::device);
  }
  ~File() { ::close(fd); }
  File(const File&) = delete;
  File& operator=(const File&) = delete;
};

// Never returns. What went wrong is written to `report`, which a successful exec of the program closes; bwrap reports there by itself.
[[noreturn]] void become(const ProgramCall& c, int program, int out, int errors, int report) {
  const auto give_up = [&](const std::string& text) {
    (void)!::write(report, text.data(), text.size());
    ::_exit(127);
  };
  ::dup2(::open("/dev/null", O_RDONLY | O_CLOEXEC), 0);
  ::dup2(out, 1);
  ::dup2(errors, 2);
  ::syscall(SYS_close_range, 3u, ~0u, kCloseOnExec);
  if (c.sandbox) {
    ::setsid();  // no terminal either
    if (const auto failed = enter_sandbox(*c.sandbox, {c.folder, c.program}); !failed.empty()) give_up(failed);
  } else if (!c.folder.empty() && ::chdir(c.folder.c_str()) != 0) {
    give_up(std::string("changing to its folder: ") + std::strerror(errno));
  }
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);  // after the change of user, which clears it
  const bool bubblewrap = c.sandbox && c.sandbox->bubblewrap;
  std::vector<std::string> words{c.program.string()};
  if (bubblewrap) words = bubblewrap_command(*c.sandbox, {c.folder, c.program}, report);
  words.insert(words.end(), c.arguments.begin(), c.arguments.end());
  std::vector<char*> pointers;
  for (auto& w : words) pointers.push_back(w.data());
  pointers.push_back(nullptr);
  const std::array<const char*, 3> clean{"PATH=/usr/bin:/bin", "LANG=C.UTF-8", nullptr};
  char* const* environment = c.sandbox ? const_cast<char* const*>(clean.data()) : environ;
  if (bubblewrap) {
    ::fcntl(report, F_SETFD, 0);
    ::execve(pointers[0], pointers.data(), environment);
  } else {
    ::fexecve(program, pointers.data(), environment);  // its path may not be reachable from inside the sandbox
  }
  give_up(std::strerror(errno));
  ::_exit(127);
}

// Whole lines of `pending` to the listener; what is left stays.
void emit_lines(std::string& pending, const std::function<void(const std::string&)>& line) {
  for (std::size_t end; (end = pending.find_first_of("\n\r")) != std::string::npos; pending.erase(0, end + 1))
    if (end > 0) line(pending.substr(0, end));
}

// The child's messages, to the file `errors` and the listener, until it has closed them; the last line that is not empty.
std::string follow(const ProgramCall& c, pid_t child, int messages, int errors) {
  std::string pending, last;
  const auto emit = [&](const std::string& line) {
    last = line;
    if (c.line) c.line(line);
  };
  bool asked = false;
  for (char buffer[4096];;) {
    if (c.stop && c.stop->load(std::memory_order_relaxed) && !asked) asked = ::kill(child, SIGINT) == 0;
    pollfd p{messages, POLLIN, 0};
    if (::poll(&p, 1, kPoll_ms) <= 0) continue;
    const ssize_t n = ::read(messages, buffer, sizeof buffer);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) break;
    (void)!::write(errors, buffer, static_cast<std::size_t>(n));
    pending.append(buffer, static_cast<std::size_t>(n));
    emit_lines(pending, emit);
  }
  pending += '\n';
  emit_lines(pending, emit);
  return last;
}

std::string rest_of(int pipe) {
  std::string out;
  char buffer[1024];
  for (ssize_t n; (n = ::read(pipe, buffer, sizeof buffer)) != 0;) {
    if (n < 0 && errno != EINTR) break;
    if (n > 0) out.append(buffer, static_cast<std::size_t>(n));
  }
  return out;
}

}  // namespace

fs::path own_program() {
  std::error_code ec;
  const fs::path p = fs::read_symlink("/proc/self/exe", ec);
  if (ec) throw Error({"/proc/self/exe", ec.message(), "there is no /proc here", "name the program with --program"}, ExitCode::device);
  return p;
}

int run_program(const ProgramCall& c) {
  const int program = ::open(c.program.c_str(), O_RDONLY | O_CLOEXEC);
  if (program < 0) cannot_start(c.program, std::strerror(errno));
  const File out(c.output), errors(c.errors);
  int message[2], report[2];
  if (::pipe2(message, O_CLOEXEC) != 0 || ::pipe2(report, O_CLOEXEC) != 0) cannot_start(c.program, std::strerror(errno));
  // A signal between fork and exec would end in this program's handler, which does nothing there: it waits until the child has its own.
  sigset_t waiting, before;
  sigemptyset(&waiting);
  sigaddset(&waiting, SIGINT);
  sigaddset(&waiting, SIGTERM);
  ::pthread_sigmask(SIG_BLOCK, &waiting, &before);
  const pid_t child = ::fork();
  if (child == 0) {
    std::signal(SIGINT, SIG_DFL);
    std::signal(SIGTERM, SIG_DFL);
  }
  ::pthread_sigmask(SIG_SETMASK, &before, nullptr);
  if (child < 0) cannot_start(c.program, std::strerror(errno));
  if (child == 0) become(c, program, out.fd, message[1], report[1]);
  ::close(program);
  ::close(message[1]);
  ::close(report[1]);
  const std::string last_line = follow(c, child, message[0], errors.fd);
  ::close(message[0]);
  int status = 0;
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  const std::string reported = rest_of(report[0]);
  ::close(report[0]);
  if (WIFSIGNALED(status)) return 128 + WTERMSIG(status);
  // bwrap returns the exit code of a program that it could start; else its last message says why not.
  const bool by_bubblewrap = c.sandbox && c.sandbox->bubblewrap && (reported.empty() || reported.starts_with('{'));
  if (by_bubblewrap && reported.find("\"exit-code\"") == std::string::npos) cannot_start(c.program, last_line);
  if (!by_bubblewrap && !reported.empty()) cannot_start(c.program, reported);
  return WEXITSTATUS(status);
}

}  // namespace rotorloop::closed_loop
