#include "bench/hil/closed_loop/sandbox.hpp"

#include <fmt/format.h>
#include <grp.h>
#include <pwd.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <memory>

#include "bench/hil/closed_loop/landlock.hpp"
#include "host/base/child_process.hpp"
#include "host/base/error.hpp"

namespace rotorloop::closed_loop {
namespace fs = std::filesystem;
namespace {

constexpr uid_t kFirstUnused = 61000, kLastUnused = 61183;
// Of Debian's packages bubblewrap and util-linux. By full path: as root no other program of that name may come first.
constexpr const char* kBubblewrap = "/usr/bin/bwrap";
constexpr const char* kSetPrivileges = "/usr/bin/setpriv";
// What a dynamically linked program needs to start, and nothing where data are kept (/usr/share may hold installed scenarios).
// Debian's libblas and liblapack are links into /etc/alternatives.
constexpr std::array kSystemFolders{"/lib", "/lib64", "/usr/lib", "/usr/lib64", "/usr/local/lib", "/bin", "/usr/bin", "/etc/alternatives"};
constexpr std::array kSystemFiles{"/etc/ld.so.cache", "/etc/ld.so.conf"};
constexpr std::array kDevices{"/dev/null", "/dev/urandom"};

std::string failed(const char* what) { return std::string(what) + ": " + std::strerror(errno); }

std::string become(uid_t user) {
  const gid_t group = user;
  if (::setgroups(0, nullptr) != 0) return failed("giving up all groups");
  if (::setresgid(group, group, group) != 0) return failed("changing the group id");
  if (::setresuid(user, user, user) != 0) return failed("changing the user id");
  return ::setresuid(0, 0, 0) == 0 ? "the user id can be changed back" : "";
}

std::string allow(LandlockRules& rules, const SandboxFiles& files) {
  if (!rules.good()) return failed("Landlock");
  for (const char* path : kSystemFolders)
    if (!rules.allow_reading(path)) return failed(path);
  for (const char* path : kSystemFiles)
    if (!rules.allow_reading(path)) return failed(path);
  for (const char* path : kDevices)
    if (!rules.allow_device(path)) return failed(path);
  if (!rules.allow_reading(files.program)) return failed("the program");
  if (!rules.allow_everything_below(".")) return failed("the sandbox's folder");
  return "";
}

std::string bubblewrap_version() {
  const std::string line = output_of(kBubblewrap, {"--version"});
  return line.empty() ? "bubblewrap of an unknown version" : line.substr(0, line.find('\n'));
}

std::string joined(std::initializer_list<std::pair<bool, std::string>> parts, const char* separator) {
  std::string out;
  for (const auto& [has, text] : parts)
    if (has) out += (out.empty() ? "" : separator) + text;
  return out;
}

}  // namespace

std::string name(const SandboxLayers& l) {
  if (!l.any()) return "not isolated";
  return joined({{l.own_user, "own user id"}, {l.bubblewrap, "bubblewrap"}, {l.landlock, "Landlock"}}, " and ");
}

std::string enforced_by(const SandboxLayers& l) {
  return joined({{l.bubblewrap, l.bubblewrap ? bubblewrap_version() : ""},
                 {l.landlock, fmt::format("Landlock version {}", landlock_version())},
                 {l.own_user, l.own_user ? fmt::format("user id {}", unused_user_id()) : ""}},
                ", ");
}

std::vector<SandboxLayers> possible_sandboxes() {
  // Landlock alone is nothing for root, who may do more than open files.
  if (::geteuid() == 0)
    return {{.own_user = true, .bubblewrap = true}, {.own_user = true, .landlock = true}, {.bubblewrap = true}, {.own_user = true}, {}};
  return {{.bubblewrap = true}, {.landlock = true}, {}};
}

std::string what_is_missing(const SandboxLayers& l) {
  if (l.bubblewrap && ::access(kBubblewrap, X_OK) != 0)
    return fmt::format("{} is not installed: install the Debian package bubblewrap", kBubblewrap);
  if (l.landlock && landlock_version() == 0)
    return "this kernel has no Landlock (Linux 5.13 and later), or it is switched off (boot option lsm=)";
  return "";
}

uid_t unused_user_id() {
  for (uid_t id = kFirstUnused; id <= kLastUnused; ++id)
    if (!::getpwuid(id) && !::getgrgid(id)) return id;
  throw Error({"sandbox", "no unused user id between 61000 and 61183", "accounts were made there", "free one of them"}, ExitCode::device);
}

std::string hand_over(const fs::path& folder, const SandboxLayers& layers) {
  if (::geteuid() != 0) return "";
  const uid_t user = layers.own_user ? unused_user_id() : 0;
  const auto gives = [&](const fs::path& path) {
    struct stat s {};
    return (::lstat(path.c_str(), &s) == 0 && s.st_uid == user && s.st_gid == user) || ::lchown(path.c_str(), user, user) == 0;
  };
  std::error_code ec;
  if (!gives(folder)) return failed("changing the owner of the sandbox's folder");
  for (const auto& entry : fs::recursive_directory_iterator(folder, ec))
    if (!gives(entry.path())) return failed("changing the owner of the sandbox's files");
  return ec ? ec.message() : "";
}

std::vector<std::string> bubblewrap_command(const SandboxLayers& layers, const SandboxFiles& files, int status_fd) {
  std::vector<std::string> words{kBubblewrap, "--json-status-fd", std::to_string(status_fd), "--die-with-parent", "--new-session"};
  const auto add = [&](std::initializer_list<std::string> more) { words.insert(words.end(), more); };
  // Root needs no user namespace for the others, and gives its privileges up for good inside, by setpriv.
  if (layers.own_user)
    add({"--unshare-ipc", "--unshare-pid", "--unshare-net", "--unshare-uts", "--unshare-cgroup-try", "--cap-drop", "ALL", "--cap-add",
         "CAP_SETUID", "--cap-add", "CAP_SETGID"});
  else
    add({"--unshare-all", "--cap-drop", "ALL"});
  // Made by name, for folders that bwrap makes on the way to a mount are closed to all but root.
  for (const char* p : {"/usr", "/usr/local", "/etc", "/dev"}) add({"--dir", p});
  // There is no /proc: nothing in it is needed, and through it others are found.
  for (const char* p : kSystemFolders) add({"--ro-bind-try", p, p});
  for (const char* p : kSystemFiles) add({"--ro-bind-try", p, p});
  for (const char* p : kDevices) add({"--dev-bind", p, p});
  add({"--ro-bind", files.program.string(), "/program", "--bind", files.folder.string(), "/sandbox", "--chdir", "/sandbox"});
  add({"--remount-ro", "/", "--clearenv", "--setenv", "PATH", "/usr/bin:/bin", "--setenv", "LANG", "C.UTF-8", "--"});
  if (layers.own_user) {
    const auto user = std::to_string(unused_user_id());
    add({kSetPrivileges, "--reuid=" + user, "--regid=" + user, "--clear-groups", "--inh-caps=-all"});
  }
  words.emplace_back("/program");
  return words;
}

std::string enter_sandbox(const SandboxLayers& layers, const SandboxFiles& files) {
  ::umask(077);
  const rlimit no_core{0, 0};
  ::setrlimit(RLIMIT_CORE, &no_core);
  if (::chdir(files.folder.c_str()) != 0) return failed("changing to the sandbox's folder");
  if (layers.bubblewrap) return "";
  // The rules are made while every path can still be opened, and hold from the last step on.
  std::unique_ptr<LandlockRules> rules;
  if (layers.landlock) {
    rules = std::make_unique<LandlockRules>();
    if (const auto text = allow(*rules, files); !text.empty()) return text;
  }
  if (layers.own_user)
    if (const auto text = become(unused_user_id()); !text.empty()) return text;
  if (layers.any() && ::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0) return failed("giving up new privileges");
  if (rules && !rules->enforce()) return failed("Landlock");
  return "";
}

}  // namespace rotorloop::closed_loop
