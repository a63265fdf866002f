// The residuals of eq. (10), whitened, with their derivatives by states and parameters: one place that the own elimination, Ceres
// and the tests share.
//   process  r = W (x_{k+1} ⊟ f(x_k, u, θ)), 12 rows; measurements r = (z - h(x_k, θ)) / σ
#pragma once
#include <Eigen/Core>

#include "bench/sysid/estimate/grid_flight.hpp"
#include "bench/sysid/estimate/model/measurement_terms.hpp"
#include "bench/sysid/estimate/model/model.hpp"
#include "bench/sysid/estimate/noise_model.hpp"

namespace rotorloop::estimate {

// Rows by state error (12) and by columns of the problem.
template <int Rows>
struct RowsBy {
  Eigen::Matrix<double, Rows, 1> r;
  Eigen::Matrix<double, Rows, 12> state;
  Eigen::Matrix<double, Rows, Eigen::Dynamic, Eigen::ColMajor, Rows, kMaxColumns> columns;
};
struct ProcessRows {
  Eigen::Matrix<double, 12, 1> r;
  StateJacobian from, to;  // by the error at node k, at node k + 1
  ParameterJacobian columns;
};

// Columns beside the parameters, known as series over a flight: what a term that the model does not hold would do per unit of its
// size. A sweep then gives their scores without a refit. Empty lists: none act there.
struct ExtraColumns {
  Eigen::Index count = 0;
  std::vector<double> wrench;       // [step][column][6]: force, N, and torque, N m, in B, mean over the step from node k to k + 1
  std::vector<double> pose;         // [pose fix][column][6]: of the sensor's position in W, m, and attitude, rotation vector in S, rad
  std::vector<double> gyro, accel;  // [fix][column][3]: of the measurements, B, without what the wrench does to them

  template <int Rows>
  Eigen::Map<const Eigen::Matrix<double, Rows, Eigen::Dynamic>> at(const std::vector<double>& list, std::size_t i) const {
    return {list.data() + i * static_cast<std::size_t>(Rows * count), Rows, count};
  }
};

// All residuals of one flight at one set of values. `columns`: the parameters by which derivatives are taken, any of them.
class Residuals {
 public:
  // `extra` columns stand behind these; kept by reference.
  Residuals(const GridFlight& flight, const ModelValues& values, const NoiseModel& noise, const Columns& columns,
            const ExtraColumns* extra = nullptr);

  // Between nodes k and k + 1, which must be linked.
  void process(std::size_t k, const BodyState& from, const BodyState& to, ProcessRows& out) const;
  Eigen::Matrix<double, 12, 1> process(std::size_t k, const BodyState& from, const BodyState& to) const;

  // Measurements; `out.columns` is filled when wanted. Position of the sensor, 3 rows; attitude, 3 rows.
  void pose(const PoseFix& fix, const BodyState& x, RowsBy<6>& out, bool derivatives) const;
  void position(const VectorFix& fix, const BodyState& x, RowsBy<3>& out, bool derivatives) const;
  void velocity(const VectorFix& fix, const BodyState& x, RowsBy<3>& out, bool derivatives) const;
  void gyro(const VectorFix& fix, const BodyState& x, RowsBy<3>& out, bool derivatives) const;
  void accel(const VectorFix& fix, const BodyState& x, RowsBy<3>& out, bool derivatives) const;
  // Start of a piece against its guess, for flights with an anchor.
  Eigen::Matrix<double, 12, 1> anchor(const BodyState& guess, const BodyState& x, StateJacobian& by_state) const;

  const GridFlight& flight() const { return flight_; }
  const Columns& columns() const { return columns_; }
  Eigen::Index width() const { return static_cast<Eigen::Index>(columns_.size()) + (extra_ ? extra_->count : 0); }

 private:
  int place_of(int parameter) const;  // among columns_, or -1
  // The state at the moment of a measurement of node's state `x`. A mean of measurements belongs to the mean of their stamps, up to half a
  // step off its node: the model carries the state there. `moved`: the derivatives below hold what the way there makes of the node's.
  struct Moment {
    BodyState x;
    double t_s;
    bool moved;
  };
  Moment moment_of(const VectorFix& fix, const BodyState& x, bool derivatives) const;
  using ExtraWrench = Eigen::Matrix<double, 6, Eigen::Dynamic, Eigen::ColMajor, 6, kMaxColumns>;
  ExtraWrench extra_wrench(const VectorFix& fix) const;  // at the moment of a measurement
  // Rows by the state at the moment become rows by that of the node.
  void back_to_node(const VectorFix& fix, const Moment& at, RowsBy<3>& out) const;
  // What terms add to the measurements at a moment, its derivatives into measurement_by_ and measurement_slope_ when wanted.
  MeasurementChange terms_read(const BodyState& x, double t_s, bool derivatives) const;
  void whiten(Eigen::Ref<Eigen::MatrixXd> rows) const;

  const GridFlight& flight_;
  RotorInput input_;
  NoiseModel noise_;
  Columns columns_;
  std::vector<int> dynamic_;  // places in columns_ of what the model knows
  Model model_;               // with those columns
  std::array<int, kCoreParameters> places_{};
  const ExtraColumns* extra_ = nullptr;
  std::vector<int> measurement_parameters_, measurement_places_;  // of terms that read: parameter, place in columns_; those that are free
  bool reads_ = false;
  mutable std::vector<MeasurementChange> measurement_by_;
  mutable MeasurementSlope measurement_slope_;
  mutable StateJacobian moment_by_state_;
  mutable ParameterJacobian moment_by_;
  Eigen::Matrix3d inverse_inertia_ = Eigen::Matrix3d::Identity();
  mutable std::size_t hint_ = 0;
};

}  // namespace rotorloop::estimate
