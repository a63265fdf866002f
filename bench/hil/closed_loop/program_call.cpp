#include "bench/hil/closed_loop/program_call.hpp"

#include <poll.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>

#include "host/base/child_process.hpp"
#include "host/base/error.hpp"

namespace rotorloop::closed_loop {
namespace fs = std::filesystem;
namespace {

constexpr int kPoll_ms = 200;

// `report`: where bwrap says how the program ended.
ChildSetup setup_of(const ProgramCall& c, int report) {
  ChildSetup s{.program = c.program, .arguments = c.arguments, .folder = c.folder};
  if (!c.sandbox) return s;
  s.environment = {"PATH=/usr/bin:/bin", "LANG=C.UTF-8"};
  s.prepare = [&c] {
    ::setsid();  // no terminal either
    return enter_sandbox(*c.sandbox, {c.folder, c.program});
  };
  if (!c.sandbox->bubblewrap) return s;
  s.arguments = bubblewrap_command(*c.sandbox, {c.folder, c.program}, report);
  s.program = s.arguments.front();
  s.arguments.erase(s.arguments.begin());
  s.arguments.insert(s.arguments.end(), c.arguments.begin(), c.arguments.end());
  s.inherited = {report};
  return s;
}

// Whole lines of `pending` to the listener; what is left stays.
void emit_lines(std::string& pending, const std::function<void(const std::string&)>& line) {
  for (std::size_t end; (end = pending.find_first_of("\n\r")) != std::string::npos; pending.erase(0, end + 1))
    if (end > 0) line(pending.substr(0, end));
}

// The child's messages, to the file `errors` and the listener, until it has closed them; the last line that is not empty.
std::string follow(const ProgramCall& c, ChildProcess& child, int messages, int errors) {
  std::string pending, last;
  const auto emit = [&](const std::string& line) {
    last = line;
    if (c.line) c.line(line);
  };
  bool asked = false;
  for (char buffer[4096];;) {
    if (c.stop && c.stop->load(std::memory_order_relaxed) && !asked) {
      child.signal(SIGINT);
      asked = true;
    }
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

}  // namespace

fs::path own_program() {
  std::error_code ec;
  const fs::path p = fs::read_symlink("/proc/self/exe", ec);
  if (ec) throw Error({"/proc/self/exe", ec.message(), "there is no /proc here", "name the program with --program"}, ExitCode::device);
  return p;
}

int run_program(const ProgramCall& c) {
  const Descriptor output = output_file(c.output), errors = output_file(c.errors);
  Pipe messages, report;
  ChildSetup setup = setup_of(c, report.write.get());
  setup.output = output.get();
  setup.errors = messages.write.get();
  ChildProcess child(setup);
  messages.write.reset();
  report.write.reset();
  const std::string last_line = follow(c, child, messages.read.get(), errors.get());
  const ChildEnd end = *child.wait();
  if (end.signal > 0) return 128 + end.signal;
  // bwrap returns the exit code of a program that it could start; else its last message says why not.
  if (c.sandbox && c.sandbox->bubblewrap && read_all(report.read.get()).find("\"exit-code\"") == std::string::npos)
    throw Error({c.program.generic_string(), "cannot be run: " + last_line, "", "check the program and the space on the disk"},
                ExitCode::device);
  return end.exit_code;
}

}  // namespace rotorloop::closed_loop
