// Reads a stream at rising times by straight lines between its samples.
#pragma once
#include <algorithm>

#include "bench/sysid/log/flight_record.hpp"

namespace rotorloop::log {

inline double between(double a, double b, double share) { return a + share * (b - a); }
inline Eigen::Vector3d between(const Eigen::Vector3d& a, const Eigen::Vector3d& b, double share) { return a + share * (b - a); }
inline PoseReading between(const PoseReading& a, const PoseReading& b, double share) {
  return {between(a.p_W_m, b.p_W_m, share), a.q_WS.slerp(share, b.q_WS)};
}

// `stream` is kept by reference. Outside its samples the nearest one is held.
template <class Value>
class StreamReader {
 public:
  explicit StreamReader(const Stream<Value>& stream) : stream_(stream) {}
  bool covers(double t_s) const { return !stream_.empty() && t_s >= stream_.t_s.front() && t_s <= stream_.t_s.back(); }
  Value at(double t_s) {
    while (next_ + 1 < stream_.size() && stream_.t_s[next_] < t_s) ++next_;
    const std::size_t before = next_ == 0 ? 0 : next_ - 1;
    const double span = stream_.t_s[next_] - stream_.t_s[before];
    const double share = span > 0.0 ? std::clamp((t_s - stream_.t_s[before]) / span, 0.0, 1.0) : 0.0;
    return between(stream_.value[before], stream_.value[next_], share);
  }

 private:
  const Stream<Value>& stream_;
  std::size_t next_ = 0;
};

}  // namespace rotorloop::log
