#include "bench/estimate/chain.hpp"

#include <Eigen/Cholesky>
#include <cmath>
#include <stdexcept>

namespace rotorloop::estimate {
namespace {

using Arrow = Eigen::Matrix<double, 12, Eigen::Dynamic, Eigen::ColMajor, 12, kMaxColumns + 1>;

// Cauchy loss of a block with sum of squares s: cost ½ c² log(1 + s/c²), weight 1/(1 + s/c²) on its rows.
double robust_cost(double s, double c) { return c > 0.0 ? 0.5 * c * c * std::log1p(s / (c * c)) : 0.5 * s; }
double robust_weight(double s, double c) { return c > 0.0 ? 1.0 / (1.0 + s / (c * c)) : 1.0; }

}  // namespace

// Positions in the lists of readings while the knots are walked upwards.
struct Chain::Cursor {
  std::size_t pose = 0, position = 0, velocity = 0, gyro = 0, accel = 0;
  template <class List, class Act>
  static void at(const List& list, std::size_t& i, std::size_t knot, Act&& act) {
    for (; i < list.size() && list[i].knot == knot; ++i) act(list[i]);
  }
};

Chain::Chain(const GridFlight& flight, std::vector<BodyState>& states, const std::vector<BodyState>& guess)
    : flight_(flight), states_(states), guess_(guess) {}

double Chain::cost(const Residuals& res, double robust_scale) const {
  double sum = 0.0;
  Cursor at;
  RowsBy<6> six;
  RowsBy<3> three;
  const bool anchored = flight_.anchor.squaredNorm() > 0.0;
  StateJacobian unused;
  for (std::size_t k = 0; k < flight_.knots; ++k) {
    const BodyState& x = states_[k];
    if (anchored && flight_.begins(k)) sum += 0.5 * res.anchor(guess_[k], x, unused).squaredNorm();
    Cursor::at(flight_.pose, at.pose, k, [&](const PoseFix& f) {
      res.pose(f, x, six, false);
      sum += robust_cost(six.r.squaredNorm(), robust_scale);
    });
    const auto vector = [&](const std::vector<VectorFix>& list, std::size_t& i, auto&& residual) {
      Cursor::at(list, i, k, [&](const VectorFix& f) {
        residual(f);
        sum += 0.5 * three.r.squaredNorm();
      });
    };
    vector(flight_.position, at.position, [&](const VectorFix& f) { res.position(f, x, three, false); });
    vector(flight_.velocity, at.velocity, [&](const VectorFix& f) { res.velocity(f, x, three, false); });
    vector(flight_.gyro, at.gyro, [&](const VectorFix& f) { res.gyro(f, x, three, false); });
    vector(flight_.accel, at.accel, [&](const VectorFix& f) { res.accel(f, x, three, false); });
    if (k + 1 < flight_.knots && flight_.linked[k]) sum += 0.5 * res.process(k, x, states_[k + 1]).squaredNorm();
  }
  return sum;
}

Reduced Chain::sweep(const Residuals& res, const SweepOptions& o) {
  columns_ = res.width();
  const Eigen::Index p = columns_;
  Reduced out;
  Eigen::MatrixXd total = Eigen::MatrixXd::Zero(p + 1, p + 1);  // of [J r]ᵀ[J r], then minus [Z y]ᵀ[Z y]
  double robust_extra = 0.0;                                    // cost that is not ½ r²
  if (o.keep_factors) {
    factors_.resize(flight_.knots);
    arrow_.resize(flight_.knots * 12 * static_cast<std::size_t>(p + 1));
  }
  rows_ = {};
  rows_.steps.resize(o.keep_rows ? flight_.knots : 0);
  StateJacobian d = StateJacobian::Zero(), e, d_next = StateJacobian::Zero();
  Arrow b(12, p + 1), b_next(12, p + 1), z(12, p + 1);
  b.setZero();
  b_next.setZero();
  double squares = 0.0;

  Cursor at;
  RowsBy<6> six;
  RowsBy<3> three;
  ProcessRows step;
  const auto add = [&](auto& rows) {
    d.noalias() += rows.state.transpose() * rows.state;
    b.leftCols(p).noalias() += rows.state.transpose() * rows.columns;
    b.col(p).noalias() += rows.state.transpose() * rows.r;
    total.topLeftCorner(p, p).noalias() += rows.columns.transpose() * rows.columns;
    total.col(p).head(p).noalias() += rows.columns.transpose() * rows.r;
    squares += rows.r.squaredNorm();
    out.residuals += static_cast<std::size_t>(rows.r.size());
  };

  const bool anchored = flight_.anchor.squaredNorm() > 0.0;
  const std::size_t settled = static_cast<std::size_t>(std::ceil(0.25 / flight_.step_s));  // knots until the past fixes a state
  std::size_t in_piece = 0;
  double block_from = flight_.start_s;
  Eigen::MatrixXd block_before = Eigen::MatrixXd::Zero(p + 1, p + 1);
  double explained = 0.0;  // Σ yᵀy

  for (std::size_t k = 0; k < flight_.knots; ++k) {
    const BodyState& x = states_[k];
    if (flight_.begins(k)) in_piece = 0;
    if (anchored && flight_.begins(k)) {
      StateJacobian by;
      const Eigen::Matrix<double, 12, 1> r = res.anchor(guess_[k], x, by);
      if (o.keep_rows) rows_.anchors.push_back({by, r});
      d.noalias() += by.transpose() * by;
      b.col(p).noalias() += by.transpose() * r;
      squares += r.squaredNorm();
    }
    Cursor::at(flight_.pose, at.pose, k, [&](const PoseFix& f) {
      res.pose(f, x, six, true);
      if (o.innovations && in_piece > settled) {
        // The past alone says x + δ with δ = -D⁻¹g, covariance D⁻¹.
        const Eigen::LLT<StateJacobian> past(d);
        if (past.info() == Eigen::Success) {
          const Eigen::Matrix<double, 6, 1> ahead = six.r - six.state * past.solve(b.col(p));
          const Eigen::Matrix<double, 6, 6> cov = Eigen::Matrix<double, 6, 6>::Identity() + six.state * past.solve(six.state.transpose());
          const Eigen::LLT<Eigen::Matrix<double, 6, 6>> factor(cov);
          out.innovations.push_back({flight_.time_s(k) + f.late_s, factor.matrixL().solve(ahead), factor.matrixL()});
        }
      }
      const double s = six.r.squaredNorm(), weight = robust_weight(s, o.robust_scale);
      if (weight != 1.0) {
        robust_extra += robust_cost(s, o.robust_scale) - 0.5 * weight * s;
        const double root = std::sqrt(weight);
        six.r *= root;
        six.state *= root;
        six.columns *= root;
      }
      if (o.keep_rows) rows_.pose.push_back({six.state, six.r, weight});
      add(six);
    });
    const auto vector = [&](const std::vector<VectorFix>& list, std::size_t& i, std::vector<LinearRows::Reading<3>>& kept,
                            auto&& residual) {
      Cursor::at(list, i, k, [&](const VectorFix& f) {
        residual(f);
        if (o.keep_rows) kept.push_back({three.state, three.r});
        add(three);
      });
    };
    vector(flight_.position, at.position, rows_.position, [&](const VectorFix& f) { res.position(f, x, three, true); });
    vector(flight_.velocity, at.velocity, rows_.velocity, [&](const VectorFix& f) { res.velocity(f, x, three, true); });
    vector(flight_.gyro, at.gyro, rows_.gyro, [&](const VectorFix& f) { res.gyro(f, x, three, true); });
    vector(flight_.accel, at.accel, rows_.accel, [&](const VectorFix& f) { res.accel(f, x, three, true); });

    const bool linked = k + 1 < flight_.knots && flight_.linked[k];
    e.setZero();
    d_next.setZero();
    b_next.setZero();
    if (linked) {
      res.process(k, x, states_[k + 1], step);
      if (o.keep_rows) rows_.steps[k] = {step.from, step.to, step.r};
      d.noalias() += step.from.transpose() * step.from;
      e.noalias() = step.from.transpose() * step.to;
      d_next.noalias() = step.to.transpose() * step.to;
      b.leftCols(p).noalias() += step.from.transpose() * step.columns;
      b.col(p).noalias() += step.from.transpose() * step.r;
      b_next.leftCols(p).noalias() = step.to.transpose() * step.columns;
      b_next.col(p).noalias() = step.to.transpose() * step.r;
      total.topLeftCorner(p, p).noalias() += step.columns.transpose() * step.columns;
      total.col(p).head(p).noalias() += step.columns.transpose() * step.r;
      squares += step.r.squaredNorm();
      out.residuals += 12;
    }
    if (d.diagonal().maxCoeff() == 0.0) {  // a knot of a dropped piece: nothing is known, nothing is asked
      d.setIdentity();
    }
    if (o.damping > 0.0) d.diagonal() *= 1.0 + o.damping;
    const Eigen::LLT<StateJacobian> llt(d);
    if (llt.info() != Eigen::Success) throw std::domain_error("the information of a state is not positive definite");
    const auto l = llt.matrixL();
    for (Eigen::Index i = 0; i < 12; ++i) out.log_det_states += 2.0 * std::log(llt.matrixLLT()(i, i));
    z = l.solve(b);
    e = l.solve(e);  // now Y
    total.noalias() -= z.transpose() * z;
    explained += z.col(p).squaredNorm();
    if (o.keep_factors) {
      factors_[k] = {llt.matrixLLT(), e};
      Eigen::Map<Arrow>(&arrow_[k * 12 * static_cast<std::size_t>(p + 1)], 12, p + 1) = z;
    }
    d = d_next;
    b = b_next;
    if (linked) {
      d.noalias() -= e.transpose() * e;
      b.noalias() -= e.transpose() * z;
    }
    ++in_piece;

    const double now = flight_.time_s(k);
    if (o.block_s > 0.0 && (k + 1 == flight_.knots || now - block_from >= o.block_s)) {
      // The state at the block's end, known from its past only, is eliminated too: otherwise it would stay pinned at the value
      // that the whole flight gives it.
      Eigen::MatrixXd sums = total;
      if (linked) {
        const Eigen::LLT<StateJacobian> past(d);
        if (past.info() == Eigen::Success) {
          const Arrow t = past.matrixL().solve(b);
          sums.noalias() -= t.transpose() * t;
        }
      }
      const Eigen::MatrixXd change = sums - block_before;
      out.blocks.push_back({block_from, now, change.topLeftCorner(p, p), change.col(p).head(p)});
      block_before = sums;
      block_from = now;
    }
  }
  out.information = total.topLeftCorner(p, p);
  out.score = total.col(p).head(p);
  out.cost = 0.5 * squares + robust_extra;
  out.predicted_cost = out.cost - 0.5 * explained;
  return out;
}

void Chain::apply(const Eigen::VectorXd& parameter_step, double share) {
  Eigen::VectorXd with(columns_ + 1);
  with << parameter_step, 1.0;
  StateError next = StateError::Zero();
  for (std::size_t k = flight_.knots; k-- > 0;) {
    const Eigen::Map<const Arrow> z(&arrow_[k * 12 * static_cast<std::size_t>(columns_ + 1)], 12, columns_ + 1);
    const StateError rhs = -(z * with) - factors_[k].y * next;
    next = factors_[k].l.triangularView<Eigen::Lower>().transpose().solve(rhs);
    states_[k] = moved(states_[k], share * next);
  }
}

void Chain::move(const std::vector<StateError>& by) {
  for (std::size_t k = 0; k < flight_.knots; ++k) states_[k] = moved(states_[k], by[k]);
}

const LinearRows& Chain::rows_here(const Residuals& res) {
  RowsBy<6> six;
  RowsBy<3> three;
  StateJacobian unused;
  std::size_t anchor = 0;
  for (std::size_t k = 0; k < flight_.knots; ++k) {
    if (!rows_.anchors.empty() && flight_.begins(k)) rows_.anchors[anchor++].r = res.anchor(guess_[k], states_[k], unused);
    if (k + 1 < flight_.knots && flight_.linked[k]) rows_.steps[k].r = res.process(k, states_[k], states_[k + 1]);
  }
  for (std::size_t i = 0; i < flight_.pose.size(); ++i) {
    res.pose(flight_.pose[i], states_[flight_.pose[i].knot], six, false);
    rows_.pose[i].r = std::sqrt(rows_.pose[i].weight) * six.r;
  }
  const auto vector = [&](const std::vector<VectorFix>& list, std::vector<LinearRows::Reading<3>>& rows, auto&& residual) {
    for (std::size_t i = 0; i < list.size(); ++i) {
      residual(list[i], states_[list[i].knot]);
      rows[i].r = three.r;
    }
  };
  vector(flight_.position, rows_.position, [&](const VectorFix& f, const BodyState& x) { res.position(f, x, three, false); });
  vector(flight_.velocity, rows_.velocity, [&](const VectorFix& f, const BodyState& x) { res.velocity(f, x, three, false); });
  vector(flight_.gyro, rows_.gyro, [&](const VectorFix& f, const BodyState& x) { res.gyro(f, x, three, false); });
  vector(flight_.accel, rows_.accel, [&](const VectorFix& f, const BodyState& x) { res.accel(f, x, three, false); });
  return rows_;
}

}  // namespace rotorloop::estimate
