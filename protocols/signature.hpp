// The 64-bit signature of a data type, computed from the same walk over its fields that encodes it: a wrong field, order or cast
// changes the signature, and peers would drop our multi-frame transfers. CRC-64-WE over the normalised definition (full name, then
// one line for each field with its cast made explicit), extended by the signature of each nested type in order (DroneCAN
// specification, "Data structure description language", signature). Compile time only; nothing of it is in a firmware.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>

#include "protocols/crc.hpp"
#include "protocols/dsdl.hpp"

namespace rotorloop::protocols {

namespace detail {

class SignatureWalk {
 public:
  explicit constexpr SignatureWalk(const char* type_name) { crc_.add_text(type_name); }
  constexpr void service_separator() { line("---"); }

  template <class T>
  constexpr void value(const char* name, Primitive p, const T&) {
    begin(p);
    end(name);
  }
  template <class T, std::size_t N>
  constexpr void fixed(const char* name, Primitive p, const std::array<T, N>&) {
    begin(p);
    crc_.add_text("[");
    number(N);
    crc_.add_text("]");
    end(name);
  }
  template <class T, std::size_t N, class Count>
  constexpr void items(const char* name, Primitive p, const std::array<T, N>&, const Count&) {
    begin(p);
    bound(N);
    end(name);
  }
  template <class T, std::size_t N, class Count>
  constexpr void tail(const char* name, Primitive p, const std::array<T, N>& values, const Count& count) {
    items(name, p, values, count);
  }
  template <class T, std::size_t N, class Count>
  constexpr void structs_tail(const char* name, const std::array<T, N>&, const Count&) {
    line(T::kName);
    bound(N);
    end(name);
    const T item{};
    SignatureWalk walk(T::kName);
    T::describe(walk, item);
    add_nested(walk.signature());
  }
  template <class T>
  constexpr void nested(const char* name, const T& v) {
    group(T::kName, name, [&](auto& f) { T::describe(f, v); });
  }
  template <class T>
  constexpr void nested_tail(const char* name, const T& v) {
    nested(name, v);
  }
  template <class Body>
  constexpr void group(const char* type_name, const char* name, Body&& body) {
    line(type_name);
    end(name);
    SignatureWalk walk(type_name);
    body(walk);
    add_nested(walk.signature());
  }
  template <class Body>
  constexpr void group_tail(const char* type_name, const char* name, Body&& body) {
    group(type_name, name, body);
  }
  constexpr void padding(unsigned bits) {
    line("void");
    number(bits);
  }
  template <class Tag, class Body>
  constexpr void member(std::size_t index, std::size_t, const char* name, const Tag&, Body&& body) {
    if (index == 0) line("@union");
    body(*this, name);
  }

  constexpr std::uint64_t signature() const {
    std::uint64_t s = crc_.value();
    for (std::size_t k = 0; k < count_; ++k) {
      Crc64 extended(s);
      extended.add_little_endian(nested_[k]);
      extended.add_little_endian(s);
      s = extended.value();
    }
    return s;
  }

 private:
  constexpr void line(const char* text) {
    crc_.add_text("\n");
    crc_.add_text(text);
  }
  constexpr void end(const char* name) {
    crc_.add_text(" ");
    crc_.add_text(name);
  }
  constexpr void bound(std::size_t n) {
    crc_.add_text("[<=");
    number(n);
    crc_.add_text("]");
  }
  constexpr void number(std::size_t n) {
    if (n >= 10) number(n / 10);
    crc_.add(static_cast<std::uint8_t>('0' + n % 10));
  }
  constexpr void begin(Primitive p) {
    line(p.truncated ? "truncated " : "saturated ");
    using Kind = Primitive::Kind;
    if (p.kind == Kind::boolean) return crc_.add_text("bool");
    crc_.add_text(p.kind == Kind::unsigned_int ? "uint" : p.kind == Kind::signed_int ? "int" : "float");
    number(p.bits);
  }
  constexpr void add_nested(std::uint64_t signature) { nested_[count_++] = signature; }

  Crc64 crc_;
  std::array<std::uint64_t, 8> nested_{};  // of this type's own fields; none has more
  std::size_t count_ = 0;
};

}  // namespace detail

template <class Message>
constexpr std::uint64_t signature_of() {
  detail::SignatureWalk walk(Message::kName);
  const Message v{};
  Message::describe(walk, v);
  return walk.signature();
}

template <class Request, class Response>
constexpr std::uint64_t signature_of_service() {
  detail::SignatureWalk walk(Request::kName);
  const Request request{};
  const Response response{};
  Request::describe(walk, request);
  walk.service_separator();
  Response::describe(walk, response);
  return walk.signature();
}

}  // namespace rotorloop::protocols
