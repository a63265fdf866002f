// What a loop over threads promises: each piece once, and the same exception with any number of workers.
#include "host/base/parallel.hpp"

#include <gtest/gtest.h>

#include <mutex>
#include <set>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

namespace rotorloop {
namespace {

TEST(ParallelFor, EachPieceIsDoneOnceWithAnyNumberOfWorkers) {
  for (const int workers : {-1, 0, 1, 2, 7, 200}) {
    std::vector<std::atomic<int>> done(100);
    parallel_for(done.size(), workers, [&](std::size_t i) { ++done[i]; });
    for (const auto& d : done) EXPECT_EQ(d, 1) << workers << " workers";
  }
  parallel_for(0, 4, [](std::size_t) { FAIL(); });
}

TEST(ParallelFor, TwoWorkersAreTwoThreads) {
  std::atomic<int> waiting{0};  // each piece ends only when both have begun
  std::set<std::thread::id> threads;
  std::mutex mutex;
  parallel_for(2, 2, [&](std::size_t) {
    for (++waiting; waiting < 2;) std::this_thread::yield();
    const std::lock_guard lock(mutex);
    threads.insert(std::this_thread::get_id());
  });
  EXPECT_EQ(threads.size(), 2u);
}

TEST(ParallelFor, TheExceptionOfTheLowestPieceIsThrownWithAnyNumberOfWorkers) {
  for (const int workers : {1, 2, 8}) {
    for (int repeat = 0; repeat < 50; ++repeat) {
      try {
        parallel_for(64, workers, [](std::size_t i) {
          if (i % 10 == 3) throw std::runtime_error(std::to_string(i));
        });
        FAIL() << "nothing was thrown";
      } catch (const std::runtime_error& e) {
        EXPECT_STREQ(e.what(), "3") << workers << " workers";
      }
    }
  }
}

TEST(ParallelFor, NothingIsBegunAfterStop) {
  std::atomic<bool> stop{false};
  std::atomic<int> done{0};
  parallel_for(
      1000, 2,
      [&](std::size_t i) {
        ++done;
        if (i == 5) stop = true;
      },
      &stop);
  EXPECT_LE(done, 8);
  EXPECT_GE(done, 6);
}

}  // namespace
}  // namespace rotorloop
