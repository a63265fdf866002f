// The fields of a data type as JSON: two more walkers over its description (protocols/dsdl.hpp).
#pragma once
#include <algorithm>
#include <array>
#include <cfloat>
#include <cmath>
#include <cstdint>
#include <limits>
#include <nlohmann/json.hpp>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "protocols/dsdl.hpp"

namespace rotorloop {

using Json = nlohmann::ordered_json;

struct BadRequest : std::runtime_error {
  using std::runtime_error::runtime_error;
};

inline std::string to_hex(std::span<const std::uint8_t> bytes) {
  static constexpr char kDigits[] = "0123456789abcdef";
  std::string text;
  for (const std::uint8_t b : bytes) {
    text += kDigits[b >> 4];
    text += kDigits[b & 15];
  }
  return text;
}

inline std::vector<std::uint8_t> from_hex(const std::string& text, const std::string& where) {
  const auto digit = [&](char c) -> unsigned {
    if (c >= '0' && c <= '9') return static_cast<unsigned>(c - '0');
    if (c >= 'a' && c <= 'f') return static_cast<unsigned>(c - 'a') + 10u;
    if (c >= 'A' && c <= 'F') return static_cast<unsigned>(c - 'A') + 10u;
    throw BadRequest(where + ": not hexadecimal: \"" + text.substr(0, 40) + "\"");
  };
  if (text.size() % 2 != 0) throw BadRequest(where + ": " + std::to_string(text.size()) + " hexadecimal digits; bytes have two each");
  std::vector<std::uint8_t> bytes;
  for (std::size_t k = 0; k < text.size(); k += 2) bytes.push_back(static_cast<std::uint8_t>(digit(text[k]) << 4 | digit(text[k + 1])));
  return bytes;
}

class FieldsToJson {
 public:
  explicit FieldsToJson(Json& out) : out_(&out) { *out_ = Json::object(); }

  template <class T>
  void value(const char* name, protocols::Primitive p, const T& v) {
    (*out_)[name] = primitive(p, v);
  }
  template <class T, std::size_t N>
  void fixed(const char* name, protocols::Primitive p, const std::array<T, N>& items) {
    (*out_)[name] = array(p, items, N);
  }
  template <class T, std::size_t N, class Count>
  void items(const char* name, protocols::Primitive p, const std::array<T, N>& items, const Count& count) {
    (*out_)[name] = array(p, items, count);
  }
  template <class T, std::size_t N, class Count>
  void tail(const char* name, protocols::Primitive p, const std::array<T, N>& items, const Count& count) {
    (*out_)[name] = array(p, items, count);
  }
  template <class T, std::size_t N, class Count>
  void structs_tail(const char* name, const std::array<T, N>& items, const Count& count) {
    Json list = Json::array();
    for (std::size_t k = 0; k < count; ++k) {
      Json item;
      FieldsToJson f(item);
      T::describe(f, items[k]);
      list.push_back(std::move(item));
    }
    (*out_)[name] = std::move(list);
  }
  template <class T>
  void nested(const char* name, const T& v) {
    FieldsToJson f((*out_)[name]);
    T::describe(f, v);
  }
  template <class T>
  void nested_tail(const char* name, const T& v) {
    nested(name, v);
  }
  template <class Body>
  void group(const char*, const char* name, Body&& body) {
    FieldsToJson f((*out_)[name]);
    body(f);
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
  static Json primitive(protocols::Primitive p, const T& v) {
    if constexpr (std::is_floating_point_v<T>) {
      if (std::isnan(v)) return "nan";
      if (std::isinf(v)) return v > 0 ? "inf" : "-inf";
      if (v == 0 && std::signbit(v)) return "-0";
      return static_cast<double>(v);
    } else if constexpr (std::is_signed_v<T> && !std::is_same_v<T, char>) {
      return static_cast<std::int64_t>(v);
    } else {
      if (p.kind == protocols::Primitive::Kind::boolean) return static_cast<bool>(v);
      return static_cast<std::uint64_t>(v);
    }
  }
  template <class T, std::size_t N>
  static Json array(protocols::Primitive p, const std::array<T, N>& items, std::size_t count) {
    if constexpr (sizeof(T) == 1 && !std::is_same_v<T, bool>) {
      if (p.kind == protocols::Primitive::Kind::unsigned_int && p.bits == 8) {
        std::vector<std::uint8_t> bytes;
        for (std::size_t k = 0; k < count; ++k) bytes.push_back(static_cast<std::uint8_t>(items[k]));
        return Json{{"hex", to_hex(bytes)}};
      }
    }
    Json list = Json::array();
    for (std::size_t k = 0; k < count; ++k) list.push_back(primitive(p, items[k]));
    return list;
  }
  Json* out_;
};

class JsonToFields {
 public:
  JsonToFields(const Json& in, std::string path) : in_(in), path_(std::move(path)) {
    if (!in_.is_object()) throw BadRequest(path_ + ": an object with the fields is expected, not " + in_.type_name());
  }
  // After the walk: what the definition does not have is a mistake of the sender.
  void finish() const {
    for (const auto& [key, ignored] : in_.items()) {
      if (std::find(known_.begin(), known_.end(), key) == known_.end()) throw BadRequest(path_ + ": there is no field \"" + key + "\"");
    }
  }

  template <class T>
  void value(const char* name, protocols::Primitive p, T& v) {
    if (const Json* j = find(name)) v = primitive<T>(p, *j, where(name));
  }
  template <class T, std::size_t N>
  void fixed(const char* name, protocols::Primitive p, std::array<T, N>& items) {
    std::size_t count = 0;
    array(name, p, items, count);
  }
  template <class T, std::size_t N, class Count>
  void items(const char* name, protocols::Primitive p, std::array<T, N>& values, Count& count) {
    std::size_t n = 0;
    array(name, p, values, n);
    count = static_cast<Count>(n);
  }
  template <class T, std::size_t N, class Count>
  void tail(const char* name, protocols::Primitive p, std::array<T, N>& values, Count& count) {
    items(name, p, values, count);
  }
  template <class T, std::size_t N, class Count>
  void structs_tail(const char* name, std::array<T, N>& items, Count& count) {
    const Json* j = find(name);
    if (j == nullptr) return;
    if (!j->is_array()) throw BadRequest(where(name) + ": an array of objects is expected, not " + j->type_name());
    check_size(j->size(), N, name);
    count = static_cast<Count>(j->size());
    for (std::size_t k = 0; k < j->size(); ++k) {
      JsonToFields f((*j)[k], where(name) + "[" + std::to_string(k) + "]");
      T::describe(f, items[k]);
      f.finish();
    }
  }
  template <class T>
  void nested(const char* name, T& v) {
    group(nullptr, name, [&](auto& f) { T::describe(f, v); });
  }
  template <class T>
  void nested_tail(const char* name, T& v) {
    nested(name, v);
  }
  template <class Body>
  void group(const char*, const char* name, Body&& body) {
    const Json* j = find(name);
    if (j == nullptr) return;
    JsonToFields f(*j, where(name));
    body(f);
    f.finish();
  }
  template <class Body>
  void group_tail(const char* type, const char* name, Body&& body) {
    group(type, name, body);
  }
  void padding(unsigned) {}
  template <class Tag, class Body>
  void member(std::size_t index, std::size_t, const char* name, Tag& tag, Body&& body) {
    if (index == 0 && in_.size() > 1)
      throw BadRequest(path_ + ": a union has one member at a time, here are " + std::to_string(in_.size()));
    if (index == 0) tag = Tag{};
    if (in_.contains(name)) tag = static_cast<Tag>(index);
    known_.push_back(name);
    if (in_.contains(name)) body(*this, name);
  }

 private:
  std::string where(const char* name) const { return path_ + "." + name; }
  const Json* find(const char* name) {
    known_.push_back(name);
    const auto it = in_.find(name);
    return it == in_.end() ? nullptr : &*it;
  }
  void check_size(std::size_t size, std::size_t most, const char* name) const {
    if (size > most) throw BadRequest(where(name) + ": " + std::to_string(size) + " items, at most " + std::to_string(most) + " fit");
  }

  template <class T>
  static T primitive(protocols::Primitive p, const Json& j, const std::string& at) {
    if constexpr (std::is_floating_point_v<T>) {
      return real(j, at);
    } else {
      return integer<T>(p, j, at);
    }
  }
  static float real(const Json& j, const std::string& at) {
    if (j.is_string()) {
      const std::string& s = j.get_ref<const std::string&>();
      if (s == "nan") return std::numeric_limits<float>::quiet_NaN();
      if (s == "inf" || s == "+inf") return std::numeric_limits<float>::infinity();
      if (s == "-inf") return -std::numeric_limits<float>::infinity();
      if (s == "-0") return -0.0f;
    }
    if (!j.is_number()) throw BadRequest(at + ": a number, \"nan\", \"inf\", \"-inf\" or \"-0\" is expected");
    return static_cast<float>(std::clamp(j.get<double>(), -static_cast<double>(FLT_MAX), static_cast<double>(FLT_MAX)));
  }
  // To the range of the struct's member; to that of the field clamps the encoder.
  template <class T>
  static T integer(protocols::Primitive p, const Json& j, const std::string& at) {
    if (p.kind == protocols::Primitive::Kind::boolean && j.is_boolean()) return static_cast<T>(j.get<bool>());
    if (!j.is_number()) throw BadRequest(at + ": an integer is expected, not " + std::string(j.type_name()));
    using Raw = decltype(raw<T>());
    constexpr Raw kMin = std::numeric_limits<Raw>::min(), kMax = std::numeric_limits<Raw>::max();
    if (j.is_number_unsigned()) {
      const auto v = j.get<std::uint64_t>();
      if (p.kind == protocols::Primitive::Kind::boolean) return static_cast<T>(v != 0);
      return static_cast<T>(p.truncated || v <= static_cast<std::uint64_t>(kMax) ? static_cast<Raw>(v) : kMax);
    }
    if (j.is_number_integer()) {  // negative
      const auto v = j.get<std::int64_t>();
      if (p.kind == protocols::Primitive::Kind::boolean) return static_cast<T>(v != 0);
      if constexpr (std::is_signed_v<Raw>) return static_cast<T>(v < static_cast<std::int64_t>(kMin) ? kMin : static_cast<Raw>(v));
      return static_cast<T>(p.truncated ? static_cast<Raw>(v) : Raw{0});
    }
    const double v = j.get<double>();
    if (v != std::floor(v)) throw BadRequest(at + ": " + j.dump() + " is no integer");
    if (p.truncated) return static_cast<T>(static_cast<std::uint64_t>(v - std::floor(v * 0x1p-64) * 0x1p64));
    if (v >= static_cast<double>(kMax)) return static_cast<T>(kMax);
    return static_cast<T>(v <= static_cast<double>(kMin) ? kMin : static_cast<Raw>(v));
  }
  template <class T>
  static auto raw() {
    if constexpr (std::is_enum_v<T>) {
      return std::underlying_type_t<T>{};
    } else if constexpr (std::is_same_v<T, bool> || std::is_same_v<T, char>) {
      return std::uint8_t{};
    } else {
      return T{};
    }
  }
  template <class T, std::size_t N>
  void array(const char* name, protocols::Primitive p, std::array<T, N>& items, std::size_t& count) {
    const Json* j = find(name);
    if (j == nullptr) return;
    if constexpr (sizeof(T) == 1 && !std::is_same_v<T, bool>) {
      const bool hex = j->is_object() && j->size() == 1 && j->contains("hex") && (*j)["hex"].is_string();
      if (p.bits == 8 && (hex || j->is_string())) {
        const std::string& text = hex ? (*j)["hex"].template get_ref<const std::string&>() : j->template get_ref<const std::string&>();
        const std::vector<std::uint8_t> bytes = hex ? from_hex(text, where(name)) : std::vector<std::uint8_t>(text.begin(), text.end());
        check_size(bytes.size(), N, name);
        count = bytes.size();
        for (std::size_t k = 0; k < count; ++k) items[k] = static_cast<T>(bytes[k]);
        return;
      }
    }
    if (!j->is_array())
      throw BadRequest(where(name) + ": an array" + (p.bits == 8 ? ", {\"hex\": …} or text" : "") + " is expected, not " + j->type_name());
    check_size(j->size(), N, name);
    count = j->size();
    for (std::size_t k = 0; k < count; ++k) items[k] = primitive<T>(p, (*j)[k], where(name) + "[" + std::to_string(k) + "]");
  }

  const Json& in_;
  std::string path_;
  std::vector<std::string> known_;
};

}  // namespace rotorloop
