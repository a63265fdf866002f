#include "bench/hil/closed_loop/workspace.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "test/unit/bench/temp_folder.hpp"

namespace rotorloop::closed_loop {
namespace {

namespace fs = std::filesystem;

const Prober kWorkspaceProber{SANDBOX_PROBER, {"try"}};

struct WorkspaceTest : ::testing::Test {
  test::TempFolder folder;
  // A shell script in the sandbox; what it printed.
  std::string run(Workspace& workspace, const std::string& script, int* code = nullptr) {
    const int c = workspace.run("/bin/sh", {"-c", script}, folder.path() / "out.txt", folder.path() / "errors.txt", {}, nullptr);
    if (code) *code = c;
    return test::read_text(folder.path() / "out.txt");
  }
};

TEST_F(WorkspaceTest, HoldsCopiesUnderTheNamesGivenAndNothingElse) {
  const auto paper = folder.write("runs/secret-name/flight.csv", "1,2\n");
  Workspace workspace({{paper, "flights/learn_1.csv"}});
  const std::vector secrets{folder.write("bench/plant.toml", "the truth")};
  workspace.isolate(kWorkspaceProber, secrets);
  int code = -1;
  EXPECT_EQ(run(workspace, "cat flights/learn_1.csv; ls -R . | grep -c secret; pwd | grep -c secret; env | grep -c secret", &code),
            "1,2\n0\n0\n0\n");
}

TEST_F(WorkspaceTest, WhatTheDiagnosisMayNotOpenItsShellCannotReadEither) {
  const auto secret = folder.write("bench/plant.toml", "the truth");
  fs::permissions(folder.path(), fs::perms::all);
  Workspace workspace({});
  if (!workspace.isolate(kWorkspaceProber, std::vector{secret}).back().holds()) GTEST_SKIP() << "not isolated on this machine";
  const std::string s = secret.string();
  int code = 0;
  EXPECT_EQ(
      run(workspace,
          "cat " + s + " ../../../../../../.." + s + " /proc/*/root" + s + "; ln " + s + " x && cat x; ln -s " + s + " y && cat y", &code),
      "");
  EXPECT_NE(code, 0);
}

TEST_F(WorkspaceTest, TakesBackPlainFilesAndLeavesLinks) {
  const auto secret = folder.write("bench/plant.toml", "the truth");
  Workspace workspace({});
  workspace.isolate(kWorkspaceProber, std::vector{secret});
  run(workspace, "mkdir -p out/sub; echo a > out/a; echo b > out/sub/b; ln -s " + secret.string() +
                     " out/c; ln -s /etc out/d; ln out/a out/e; rm out/e");
  EXPECT_EQ(workspace.take_back("out", folder.path() / "back"), 2u);
  EXPECT_EQ(test::read_text(folder.path() / "back/a"), "a\n");
  EXPECT_EQ(test::read_text(folder.path() / "back/sub/b"), "b\n");
  EXPECT_FALSE(fs::exists(folder.path() / "back/c"));
  EXPECT_FALSE(fs::exists(folder.path() / "back/d"));
}

TEST_F(WorkspaceTest, IsGoneAfterwards) {
  fs::path place;
  {
    Workspace workspace({});
    place = workspace.path();
    EXPECT_TRUE(fs::exists(place));
  }
  EXPECT_FALSE(fs::exists(place.parent_path()));
}

TEST_F(WorkspaceTest, ReportsTheProgramsExitCodeAndItsMessagesLineByLine) {
  Workspace workspace({});
  std::vector<std::string> lines;
  const int code = workspace.run(
      "/bin/sh", {"-c", "echo one >&2; printf 'two\\rthree' >&2; exit 5"}, folder.path() / "o", folder.path() / "e",
      [&](const std::string& l) { lines.push_back(l); }, nullptr);
  EXPECT_EQ(code, 5);
  EXPECT_EQ(lines, (std::vector<std::string>{"one", "two", "three"}));
}

TEST_F(WorkspaceTest, AProgramThatIsNoneIsAnErrorOfTheDevice) {
  Workspace workspace({});
  const auto text = folder.write("program", "no program");
  EXPECT_THAT(test::error_of([&] { workspace.run(text, {}, folder.path() / "o", folder.path() / "e", {}, nullptr); }, ExitCode::device),
              ::testing::HasSubstr("cannot be run"));
}

}  // namespace
}  // namespace rotorloop::closed_loop
