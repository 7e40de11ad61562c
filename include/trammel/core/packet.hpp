// SPDX-License-Identifier: Apache-2.0
/// @file
/// Several doubles worked on at once: the number type of code that follows several random runs in lockstep.
#pragma once

#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include <Eigen/Core>

#include "trammel/core/config.hpp"

#ifdef __AVX2__
#include <immintrin.h>
#endif

#if defined(__GNUC__) && !defined(__clang__)
// Everything here is inlined: no packet crosses a call whose convention depends on the vector flags.
#pragma GCC diagnostic ignored "-Wpsabi"
#endif

namespace trammel::inline TRAMMEL_ABI {

namespace detail {

inline constexpr std::size_t kRegisterBytes = 32;
// The vector extension that GCC and Clang share. Without 256-bit instructions the compiler splits them.
using DoubleRegister = double __attribute__((vector_size(kRegisterBytes)));
using WordRegister = std::uint64_t __attribute__((vector_size(kRegisterBytes)));

/// kParts registers of kWidth elements each.
template <class ElementType, class RegisterType>
struct Registers {
  using Element = ElementType;
  using Register = RegisterType;
  static constexpr std::size_t kWidth = sizeof(Register) / sizeof(Element);
  static constexpr std::size_t kParts = 2;  ///< independent of each other: they hide latency

  std::array<Register, kParts> part;

  Registers() noexcept = default;
  // Copied register by register: compilers move arrays in smaller pieces, and the load of a whole register
  // then waits for them.
  Registers(const Registers& other) noexcept { *this = other; }
  Registers& operator=(const Registers& other) noexcept {
    for (std::size_t i = 0; i < kParts; ++i) {
      part[i] = other.part[i];
    }
    return *this;
  }
  ~Registers() = default;

  [[nodiscard]] Element operator[](std::size_t lane) const noexcept {
    return part[lane / kWidth][lane % kWidth];
  }
  void set(std::size_t lane, Element value) noexcept { part[lane / kWidth][lane % kWidth] = value; }
  void fill(Element value) noexcept {
    for (Register& lanes : part) {
      lanes = Register{value, value, value, value};
    }
  }
};

/// operation(register of a, register of b, ...) for every register.
template <class Result, class Operation, class... Operands>
[[nodiscard]] inline Result map_registers(const Operation& operation, const Operands&... operands) noexcept {
  Result result;
  for (std::size_t i = 0; i < Result::kParts; ++i) {
    result.part[i] = reinterpret_cast<typename Result::Register>(operation(operands.part[i]...));
  }
  return result;
}

}  // namespace detail

/// A 64-bit word per lane; as a truth value all bits of a lane are set or none.
struct PacketWords : detail::Registers<std::uint64_t, detail::WordRegister> {
  PacketWords() noexcept = default;
  explicit PacketWords(std::uint64_t value) noexcept { fill(value); }
};

/// kLanes doubles with the arithmetic of one, lane by lane.
///
/// Code templated on its number type follows one run with `double` and kLanes runs with `Packet`, if its
/// branches are written with `select` and `choose` and its loops end when no lane needs them. A lane never
/// depends on its neighbours.
struct Packet : detail::Registers<double, detail::DoubleRegister> {
  static constexpr std::size_t kLanes = kWidth * kParts;

  Packet() noexcept = default;
  Packet(double value) noexcept {  // NOLINT(google-explicit-constructor): a number is a packet of equal lanes
    fill(value);
  }

  Packet& operator+=(const Packet& o) noexcept { return *this = *this + o; }
  Packet& operator-=(const Packet& o) noexcept { return *this = *this - o; }
  Packet& operator*=(const Packet& o) noexcept { return *this = *this * o; }
  Packet& operator/=(const Packet& o) noexcept { return *this = *this / o; }

  friend Packet operator+(const Packet& a, const Packet& b) noexcept {
    return detail::map_registers<Packet>([](Register x, Register y) { return x + y; }, a, b);
  }
  friend Packet operator-(const Packet& a, const Packet& b) noexcept {
    return detail::map_registers<Packet>([](Register x, Register y) { return x - y; }, a, b);
  }
  friend Packet operator*(const Packet& a, const Packet& b) noexcept {
    return detail::map_registers<Packet>([](Register x, Register y) { return x * y; }, a, b);
  }
  friend Packet operator/(const Packet& a, const Packet& b) noexcept {
    return detail::map_registers<Packet>([](Register x, Register y) { return x / y; }, a, b);
  }
  friend Packet operator-(const Packet& a) noexcept {
    return detail::map_registers<Packet>([](Register x) { return -x; }, a);
  }
  friend PacketWords operator<(const Packet& a, const Packet& b) noexcept {
    return detail::map_registers<PacketWords>([](Register x, Register y) { return x < y; }, a, b);
  }
  friend PacketWords operator<=(const Packet& a, const Packet& b) noexcept {
    return detail::map_registers<PacketWords>([](Register x, Register y) { return x <= y; }, a, b);
  }
  friend PacketWords operator>(const Packet& a, const Packet& b) noexcept { return b < a; }
  friend PacketWords operator>=(const Packet& a, const Packet& b) noexcept { return b <= a; }
  friend PacketWords operator==(const Packet& a, const Packet& b) noexcept {
    return detail::map_registers<PacketWords>([](Register x, Register y) { return x == y; }, a, b);
  }
};

[[nodiscard]] inline PacketWords operator&(const PacketWords& a, const PacketWords& b) noexcept {
  return detail::map_registers<PacketWords>([](auto x, auto y) { return x & y; }, a, b);
}
[[nodiscard]] inline PacketWords operator|(const PacketWords& a, const PacketWords& b) noexcept {
  return detail::map_registers<PacketWords>([](auto x, auto y) { return x | y; }, a, b);
}
[[nodiscard]] inline PacketWords operator^(const PacketWords& a, const PacketWords& b) noexcept {
  return detail::map_registers<PacketWords>([](auto x, auto y) { return x ^ y; }, a, b);
}
[[nodiscard]] inline PacketWords operator+(const PacketWords& a, const PacketWords& b) noexcept {
  return detail::map_registers<PacketWords>([](auto x, auto y) { return x + y; }, a, b);
}
[[nodiscard]] inline PacketWords operator==(const PacketWords& a, const PacketWords& b) noexcept {
  return detail::map_registers<PacketWords>([](auto x, auto y) { return x == y; }, a, b);
}
[[nodiscard]] inline PacketWords operator>>(const PacketWords& a, unsigned places) noexcept {
  return detail::map_registers<PacketWords>([places](auto x) { return x >> places; }, a);
}
[[nodiscard]] inline PacketWords operator<<(const PacketWords& a, unsigned places) noexcept {
  return detail::map_registers<PacketWords>([places](auto x) { return x << places; }, a);
}
[[nodiscard]] inline PacketWords operator!(const PacketWords& a) noexcept {
  return detail::map_registers<PacketWords>([](auto x) { return ~x; }, a);
}
/// Of truth values; both sides are evaluated.
[[nodiscard]] inline PacketWords operator&&(const PacketWords& a, const PacketWords& b) noexcept {
  return a & b;
}
[[nodiscard]] inline PacketWords operator||(const PacketWords& a, const PacketWords& b) noexcept {
  return a | b;
}
/// Product of the lower 32 bits of every lane and a 32-bit number.
[[nodiscard]] inline PacketWords lower_product(std::uint32_t factor, const PacketWords& a) noexcept {
  return detail::map_registers<PacketWords>(
      [factor](PacketWords::Register x) {
#ifdef __AVX2__
        return _mm256_mul_epu32(reinterpret_cast<__m256i>(x), _mm256_set1_epi64x(std::int64_t{factor}));
#else
        constexpr std::uint64_t kLower = 0xFFFFFFFFU;
        return (x & kLower) * std::uint64_t{factor};
#endif
      },
      a);
}

/// Truth value of comparing two numbers of type Real, and 64 bits of one.
template <class Real>
struct RealTraits;
template <>
struct RealTraits<double> {
  using Mask = bool;
  using Words = std::uint64_t;
  static constexpr std::size_t kLanes = 1;
};
template <>
struct RealTraits<Packet> {
  using Mask = PacketWords;
  using Words = PacketWords;
  static constexpr std::size_t kLanes = Packet::kLanes;
};
template <class Real>
using MaskOf = typename RealTraits<Real>::Mask;
template <class Real>
using WordsOf = typename RealTraits<Real>::Words;
template <class Real>
inline constexpr std::size_t kLanesOf = RealTraits<Real>::kLanes;

[[nodiscard]] inline double lane_of(double value, std::size_t /*lane*/) noexcept { return value; }
[[nodiscard]] inline double lane_of(const Packet& value, std::size_t lane) noexcept { return value[lane]; }
template <class Value>
void set_lane(Value& value, std::size_t lane, decltype(value[0]) lane_value) noexcept {
  value.set(lane, lane_value);
}
inline void set_lane(double& value, std::size_t /*lane*/, double lane_value) noexcept { value = lane_value; }
inline void set_lane(std::uint64_t& value, std::size_t /*lane*/, std::uint64_t lane_value) noexcept {
  value = lane_value;
}

[[nodiscard]] inline std::uint64_t bits_of(double value) noexcept {
  return std::bit_cast<std::uint64_t>(value);
}
[[nodiscard]] inline PacketWords bits_of(const Packet& value) noexcept {
  return detail::map_registers<PacketWords>([](auto x) { return x; }, value);
}
[[nodiscard]] inline double from_bits(std::uint64_t bits) noexcept { return std::bit_cast<double>(bits); }
[[nodiscard]] inline Packet from_bits(const PacketWords& bits) noexcept {
  return detail::map_registers<Packet>([](auto x) { return x; }, bits);
}

[[nodiscard]] inline bool any(bool mask) noexcept { return mask; }
[[nodiscard]] inline bool any(const PacketWords& mask) noexcept {
  PacketWords::Register sum = mask.part[0];
  for (std::size_t i = 1; i < PacketWords::kParts; ++i) {
    sum |= mask.part[i];
  }
#ifdef __AVX2__
  return _mm256_testz_si256(reinterpret_cast<__m256i>(sum), reinterpret_cast<__m256i>(sum)) == 0;
#else
  return (sum[0] | sum[1] | sum[2] | sum[3]) != 0;
#endif
}
[[nodiscard]] inline bool all(bool mask) noexcept { return mask; }
[[nodiscard]] inline bool all(const PacketWords& mask) noexcept { return !any(!mask); }

/// mask ? a : b, lane by lane.
[[nodiscard]] inline double select(bool mask, double a, double b) noexcept { return mask ? a : b; }
[[nodiscard]] inline Packet select(const PacketWords& mask, const Packet& a, const Packet& b) noexcept {
  using SignedRegister = std::int64_t __attribute__((vector_size(detail::kRegisterBytes)));
  return detail::map_registers<Packet>(
      [](PacketWords::Register m, Packet::Register x, Packet::Register y) -> Packet::Register {
        return reinterpret_cast<SignedRegister>(m) < 0 ? x : y;
      },
      mask, a, b);
}

/// mask ? first() : second(), evaluating only what some lane needs.
template <class Mask, class First, class Second>
[[nodiscard]] auto choose(const Mask& mask, const First& first, const Second& second) noexcept {
  if (all(mask)) {
    return first();
  }
  if (!any(mask)) {
    return second();
  }
  return select(mask, first(), second());
}

[[nodiscard]] inline Packet sqrt(const Packet& a) noexcept {
  using Lanes = Eigen::Array<double, Packet::kLanes, 1>;
  Packet result;
  Eigen::Map<Lanes>(reinterpret_cast<double*>(&result)) =
      Eigen::Map<const Lanes>(reinterpret_cast<const double*>(&a)).sqrt();
  return result;
}
/// |magnitude| with the sign of `sign`.
[[nodiscard]] inline Packet copysign(const Packet& magnitude, const Packet& sign) noexcept {
  const PacketWords mask(std::uint64_t{1} << 63U);
  return from_bits((bits_of(magnitude) & !mask) | (bits_of(sign) & mask));
}
[[nodiscard]] inline Packet abs(const Packet& a) noexcept { return copysign(a, Packet(0.0)); }
[[nodiscard]] inline Packet atan2(const Packet& y, const Packet& x) noexcept {
  Packet result;
  for (std::size_t lane = 0; lane < Packet::kLanes; ++lane) {
    result.set(lane, std::atan2(y[lane], x[lane]));
  }
  return result;
}

}  // namespace trammel::inline TRAMMEL_ABI

/// Eigen's small matrices of packets.
template <>
struct Eigen::NumTraits<trammel::Packet> : Eigen::GenericNumTraits<trammel::Packet> {
  enum { IsInteger = 0, IsSigned = 1, RequireInitialization = 0, ReadCost = 2, AddCost = 2, MulCost = 2 };
};
