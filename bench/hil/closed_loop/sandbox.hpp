// Keeps a diagnosis away from the truth. Who diagnoses a simulated vehicle must not be able to open the plant that flew, or the figures
// mean nothing: its process runs in a sandbox with one folder to write in, the system's libraries and its own program, nothing else.
// Bubblewrap makes the sandbox (namespaces of its own for mounts, processes, network, users). Where bwrap is missing or namespaces are
// not allowed, as in many containers, Landlock keeps the files closed. As root either works under a user id that no account has.
// No layer is trusted for its name: isolation_probe.hpp tries to get out from inside. Decision 0089.
#pragma once
#include <sys/types.h>

#include <filesystem>
#include <string>
#include <vector>

namespace rotorloop::closed_loop {

struct SandboxLayers {
  bool own_user = false;  // a user id that no account has
  bool bubblewrap = false;
  bool landlock = false;
  bool any() const { return own_user || bubblewrap || landlock; }
  friend bool operator==(const SandboxLayers&, const SandboxLayers&) = default;
};
std::string name(const SandboxLayers& layers);         // "own user id and bubblewrap", "not isolated"
std::string enforced_by(const SandboxLayers& layers);  // "bubblewrap 0.8.0", "Landlock version 7, user id 61000"

struct SandboxFiles {
  std::filesystem::path folder;   // the only one that can be written, and the working folder. Absolute, alone in its parent folder
  std::filesystem::path program;  // that runs; absolute
};

// What may hold on some machine for the user of this process, best first; the last is no sandbox at all.
std::vector<SandboxLayers> possible_sandboxes();

// What this machine lacks for them and how to get it; empty where only trying shows it.
std::string what_is_missing(const SandboxLayers& layers);

// A user id that no account has, from the range that systemd's documentation ("Users, Groups, UIDs and GIDs") leaves unused.
uid_t unused_user_id();

// Gives the folder and all in it to the user who will work there. Returns what failed, empty when nothing did.
std::string hand_over(const std::filesystem::path& folder, const SandboxLayers& layers);

// The command line of bwrap in front of the program's own arguments. bwrap reports to the open file `status_fd` (--json-status-fd).
std::vector<std::string> bubblewrap_command(const SandboxLayers& layers, const SandboxFiles& files, int status_fd);

// For a process between fork and exec: all but bubblewrap, which is a program of its own. For good. Returns what failed, empty when
// nothing did; a process in which it failed must end.
std::string enter_sandbox(const SandboxLayers& layers, const SandboxFiles& files);

}  // namespace rotorloop::closed_loop
