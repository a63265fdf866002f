#include "host/base/parallel.hpp"

#include <algorithm>
#include <exception>
#include <thread>
#include <vector>

namespace rotorloop {

void parallel_for(std::size_t count, int workers, const std::function<void(std::size_t)>& work, const std::atomic<bool>* stop) {
  std::atomic<std::size_t> next{0};
  std::atomic<bool> failed{false};
  std::vector<std::exception_ptr> failures(count);
  const auto run = [&] {
    while (!failed && !(stop && *stop)) {
      const std::size_t i = next++;
      if (i >= count) return;
      try {
        work(i);
      } catch (...) {
        failures[i] = std::current_exception();
        failed = true;
      }
    }
  };
  {
    std::vector<std::jthread> threads;  // joined at the end of this block, also when one more cannot be started
    for (std::size_t w = 1; w < std::min(count, static_cast<std::size_t>(std::max(1, workers))); ++w) threads.emplace_back(run);
    run();
  }
  for (const std::exception_ptr& f : failures) {
    if (f) std::rethrow_exception(f);
  }
}

}  // namespace rotorloop
