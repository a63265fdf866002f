// An expression of a user's term as a small program for a stack machine: fixed size, no heap, the same for every scalar, so that a
// load written in a TOML file has exact derivatives like one written in C++. Text becomes a program in expression_parse.cpp (host only).
#pragma once
#include <array>
#include <cstdint>
#include <string_view>

#include "host/effects/loads.hpp"

namespace rotorloop::host {

enum class Operation : std::uint8_t {
  constant,
  variable,
  add,
  subtract,
  multiply,
  divide,
  negate,
  square_root,
  magnitude,
  smaller,
  larger
};

struct Instruction {
  Operation operation = Operation::constant;
  std::uint8_t variable = 0;  // place in kVariables
  double constant = 0.0;
};

struct Expression {
  static constexpr std::size_t kMaxLength = 64, kMaxDepth = 12;
  std::array<Instruction, kMaxLength> code{};
  std::size_t length = 0;  // 0: the expression is zero
};

// What an expression may name. Body axes unless said otherwise; all SI.
struct VariableInfo {
  std::string_view name, meaning;
};
inline constexpr VariableInfo kVariables[] = {
    {"v_x", "velocity through the air, m/s"},
    {"v_y", "velocity through the air, m/s"},
    {"v_z", "velocity through the air, m/s"},
    {"p", "body rate about x, rad/s"},
    {"q", "body rate about y, rad/s"},
    {"r", "body rate about z, rad/s"},
    {"x", "place in the world, m"},
    {"y", "place in the world, m"},
    {"z", "place in the world, m"},
    {"up_x", "the world's z axis in body axes, 1"},
    {"up_y", "the world's z axis in body axes, 1"},
    {"up_z", "the world's z axis in body axes, 1"},
    {"omega_1", "speed of rotor 1, rad/s"},
    {"omega_2", "speed of rotor 2, rad/s"},
    {"omega_3", "speed of rotor 3, rad/s"},
    {"omega_4", "speed of rotor 4, rad/s"},
    {"omegadot_1", "its derivative, rad/s2"},
    {"omegadot_2", "its derivative, rad/s2"},
    {"omegadot_3", "its derivative, rad/s2"},
    {"omegadot_4", "its derivative, rad/s2"},
    {"thrust_1", "thrust of rotor 1, N"},
    {"thrust_2", "thrust of rotor 2, N"},
    {"thrust_3", "thrust of rotor 3, N"},
    {"thrust_4", "thrust of rotor 4, N"},
    {"torque_1", "aerodynamic torque of rotor 1, N m, > 0"},
    {"torque_2", "aerodynamic torque of rotor 2, N m, > 0"},
    {"torque_3", "aerodynamic torque of rotor 3, N m, > 0"},
    {"torque_4", "aerodynamic torque of rotor 4, N m, > 0"},
    {"battery", "battery voltage of the log, V"},
    {"t", "time of the log, s"},
};

template <class S>
S variable(const LoadState<S>& s, std::uint8_t place) {
  const std::size_t rotor = place >= 12 && place < 28 ? (place - 12u) % 4u : 0;
  switch (place) {
    case 0:
      return s.v_air_B_m_s.x;
    case 1:
      return s.v_air_B_m_s.y;
    case 2:
      return s.v_air_B_m_s.z;
    case 3:
      return s.in.rates_B_rad_s.x;
    case 4:
      return s.in.rates_B_rad_s.y;
    case 5:
      return s.in.rates_B_rad_s.z;
    case 6:
      return s.in.p_W_m.x;
    case 7:
      return s.in.p_W_m.y;
    case 8:
      return s.in.p_W_m.z;
    case 9:
      return s.in.world_B[2].x;
    case 10:
      return s.in.world_B[2].y;
    case 11:
      return s.in.world_B[2].z;
    case 28:
      return S(s.in.battery_V);
    case 29:
      return S(s.in.t_s);
    default:
      break;
  }
  switch ((place - 12) / 4) {
    case 0:
      return s.omega_rad_s[rotor];
    case 1:
      return s.omega_dot_rad_s2[rotor];
    case 2:
      return s.rotor[rotor].thrust_N;
    default:
      return s.rotor[rotor].torque_N_m;
  }
}

// The value; roots of negative numbers are 0.
template <class S>
S evaluate(const Expression& e, const LoadState<S>& state) {
  std::array<S, Expression::kMaxDepth> stack;
  std::size_t top = 0;  // values on the stack
  for (std::size_t i = 0; i < e.length; ++i) {
    const Instruction& at = e.code[i];
    switch (at.operation) {
      case Operation::constant:
        stack[top++] = S(at.constant);
        break;
      case Operation::variable:
        stack[top++] = variable(state, at.variable);
        break;
      case Operation::negate:
        stack[top - 1] = -stack[top - 1];
        break;
      case Operation::square_root:
        stack[top - 1] = value_of(stack[top - 1]) > 0.0 ? square_root(stack[top - 1]) : S(0.0);
        break;
      case Operation::magnitude:
        stack[top - 1] = magnitude(stack[top - 1]);
        break;
      default: {
        const S b = stack[--top];
        S& a = stack[top - 1];
        switch (at.operation) {
          case Operation::add:
            a += b;
            break;
          case Operation::subtract:
            a -= b;
            break;
          case Operation::multiply:
            a *= b;
            break;
          case Operation::divide:
            a = a / b;
            break;
          case Operation::smaller:
            a = value_of(b) < value_of(a) ? b : a;
            break;
          default:
            a = value_of(b) > value_of(a) ? b : a;
            break;
        }
      }
    }
  }
  return top > 0 ? stack[0] : S(0.0);
}

}  // namespace rotorloop::host
