#include "bench/sysid/estimate/linear_rows.hpp"

#include <Eigen/Cholesky>
#include <stdexcept>

namespace rotorloop::estimate {
namespace {

using Six = Eigen::Matrix<double, 6, 1>;

Six both(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  Six out;
  out << a, b;
  return out;
}
Eigen::Vector3d ratio(const Eigen::Vector3d& was, const Eigen::Vector3d& is) { return was.cwiseQuotient(is); }

template <int N>
LinearRows::Measurement<N> scaled(const LinearRows::Measurement<N>& row, const Eigen::Matrix<double, N, 1>& by) {
  return {by.asDiagonal() * row.state, by.cwiseProduct(row.r), row.weight};
}

// The measurements of one node, upwards: each list is walked once.
template <int N, class Fix, class Act>
void upwards(const std::vector<Fix>& list, const std::vector<LinearRows::Measurement<N>>& rows, std::size_t node, std::size_t& i,
             Act&& act) {
  for (; i < list.size() && list[i].node == node; ++i) act(rows[i]);
}
template <int N, class Fix, class Act>
void downwards(const std::vector<Fix>& list, const std::vector<LinearRows::Measurement<N>>& rows, std::size_t node, std::size_t& i,
               Act&& act) {
  for (; i > 0 && list[i - 1].node == node; --i) act(rows[i - 1]);
}

}  // namespace

// What each row is multiplied by when the noise is another than the one that it was whitened with.
struct RowSmoother::Scales {
  Scales(const NoiseModel& was, const NoiseModel& is)
      : pose(both(ratio(was.position_m, is.position_m), ratio(was.attitude_rad, is.attitude_rad))),
        position(ratio(was.position_m, is.position_m)),
        velocity(ratio(was.velocity_m_s, is.velocity_m_s)),
        gyro(ratio(was.gyro_rad_s, is.gyro_rad_s)),
        accel(ratio(was.accel_m_s2, is.accel_m_s2)) {
    const Eigen::Vector3d force = ratio(was.force_m_s2_rtHz, is.force_m_s2_rtHz),
                          angular = ratio(was.angular_rad_s2_rtHz, is.angular_rad_s2_rtHz);
    step << force, force, angular, angular;
  }
  StateError step;
  Six pose;
  Eigen::Vector3d position, velocity, gyro, accel;
};

NoiseMoments RowSmoother::smooth(const NoiseModel& noise) {
  const Scales scales(whitened_, noise);
  eliminate(scales);
  return walk_back(scales);
}

// As Chain::sweep, without parameters.
void RowSmoother::eliminate(const Scales& scales) {
  factors_.resize(flight_.nodes);
  StateJacobian d = StateJacobian::Zero();
  StateError g = StateError::Zero();
  std::size_t pose = 0, position = 0, velocity = 0, gyro = 0, accel = 0, anchor = 0;
  const auto add = [&](const auto& row) {
    d.noalias() += row.state.transpose() * row.state;
    g.noalias() += row.state.transpose() * row.r;
  };
  for (std::size_t k = 0; k < flight_.nodes; ++k) {
    if (!rows_.anchors.empty() && flight_.begins(k)) add(rows_.anchors[anchor++]);
    upwards(flight_.pose, rows_.pose, k, pose, [&](const auto& row) { add(scaled(row, scales.pose)); });
    upwards(flight_.position, rows_.position, k, position, [&](const auto& row) { add(scaled(row, scales.position)); });
    upwards(flight_.velocity, rows_.velocity, k, velocity, [&](const auto& row) { add(scaled(row, scales.velocity)); });
    upwards(flight_.gyro, rows_.gyro, k, gyro, [&](const auto& row) { add(scaled(row, scales.gyro)); });
    upwards(flight_.accel, rows_.accel, k, accel, [&](const auto& row) { add(scaled(row, scales.accel)); });
    const bool linked = k + 1 < flight_.nodes && flight_.linked[k];
    StateJacobian to;
    StateError r;
    Factor& factor = factors_[k];
    if (linked) {
      const StateJacobian from = scales.step.asDiagonal() * rows_.steps[k].from;
      to = scales.step.asDiagonal() * rows_.steps[k].to;
      r = scales.step.cwiseProduct(rows_.steps[k].r);
      d.noalias() += from.transpose() * from;
      g.noalias() += from.transpose() * r;
      factor.y.noalias() = from.transpose() * to;
    } else {
      factor.y.setZero();
    }
    if (d.diagonal().maxCoeff() == 0.0) d.setIdentity();  // a node of a dropped piece
    const Eigen::LLT<StateJacobian> llt(d);
    if (llt.info() != Eigen::Success) throw std::domain_error("the information of a state is not positive definite");
    factor.l = llt.matrixLLT();
    llt.matrixL().solveInPlace(factor.y);
    factor.pull = llt.matrixL().solve(g);
    d.setZero();
    g.setZero();
    if (linked) {
      d.noalias() = to.transpose() * to;
      d.noalias() -= factor.y.transpose() * factor.y;
      g.noalias() = to.transpose() * r;
      g.noalias() -= factor.y.transpose() * factor.pull;
    }
  }
}

NoiseMoments RowSmoother::walk_back(const Scales& scales) {
  NoiseMoments m;
  moves_.resize(flight_.nodes);
  std::size_t pose = flight_.pose.size(), position = flight_.position.size(), velocity = flight_.velocity.size(),
              gyro = flight_.gyro.size(), accel = flight_.accel.size();
  StateJacobian p = StateJacobian::Zero();
  StateError move = StateError::Zero();
  const auto add = [&](NoiseMoment& to, const auto& row, Eigen::Index first) {
    for (Eigen::Index i = 0; i < 3; ++i) {
      const auto state = row.state.row(first + i);
      const double r = row.r[first + i] + state.dot(move);
      to.squares[i] += r * r + state * p * state.transpose();
    }
    to.count += row.weight;
  };
  for (std::size_t k = flight_.nodes; k-- > 0;) {
    const Factor& factor = factors_[k];
    const auto l = factor.l.triangularView<Eigen::Lower>().transpose();
    const StateJacobian next = p;
    const StateError next_move = move;
    const StateJacobian passed = factor.y * next;
    StateJacobian half = StateJacobian::Identity() + passed * factor.y.transpose();
    l.solveInPlace(half);
    p = half.transpose();
    l.solveInPlace(p);
    move = -(factor.pull + factor.y * next_move);
    l.solveInPlace(move);
    moves_[k] = move;
    if (k + 1 < flight_.nodes && flight_.linked[k]) {
      StateJacobian joint = -passed;  // becomes P_{k,k+1}
      l.solveInPlace(joint);
      const StateJacobian from = scales.step.asDiagonal() * rows_.steps[k].from, to = scales.step.asDiagonal() * rows_.steps[k].to;
      const StateJacobian left = from * p + to * joint.transpose(), right = from * joint + to * next;
      const StateError r = scales.step.cwiseProduct(rows_.steps[k].r) + from * move + to * next_move;
      for (Eigen::Index i = 0; i < 12; ++i) {
        const double square = r[i] * r[i] + left.row(i).dot(from.row(i)) + right.row(i).dot(to.row(i));
        (i < 6 ? m.force : m.angular).squares[i % 3] += 0.5 * square;  // each density has two rows
      }
      m.force.count += 1.0;
      m.angular.count += 1.0;
    }
    downwards(flight_.pose, rows_.pose, k, pose, [&](const auto& row) {
      const auto at = scaled(row, scales.pose);
      add(m.position, at, 0);
      add(m.attitude, at, 3);
    });
    downwards(flight_.position, rows_.position, k, position, [&](const auto& row) { add(m.position, scaled(row, scales.position), 0); });
    downwards(flight_.velocity, rows_.velocity, k, velocity, [&](const auto& row) { add(m.velocity, scaled(row, scales.velocity), 0); });
    downwards(flight_.gyro, rows_.gyro, k, gyro, [&](const auto& row) { add(m.gyro, scaled(row, scales.gyro), 0); });
    downwards(flight_.accel, rows_.accel, k, accel, [&](const auto& row) { add(m.accel, scaled(row, scales.accel), 0); });
  }
  return m;
}

}  // namespace rotorloop::estimate
