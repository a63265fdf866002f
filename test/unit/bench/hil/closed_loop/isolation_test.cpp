// A sandboxed diagnosis cannot open the plant: tried for real, by every way we know, by a program in the same sandbox; and each layer is
// shown to be what holds, because without it the same attempts succeed.
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>

#include "bench/hil/closed_loop/isolation_probe.hpp"
#include "bench/hil/closed_loop/isolation_record.hpp"
#include "bench/hil/closed_loop/landlock.hpp"
#include "bench/hil/closed_loop/program_call.hpp"
#include "bench/hil/closed_loop/sandbox.hpp"
#include "test/unit/bench/temp_folder.hpp"

namespace rotorloop::closed_loop {
namespace {

namespace fs = std::filesystem;

const Prober kProber{SANDBOX_PROBER, {"try"}};

// A folder for the sandbox, alone in its parent folder as Workspace makes it, and a secret that every user of the machine may read.
struct IsolationTest : ::testing::Test {
  test::TempFolder folder;
  fs::path secret, workspace;
  void SetUp() override {
    secret = folder.write("bench/plant.toml", "the truth\n");
    fs::permissions(folder.path(), fs::perms::all);
    workspace = folder.path() / "room" / "workspace";
    fs::create_directories(workspace);
  }
  IsolationProbeResult in(const SandboxLayers& layers) {
    const std::vector secrets{secret};
    return probe(layers, workspace, kProber, secrets);
  }
  static bool opened(const IsolationProbeResult& r, const std::string& way) {
    return std::any_of(r.attempts.begin(), r.attempts.end(), [&](const Attempt& a) { return a.way == way && a.opened; });
  }
  static std::string all_opened(const IsolationProbeResult& r) {
    std::string out = r.failed;
    for (const auto& a : r.attempts)
      if (a.opened) out += "\n  " + a.way + " " + a.what;
    return out;
  }
};

TEST_F(IsolationTest, WithoutAnyTheAttemptsSucceedSoTheyAreRealAttempts) {
  const auto r = in({});
  EXPECT_FALSE(r.holds());
  for (const char* way : {"its path", "a relative path", "a symbolic link", "a hard link", "moving it here", "listing its folder",
                          "the bench's root in /proc", "the bench's working folder in /proc", "the bench's command line in /proc"})
    EXPECT_TRUE(opened(r, way)) << way;
}

TEST_F(IsolationTest, TheBestOfThisMachineHoldsOrTheRunSaysNotIsolated) {
  const std::vector secrets{secret};
  const auto tried = find_sandbox(workspace, kProber, secrets);
  ASSERT_FALSE(tried.empty());
  if (!tried.back().layers.any()) {
    EXPECT_EQ(name(tried.back().layers), "not isolated");
    EXPECT_FALSE(tried.back().holds());
    GTEST_SKIP() << "not isolated: neither bubblewrap nor Landlock holds on this machine";
  }
  EXPECT_TRUE(tried.back().holds()) << all_opened(tried.back());
  EXPECT_EQ(tried.back().attempts.size(), 16u);
}

TEST_F(IsolationTest, LandlockHoldsAloneAgainstASecretThatEveryUserMayRead) {
  if (landlock_version() == 0) GTEST_SKIP() << "this kernel has no Landlock";
  if (::geteuid() == 0) {
    // As root it is never used alone: root may read the memory of others. With a user id of its own nothing opens.
    EXPECT_TRUE(in({.own_user = true, .landlock = true}).holds()) << all_opened(in({.own_user = true, .landlock = true}));
  } else {
    EXPECT_TRUE(in({.landlock = true}).holds()) << all_opened(in({.landlock = true}));
  }
}

TEST_F(IsolationTest, BubblewrapHoldsWhereNamespacesAreAllowed) {
  for (const bool own_user : {false, true}) {
    if (own_user && ::geteuid() != 0) continue;
    const auto r = in({.own_user = own_user, .bubblewrap = true});
    if (!r.failed.empty()) GTEST_SKIP() << "no bubblewrap here: " << r.failed;
    EXPECT_TRUE(r.holds()) << all_opened(r);
    EXPECT_EQ(r.attempts.size(), 16u);
    EXPECT_TRUE(r.enforced_by.starts_with("bubblewrap 0.")) << r.enforced_by;
  }
}

// An ordinary user in a container that allows no user namespaces, made by bwrap itself.
TEST_F(IsolationTest, WhereNoUserNamespaceIsAllowedTheRecordSaysWhyBubblewrapFailedAndLandlockHolds) {
  if (landlock_version() == 0) GTEST_SKIP() << "this kernel has no Landlock";
  const std::string container = "bwrap --unshare-user --uid 61001 --gid 61001 --disable-userns --cap-drop ALL --dev-bind / / ";
  if (std::system((container + "true 2>/dev/null").c_str()) != 0) GTEST_SKIP() << "bwrap makes no container here";
  const auto record = folder.path() / "record.json";
  const std::string call = std::string(SANDBOX_PROBER) + " choose " + workspace.string() + " " + secret.string() + " >" + record.string();
  ASSERT_EQ(std::system((container + call).c_str()), 0);
  const auto summary = read_isolation_record(record);
  EXPECT_EQ(summary.layers, "Landlock");
  EXPECT_TRUE(summary.holds);
  EXPECT_EQ(summary.attempts, 16u);
  EXPECT_EQ(summary.enforced_by, "Landlock version " + std::to_string(landlock_version()));
  ASSERT_EQ(summary.gave_up.size(), 1u);
  EXPECT_TRUE(summary.gave_up[0].starts_with("bubblewrap: cannot be run: bwrap: ")) << summary.gave_up[0];
}

TEST_F(IsolationTest, AUserIdOfItsOwnOpensNothingInAFolderOfTheBenchButFilesThatAllMayRead) {
  if (::geteuid() != 0) GTEST_SKIP() << "only root can change the user id";
  EXPECT_TRUE(opened(in({.own_user = true}), "its path")) << "this is why a user id alone is not accepted";
  fs::permissions(folder.path() / "bench", fs::perms::owner_all);
  const auto r = in({.own_user = true});
  for (const char* way : {"its path", "a relative path", "a symbolic link", "a hard link", "moving it here", "listing its folder",
                          "the bench's root in /proc", "becoming root", "the bench's memory in /proc"})
    EXPECT_FALSE(opened(r, way)) << way;
}

TEST_F(IsolationTest, TheRecordNamesWhatEnforcedTheSandboxWithItsVersionAndEveryAttempt) {
  const std::vector secrets{secret};
  const auto tried = find_sandbox(workspace, kProber, secrets);
  if (!tried.back().layers.any()) GTEST_SKIP() << "not isolated on this machine";
  const auto record = folder.write("isolation.json", isolation_record(tried));
  const auto summary = read_isolation_record(record);
  EXPECT_TRUE(summary.holds);
  EXPECT_TRUE(summary.opened.empty());
  EXPECT_EQ(summary.attempts, tried.back().attempts.size());
  EXPECT_EQ(summary.layers, name(tried.back().layers));
  EXPECT_EQ(summary.enforced_by, tried.back().enforced_by);
  EXPECT_NE(summary.enforced_by.find_first_of("0123456789"), std::string::npos);
}

TEST_F(IsolationTest, WhereNothingHoldsTheRecordSaysWhyOfEveryLayer) {
  IsolationProbeResult missing, leaking, none;
  missing.layers = {.bubblewrap = true};
  missing.failed = "/usr/bin/bwrap is not installed";
  leaking.layers = {.landlock = true};
  leaking.attempts = {{"its path", "plant.toml", true}, {"a hard link", "plant.toml", false}};
  const auto summary = read_isolation_record(folder.write("isolation.json", isolation_record({missing, leaking, none})));
  EXPECT_FALSE(summary.holds);
  EXPECT_EQ(summary.layers, "not isolated");
  EXPECT_EQ(summary.gave_up, (std::vector<std::string>{"bubblewrap: /usr/bin/bwrap is not installed", "Landlock: 1 ways open"}));
}

// In every sandbox that this machine has: one folder to write in, and no other; what programs need to start can be read.
TEST_F(IsolationTest, AProgramInTheSandboxReadsTheSystemsLibrariesWritesInItsFolderAndNowhereElse) {
  for (const SandboxLayers& layers : possible_sandboxes()) {
    if (!in(layers).holds()) continue;
    ProgramCall call;
    call.program = "/bin/sh";
    call.arguments = {
        "-c",
        "echo a > here; for d in /usr/lib /usr/bin /usr/local/lib /etc/alternatives; do ls $d > /dev/null || echo closed; done; head -c 1 "
        "/dev/urandom > /dev/null || echo closed; for d in / /tmp /dev /usr/lib /etc .. " +
            folder.path().string() + "; do echo b > $d/there && echo $d; done; exit 7"};
    call.folder = workspace;
    call.output = folder.path() / "out.txt";
    call.errors = folder.path() / "errors.txt";
    call.sandbox = layers;
    EXPECT_EQ(run_program(call), 7) << name(layers);
    EXPECT_EQ(test::read_text(call.output), "") << name(layers);
    EXPECT_EQ(test::read_text(workspace / "here"), "a\n") << name(layers);
    fs::remove(workspace / "here");
  }
}

TEST_F(IsolationTest, AProgramThatBubblewrapCannotStartIsAnErrorOfTheDeviceAndNotAnExitCode) {
  if (!in({.bubblewrap = true}).failed.empty()) GTEST_SKIP() << "no bubblewrap here";
  ProgramCall call;
  call.program = folder.write("program", "no program");
  call.folder = workspace;
  call.output = folder.path() / "out.txt";
  call.errors = folder.path() / "errors.txt";
  call.sandbox = SandboxLayers{.bubblewrap = true};
  EXPECT_NE(test::error_of([&] { run_program(call); }, ExitCode::device).find("bwrap: execvp"), std::string::npos);
}

TEST(UnusedUserId, IsOneThatNoAccountHas) {
  const uid_t id = unused_user_id();
  EXPECT_GE(id, 61000u);
  EXPECT_LE(id, 61183u);
}

}  // namespace
}  // namespace rotorloop::closed_loop
