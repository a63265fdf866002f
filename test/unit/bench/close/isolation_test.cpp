// The analyst cannot open the plant: tried for real, by every way we know, in the same room that the analyst gets; and each layer is
// shown to be what holds, because without it the same attempts succeed.
#include "bench/close/isolation.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>

#include "bench/close/isolation_probe.hpp"
#include "bench/close/isolation_record.hpp"
#include "bench/close/landlock.hpp"
#include "test/unit/bench/temp_folder.hpp"

namespace rotorloop::closed_loop {
namespace {

namespace fs = std::filesystem;

// A desk alone in its folder as Desk makes it, and a secret that every user of the machine may read.
struct IsolationTest : ::testing::Test {
  test::TempFolder folder;
  fs::path secret, desk;
  void SetUp() override {
    secret = folder.write("bench/plant.toml", "the truth\n");
    fs::permissions(folder.path(), fs::perms::all);
    desk = folder.path() / "room" / "desk";
    fs::create_directories(desk);
  }
  IsolationProbeResult in(const Isolation& isolation) {
    hand_over(desk, isolation);
    const std::vector secrets{secret};
    return probe(isolation, {desk, "/bin/true"}, secrets);
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
  const auto tried = find_isolation({desk, "/bin/true"}, secrets);
  ASSERT_FALSE(tried.empty());
  if (!tried.back().isolation.any()) {
    EXPECT_EQ(name(tried.back().isolation), "not isolated");
    EXPECT_FALSE(tried.back().holds());
    GTEST_SKIP() << "not isolated: neither Landlock nor a namespace holds on this machine";
  }
  EXPECT_TRUE(tried.back().holds()) << all_opened(tried.back());
  EXPECT_GE(tried.back().attempts.size(), 15u);
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

TEST_F(IsolationTest, ARootFolderOfItsOwnHoldsWhereNamespacesAreAllowed) {
  const auto r = in({.own_user = ::geteuid() == 0, .own_root = true});
  if (!r.failed.empty()) GTEST_SKIP() << "no mount namespace here: " << r.failed;
  EXPECT_TRUE(r.holds()) << all_opened(r);
}

TEST_F(IsolationTest, AUserIdOfItsOwnOpensNothingInAFolderOfTheBenchButFilesThatAllMayRead) {
  if (::geteuid() != 0) GTEST_SKIP() << "only root can change the user id";
  EXPECT_TRUE(opened(in({.own_user = true}), "its path")) << "this is why a user id alone is not believed";
  fs::permissions(folder.path() / "bench", fs::perms::owner_all);
  const auto r = in({.own_user = true});
  for (const char* way : {"its path", "a relative path", "a symbolic link", "a hard link", "moving it here", "listing its folder",
                          "the bench's root in /proc", "becoming root", "the bench's memory in /proc"})
    EXPECT_FALSE(opened(r, way)) << way;
}

TEST_F(IsolationTest, TheRoomLetsItsTenantWriteOnTheDeskAndRunItsProgram) {
  const std::vector secrets{secret};
  const auto tried = find_isolation({desk, "/bin/sh"}, secrets);
  if (!tried.back().isolation.any()) GTEST_SKIP() << "not isolated on this machine";
  EXPECT_FALSE(name(tried.back().isolation).empty());
  const auto record = folder.write("isolation.json", isolation_record(tried));
  const auto summary = read_isolation_record(record);
  EXPECT_TRUE(summary.holds);
  EXPECT_TRUE(summary.opened.empty());
  EXPECT_EQ(summary.attempts, tried.back().attempts.size());
}

TEST(UnusedUserId, IsOneThatNoAccountHas) {
  const uid_t id = unused_user_id();
  EXPECT_GE(id, 61000u);
  EXPECT_LE(id, 61183u);
}

}  // namespace
}  // namespace rotorloop::closed_loop
