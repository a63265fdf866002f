// The promise of bit-identical reruns, held against the built command: what the machine does besides, how many flights run at a
// time and where the command is started must not show in a single byte of a log.
#include <gtest/gtest.h>

#include "test/integration/hil/busy_neighbours.hpp"
#include "test/integration/hil/cli_run.hpp"

namespace rotorloop::test {
namespace {

class Determinism : public testing::Test {
 protected:
  // Hash over all logs of a run; empty when it failed.
  std::string hash(const std::string& name, const std::string& options, const std::filesystem::path& working_directory) {
    const auto done =
        rotorloop_command("hil '" + scenario_.string() + "' -q --out '" + (folder_ / "runs").string() + "' --name " + name + " " + options,
                          working_directory);
    EXPECT_EQ(done.exit_code, 0) << done.err;
    const auto result = result_of(folder_ / "runs" / name);
    if (!result.is_object() || !result.contains("log_sha256")) return "";
    return result["log_sha256"].get<std::string>();
  }
  std::string hash(const std::string& name, const std::string& options = "--jobs 1") { return hash(name, options, folder_.path()); }

  ScratchFolder folder_;
  std::filesystem::path scenario_ = write_short_scenario(folder_.path(), "", "[1, 2]");
};

TEST_F(Determinism, LogsDoNotDependOnLoadThreadsOrWorkingDirectory) {
  const std::string first = hash("first");
  ASSERT_EQ(first.size(), 64u);
  EXPECT_EQ(hash("again"), first);
  EXPECT_EQ(hash("two_threads", "--jobs 2"), first);
  EXPECT_EQ(hash("elsewhere", "--jobs 1", "/"), first);
  {
    const BusyNeighbours neighbours(2);
    ASSERT_EQ(neighbours.count(), 2u);
    EXPECT_EQ(hash("beside_busy_processes", "--jobs 2"), first);
  }
  // Not only the hash of hashes: the files themselves, byte by byte.
  std::size_t logs = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder_ / "runs" / "first")) {
    const auto extension = entry.path().extension();
    if (extension != ".csv" && extension != ".log") continue;
    const auto counterpart =
        folder_ / "runs" / "beside_busy_processes" / std::filesystem::relative(entry.path(), folder_ / "runs" / "first").string();
    const std::string text = read_text(entry.path());
    EXPECT_GT(text.size(), 100'000u) << entry.path();
    EXPECT_TRUE(text == read_text(counterpart)) << counterpart;
    ++logs;
  }
  EXPECT_EQ(logs, 8u);  // flight, truth and two buses of two seeds
}

// A hash that never changes proves nothing: another seed and another controller must show.
TEST_F(Determinism, SeedAndVariantShowInTheLogs) {
  const std::string seed_1 = hash("seed_1", "--seeds 1,"), seed_2 = hash("seed_2", "--seeds 2,");
  ASSERT_EQ(seed_1.size(), 64u);
  EXPECT_NE(seed_1, seed_2);
  EXPECT_NE(hash("other_variant", "--seeds 1, --variants pd_ff"), seed_1);
}

// What a flight does depends on its own seed alone, not on the seeds flown beside it.
TEST_F(Determinism, AFlightIsTheSameAloneAndAmongOthers) {
  hash("both");
  hash("alone", "--seeds 2,");
  std::vector<std::filesystem::path> alone;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder_ / "runs" / "alone"))
    if (entry.path().filename() == "truth.csv") alone.push_back(entry.path());
  ASSERT_EQ(alone.size(), 1u);
  const auto counterpart = folder_ / "runs" / "both" / std::filesystem::relative(alone[0], folder_ / "runs" / "alone").string();
  EXPECT_TRUE(read_text(alone[0]) == read_text(counterpart)) << counterpart;
}

}  // namespace
}  // namespace rotorloop::test
