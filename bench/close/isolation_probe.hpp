// Whether an isolation holds, found by trying: a process shut into the room attempts every way we know to read what it must not. What
// counts is what it could open, not what the layers promise.
#pragma once
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "bench/close/isolation.hpp"

namespace rotorloop::closed_loop {

struct Attempt {
  std::string way;   // "its path", "a hard link to it", "the bench's root in /proc"
  std::string what;  // the secret, or what stands for it
  bool opened = false;
};

struct IsolationProbeResult {
  Isolation isolation;
  std::vector<Attempt> attempts;
  std::string failed;  // the layer could not be entered at all: why
  std::size_t opened() const;
  bool holds() const { return failed.empty() && isolation.any() && !attempts.empty() && opened() == 0; }
};

// All ways, from inside whatever holds this process; may leave links on the working folder. `bench`: the process that knows the truth.
std::vector<Attempt> try_all_ways(std::span<const std::filesystem::path> secrets, pid_t bench);

// The same in a child shut into the room.
IsolationProbeResult probe(const Isolation& isolation, const Room& room, std::span<const std::filesystem::path> secrets);

// The first of possible_isolations() that holds, or the last of them. Every result, in the order tried.
std::vector<IsolationProbeResult> find_isolation(const Room& room, std::span<const std::filesystem::path> secrets);

}  // namespace rotorloop::closed_loop
