#include "bench/close/isolation_probe.hpp"

#include <dirent.h>
#include <fcntl.h>
#include <sched.h>
#include <sys/mount.h>
#include <sys/ptrace.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

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

IsolationProbeResult probe(const Isolation& isolation, const Room& room, std::span<const fs::path> secrets) {
  IsolationProbeResult out;
  out.isolation = isolation;
  int ends[2];
  if (::pipe2(ends, O_CLOEXEC) != 0) throw Error({"isolation", std::strerror(errno), "", ""}, ExitCode::device);
  const pid_t bench = ::getpid();
  const pid_t child = ::fork();
  if (child < 0) throw Error({"isolation", std::strerror(errno), "too many processes", ""}, ExitCode::device);
  if (child == 0) {
    ::close(ends[0]);
    std::string text;
    if (const auto failed = enter_room(isolation, room); !failed.empty()) {
      text = "!" + failed + "\n";
    } else {
      for (const Attempt& a : try_all_ways(secrets, bench)) text += (a.opened ? "1" : "0") + a.way + "\t" + a.what + "\n";
      text += ".\n";
    }
    for (std::size_t at = 0; at < text.size();) {
      const ssize_t n = ::write(ends[1], text.data() + at, text.size() - at);
      if (n <= 0) break;
      at += static_cast<std::size_t>(n);
    }
    ::_exit(0);
  }
  ::close(ends[1]);
  std::string text;
  char buffer[4096];
  for (ssize_t n; (n = ::read(ends[0], buffer, sizeof buffer)) != 0;) {
    if (n < 0 && errno != EINTR) break;
    if (n > 0) text.append(buffer, static_cast<std::size_t>(n));
  }
  ::close(ends[0]);
  ::waitpid(child, nullptr, 0);
  bool complete = false;
  for (std::size_t at = 0; at < text.size();) {
    const auto end = std::min(text.find('\n', at), text.size());
    const std::string line = text.substr(at, end - at);
    at = end + 1;
    if (line == ".")
      complete = true;
    else if (line.starts_with('!'))
      out.failed = line.substr(1);
    else if (const auto tab = line.find('\t'); tab != std::string::npos && tab > 0)
      out.attempts.push_back({line.substr(1, tab - 1), line.substr(tab + 1), line.front() == '1'});
  }
  if (!complete && out.failed.empty()) out.failed = "the process that tried it ended early";
  return out;
}

std::vector<IsolationProbeResult> find_isolation(const Room& room, std::span<const fs::path> secrets) {
  std::vector<IsolationProbeResult> out;
  for (const Isolation& i : possible_isolations()) {
    hand_over(room.desk, i);
    out.push_back(probe(i, room, secrets));
    if (out.back().holds()) break;
  }
  return out;
}

}  // namespace rotorloop::closed_loop
