#include "bench/close/child_process.hpp"

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

// Never returns. What went wrong is written to `report`, which a successful exec closes.
[[noreturn]] void become(const ProgramCall& c, int program, int out, int errors, int report) {
  const auto give_up = [&](const std::string& text) {
    (void)!::write(report, text.data(), text.size());
    ::_exit(127);
  };
  ::dup2(::open("/dev/null", O_RDONLY | O_CLOEXEC), 0);
  ::dup2(out, 1);
  ::dup2(errors, 2);
  ::syscall(SYS_close_range, 3u, ~0u, kCloseOnExec);
  if (c.room) {
    ::setsid();  // no terminal either
    if (const auto failed = enter_room(c.room->first, c.room->second); !failed.empty()) give_up(failed);
  } else if (!c.folder.empty() && ::chdir(c.folder.c_str()) != 0) {
    give_up(std::string("changing to its folder: ") + std::strerror(errno));
  }
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);  // after the change of user, which clears it
  std::vector<char*> words{const_cast<char*>(c.program.c_str())};
  for (const auto& a : c.arguments) words.push_back(const_cast<char*>(a.c_str()));
  words.push_back(nullptr);
  const std::array<const char*, 3> clean{"PATH=/usr/bin:/bin", "LANG=C.UTF-8", nullptr};
  char* const* environment = c.room ? const_cast<char* const*>(clean.data()) : environ;
  ::fexecve(program, words.data(), environment);  // its path may not be reachable from inside the room
  give_up(std::strerror(errno));
  ::_exit(127);
}

// Whole lines of `pending` to the listener; what is left stays.
void tell_lines(std::string& pending, const std::function<void(const std::string&)>& line) {
  for (std::size_t end; (end = pending.find_first_of("\n\r")) != std::string::npos; pending.erase(0, end + 1))
    if (line && end > 0) line(pending.substr(0, end));
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
  const pid_t child = ::fork();
  if (child < 0) cannot_start(c.program, std::strerror(errno));
  if (child == 0) become(c, program, out.fd, message[1], report[1]);
  ::close(program);
  ::close(message[1]);
  ::close(report[1]);

  std::string pending;
  bool asked = false;
  for (char buffer[4096];;) {
    if (c.stop && c.stop->load(std::memory_order_relaxed) && !asked) asked = ::kill(child, SIGINT) == 0;
    pollfd p{message[0], POLLIN, 0};
    if (::poll(&p, 1, kPoll_ms) <= 0) continue;
    const ssize_t n = ::read(message[0], buffer, sizeof buffer);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) break;
    (void)!::write(errors.fd, buffer, static_cast<std::size_t>(n));
    pending.append(buffer, static_cast<std::size_t>(n));
    tell_lines(pending, c.line);
  }
  pending += '\n';
  tell_lines(pending, c.line);
  ::close(message[0]);
  int status = 0;
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  char text[1024];
  const ssize_t n = ::read(report[0], text, sizeof text);
  ::close(report[0]);
  if (n > 0) cannot_start(c.program, std::string(text, static_cast<std::size_t>(n)));
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

}  // namespace rotorloop::closed_loop
