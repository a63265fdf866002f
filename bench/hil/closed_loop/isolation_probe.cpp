#include "bench/hil/closed_loop/isolation_probe.hpp"

#include <dirent.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <sched.h>
#include <sys/mount.h>
#include <sys/ptrace.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <iostream>

#include "bench/hil/closed_loop/program_call.hpp"
#include "host/base/error.hpp"

namespace rotorloop::closed_loop {
namespace fs = std::filesystem;
namespace {

bool readable(const fs::path& path) {
  const int fd = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (fd < 0) return false;
  ::close(fd);
  return true;
}

bool listable(const fs::path& folder) {
  DIR* d = ::opendir(folder.c_str());
  if (d) ::closedir(d);
  return d != nullptr;
}

bool by_symlink(const fs::path& secret) {
  ::unlink("a-symlink");
  const bool ok = ::symlink(secret.c_str(), "a-symlink") == 0 && readable("a-symlink");
  ::unlink("a-symlink");
  return ok;
}

bool by_hard_link(const fs::path& secret) {
  ::unlink("a-link");
  const bool ok = ::link(secret.c_str(), "a-link") == 0 && readable("a-link");
  ::unlink("a-link");
  return ok;
}

bool by_moving(const fs::path& secret) {
  if (::rename(secret.c_str(), "moved") != 0) return false;
  ::rename("moved", secret.c_str());
  return true;
}

// "../../../…/secret" from the working folder, more steps up than there are folders.
bool by_relative_path(const fs::path& secret) {
  fs::path p;
  for (int i = 0; i < 40; ++i) p /= "..";
  return readable(p / secret.relative_path());
}

bool by_becoming_root(const fs::path& secret) {
  (void)::setresuid(0, 0, 0);
  (void)!::seteuid(0);
  return readable(secret);
}

bool by_old_root_folder(const fs::path& secret) {
  if (::chroot(".") != 0) return false;  // the classical way out of a chroot
  for (int i = 0; i < 40; ++i) (void)!::chdir("..");
  return ::chroot(".") == 0 && readable(secret);
}

bool by_watching(pid_t process) {
  if (::ptrace(PTRACE_SEIZE, process, nullptr, nullptr) != 0) return false;
  ::ptrace(PTRACE_DETACH, process, nullptr, nullptr);
  return true;
}

// In a namespace of one's own one is root and may mount.
bool by_mounting(const fs::path& secret) {
  if (::unshare(CLONE_NEWUSER | CLONE_NEWNS) != 0 && ::unshare(CLONE_NEWNS) != 0) return false;
  ::mkdir("mounted", 0700);
  const bool mounted = ::mount(secret.parent_path().c_str(), "mounted", nullptr, MS_BIND, nullptr) == 0;
  const bool ok = readable(secret) || (mounted && readable(fs::path("mounted") / secret.filename()));
  if (mounted) ::umount("mounted");
  ::rmdir("mounted");
  return ok;
}

}  // namespace

std::size_t IsolationProbeResult::opened() const {
  return static_cast<std::size_t>(std::count_if(attempts.begin(), attempts.end(), [](const Attempt& a) { return a.opened; }));
}

std::vector<Attempt> try_all_ways(std::span<const fs::path> secrets, pid_t bench) {
  std::vector<Attempt> out;
  const fs::path process = "/proc/" + std::to_string(bench);
  for (const fs::path& s : secrets) {
    const std::string what = s.filename().string();
    out.push_back({"its path", what, readable(s)});
    out.push_back({"a relative path", what, by_relative_path(s)});
    out.push_back({"a symbolic link", what, by_symlink(s)});
    out.push_back({"a hard link", what, by_hard_link(s)});
    out.push_back({"moving it here", what, by_moving(s)});
    out.push_back({"listing its folder", what, listable(s.parent_path())});
    out.push_back({"the bench's root in /proc", what, readable(process / "root" / s.relative_path())});
    out.push_back({"the first process's root in /proc", what, readable("/proc/1/root" / s.relative_path())});
    out.push_back({"becoming root", what, by_becoming_root(s)});
  }
  // Files that the bench holds open, by their numbers.
  bool any_fd = false;
  for (int fd = 3; fd < 64; ++fd) any_fd = any_fd || readable(process / "fd" / std::to_string(fd));
  out.push_back({"the bench's open files in /proc", "", any_fd});
  out.push_back({"the bench's working folder in /proc", "", listable(process / "cwd")});
  out.push_back({"the bench's command line in /proc", "", readable(process / "cmdline")});
  out.push_back({"the bench's memory in /proc", "", readable(process / "mem")});
  out.push_back({"watching the bench as a debugger", "", by_watching(bench)});
  // Last: these change what this process is.
  if (!secrets.empty()) {
    const fs::path& s = secrets.front();
    out.push_back({"a namespace of its own", s.filename().string(), by_mounting(s)});
    out.push_back({"leaving a changed root", s.filename().string(), by_old_root_folder(s)});
  }
  return out;
}

int probe_command(std::span<const std::string> words) {
  if (words.empty()) return to_int(ExitCode::usage);
  const std::vector<fs::path> secrets(words.begin() + 1, words.end());
  for (const Attempt& a : try_all_ways(secrets, static_cast<pid_t>(std::stol(words.front()))))
    std::cout << (a.opened ? "1" : "0") << a.way << "\t" << a.what << "\n";
  std::cout << ".\n" << std::flush;
  return 0;
}

IsolationProbeResult probe(const SandboxLayers& layers, const fs::path& folder, const Prober& prober, std::span<const fs::path> secrets) {
  IsolationProbeResult out;
  out.layers = layers;
  out.failed = what_is_missing(layers);
  if (out.failed.empty()) out.failed = hand_over(folder, layers);
  if (!out.failed.empty()) return out;
  out.enforced_by = enforced_by(layers);
  ProgramCall call;
  call.program = prober.program;
  call.arguments = prober.arguments;
  call.arguments.push_back(std::to_string(::getpid()));
  for (const fs::path& s : secrets) call.arguments.push_back(s.string());
  call.folder = folder;
  call.output = folder.parent_path() / "probe.txt";
  call.errors = folder.parent_path() / "probe-messages.txt";
  call.sandbox = layers;
  std::string message;
  call.line = [&](const std::string& line) { message = line; };
  int code = 0;
  try {
    code = run_program(call);
  } catch (const Error& e) {
    out.failed = e.text().what;
    return out;
  }
  bool complete = false;
  std::ifstream in(call.output);
  for (std::string line; std::getline(in, line);) {
    if (line == ".")
      complete = true;
    else if (const auto tab = line.find('\t'); tab != std::string::npos && tab > 0)
      out.attempts.push_back({line.substr(1, tab - 1), line.substr(tab + 1), line.front() == '1'});
  }
  if (!complete) out.failed = fmt::format("the program that tried it ended early, with {}: {}", code, message);
  return out;
}

std::vector<IsolationProbeResult> find_sandbox(const fs::path& folder, const Prober& prober, std::span<const fs::path> secrets) {
  std::vector<IsolationProbeResult> out;
  for (const SandboxLayers& layers : possible_sandboxes()) {
    out.push_back(probe(layers, folder, prober, secrets));
    if (out.back().holds()) break;
  }
  return out;
}

}  // namespace rotorloop::closed_loop
