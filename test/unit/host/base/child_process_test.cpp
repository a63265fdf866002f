#include "host/base/child_process.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <string>

#include "host/base/error.hpp"

namespace rotorloop {
namespace {

std::string error_of(const ChildSetup& setup) {
  try {
    ChildProcess child(setup);
  } catch (const Error& e) {
    EXPECT_EQ(e.exit_code(), ExitCode::device);
    return e.what();
  }
  ADD_FAILURE() << "it was started";
  return "";
}

TEST(ChildProcess, ReportsTheExitCodeOfAProgramThatEndsByItself) {
  ChildProcess child({.program = "/bin/sh", .arguments = {"-c", "exit 7"}});
  const auto end = child.wait();
  ASSERT_TRUE(end);
  EXPECT_EQ(end->exit_code, 7);
  EXPECT_EQ(end->signal, 0);
}

TEST(ChildProcess, ReportsTheSignalThatEndedIt) {
  ChildProcess child({.program = "/bin/sleep", .arguments = {"1000"}});
  EXPECT_FALSE(child.wait(0));
  child.signal(SIGTERM);
  const auto end = child.wait();
  ASSERT_TRUE(end);
  EXPECT_EQ(end->signal, SIGTERM);
}

TEST(ChildProcess, NamesTheProgramAndTheReasonWhenItCannotBeRun) {
  const std::string missing = error_of({.program = "/no/such/program"});
  EXPECT_NE(missing.find("/no/such/program: error: cannot be run: No such file or directory"), std::string::npos) << missing;
  const std::string folder = error_of({.program = "/bin/true", .folder = "/no/such/folder"});
  EXPECT_NE(folder.find("cannot be run: No such file or directory"), std::string::npos) << folder;
  const std::string not_a_program = error_of({.program = "/etc/passwd"});
  EXPECT_NE(not_a_program.find("Permission denied"), std::string::npos) << not_a_program;
}

TEST(ChildProcess, GivesTheReasonOfAPreparationThatFailed) {
  const std::string error = error_of({.program = "/bin/true", .prepare = [] { return std::string("no rights to give up"); }});
  EXPECT_NE(error.find("no rights to give up"), std::string::npos) << error;
}

TEST(ChildProcess, HasTheFolderAndTheEnvironmentThatItIsGivenAndNoOther) {
  Pipe out;
  ChildProcess child({.program = "/bin/sh",
                      .arguments = {"-c", "pwd; /usr/bin/env | grep -v -e PWD -e SHLVL -e '^_='"},
                      .folder = "/usr",
                      .output = out.write.get(),
                      .environment = std::vector<std::string>{"ROTOR=3"}});
  out.write.reset();
  EXPECT_EQ(read_all(out.read.get()), "/usr\nROTOR=3\n");
}

TEST(ChildProcess, InheritsNoDescriptorThatItWasNotGiven) {
  Pipe secret, out;  // open across exec, as those of a careless library are
  const int leaking = ::dup(secret.read.get());
  ChildProcess child({.program = "/bin/ls", .arguments = {"/proc/self/fd"}, .output = out.write.get()});
  out.write.reset();
  EXPECT_EQ(read_all(out.read.get()), "0\n1\n2\n3\n");  // the third is that of the folder being listed
  ::close(leaking);
}

TEST(ChildProcess, EndsWithItsOwnerTogetherWithAllThatItStartedInItsGroup) {
  Pipe out;
  {
    ChildProcess child(
        {.program = "/bin/sh", .arguments = {"-c", "sleep 1000 & echo started; wait"}, .output = out.write.get(), .own_group = true});
    out.write.reset();
    char text[8];
    ASSERT_EQ(::read(out.read.get(), text, sizeof text), 8);
  }
  EXPECT_EQ(read_all(out.read.get()), "");  // ends only once the last process with the pipe's other end has ended
}

TEST(ChildProcess, PrintedTextOfAProgramIsReadToItsEnd) {
  EXPECT_EQ(output_of("/bin/echo", {"bubblewrap", "0.8.0"}), "bubblewrap 0.8.0\n");
}

}  // namespace
}  // namespace rotorloop
