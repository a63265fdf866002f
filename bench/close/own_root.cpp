#include "bench/close/own_root.hpp"

#include <fcntl.h>
#include <sched.h>
#include <sys/mount.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>

namespace rotorloop::closed_loop {
namespace fs = std::filesystem;
namespace {

std::string failed(const std::string& what) { return what + ": " + std::strerror(errno); }

bool write_once(const char* path, const std::string& text) {
  std::ofstream out(path);
  out << text;
  out.close();
  return static_cast<bool>(out);
}

// Without privileges: in a user namespace of one's own, oneself stays oneself and may mount.
std::string own_user_namespace() {
  const std::string user = std::to_string(::geteuid()), group = std::to_string(::getegid());
  if (::unshare(CLONE_NEWUSER) != 0) return failed("user namespace");
  if (!write_once("/proc/self/setgroups", "deny") || !write_once("/proc/self/uid_map", user + " " + user + " 1") ||
      !write_once("/proc/self/gid_map", group + " " + group + " 1"))
    return failed("map of the user namespace");
  return "";
}

// `from` becomes visible as `to`; a link is copied as a link. What does not exist is left out.
std::string show(const fs::path& from, const fs::path& to, bool read_only) {
  std::error_code ec;
  const auto status = fs::symlink_status(from, ec);
  if (!fs::exists(status)) return "";
  fs::create_directories(to.parent_path(), ec);
  if (fs::is_symlink(status)) {
    fs::copy_symlink(from, to, ec);
    return ec ? to.string() + ": " + ec.message() : "";
  }
  if (fs::is_directory(status))
    fs::create_directories(to, ec);
  else
    write_once(to.c_str(), "");
  if (::mount(from.c_str(), to.c_str(), nullptr, MS_BIND | MS_REC, nullptr) != 0) return failed("mounting " + from.string());
  // Flags that the mount has already must be repeated inside a user namespace; nosuid and nodev hold nearly everywhere.
  const unsigned long flags = MS_BIND | MS_REMOUNT | MS_RDONLY | MS_NOSUID;
  if (read_only && ::mount(nullptr, to.c_str(), nullptr, flags, nullptr) != 0 &&
      ::mount(nullptr, to.c_str(), nullptr, flags | MS_NODEV, nullptr) != 0)
    return failed("making " + from.string() + " read-only");
  return "";
}

}  // namespace

std::string enter_own_root(const Room& room) {
  if (::geteuid() != 0)
    if (const auto text = own_user_namespace(); !text.empty()) return text;
  if (::unshare(CLONE_NEWNS) != 0) return failed("mount namespace");
  if (::mount(nullptr, "/", nullptr, MS_REC | MS_PRIVATE, nullptr) != 0) return failed("keeping mounts to oneself");
  // The new root stands in an empty folder beside the desk; the memory file system in it ends with the process.
  const fs::path at = room.desk.parent_path() / "root";
  const std::string root = at.string();
  if (::mkdir(root.c_str(), 0700) != 0 && errno != EEXIST) return failed("folder of the new root");
  if (::mount("tmpfs", root.c_str(), "tmpfs", MS_NOSUID | MS_NODEV, "size=1m,mode=0755") != 0) return failed("root of its own");
  for (const char* p : kSystemFolders)
    if (const auto text = show(p, at / fs::path(p).relative_path(), true); !text.empty()) return text;
  for (const char* p : kSystemFiles)
    if (const auto text = show(p, at / fs::path(p).relative_path(), true); !text.empty()) return text;
  for (const char* p : kDevices)
    if (const auto text = show(p, at / fs::path(p).relative_path(), false); !text.empty()) return text;
  if (const auto text = show(room.program, at / "program", true); !text.empty()) return text;
  if (const auto text = show(room.desk, at / "desk", false); !text.empty()) return text;
  if (::chdir(root.c_str()) != 0 || ::syscall(SYS_pivot_root, ".", ".") != 0) return failed("changing the root");
  if (::umount2(".", MNT_DETACH) != 0) return failed("leaving the old root");
  if (::chdir("/desk") != 0) return failed("the desk in the new root");
  return "";
}

}  // namespace rotorloop::closed_loop
