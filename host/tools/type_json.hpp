// A value of a DroneCAN type as JSON, by its own description (protocols/dsdl.hpp): names of fields as in the public definitions.
#pragma once
#include <cmath>
#include <cstddef>
#include <nlohmann/json.hpp>
#include <string>
#include <type_traits>

#include "protocols/dsdl.hpp"

namespace rotorloop::tools {

namespace detail {

// Bytes as text when they are, else in hexadecimal.
std::string bytes_text(const std::uint8_t* bytes, std::size_t count);

class JsonWalk {
 public:
  nlohmann::ordered_json out = nlohmann::ordered_json::object();

  template <class T>
  void value(const char* name, protocols::Primitive p, const T& v) {
    out[name] = item(p, v);
  }
  template <class T, std::size_t N>
  void fixed(const char* name, protocols::Primitive p, const std::array<T, N>& values) {
    list(name, p, values, N);
  }
  template <class T, std::size_t N, class Count>
  void items(const char* name, protocols::Primitive p, const std::array<T, N>& values, const Count& count) {
    list(name, p, values, count);
  }
  template <class T, std::size_t N, class Count>
  void tail(const char* name, protocols::Primitive p, const std::array<T, N>& values, const Count& count) {
    list(name, p, values, count);
  }
  template <class T, std::size_t N, class Count>
  void structs_tail(const char* name, const std::array<T, N>& values, const Count& count) {
    out[name] = nlohmann::ordered_json::array();
    for (std::size_t i = 0; i < count; ++i) {
      JsonWalk inner;
      T::describe(inner, values[i]);
      out[name].push_back(inner.out);
    }
  }
  template <class T>
  void nested(const char* name, const T& v) {
    JsonWalk inner;
    T::describe(inner, v);
    out[name] = inner.out;
  }
  template <class T>
  void nested_tail(const char* name, const T& v) {
    nested(name, v);
  }
  template <class Body>
  void group(const char*, const char* name, Body&& body) {
    JsonWalk inner;
    body(inner);
    out[name] = inner.out;
  }
  template <class Body>
  void group_tail(const char* type, const char* name, Body&& body) {
    group(type, name, body);
  }
  void padding(unsigned) {}
  template <class Tag, class Body>
  void member(std::size_t index, std::size_t, const char* name, const Tag& tag, Body&& body) {
    if (static_cast<std::size_t>(tag) == index) body(*this, name);
  }

 private:
  template <class T>
  static nlohmann::ordered_json item(protocols::Primitive p, const T& v) {
    if constexpr (std::is_enum_v<T>) {
      return static_cast<std::underlying_type_t<T>>(v);
    } else if constexpr (std::is_floating_point_v<T>) {
      if (std::isnan(v)) return "nan";
      if (std::isinf(v)) return v > 0 ? "inf" : "-inf";
      return v;
    } else {
      if (p.kind == protocols::Primitive::Kind::boolean) return v != T{};
      return v;
    }
  }
  template <class T, std::size_t N>
  void list(const char* name, protocols::Primitive p, const std::array<T, N>& values, std::size_t count) {
    if constexpr (std::is_same_v<T, std::uint8_t>) {
      if (p.bits == 8) {
        out[name] = bytes_text(values.data(), count);
        return;
      }
    }
    out[name] = nlohmann::ordered_json::array();
    for (std::size_t i = 0; i < count; ++i) out[name].push_back(item(p, values[i]));
  }
};

}  // namespace detail

template <class T>
nlohmann::ordered_json to_json(const T& value) {
  detail::JsonWalk walk;
  T::describe(walk, value);
  return walk.out;
}

}  // namespace rotorloop::tools
