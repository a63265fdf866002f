// XFOIL (Drela; Debian's package xfoil) as a process: one sweep over angles of one section at one Reynolds number.
#pragma once
#include <filesystem>
#include <map>
#include <optional>
#include <string>

#include "bench/propeller/polar/section_shape.hpp"

namespace rotorloop::propeller {

struct XfoilPoint {
  double cl, cd;
};
using XfoilPoints = std::map<int, XfoilPoint>;  // by angle in thousandths of a degree, as XFOIL writes it

struct XfoilSweep {
  double reynolds, n_crit, last_deg, step_deg;  // from 0 degrees on
  double time_limit_s;
};

class XfoilProgram {
 public:
  // The one on PATH; nothing where there is none. Throws Error (device) for one that cannot be run.
  static std::optional<XfoilProgram> find();
  static bool on_path();
  ~XfoilProgram();
  XfoilProgram(XfoilProgram&& other) noexcept;
  XfoilProgram(const XfoilProgram&) = delete;

  const std::string& version() const { return version_; }  // "6.99"

  struct Result {
    XfoilPoints points;  // that converged
    bool hung = false;   // ended at the time limit; what had converged before is there
  };
  Result sweep(const SectionShape& section, const XfoilSweep& sweep) const;

 private:
  explicit XfoilProgram(std::filesystem::path program);
  bool run(const std::string& script, double time_limit_s) const;  // false: ended at the limit

  std::filesystem::path program_, folder_;  // a folder of its own below the system's temporary one
  std::string version_;
};

}  // namespace rotorloop::propeller
