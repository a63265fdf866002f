// A process of its own that begins as this one is now: a snapshot of chip, motor, bus and tool alike.
#pragma once
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <optional>
#include <type_traits>
#include <utility>

namespace rotorloop::boot_chip {

// Runs `f` there. Several at once take several cores.
template <class Result>
class Fork {
 public:
  template <class F>
  explicit Fork(const F& f) {
    static_assert(std::is_trivially_copyable_v<Result>);
    int ends[2];
    if (::pipe(ends) != 0) return;
    std::fflush(stdout);
    child_ = ::fork();
    if (child_ == 0) {
      const Result r = f();
      const bool whole = ::write(ends[1], &r, sizeof r) == static_cast<ssize_t>(sizeof r);
      ::_exit(whole ? 0 : 1);
    }
    ::close(ends[1]);
    end_ = ends[0];
  }
  Fork(Fork&& other) noexcept : child_(std::exchange(other.child_, -1)), end_(std::exchange(other.end_, -1)) {}
  Fork& operator=(Fork&&) = delete;
  ~Fork() { result(); }

  // What it returned, once; none when that process ended otherwise.
  std::optional<Result> result() {
    if (end_ < 0) return std::nullopt;
    Result r{};
    const bool whole = child_ > 0 && ::read(end_, &r, sizeof r) == static_cast<ssize_t>(sizeof r);
    ::close(std::exchange(end_, -1));
    if (child_ > 0) ::waitpid(child_, nullptr, 0);
    return whole ? std::optional(r) : std::nullopt;
  }

 private:
  pid_t child_ = -1;
  int end_ = -1;
};

template <class F>
auto in_a_fork(const F& f) {
  return Fork<std::invoke_result_t<F>>(f).result();
}

}  // namespace rotorloop::boot_chip
