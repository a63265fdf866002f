#include "bench/propeller/polar/xfoil_program.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <sstream>
#include <utility>
#include <vector>

#include "host/base/child_process.hpp"
#include "host/base/error.hpp"

// The shared object of xfoil_traps.cpp.
asm(".section .rodata\n"
    ".global rotorloop_xfoil_traps_begin\n.global rotorloop_xfoil_traps_end\n"
    "rotorloop_xfoil_traps_begin:\n.incbin \"" ROTORLOOP_XFOIL_TRAPS "\"\nrotorloop_xfoil_traps_end:\n.byte 0\n.previous\n");
extern "C" const char rotorloop_xfoil_traps_begin[], rotorloop_xfoil_traps_end[];

namespace rotorloop::propeller {
namespace fs = std::filesystem;
namespace {

constexpr const char* kTraps = "traps.so";
constexpr double kVersionLimit_s = 10.0;
constexpr int kIterations = 200;

std::optional<fs::path> program_on_path(const std::string& name) {
  const char* path = std::getenv("PATH");
  std::istringstream folders(path != nullptr ? path : "");
  for (std::string folder; std::getline(folders, folder, ':');) {
    const fs::path p = fs::path(folder.empty() ? "." : folder) / name;
    std::error_code ec;
    if (fs::is_regular_file(p, ec) && ::access(p.c_str(), X_OK) == 0) return fs::absolute(p, ec);
  }
  return std::nullopt;
}

[[noreturn]] void fail(const fs::path& where, const std::string& what) {
  throw Error(
      {where.generic_string(), what, "", "check the package xfoil, and TMPDIR for space and for a place that programs may be run from"},
      ExitCode::device);
}

}  // namespace

std::optional<XfoilProgram> XfoilProgram::find() {
  const auto program = program_on_path("xfoil");
  if (!program) return std::nullopt;
  return XfoilProgram(*program);
}

bool XfoilProgram::on_path() { return program_on_path("xfoil").has_value(); }

XfoilProgram::XfoilProgram(fs::path program) : program_(std::move(program)) {
  std::string name = (fs::temp_directory_path() / "rotorloop_xfoil_XXXXXX").string();
  if (::mkdtemp(name.data()) == nullptr) fail(name, std::strerror(errno));
  folder_ = name;
  std::ofstream(folder_ / kTraps, std::ios::binary)
      .write(rotorloop_xfoil_traps_begin, rotorloop_xfoil_traps_end - rotorloop_xfoil_traps_begin);
  run("QUIT\n", kVersionLimit_s);
  std::ifstream output(folder_ / "output.txt");
  std::string word;
  while (output >> word)
    if (word == "Version" && output >> version_) break;
  if (version_.empty()) fail(program_, "starts without the line \"XFOIL Version\"");
}

XfoilProgram::XfoilProgram(XfoilProgram&& other) noexcept
    : program_(std::move(other.program_)), folder_(std::exchange(other.folder_, {})), version_(std::move(other.version_)) {}

XfoilProgram::~XfoilProgram() {
  std::error_code ec;
  if (!folder_.empty()) fs::remove_all(folder_, ec);
}

bool XfoilProgram::run(const std::string& script, double time_limit_s) const {
  std::ofstream(folder_ / "script.txt") << script;
  const Descriptor input(::open((folder_ / "script.txt").c_str(), O_RDONLY | O_CLOEXEC)), output = output_file(folder_ / "output.txt");
  std::vector<std::string> environment{"LD_PRELOAD=" + (folder_ / kTraps).string()};
  for (char** e = environ; *e != nullptr; ++e)
    if (std::strncmp(*e, "LD_PRELOAD=", 11) != 0) environment.emplace_back(*e);
  ChildProcess child({.program = program_,
                      .folder = folder_,
                      .input = input.get(),
                      .output = output.get(),
                      .errors = output.get(),
                      .environment = std::move(environment)});
  const auto end = child.wait(static_cast<int>(1000.0 * time_limit_s));
  // A floating-point exception: the library in front was not loaded. Any other crash costs the sweep, not the section.
  if (end && end->signal == SIGFPE) fail(program_, "ended by a floating-point exception although its traps are off");
  return end.has_value();
}

XfoilProgram::Result XfoilProgram::sweep(const SectionShape& section, const XfoilSweep& s) const {
  std::error_code ec;
  fs::remove(folder_ / "polar.txt", ec);
  if (section.naca.empty()) {
    std::ofstream f(folder_ / "section.dat");
    f << "section\n";
    for (std::size_t i = 0; i < section.x.size(); ++i) f << fmt::format("{:.6f} {:.6f}\n", section.x[i], section.y[i]);
  }
  const std::string load = section.naca.empty() ? "LOAD section.dat" : "NACA " + section.naca;
  Result r;
  r.hung = !run(fmt::format("PLOP\nG F\n\n{}\nPANE\nOPER\nVPAR\nN {}\n\nVISC {:.0f}\nITER {}\nPACC\npolar.txt\n\nASEQ 0 {} {}\n\n\nQUIT\n",
                            load, s.n_crit, s.reynolds, kIterations, s.last_deg, s.step_deg),
                s.time_limit_s);
  std::ifstream polar(folder_ / "polar.txt");
  for (std::string line; std::getline(polar, line);) {
    std::istringstream fields(line);
    double alpha, cl, cd;
    if (fields >> alpha >> cl >> cd && cd > 0.0)
      r.points[static_cast<int>(alpha < 0.0 ? 1000.0 * alpha - 0.5 : 1000.0 * alpha + 0.5)] = {cl, cd};
  }
  return r;
}

}  // namespace rotorloop::propeller
