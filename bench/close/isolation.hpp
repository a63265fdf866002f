// Keeps the analyst away from the truth. Who diagnoses a simulated vehicle must not be able to open the plant that flew, or the figures
// mean nothing. A process is shut into a room: one desk to write on, the system's libraries and its own program to run, nothing else.
// Three layers, as the machine allows: an own user id (when started as root), Landlock, and a root folder of its own (mount namespace).
// No layer is believed: isolation_probe.hpp tries the doors from inside.
#pragma once
#include <sys/types.h>

#include <filesystem>
#include <string>
#include <vector>

namespace rotorloop::closed_loop {

struct Isolation {
  bool own_user = false;  // a user id that nobody has
  bool landlock = false;
  bool own_root = false;  // a mount namespace with nothing in it but the room
  bool any() const { return own_user || landlock || own_root; }
  friend bool operator==(const Isolation&, const Isolation&) = default;
};
std::string name(const Isolation& isolation);  // "own user id and Landlock", "not isolated"

struct Room {
  std::filesystem::path desk;     // the only folder that can be written; the working folder. Absolute, alone in its parent folder
  std::filesystem::path program;  // that runs; absolute
};

// What this machine may be able to do, best first; the last is no isolation at all.
std::vector<Isolation> possible_isolations();

// A user id that no account has, from the range that systemd's documentation ("Users, Groups, UIDs and GIDs") leaves unused.
uid_t unused_user_id();

// Hands the desk and all on it to the user who will work there.
void hand_over(const std::filesystem::path& desk, const Isolation& isolation);

// For a process between fork and exec: shuts itself in, for good. Returns what failed, empty when nothing did; a process in which
// it failed must end.
std::string enter_room(const Isolation& isolation, const Room& room);

}  // namespace rotorloop::closed_loop
