// A root folder that holds nothing but a room, for kernels without Landlock: a mount namespace (as root, or inside a user namespace of
// one's own) in which the system's libraries are mounted read-only, the desk writable, and the old root is gone. There is no /proc.
#pragma once
#include <array>
#include <string>

#include "bench/close/isolation.hpp"

namespace rotorloop::closed_loop {

// What a dynamically linked program needs to start, and nothing where data are kept (/usr/share may hold installed scenarios).
inline constexpr std::array kSystemFolders{"/lib", "/lib64", "/usr/lib", "/usr/lib64", "/usr/local/lib", "/bin", "/usr/bin"};
inline constexpr std::array kSystemFiles{"/etc/ld.so.cache", "/etc/ld.so.conf"};
inline constexpr std::array kDevices{"/dev/null", "/dev/urandom"};

// The working folder is the desk, before and after. Returns what failed, empty when nothing did.
std::string enter_own_root(const Room& room);

}  // namespace rotorloop::closed_loop
