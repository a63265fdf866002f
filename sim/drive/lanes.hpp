// Four doubles that take the same steps: the equations of sim/drive are templates, so that one source gives the single drive
// (double) and four drives at once (Lanes). Every operation is the IEEE one of its lane: a lane's bits do not depend on the
// other lanes. Two pairs of the compiler's generic vectors, which every 64-bit CPU has as registers.
#pragma once
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace rotorloop::sim {

class Lanes {
 public:
  static constexpr std::size_t kCount = 4;

  Lanes() = default;
  Lanes(double all) : low_{all, all}, high_{all, all} {}  // NOLINT: constants of a formula stand in all lanes
  Lanes(double a, double b, double c, double d) : low_{a, b}, high_{c, d} {}
  double operator[](std::size_t lane) const { return lane < 2 ? low_[lane] : high_[lane - 2]; }

  friend Lanes operator+(const Lanes& x, const Lanes& y) { return {x.low_ + y.low_, x.high_ + y.high_}; }
  friend Lanes operator-(const Lanes& x, const Lanes& y) { return {x.low_ - y.low_, x.high_ - y.high_}; }
  friend Lanes operator*(const Lanes& x, const Lanes& y) { return {x.low_ * y.low_, x.high_ * y.high_}; }
  friend Lanes operator/(const Lanes& x, const Lanes& y) { return {x.low_ / y.low_, x.high_ / y.high_}; }
  Lanes& operator+=(const Lanes& y) { return *this = *this + y; }

  friend Lanes square_root(const Lanes& x) {
    return {Pair{std::sqrt(x.low_[0]), std::sqrt(x.low_[1])}, Pair{std::sqrt(x.high_[0]), std::sqrt(x.high_[1])}};
  }
  friend Lanes magnitude(const Lanes& x) { return {without_sign(x.low_), without_sign(x.high_)}; }
  // Lane by lane: x >= limit ? yes : no.
  friend Lanes if_at_least(const Lanes& x, const Lanes& limit, const Lanes& yes, const Lanes& no) {
    return {x.low_ >= limit.low_ ? yes.low_ : no.low_, x.high_ >= limit.high_ ? yes.high_ : no.high_};
  }

 private:
  using Pair = double __attribute__((vector_size(16)));
  using PairBits = std::int64_t __attribute__((vector_size(16)));
  Lanes(Pair low, Pair high) : low_(low), high_(high) {}
  static Pair without_sign(Pair x) {
    constexpr std::int64_t kAllButSign = INT64_MAX;
    return reinterpret_cast<Pair>(reinterpret_cast<PairBits>(x) & PairBits{kAllButSign, kAllButSign});
  }

  Pair low_{}, high_{};
};

// The same names for one drive.
inline double square_root(double x) { return std::sqrt(x); }
inline double magnitude(double x) { return std::fabs(x); }
inline double if_at_least(double x, double limit, double yes, double no) { return x >= limit ? yes : no; }

}  // namespace rotorloop::sim
