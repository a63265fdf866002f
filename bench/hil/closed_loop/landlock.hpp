// Landlock, the kernel's sandbox for processes without privileges (Linux 5.13 and later; kernel documentation,
// userspace-api/landlock.rst): a process gives up all files but those named here, for good and for its children. Raw system calls,
// because the C library has none and the header of an older kernel knows less than the running one.
#pragma once
#include <filesystem>
#include <vector>

namespace rotorloop::closed_loop {

int landlock_version();  // of the running kernel; 0: there is none, or it is switched off

class LandlockRules {
 public:
  LandlockRules();  // everything that this kernel can forbid is forbidden
  ~LandlockRules();
  LandlockRules(const LandlockRules&) = delete;
  LandlockRules& operator=(const LandlockRules&) = delete;

  // A file, or a folder with all below it. A path that does not exist adds nothing. False: refused (errno).
  bool allow_reading(const std::filesystem::path& path);  // and running
  bool allow_everything_below(const std::filesystem::path& folder);
  bool allow_device(const std::filesystem::path& device);  // reading and writing
  // From here on, for this process and what it starts. Needs no_new_privs. False: refused (errno).
  bool enforce() const;
  bool good() const { return ruleset_ >= 0; }

 private:
  bool add(const std::filesystem::path& path, unsigned long long access);
  int ruleset_ = -1;
  unsigned long long all_ = 0;  // file rights that the running kernel can forbid
};

}  // namespace rotorloop::closed_loop
