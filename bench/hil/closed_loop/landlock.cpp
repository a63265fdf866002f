#include "bench/hil/closed_loop/landlock.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>

namespace rotorloop::closed_loop {
namespace {

// Numbers of the generic system call table; the same on every architecture (include/uapi/asm-generic/unistd.h).
constexpr long kCreateRuleset = 444, kAddRule = 445, kRestrictSelf = 446;
constexpr unsigned kAskVersion = 1;
constexpr int kPathBeneath = 1;

// Bits of include/uapi/linux/landlock.h.
constexpr std::uint64_t kExecute = 1u << 0, kWriteFile = 1u << 1, kReadFile = 1u << 2, kReadDir = 1u << 3;
constexpr std::uint64_t kVersion1 = (1u << 13) - 1;  // those, removing, making: 13 rights
constexpr std::uint64_t kRefer = 1u << 13;           // version 2: links and renames between folders
constexpr std::uint64_t kTruncate = 1u << 14;        // version 3
constexpr std::uint64_t kIoctlDevice = 1u << 15;     // version 5
constexpr std::uint64_t kTcp = 3;                    // version 4: bind and connect
constexpr std::uint64_t kScopes = 3;                 // version 6: abstract sockets and signals to processes outside

struct RulesetAttributes {
  std::uint64_t files = 0, net = 0, scopes = 0;
};
struct [[gnu::packed]] PathBeneath {
  std::uint64_t access = 0;
  std::int32_t folder = -1;
};

}  // namespace

int landlock_version() {
  const long v = ::syscall(kCreateRuleset, nullptr, 0, kAskVersion);
  return v > 0 ? static_cast<int>(v) : 0;
}

LandlockRules::LandlockRules() {
  const int version = landlock_version();
  if (version == 0) return;
  RulesetAttributes a;
  a.files = kVersion1 | (version >= 2 ? kRefer : 0) | (version >= 3 ? kTruncate : 0) | (version >= 5 ? kIoctlDevice : 0);
  if (version >= 4) a.net = kTcp;
  if (version >= 6) a.scopes = kScopes;
  all_ = a.files;
  // An older kernel takes a shorter struct; what lies behind is zero there.
  const std::size_t size = version >= 6 ? 24 : version >= 4 ? 16 : 8;
  ruleset_ = static_cast<int>(::syscall(kCreateRuleset, &a, size, 0));
}

LandlockRules::~LandlockRules() {
  if (ruleset_ >= 0) ::close(ruleset_);
}

bool LandlockRules::add(const std::filesystem::path& path, unsigned long long access) {
  const int fd = ::open(path.c_str(), O_PATH | O_CLOEXEC);
  if (fd < 0) return errno == ENOENT;
  struct stat s {};
  PathBeneath rule{access & all_, fd};
  // A rule for a file may only hold rights that files have.
  if (::fstat(fd, &s) == 0 && !S_ISDIR(s.st_mode)) rule.access &= kExecute | kWriteFile | kReadFile | kTruncate | kIoctlDevice;
  const bool ok = ::syscall(kAddRule, ruleset_, kPathBeneath, &rule, 0) == 0;
  ::close(fd);
  return ok;
}

bool LandlockRules::allow_reading(const std::filesystem::path& path) { return add(path, kExecute | kReadFile | kReadDir); }
bool LandlockRules::allow_everything_below(const std::filesystem::path& folder) { return add(folder, all_ & ~kRefer & ~kIoctlDevice); }
bool LandlockRules::allow_device(const std::filesystem::path& device) { return add(device, kReadFile | kWriteFile); }

bool LandlockRules::enforce() const { return ::syscall(kRestrictSelf, ruleset_, 0) == 0; }

}  // namespace rotorloop::closed_loop
