#include "bench/close/isolation.hpp"

#include <fcntl.h>
#include <grp.h>
#include <pwd.h>
#include <sched.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <memory>

#include "bench/close/landlock.hpp"
#include "bench/close/own_root.hpp"
#include "host/base/error.hpp"

namespace rotorloop::closed_loop {
namespace fs = std::filesystem;
namespace {

constexpr uid_t kFirstUnused = 61000, kLastUnused = 61183;

std::string failed(const char* what) { return std::string(what) + ": " + std::strerror(errno); }

std::string become(uid_t user) {
  const gid_t group = user;
  if (::setgroups(0, nullptr) != 0) return failed("giving up all groups");
  if (::setresgid(group, group, group) != 0) return failed("changing the group id");
  if (::setresuid(user, user, user) != 0) return failed("changing the user id");
  return ::setresuid(0, 0, 0) == 0 ? "the user id can be changed back" : "";
}

std::string allow(LandlockRules& rules, const Room& room) {
  if (!rules.good()) return failed("Landlock");
  for (const char* path : kSystemFolders)
    if (!rules.allow_reading(path)) return failed(path);
  for (const char* path : kSystemFiles)
    if (!rules.allow_reading(path)) return failed(path);
  for (const char* path : kDevices)
    if (!rules.allow_device(path)) return failed(path);
  if (!rules.allow_reading(room.program)) return failed("the program");
  if (!rules.allow_everything_below(".")) return failed("the desk");
  return "";
}

}  // namespace

std::string name(const Isolation& i) {
  std::string out;
  const auto add = [&](bool has, const char* text) {
    if (has) out += (out.empty() ? "" : " and ") + std::string(text);
  };
  add(i.own_user, "own user id");
  add(i.landlock, "Landlock");
  add(i.own_root, "own root folder");
  return out.empty() ? "not isolated" : out;
}

std::vector<Isolation> possible_isolations() {
  const bool root = ::geteuid() == 0;
  std::vector<Isolation> out;
  if (landlock_version() > 0) out.push_back({.own_user = root, .landlock = true});
  out.push_back({.own_user = root, .own_root = true});
  if (root) out.push_back({.own_user = true});
  out.push_back({});
  return out;
}

uid_t unused_user_id() {
  for (uid_t id = kFirstUnused; id <= kLastUnused; ++id)
    if (!::getpwuid(id) && !::getgrgid(id)) return id;
  throw Error({"isolation", "no unused user id between 61000 and 61183", "accounts were made there", "free one of them"}, ExitCode::device);
}

void hand_over(const fs::path& desk, const Isolation& isolation) {
  if (!isolation.own_user) return;
  const uid_t user = unused_user_id();
  const auto give = [&](const fs::path& p) {
    if (::lchown(p.c_str(), user, user) != 0)
      throw Error({p.generic_string(), failed("cannot be handed to the analyst"), "", "use a temporary folder on a local disk (TMPDIR)"},
                  ExitCode::device);
  };
  give(desk);
  for (const auto& entry : fs::recursive_directory_iterator(desk)) give(entry.path());
}

std::string enter_room(const Isolation& isolation, const Room& room) {
  ::umask(077);
  const rlimit no_core{0, 0};
  ::setrlimit(RLIMIT_CORE, &no_core);
  if (::chdir(room.desk.c_str()) != 0) return failed("changing to the desk");
  if (isolation.own_root)
    if (const auto text = enter_own_root(room); !text.empty()) return text;
  // The rules are made while every path can still be opened, and hold from the last step on.
  std::unique_ptr<LandlockRules> rules;
  if (isolation.landlock) {
    rules = std::make_unique<LandlockRules>();
    if (const auto text = allow(*rules, room); !text.empty()) return text;
  }
  if (isolation.own_user)
    if (const auto text = become(unused_user_id()); !text.empty()) return text;
  if (isolation.any() && ::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0) return failed("giving up new privileges");
  if (isolation.any()) ::prctl(PR_SET_DUMPABLE, 0, 0, 0, 0);
  if (rules && !rules->enforce()) return failed("Landlock");
  return "";
}

}  // namespace rotorloop::closed_loop
