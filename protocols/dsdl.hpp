// A data type is described once, as a walk over its fields, and everything else follows from that walk: encoding, decoding, the
// size of the largest payload, the signature, and (in tools) JSON. A type is a plain struct with
//   static constexpr const char* kName;                       full name; request and response of a service share it
//   template <class F, class Self> static constexpr void describe(F& f, Self& v)   fields in the order of the definition
// The walker F offers: value, fixed, items, tail, structs_tail, nested, nested_tail, group, group_tail, padding, member.
// "tail" marks what stands last in its struct: such an array has no length field when it ends a classic CAN payload (tail array
// optimisation); on CAN FD every array has one.
#pragma once
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>

#include "protocols/bits.hpp"
#include "protocols/crc.hpp"

namespace rotorloop::protocols {

// Which kind of frames carries a transfer; it decides about length fields and padding.
enum class Framing : std::uint8_t { classic, fd };

struct Primitive {
  enum class Kind : std::uint8_t { unsigned_int, signed_int, boolean, real };
  Kind kind = Kind::unsigned_int;
  std::uint8_t bits = 8;
  bool truncated = false;  // cast by dropping upper bits instead of clamping
};
inline constexpr Primitive kBool{Primitive::Kind::boolean, 1}, kFloat16{Primitive::Kind::real, 16}, kFloat32{Primitive::Kind::real, 32};
constexpr Primitive u(unsigned bits) { return {Primitive::Kind::unsigned_int, static_cast<std::uint8_t>(bits)}; }
constexpr Primitive i(unsigned bits) { return {Primitive::Kind::signed_int, static_cast<std::uint8_t>(bits)}; }
constexpr Primitive truncated_u(unsigned bits) { return {Primitive::Kind::unsigned_int, static_cast<std::uint8_t>(bits), true}; }

// At most N items in place. Items beyond `count` are zero, so that equal contents compare equal.
template <class T, std::size_t N>
struct BoundedArray {
  static constexpr std::size_t kCapacity = N;
  std::array<T, N> items{};
  std::uint16_t count = 0;

  constexpr std::span<const T> view() const { return {items.data(), count}; }
  constexpr bool push_back(const T& item) {
    if (count == N) return false;
    items[count++] = item;
    return true;
  }
  // Takes as many as fit.
  constexpr void assign(std::span<const T> from) {
    *this = {};
    for (const T& item : from.first(std::min(from.size(), N))) items[count++] = item;
  }
  friend constexpr bool operator==(const BoundedArray&, const BoundedArray&) = default;
};

// Bytes that are mostly text; not terminated.
template <std::size_t N>
struct Text : BoundedArray<std::uint8_t, N> {
  constexpr Text() = default;
  constexpr Text(const char* text) {  // implicit: a name is given as a literal
    for (; *text != '\0' && this->count < N; ++text) this->items[this->count++] = static_cast<std::uint8_t>(*text);
  }
  constexpr bool is(const char* text) const {
    std::size_t n = 0;
    for (; n < this->count; ++n) {
      if (text[n] == '\0' || static_cast<std::uint8_t>(text[n]) != this->items[n]) return false;
    }
    return text[n] == '\0';
  }
  friend constexpr bool operator==(const Text&, const Text&) = default;
};

// Bits of the length field of an array of at most `capacity` items, and of the tag of a union of `members`.
constexpr unsigned count_bits(std::size_t capacity) { return static_cast<unsigned>(std::bit_width(capacity)); }
constexpr unsigned tag_bits(std::size_t members) { return static_cast<unsigned>(std::bit_width(members - 1u)); }

namespace detail {

class Encoder {
 public:
  constexpr Encoder(std::span<std::uint8_t> out, Framing framing) : w_(out), tail_(framing == Framing::classic) {}
  constexpr std::size_t bytes() const { return w_.bytes(); }

  template <class T>
  constexpr void value(const char*, Primitive p, const T& v) {
    if constexpr (std::is_floating_point_v<T>) {
      p.bits == 16 ? w_.put_float16(v) : w_.put_float32(v);
    } else if constexpr (std::is_signed_v<T> && !std::is_same_v<T, char>) {
      w_.put_signed_saturated(v, p.bits);
    } else if (p.truncated || p.kind == Primitive::Kind::boolean) {
      w_.put(static_cast<std::uint64_t>(v), p.bits);
    } else {
      w_.put_saturated(static_cast<std::uint64_t>(v), p.bits);
    }
  }
  template <class T, std::size_t N>
  constexpr void fixed(const char* name, Primitive p, const std::array<T, N>& items) {
    some(name, p, items, N);
  }
  template <class T, std::size_t N, class Count>
  constexpr void items(const char* name, Primitive p, const std::array<T, N>& items, const Count& count) {
    const std::size_t n = std::min<std::size_t>(count, N);
    w_.put(n, count_bits(N));
    some(name, p, items, n);
  }
  template <class T, std::size_t N, class Count>
  constexpr void tail(const char* name, Primitive p, const std::array<T, N>& values, const Count& count) {
    if (!tail_ || p.bits < 8) return items(name, p, values, count);
    some(name, p, values, std::min<std::size_t>(count, N));
  }
  template <class T, std::size_t N, class Count>
  constexpr void structs_tail(const char*, const std::array<T, N>& items, const Count& count) {
    const std::size_t n = std::min<std::size_t>(count, N);
    if (!tail_) w_.put(n, count_bits(N));
    const bool before = tail_;
    tail_ = false;
    for (std::size_t k = 0; k < n; ++k) T::describe(*this, items[k]);
    tail_ = before;
  }
  template <class T>
  constexpr void nested(const char* name, const T& v) {
    group(T::kName, name, [&](auto& f) { T::describe(f, v); });
  }
  template <class T>
  constexpr void nested_tail(const char*, const T& v) {
    T::describe(*this, v);
  }
  template <class Body>
  constexpr void group(const char*, const char*, Body&& body) {
    const bool before = tail_;
    tail_ = false;
    body(*this);
    tail_ = before;
  }
  template <class Body>
  constexpr void group_tail(const char*, const char*, Body&& body) {
    body(*this);
  }
  constexpr void padding(unsigned bits) { w_.put(0, bits); }
  // One call for each member of a union, in order; the first also stands for the tag.
  template <class Tag, class Body>
  constexpr void member(std::size_t index, std::size_t members, const char* name, const Tag& tag, Body&& body) {
    if (index == 0) w_.put(static_cast<std::uint64_t>(tag), tag_bits(members));
    if (static_cast<std::size_t>(tag) == index) body(*this, name);
  }

 private:
  template <class T, std::size_t N>
  constexpr void some(const char* name, Primitive p, const std::array<T, N>& items, std::size_t n) {
    if constexpr (sizeof(T) == 1 && std::is_unsigned_v<T>) {
      if (p.bits == 8) return w_.put_bytes(std::span<const T>(items.data(), n));
    }
    for (std::size_t k = 0; k < n; ++k) value(name, p, items[k]);
  }
  BitWriter w_;
  bool tail_;
};

class Decoder {
 public:
  constexpr Decoder(std::span<const std::uint8_t> in, Framing framing) : r_(in), tail_(framing == Framing::classic) {}
  constexpr bool good() const { return good_ && !r_.missing(); }

  template <class T>
  constexpr void value(const char*, Primitive p, T& v) {
    if constexpr (std::is_floating_point_v<T>) {
      v = p.bits == 16 ? r_.get_float16() : r_.get_float32();
    } else if constexpr (std::is_signed_v<T> && !std::is_same_v<T, char>) {
      v = static_cast<T>(r_.get_signed64(p.bits));
    } else {
      v = static_cast<T>(r_.get(p.bits));
    }
  }
  template <class T, std::size_t N>
  constexpr void fixed(const char* name, Primitive p, std::array<T, N>& items) {
    for (T& item : items) value(name, p, item);
  }
  template <class T, std::size_t N, class Count>
  constexpr void items(const char* name, Primitive p, std::array<T, N>& values, Count& count) {
    fill(name, p, values, count, static_cast<std::size_t>(r_.get(count_bits(N))));
  }
  // The number of items follows from the length; bits that fill up the last byte are no item.
  template <class T, std::size_t N, class Count>
  constexpr void tail(const char* name, Primitive p, std::array<T, N>& values, Count& count) {
    if (!tail_ || p.bits < 8) return items(name, p, values, count);
    fill(name, p, values, count, std::min<std::size_t>(r_.remaining_bits() / p.bits, N));
  }
  template <class T, std::size_t N, class Count>
  constexpr void structs_tail(const char*, std::array<T, N>& items, Count& count) {
    const std::size_t n = tail_ ? N : static_cast<std::size_t>(r_.get(count_bits(N)));
    if (n > N) good_ = false;
    const bool before = tail_;
    tail_ = false;
    count = 0;
    items = {};
    for (std::size_t k = 0; k < std::min(n, N) && (!before || r_.remaining_bits() >= 8u); ++k) {
      T::describe(*this, items[k]);
      ++count;
    }
    tail_ = before;
  }
  template <class T>
  constexpr void nested(const char* name, T& v) {
    group(T::kName, name, [&](auto& f) { T::describe(f, v); });
  }
  template <class T>
  constexpr void nested_tail(const char*, T& v) {
    T::describe(*this, v);
  }
  template <class Body>
  constexpr void group(const char*, const char*, Body&& body) {
    const bool before = tail_;
    tail_ = false;
    body(*this);
    tail_ = before;
  }
  template <class Body>
  constexpr void group_tail(const char*, const char*, Body&& body) {
    body(*this);
  }
  constexpr void padding(unsigned bits) { r_.get(bits); }
  template <class Tag, class Body>
  constexpr void member(std::size_t index, std::size_t members, const char* name, Tag& tag, Body&& body) {
    if (index == 0) {
      const std::uint64_t read = r_.get(tag_bits(members));
      if (read >= members) good_ = false;
      tag = static_cast<Tag>(read < members ? read : 0u);
    }
    if (static_cast<std::size_t>(tag) == index) body(*this, name);
  }

 private:
  template <class T, std::size_t N, class Count>
  constexpr void fill(const char* name, Primitive p, std::array<T, N>& values, Count& count, std::size_t n) {
    if (n > N) good_ = false;
    values = {};
    count = static_cast<Count>(std::min(n, N));
    for (std::size_t k = 0; k < count; ++k) value(name, p, values[k]);
  }
  BitReader r_;
  bool tail_;
  bool good_ = true;
};

// Bits of the largest payload, with every length field (the larger of the two framings).
class Measure {
 public:
  std::size_t bits = 0;

  template <class T>
  constexpr void value(const char*, Primitive p, const T&) {
    bits += p.bits;
  }
  template <class T, std::size_t N>
  constexpr void fixed(const char*, Primitive p, const std::array<T, N>&) {
    bits += N * p.bits;
  }
  template <class T, std::size_t N, class Count>
  constexpr void items(const char*, Primitive p, const std::array<T, N>&, const Count&) {
    bits += count_bits(N) + N * p.bits;
  }
  template <class T, std::size_t N, class Count>
  constexpr void tail(const char* name, Primitive p, const std::array<T, N>& values, const Count& count) {
    items(name, p, values, count);
  }
  template <class T, std::size_t N, class Count>
  constexpr void structs_tail(const char*, const std::array<T, N>&, const Count&) {
    Measure one;
    const T item{};
    T::describe(one, item);
    bits += count_bits(N) + N * one.bits;
  }
  template <class T>
  constexpr void nested(const char*, const T& v) {
    T::describe(*this, v);
  }
  template <class T>
  constexpr void nested_tail(const char*, const T& v) {
    T::describe(*this, v);
  }
  template <class Body>
  constexpr void group(const char*, const char*, Body&& body) {
    body(*this);
  }
  template <class Body>
  constexpr void group_tail(const char*, const char*, Body&& body) {
    body(*this);
  }
  constexpr void padding(unsigned n) { bits += n; }
  template <class Tag, class Body>
  constexpr void member(std::size_t index, std::size_t members, const char* name, const Tag&, Body&& body) {
    if (index == 0) {
      bits += tag_bits(members);
      largest_ = 0;
    }
    Measure one;
    body(one, name);
    if (one.bits > largest_) {
      bits += one.bits - largest_;
      largest_ = one.bits;
    }
  }

 private:
  std::size_t largest_ = 0;  // member of the union being walked
};

}  // namespace detail

// Bytes of the largest payload of T, in either framing.
template <class T>
constexpr std::size_t max_bytes() {
  detail::Measure m;
  const T value{};
  T::describe(m, value);
  return (m.bits + 7u) / 8u;
}

template <class T>
concept DataTypeStruct = requires {
  T::kName;
};

// Clamps each value to its field, writes from the start of `out` and returns the payload's size (0 is a valid size of some types).
// `out` has max_bytes<T>() bytes, or what the value at hand needs: what does not fit is left out.
template <DataTypeStruct T>
constexpr std::size_t encode(const T& v, std::span<std::uint8_t> out, Framing framing = Framing::classic) {
  detail::Encoder f(out, framing);
  T::describe(f, v);
  return f.bytes();
}

// False when the payload is too short for its fields, or says that an array is longer than it can be. Longer payloads are accepted.
template <DataTypeStruct T>
constexpr bool decode(std::span<const std::uint8_t> in, T& v, Framing framing = Framing::classic) {
  detail::Decoder f(in, framing);
  T::describe(f, v);
  return f.good();
}

}  // namespace rotorloop::protocols
