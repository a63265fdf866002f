// Text of an expression to its program:
//   sum = product {("+" | "-") product};  product = sign {("*" | "/") sign};  sign = {"-" | "+"} value
//   value = number | variable | "(" sum ")" | ("sqrt" | "abs") "(" sum ")" | ("min" | "max") "(" sum "," sum ")"
#pragma once
#include <optional>
#include <string>
#include <string_view>

#include "host/effects/expression.hpp"

namespace rotorloop::host {

struct ExpressionFault {
  std::size_t column = 0;  // from 1, in the text
  std::string what, remedy;
};

// The program, or where and why the text is none.
std::optional<ExpressionFault> parse_expression(std::string_view text, Expression& out);

// "v_x, v_y, …": for messages.
std::string variable_names();

}  // namespace rotorloop::host
