#include "host/base/child_process.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstring>

#include "host/base/error.hpp"

namespace rotorloop {
namespace {

namespace fs = std::filesystem;
constexpr unsigned kCloseOnExec = 4;  // CLOSE_RANGE_CLOEXEC, include/uapi/linux/close_range.h
constexpr int kNotRun = 127;          // the exit code by which a shell says the same

[[noreturn]] void cannot_run(const fs::path& program, const std::string& reason) {
  throw Error({program.generic_string(), "cannot be run: " + reason, "", "check the program, and the space on the disk"}, ExitCode::device);
}

std::vector<char*> pointers_to(std::vector<std::string>& words) {
  std::vector<char*> out;
  for (std::string& w : words) out.push_back(w.data());
  out.push_back(nullptr);
  return out;
}

// All that exec needs, made before fork: in a program with threads a child may not allocate.
struct Call {
  fs::path path;
  std::vector<std::string> words, variables;
  std::vector<char*> arguments, environment;
  Descriptor opened;

  explicit Call(const ChildSetup& s) : path(fs::absolute(s.program)), words{s.program.string()} {
    words.insert(words.end(), s.arguments.begin(), s.arguments.end());
    if (s.environment) {
      variables = *s.environment;
    } else {
      for (char** e = environ; *e != nullptr; ++e) variables.emplace_back(*e);
    }
    arguments = pointers_to(words);
    environment = pointers_to(variables);
    if (!s.prepare) return;
    opened.reset(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
    if (opened.get() < 0) cannot_run(s.program, std::strerror(errno));
  }
};

// In the child; never returns. A successful exec closes `report`; otherwise the reason is written to it.
[[noreturn]] void become(const ChildSetup& s, const Call& call, int report) {
  const auto give_up = [&](const char* reason) {
    (void)!::write(report, reason, std::strlen(reason));
    ::_exit(kNotRun);
  };
  if (s.own_group) ::setpgid(0, 0);
  ::dup2(s.input >= 0 ? s.input : ::open("/dev/null", O_RDONLY | O_CLOEXEC), STDIN_FILENO);
  if (s.output >= 0) ::dup2(s.output, STDOUT_FILENO);
  if (s.errors >= 0) ::dup2(s.errors, STDERR_FILENO);
  ::syscall(SYS_close_range, 3u, ~0u, kCloseOnExec);
  for (const int fd : s.inherited) ::fcntl(fd, F_SETFD, 0);
  if (!s.folder.empty() && ::chdir(s.folder.c_str()) != 0) give_up(std::strerror(errno));
  if (s.prepare)
    if (const std::string failed = s.prepare(); !failed.empty()) give_up(failed.c_str());
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);  // after a change of user, which clears it
  if (call.opened.get() >= 0)
    ::fexecve(call.opened.get(), call.arguments.data(), call.environment.data());
  else
    ::execve(call.path.c_str(), call.arguments.data(), call.environment.data());
  give_up(std::strerror(errno));
  ::_exit(kNotRun);
}

// A signal between fork and exec would end in a handler of this program, which does nothing there: it waits until the child has its own.
class SignalsHeld {
 public:
  SignalsHeld() {
    sigset_t all;
    sigfillset(&all);
    ::pthread_sigmask(SIG_BLOCK, &all, &before_);
  }
  ~SignalsHeld() { ::pthread_sigmask(SIG_SETMASK, &before_, nullptr); }
  static void release_in_child() {
    for (const int s : {SIGINT, SIGTERM, SIGPIPE}) std::signal(s, SIG_DFL);
    sigset_t none;
    sigemptyset(&none);
    ::pthread_sigmask(SIG_SETMASK, &none, nullptr);
  }

 private:
  sigset_t before_;
};

}  // namespace

Pipe::Pipe() {
  int ends[2];
  if (::pipe2(ends, O_CLOEXEC) != 0) throw Error({"pipe", std::strerror(errno), "", "close other programs"}, ExitCode::device);
  read.reset(ends[0]);
  write.reset(ends[1]);
}

Descriptor output_file(const fs::path& path) {
  Descriptor file(::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644));
  if (file.get() < 0)
    throw Error({path.generic_string(), std::string("cannot be written: ") + std::strerror(errno), "", "choose another folder"},
                ExitCode::device);
  return file;
}

ChildProcess::ChildProcess(const ChildSetup& setup) : own_group_(setup.own_group) {
  const Call call(setup);
  Pipe report;
  {
    const SignalsHeld held;
    pid_ = ::fork();
    if (pid_ == 0) {
      SignalsHeld::release_in_child();
      become(setup, call, report.write.get());
    }
  }
  if (pid_ < 0) cannot_run(setup.program, std::strerror(errno));
  report.write.reset();
  exit_watch_.reset(static_cast<int>(::syscall(SYS_pidfd_open, pid_, 0)));
  std::string reason = read_all(report.read.get());
  if (exit_watch_.get() < 0) reason = "this kernel has no pidfd_open (Linux 5.3)";
  if (reason.empty()) return;
  ::kill(pid_, SIGKILL);
  while (::waitpid(pid_, nullptr, 0) < 0 && errno == EINTR) {
  }
  cannot_run(setup.program, reason);
}

ChildProcess::~ChildProcess() {
  if (own_group_)
    ::kill(-pid_, SIGKILL);
  else if (!end_)
    ::kill(pid_, SIGKILL);
  wait();
}

std::optional<ChildEnd> ChildProcess::wait(std::optional<int> limit_ms) {
  if (end_) return end_;
  pollfd watch{exit_watch_.get(), POLLIN, 0};
  int ready = 0;
  while ((ready = ::poll(&watch, 1, limit_ms.value_or(-1))) < 0 && errno == EINTR) {
  }
  if (ready <= 0) return std::nullopt;
  int status = 0;
  while (::waitpid(pid_, &status, 0) < 0 && errno == EINTR) {
  }
  end_ = WIFSIGNALED(status) ? ChildEnd{0, WTERMSIG(status)} : ChildEnd{WEXITSTATUS(status), 0};
  return end_;
}

void ChildProcess::signal(int number) {
  if (!end_) ::kill(own_group_ ? -pid_ : pid_, number);
}

std::string read_all(int fd) {
  std::string out;
  char buffer[1024];
  for (ssize_t n; (n = ::read(fd, buffer, sizeof buffer)) != 0;) {
    if (n < 0 && errno != EINTR) break;
    if (n > 0) out.append(buffer, static_cast<std::size_t>(n));
  }
  return out;
}

std::string output_of(const fs::path& program, const std::vector<std::string>& arguments) {
  Pipe output;
  ChildProcess child({.program = program, .arguments = arguments, .output = output.write.get()});
  output.write.reset();
  return read_all(output.read.get());
}

}  // namespace rotorloop
