// Processes that keep cores busy while they live: what the machine does besides must not show in a log.
#pragma once
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstddef>
#include <vector>

namespace rotorloop::test {

class BusyNeighbours {
 public:
  explicit BusyNeighbours(int count) {
    for (int i = 0; i < count; ++i) {
      const pid_t child = fork();
      if (child == 0) {
        alarm(60);  // should the test die first
        volatile unsigned n = 0;
        for (;;) (void)n;
      }
      if (child > 0) children_.push_back(child);
    }
  }
  ~BusyNeighbours() {
    for (const pid_t child : children_) {
      kill(child, SIGKILL);
      waitpid(child, nullptr, 0);
    }
  }
  BusyNeighbours(const BusyNeighbours&) = delete;
  BusyNeighbours& operator=(const BusyNeighbours&) = delete;
  std::size_t count() const { return children_.size(); }

 private:
  std::vector<pid_t> children_;
};

}  // namespace rotorloop::test
