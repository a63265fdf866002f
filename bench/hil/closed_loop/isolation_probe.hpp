// Whether a sandbox holds, found by trying: a program started in it exactly as the diagnosis will be attempts every way we know to read
// what it must not. What counts is what it could open, not what the layers promise.
#pragma once
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "bench/hil/closed_loop/sandbox.hpp"

namespace rotorloop::closed_loop {

struct Attempt {
  std::string way;   // "its path", "a hard link to it", "the bench's root in /proc"
  std::string what;  // the secret, or what stands for it
  bool opened = false;
};

struct IsolationProbeResult {
  SandboxLayers layers;
  std::string enforced_by;  // with versions
  std::vector<Attempt> attempts;
  std::string failed;  // the sandbox could not be entered at all: why
  std::size_t opened() const;
  bool holds() const { return failed.empty() && layers.any() && !attempts.empty() && opened() == 0; }
};

// All ways, from inside whatever holds this process; may leave links on the working folder. `bench`: the process that knows the truth.
std::vector<Attempt> try_all_ways(std::span<const std::filesystem::path> secrets, pid_t bench);

// The program that tries, in a sandbox: answers `program arguments… PID SECRET…` by probe_command(PID SECRET…).
struct Prober {
  std::filesystem::path program;
  std::vector<std::string> arguments;
};
// Writes all attempts to standard output, for probe() to read. Exit code.
int probe_command(std::span<const std::string> words);

// All ways, from inside a sandbox around `folder`.
IsolationProbeResult probe(const SandboxLayers& layers, const std::filesystem::path& folder, const Prober& prober,
                           std::span<const std::filesystem::path> secrets);

// The first of possible_sandboxes() that holds, or the last of them. Every result, in the order tried.
std::vector<IsolationProbeResult> find_sandbox(const std::filesystem::path& folder, const Prober& prober,
                                               std::span<const std::filesystem::path> secrets);

}  // namespace rotorloop::closed_loop
