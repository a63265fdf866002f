#include "bench/hil/closed_loop/stage.hpp"

#include <gtest/gtest.h>

#include "test/unit/bench/temp_folder.hpp"

namespace rotorloop::closed_loop {
namespace {

TEST(Stage, IsDoneOnlyWhenItsDoneFileNamesTheSameInputs) {
  test::TempFolder folder;
  const Stage stage(folder.path() / "1-fly", {{"vehicle", "aa"}, {"plan", "name = \"x\"\nseeds = [1]"}});
  EXPECT_FALSE(stage.done());
  stage.begin();
  EXPECT_FALSE(stage.done()) << "stopped while it was made";
  stage.finish("rotorloop 1");
  EXPECT_TRUE(stage.done());
  EXPECT_EQ(stage.made_by(), "rotorloop 1");
  EXPECT_FALSE(Stage(stage.folder(), {{"vehicle", "ab"}, {"plan", "name = \"x\"\nseeds = [1]"}}).done()) << "another vehicle file";
  EXPECT_FALSE(Stage(stage.folder(), {{"vehicle", "aa"}}).done());
}

TEST(Stage, BeginsWithAnEmptyFolder) {
  test::TempFolder folder;
  folder.write("1-fly/left_over.csv", "half a flight");
  const Stage stage(folder.path() / "1-fly", {});
  stage.begin();
  EXPECT_TRUE(std::filesystem::is_empty(stage.folder()));
}

}  // namespace
}  // namespace rotorloop::closed_loop
