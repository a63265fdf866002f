// Forward-mode derivatives: a number with its derivatives along N directions, so that the loads are written once and their
// Jacobians are exact. Only what the loads need; no heap.
#pragma once
#include <array>
#include <cmath>
#include <cstddef>

namespace rotorloop::host {

template <int N>
struct Dual {
  double a = 0.0;             // value
  std::array<double, N> d{};  // derivatives

  Dual() = default;
  Dual(double value) : a(value) {}  // NOLINT: a constant is a number without derivatives
  static Dual variable(double value, int direction) {
    Dual x(value);
    x.d[static_cast<std::size_t>(direction)] = 1.0;
    return x;
  }

  Dual& operator+=(const Dual& o) {
    a += o.a;
    for (std::size_t i = 0; i < N; ++i) d[i] += o.d[i];
    return *this;
  }
  Dual& operator-=(const Dual& o) {
    a -= o.a;
    for (std::size_t i = 0; i < N; ++i) d[i] -= o.d[i];
    return *this;
  }
  Dual& operator*=(const Dual& o) {
    for (std::size_t i = 0; i < N; ++i) d[i] = d[i] * o.a + a * o.d[i];
    a *= o.a;
    return *this;
  }
  Dual& operator*=(double s) {
    a *= s;
    for (std::size_t i = 0; i < N; ++i) d[i] *= s;
    return *this;
  }

  friend Dual operator+(Dual x, const Dual& y) { return x += y; }
  friend Dual operator+(Dual x, double s) {
    x.a += s;
    return x;
  }
  friend Dual operator+(double s, Dual x) {
    x.a += s;
    return x;
  }
  friend Dual operator-(Dual x, const Dual& y) { return x -= y; }
  friend Dual operator-(Dual x, double s) {
    x.a -= s;
    return x;
  }
  friend Dual operator-(double s, const Dual& x) { return -x + s; }
  friend Dual operator-(Dual x) { return x *= -1.0; }
  friend Dual operator*(Dual x, const Dual& y) { return x *= y; }
  friend Dual operator*(Dual x, double s) { return x *= s; }
  friend Dual operator*(double s, Dual x) { return x *= s; }
  friend Dual operator/(const Dual& x, const Dual& y) {
    const double inverse = 1.0 / y.a;
    Dual r(x.a * inverse);
    for (std::size_t i = 0; i < N; ++i) r.d[i] = (x.d[i] - r.a * y.d[i]) * inverse;
    return r;
  }
  friend Dual operator/(Dual x, double s) { return x *= 1.0 / s; }
  friend Dual operator/(double s, const Dual& x) { return Dual(s) / x; }
};

inline double value_of(double x) { return x; }
template <int N>
double value_of(const Dual<N>& x) {
  return x.a;
}

// f(x) for a function known by value and slope at x: the chain rule in one place.
inline double chained(double, double value, double) { return value; }
template <int N>
Dual<N> chained(const Dual<N>& x, double value, double slope) {
  Dual<N> r = x;
  r *= slope;
  r.a = value;
  return r;
}

template <class S>
S square_root(const S& x) {  // of x > 0; the slope at 0 is taken as 0
  const double v = std::sqrt(value_of(x));
  return chained(x, v, v > 0.0 ? 0.5 / v : 0.0);
}
template <class S>
S magnitude(const S& x) {
  const double v = value_of(x);
  return chained(x, v < 0.0 ? -v : v, v < 0.0 ? -1.0 : 1.0);
}

}  // namespace rotorloop::host
