// SPDX-License-Identifier: Apache-2.0
/// @file
/// A sensor whose kind is known at run time only.
#pragma once

#include <utility>
#include <variant>

#include "trammel/sensor/azimuth_elevation.hpp"
#include "trammel/sensor/azimuth_elevation_range.hpp"
#include "trammel/sensor/direction_cosines.hpp"
#include "trammel/sensor/direction_cosines_range.hpp"
#include "trammel/sensor/position.hpp"
#include "trammel/sensor/range.hpp"
#include "trammel/sensor/range_rate.hpp"

namespace trammel::inline TRAMMEL_ABI::sensor {

/// One alternative per SensorKind, in the order of the enumeration.
using AnySensor = std::variant<DirectionCosinesRange, AzimuthElevationRange, Range, DirectionCosines,
                               AzimuthElevation, RangeRate, Position>;
static_assert(std::variant_size_v<AnySensor> == kSensorKinds);

namespace detail {
template <std::size_t... I>
[[nodiscard]] AnySensor make_sensor(SensorKind kind, std::index_sequence<I...> /*all*/) {
  static_assert(((std::variant_alternative_t<I, AnySensor>::kKind == static_cast<SensorKind>(I)) && ...));
  AnySensor result;
  ((static_cast<std::size_t>(kind) == I ? static_cast<void>(result.emplace<I>()) : void()), ...);
  return result;
}
}  // namespace detail

/// The sensor of a kind.
[[nodiscard]] inline AnySensor make_sensor(SensorKind kind) {
  return detail::make_sensor(kind, std::make_index_sequence<kSensorKinds>{});
}

/// A measurement of up to three components; places past the last component hold zeros. (Fixed size: no memory
/// on the heap, and one code path for every kind.)
using Padded = Eigen::Vector3d;
/// The same for derivatives: rows past the last component hold zeros.
using PaddedRows = Eigen::Matrix3d;

/// Value and derivatives of one measurement.
struct Linearised {
  Padded value;
  PaddedRows J_value_position;
  PaddedRows J_value_velocity;
};

namespace detail {
template <class Fixed>
[[nodiscard]] PaddedRows pad_rows(const Fixed& rows) {
  PaddedRows result = PaddedRows::Zero();
  result.template topRows<Fixed::RowsAtCompileTime>() = rows;
  return result;
}
template <class Fixed>
[[nodiscard]] Padded pad(const Fixed& value) {
  Padded result = Padded::Zero();
  result.template head<Fixed::RowsAtCompileTime>() = value;
  return result;
}
}  // namespace detail

/// The measurement of `kind` that an ideal station makes; position (m) relative to it, velocity in m/s.
[[nodiscard]] inline Padded measure(SensorKind kind, const Vector3<double>& position,
                                    const Vector3<double>& velocity) {
  return std::visit(
      [&]<class S>(S /*sensor*/) -> Padded { return detail::pad(S::value(position, velocity)); },
      make_sensor(kind));
}

/// The same with its derivatives.
[[nodiscard]] inline Linearised linearise(SensorKind kind, const Vector3<double>& position,
                                          const Vector3<double>& velocity) {
  return std::visit(
      [&]<class S>(S /*sensor*/) -> Linearised {
        const Jacobian<double, S::kComponents> J = S::jacobian(position, velocity);
        return {detail::pad(S::value(position, velocity)), detail::pad_rows(J.position),
                detail::pad_rows(J.velocity)};
      },
      make_sensor(kind));
}

/// observed - computed, angles modulo 2 pi.
[[nodiscard]] inline Padded difference(SensorKind kind, const Padded& observed, const Padded& computed) {
  Padded result = observed - computed;
  const int angles = std::visit([]<class S>(S /*sensor*/) { return S::kAngles; }, make_sensor(kind));
  for (int i = 0; i < angles; ++i) {
    result(i) = wrap_angle(result(i));
  }
  return result;
}

/// A measurement of up to three components in padded form.
[[nodiscard]] inline Padded padded(const Eigen::VectorXd& value) {
  Padded result = Padded::Zero();
  for (Eigen::Index i = 0; i < value.size() && i < result.size(); ++i) {
    result(i) = value(i);
  }
  return result;
}

/// The first `size` components. (Entry by entry: GCC 12 sees reads past the end in a copy by packets.)
[[nodiscard]] inline Eigen::VectorXd unpadded(const Padded& value, Eigen::Index size) {
  Eigen::VectorXd result(size);
  for (Eigen::Index i = 0; i < size; ++i) {
    result(i) = value(i);
  }
  return result;
}

}  // namespace trammel::inline TRAMMEL_ABI::sensor
